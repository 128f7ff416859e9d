#!/usr/bin/env python3
"""A run that no step down to simulation.min_step can go on with: exit code 3, a message that names the place, results up to there that read, a report, and
a state to go on from: with --resume to the same end, and with a smaller step past it.

    smallest_step.py TALUS
"""
import json
import pathlib
import subprocess
import sys
import tempfile

import h5py

here = pathlib.Path(__file__).resolve().parent
failures = []


def talus(*arguments):
    return subprocess.run([program, *map(str, arguments)], capture_output=True, text=True, timeout=240)


def expect(name, result, code, *words):
    text = result.stdout + result.stderr
    missing = [w for w in words if w not in text]
    good = result.returncode == code and not missing
    if not good:
        failures.append(name)
    print(f"{'ok  ' if good else 'FAIL'} {name}" + ("" if good else f": exit code {result.returncode} (expected {code}), missing {missing}\n{text[-1500:]}"))


def check(name, good, told=""):
    if not good:
        failures.append(name)
    print(f"{'ok  ' if good else 'FAIL'} {name} {'' if good else told}")


def results(directory):
    """The summary, and the times and heights of the stone that results.h5 holds, which must read to its last dataset."""
    with h5py.File(directory / "results.h5", "r") as h5:
        h5.visititems(lambda _, item: item[()] if isinstance(item, h5py.Dataset) else None)
        return json.loads((directory / "summary.json").read_text()), h5["history/time"][:], h5["history/blocks/position"][:]


def main():
    scene = here / "smallest_step.toml"
    with tempfile.TemporaryDirectory() as work:
        work = pathlib.Path(work)
        first = talus("run", scene, "-o", work / "first")
        expect("the run ends where no step is short enough", first, 3, "stone", "shortest macro step", "t = ")
        summary, times, _ = results(work / "first")
        check("the summary says so", summary["status"] == "failed" and "stone" in summary["message"], str(summary.get("message")))
        check("results reach up to there", 0.05 <= times[-1] < 0.3 and abs(summary["time"]["end"] - times[-1]) < 1e-12, f"{times} {summary['time']}")
        check("there is a report", (work / "first" / "report.html").exists())
        expect("talus report reads it", talus("report", work / "first"), 0)
        again = talus("run", scene, "-o", work / "first", "--resume")
        expect("gone on with, it ends there again", again, 3, "stone", "shortest macro step")
        resumed, after, _ = results(work / "first")
        check("and has changed nothing", resumed["message"] == summary["message"] and list(after) == list(times), f"{resumed['message']} {after}")
        onward = talus("run", scene, "-o", work / "first", "--resume", "--set", "simulation.min_step=1e-9")
        expect("its state goes on with a smaller step", onward, 0, "done at t = 0.3")
        summary, times, position = results(work / "first")
        check("to the end", summary["status"] == "done" and times[-1] == 0.3 and position[-1][1][0] > 0.5, f"{summary['status']} {times} {position[-1]}")
        expect("with other values it does not", talus("run", scene, "-o", work / "first", "--resume", "--set", "simulation.accuracy=1e-2"), 2, "with other values")
    if failures:
        raise SystemExit(f"{len(failures)} failed: {', '.join(failures)}")


if __name__ == "__main__":
    if len(sys.argv) != 2:
        raise SystemExit(__doc__)
    program = sys.argv[1]
    main()
