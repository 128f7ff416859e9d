"""What goes wrong: SceneError for bad input, RunError for a run that did not come to its end."""


class SceneError(ValueError):
    """Bad input; nothing was written. `problems` is a list of dicts with severity, file, line, column, key,
    value, rule, remedy, text."""

    def __init__(self, problems):
        super().__init__("\n".join(p["text"] for p in problems))
        self.problems = problems


class RunError(RuntimeError):
    """The run failed: status and message as in summary.json; `results` holds what was computed till then."""

    def __init__(self, message, results):
        super().__init__(message)
        self.results = results
