#!/usr/bin/env python3
"""Stops a run at random moments, goes on with it, and compares every bit of its results with those of the unbroken run.

    kill_and_resume.py TALUS [--moments 200] [--seed 1] [--scene SCENE] [--work DIR]

Each moment is one run that is stopped one to three times by SIGKILL, SIGTERM or SIGINT, and then left to end. After every stop results.h5,
if it is there, must open and read to its last byte. At the end all datasets of results.h5, all files of fields/, results.pvd, results.xdmf
and summary.json (apart from the time it took) must be those of the unbroken run. Exit code 0 if all are, 1 if not.
"""
import argparse
import json
import pathlib
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time

import h5py
import numpy

here = pathlib.Path(__file__).resolve().parent


def datasets(path):
    """Every dataset and attribute of an HDF5 file as bytes."""
    found = {}
    with h5py.File(path, "r") as file:
        def visit(name, item):
            for key, value in item.attrs.items():
                found[f"{name}@{key}"] = numpy.asarray(value).astype(str).tobytes()
            if isinstance(item, h5py.Dataset):
                value = item[()]
                found[name] = repr(value.tolist()).encode() if value.dtype == object else value.tobytes()
        file.visititems(visit)
    return found


def outcome(directory):
    """What a run leaves behind, without what may differ: the clock."""
    summary = json.loads((directory / "summary.json").read_text())
    summary["time"] = {key: value for key, value in summary["time"].items() if not key.endswith("_seconds")}
    files = {path.name: path.read_bytes() for path in (directory / "fields").iterdir()}
    for name in ("results.pvd", "results.xdmf"):
        files[name] = (directory / name).read_bytes()
    return {"summary.json": summary, **files, **{f"results.h5/{k}": v for k, v in datasets(directory / "results.h5").items()}}


class Broken(Exception):
    pass


def defaults():
    """A shell that starts this in the background ignores SIGINT, and its children with it."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def stop_once(command, after, number, log):
    """Starts the command, sends the signal after that time, returns true if the run ended before."""
    process = subprocess.Popen(command, stdout=log, stderr=log, preexec_fn=defaults)
    try:
        code = process.wait(timeout=after)
    except subprocess.TimeoutExpired:
        process.send_signal(number)
        code = process.wait(timeout=300)
    # Before the program has set up its signals the system's own answer holds.
    allowed = {0, -number} | ({128 + number} if number != signal.SIGKILL else set())
    if code not in allowed:
        raise Broken(f"exit code {code} after {number.name} at {after:.3f} s")
    return code == 0


def attempt(talus, scene, directory, rng, length, log):
    """One run with its stops, one at least; returns their list as text."""
    command = [talus, "run", scene, "-o", str(directory)]

    def resumed():
        return [*command, "--resume"] if (directory / ".talus-output").exists() else command

    stops, wanted = [], rng.randint(1, 3)
    while len(stops) < wanted:
        number = rng.choice([signal.SIGKILL, signal.SIGKILL, signal.SIGTERM, signal.SIGINT])
        after = rng.uniform(0, length)
        if stop_once(resumed(), after, number, log):
            if stops:
                break
            shutil.rmtree(directory)  # too late: nothing was stopped
            length *= 0.9
            continue
        stops.append(f"{number.name[3:]} {after:.3f}")
        if (directory / "results.h5").exists():
            datasets(directory / "results.h5")
    result = subprocess.run(resumed(), stdout=log, stderr=log, timeout=600)
    if result.returncode != 0:
        raise Broken(f"exit code {result.returncode} of the last run after {', '.join(stops)}")
    return ", ".join(stops)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("talus")
    parser.add_argument("--moments", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--scene", default=str(here / "scene.toml"))
    parser.add_argument("--work", help="directory that keeps what was compared; a temporary one if left out")
    options = parser.parse_args()
    work = pathlib.Path(options.work or tempfile.mkdtemp(prefix="talus-kill-"))
    work.mkdir(parents=True, exist_ok=True)
    rng = random.Random(options.seed)
    failures = 0
    stopped = {"KILL": 0, "TERM": 0, "INT": 0}
    with open(work / "log.txt", "wb") as log:
        start = time.monotonic()
        subprocess.run([options.talus, "run", options.scene, "-o", str(work / "unbroken")], stdout=log, stderr=log, check=True, timeout=600)
        length = 1.1 * (time.monotonic() - start)
        expected = outcome(work / "unbroken")
        for key in ("sleep", "damage", "fragments"):
            if not has(expected["summary.json"], key):
                print(f"the scene shows no {key}: this test would prove too little")
                return 1
        for i in range(options.moments):
            directory = work / f"broken{i}"
            shutil.rmtree(directory, ignore_errors=True)
            try:
                told = attempt(options.talus, options.scene, directory, rng, length, log)
                for key in stopped:
                    stopped[key] += told.count(key)
                found = outcome(directory)
                wrong = sorted(k for k in expected.keys() | found.keys() if expected.get(k) != found.get(k))
                if wrong:
                    raise Broken(f"{len(wrong)} of {len(expected)} parts differ after {told}: {', '.join(wrong[:6])}")
                shutil.rmtree(directory)
            except Broken as error:
                failures += 1
                print(f"moment {i}: {error}; kept in {directory}")
    stops = ", ".join(f"{n} by SIG{key}" for key, n in stopped.items())
    print(f"{options.moments - failures} of {options.moments} broken runs ended with the bits of the unbroken one ({stops}; {len(expected)} parts compared)")
    if not failures and not options.work:
        shutil.rmtree(work)
    return 1 if failures else 0


def has(summary, what):
    if what == "sleep":
        return summary["counters"]["asleep_skipped"] > 0
    if what == "damage":
        return any(s["damage_max"] > 0.9 for s in summary["structures"])
    return any(b["fragment"] for b in summary["blocks"])


if __name__ == "__main__":
    sys.exit(main())
