"""Talus in Python: check and run scenes in this process, sweep over keys, read results and ensembles as NumPy
arrays, draw the report's plots.

    import talus
    r = talus.run("cases/tirol-pier/scene.toml", set={"simulation.duration": "8 s"})
    talus.plots.speed(r)

Reading needs h5py and NumPy alone; plots need Matplotlib; running needs the extension that `make build` puts
beside this package.
"""
import json as _json
import numbers as _numbers
import os as _os
import pathlib as _pathlib
import re as _re

from . import plots
from .errors import RunError, SceneError
from .results import Block, EnsembleResults, Results, rotation_matrix

__all__ = ["check", "run", "sweep", "open", "open_ensemble", "plots", "Results", "EnsembleResults", "Block",
           "Check", "Sweep", "SceneError", "RunError", "rotation_matrix"]


def _extension():
    """The compiled part; the modules of structures and rasters lie beside the program."""
    from . import _talus

    if not getattr(_extension, "ready", False):
        here = _pathlib.Path(_talus.__file__).resolve().parent
        for place in (here.parent.parent, here.parents[2] / "talus"):   # of a build; of an installation
            if (place / "libtalus_fem.so").exists():
                _talus.add_module_directory(str(place))
        _extension.ready = True
    return _talus


def _toml(value, within=False):
    """A value of `set` as TOML: "45 deg" is a text, which needs no quotes unless it stands within another
    value, [0, 0, 1] a list, {"dip": 30} a table."""
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, _pathlib.PurePath):
        value = str(value)
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return _json.dumps(value, ensure_ascii=False) if within else value
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(_toml(v, True) for v in value) + "]"
    if isinstance(value, dict):
        entries = (_json.dumps(str(k), ensure_ascii=False) + " = " + _toml(v, True) for k, v in value.items())
        return "{ " + ", ".join(entries) + " }"
    if isinstance(value, _numbers.Integral):
        return str(int(value))
    if isinstance(value, _numbers.Real):
        return repr(float(value))
    raise TypeError(f"{value!r}: a value of `set` is a number, a text, True, False, a path, or a list "
                    "or dict of these")


def _overrides(values):
    if values is not None and not hasattr(values, "items"):
        raise TypeError(f"{values!r}: `set` is a dict of keys and values, {{'simulation.duration': '8 s'}}")
    return [(key, _toml(value)) for key, value in (values or {}).items()]


def _scene(scene):
    """(text, whether it is one): a path, or the text of a scene, which has more than one line."""
    if not isinstance(scene, (str, _os.PathLike)):
        raise TypeError(f"a scene is the path of a file, or its text, not {type(scene).__name__}")
    text = _os.fspath(scene)
    return text, "\n" in text


class Check:
    """What `talus check` says: `title`, `plan` and `warnings`, lists of sentences."""

    def __init__(self, told):
        self.title, self.plan, self.warnings = told["title"], list(told["plan"]), list(told["warnings"])

    def __repr__(self):
        return "\n".join([self.title, *self.plan, *self.warnings])


def check(scene, set=None):
    """Reads and builds a scene, steps nothing. `scene` is a path or the text of a scene; `set` as in `run`.

    Raises SceneError with every problem.
    """
    text, is_text = _scene(scene)
    return Check(_extension().check(text, is_text, _overrides(set)))


def run(scene, output=None, set=None, resume=False, report=False, progress=None):
    """Runs a scene in this process and opens its results.

    scene     path of a file, or the text of a scene (relative paths in it start at the working directory)
    output    directory, as `talus run -o`; results/STEM by default. An earlier run of Talus in it is replaced
    set       dict of keys and values that replace those of the file:
              {"interface.rock/slope.friction": "35 deg"}
    resume    go on from the directory's checkpoint, if it has one
    report    write report.html as well
    progress  called as progress(time, duration) between macro steps; what it raises stops the run with its
              state saved

    Raises SceneError for bad input, RunError if the run fails or its audit does. Ctrl-C stops it with its
    state saved.
    """
    text, is_text = _scene(scene)
    if output is None:
        if is_text:
            raise ValueError("a scene given as text has no name: give output=DIRECTORY")
        output = _pathlib.Path("results") / _re.sub(r"\.resolved$", "", _pathlib.Path(text).stem)
    end = _extension().run(text, is_text, _overrides(set), str(output), bool(resume), bool(report), progress)
    if is_text:
        (_pathlib.Path(output) / "scene.toml").write_text(text, encoding="utf-8")
    results = Results(output)
    if end["exit_code"] != 0:
        raise RunError(f"{end['status']}: {end['message']}", results)
    return results


def open(directory):
    """Results of a run: a directory, or its results.h5."""
    return Results(directory)


def open_ensemble(directory):
    """Results of an ensemble: a directory, or its ensemble.h5."""
    return EnsembleResults(directory)


class Sweep:
    """Runs of one scene that differ in some keys: `runs` is a list of (values, Results); a failed run has its
    exception in place of results."""

    def __init__(self, keys, runs):
        self.keys, self.runs = list(keys), runs

    def table(self, **columns):
        """One row a run: dict of lists with the swept keys and, by name, what each function makes of a
        Results (None for a failed run).

            s.table(runout=lambda r: r.summary["blocks"][0]["runout"])
        """
        out = {key: [values[key] for values, _ in self.runs] for key in self.keys}
        for name, get in columns.items():
            out[name] = [None if isinstance(r, Exception) else get(r) for _, r in self.runs]
        return out

    def __len__(self):
        return len(self.runs)

    def __iter__(self):
        return iter(self.runs)


def _run_one(scene, output, values):
    try:
        run(scene, output, values).close()
    except (SceneError, RunError, OSError) as error:
        return f"{type(error).__name__}: {error}"
    return None


def sweep(scene, set, output, jobs=1, each=None):
    """Runs a scene for every combination of values.

    set     dict of keys and lists of values: {"plane.0.dip": ["30 deg", "35 deg"], "block.B1.volume": [1, 2]}
    output  directory; each run has a folder 000, 001, ... in it, in the order of itertools.product
    jobs    number of processes
    each    called as each(values, results) as runs come to their end

    A bad value is told before anything runs (SceneError); a run that fails later does not end the others.
    """
    import itertools
    import multiprocessing
    from concurrent.futures import ProcessPoolExecutor

    for key, values in set.items():
        if isinstance(values, str) or not hasattr(values, "__iter__"):
            raise TypeError(f"{key}: {values!r}: a sweep has a list of values for each key")
    keys = list(set)
    combinations = [dict(zip(keys, values)) for values in itertools.product(*set.values())]
    for values in combinations:
        check(scene, values)
    folders = [_pathlib.Path(output) / f"{i:03d}" for i in range(len(combinations))]
    if jobs > 1:
        with ProcessPoolExecutor(jobs, mp_context=multiprocessing.get_context("spawn")) as pool:
            failures = list(pool.map(_run_one, itertools.repeat(str(scene)), map(str, folders), combinations))
    else:
        failures = [_run_one(str(scene), str(folder), values)
                    for folder, values in zip(folders, combinations)]
    runs = []
    for values, folder, failure in zip(combinations, folders, failures):
        runs.append((values, RuntimeError(failure) if failure else Results(folder)))
        if each:
            each(*runs[-1])
    return Sweep(keys, runs)
