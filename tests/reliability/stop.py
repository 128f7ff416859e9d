#!/usr/bin/env python3
"""SIGTERM and SIGINT end a run within seconds, whatever it is at: building a large structure, or a step that lasts for minutes. What ends within a step goes on with --resume.

    stop.py TALUS
"""
import os
import pathlib
import signal
import subprocess
import sys
import tempfile
import time

SCENE = """
schema = 1
[simulation]
duration = 0.2
threads = 1
[output]
interval = 0.2
history_interval = 0.1
report = false
[[material]]
name = "m"
density = 2500
young = "30 GPa"
poisson = 0.2
[[structure]]
name = "S"
kind = "column"
material = "m"
base = [0, 0, 0]
section = [4, 4]
height = 16
cells = [%d, %d, %d]
support = ["-z"]
preload = "%s"
integrator = "explicit"
"""
PATIENCE = 60   # [s]: five by the program, the rest for a crowded machine
failures = []


def check(name, good, told=""):
    if not good:
        failures.append(name)
    print(f"{'ok  ' if good else 'FAIL'} {name} {'' if good else told}")


def stop(work, name, cells, number, wait_for):
    """Starts a run, sends the signal once `wait_for` has been told (empty: after a second); exit code, words, seconds."""
    scene = work / f"{name}.toml"
    scene.write_text(SCENE % (*cells, "none"))
    run = subprocess.Popen([program, "run", scene, "-o", work / name], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    said = ""
    while wait_for and wait_for not in said:
        line = run.stdout.readline()
        if not line:
            break
        said += line
    time.sleep(1)
    sent = time.monotonic()
    run.send_signal(number)
    try:
        said += run.communicate(timeout=PATIENCE)[0]
    except subprocess.TimeoutExpired:
        run.kill()
        return None, said + run.communicate()[0], PATIENCE
    return run.returncode, said, time.monotonic() - sent


def orderings(work):
    """Signals all along the first half of a check that orders and factorises: each ends it. (A library that puts in its own handler
    while it orders swallowed them, or made an error of the factorisation of them.)"""
    scene = work / "preloaded.toml"
    scene.write_text(SCENE % (20, 20, 60, "gravity"))
    began = time.monotonic()
    subprocess.run([program, "check", scene], stdout=subprocess.DEVNULL, check=True)
    whole = time.monotonic() - began
    wrong = []
    for k in range(24):
        run = subprocess.Popen([program, "check", scene], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        time.sleep(0.5 * whole * (k + 0.5) / 24)  # it orders between a seventh and a quarter of it
        run.send_signal(signal.SIGTERM)
        said = run.communicate(timeout=PATIENCE)[0]
        if run.returncode != -signal.SIGTERM:
            wrong.append((k, run.returncode, said[-200:]))
    check("SIGTERM all along a check", not wrong, str(wrong[:3]))


def temporary_files(work):
    """A signal leaves none of the meshes that `talus verify` writes for its structures."""
    folder = work / "temporary"
    folder.mkdir()
    run = subprocess.Popen(
        [program, "verify", "fem"], stdout=subprocess.DEVNULL, env={**os.environ, "TMPDIR": str(folder)}
    )
    began = time.monotonic()
    while run.poll() is None and not any(folder.iterdir()) and time.monotonic() - began < PATIENCE:
        time.sleep(0.01)
    check("talus verify writes meshes", any(folder.iterdir()))
    run.send_signal(signal.SIGTERM)
    check("SIGTERM ends talus verify", run.wait(PATIENCE) == -signal.SIGTERM, str(run.returncode))
    check("and removes its meshes", not any(folder.iterdir()), str(list(folder.iterdir())))


def main():
    with tempfile.TemporaryDirectory() as work:
        work = pathlib.Path(work)
        for number in (signal.SIGTERM, signal.SIGINT):
            code, said, seconds = stop(work, f"step{number}", (48, 48, 192), number, "Cohesion and tension")
            check(f"{number.name} within a long step", code == 128 + number, f"exit code {code} after {seconds:.1f} s: {said[-500:]}")
            # Stopped before its first step ends, a run has nothing to go on with and says that it made none.
            check("says how to go on", "--resume" in said or "at t = 0 s: 0 steps" in said, said[-500:])
        code, said, seconds = stop(work, "build", (48, 48, 192), signal.SIGTERM, "")
        check("SIGTERM while it is built", code == 128 + signal.SIGTERM, f"exit code {code}: {said[-500:]}")
        check("nothing is written yet", not (work / "build" / "results.h5").exists())
        temporary_files(work)
        orderings(work)
    return 1 if failures else 0


program = sys.argv[1]
sys.exit(main())
