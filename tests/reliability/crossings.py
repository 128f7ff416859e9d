#!/usr/bin/env python3
"""Crossings of [[line]] in a plain run on soft ground: against closed forms, and the same bits with two threads, two ranks, another output interval, and after kills.

    crossings.py TALUS [MPIRUN]

Exit code 0 if all holds.
"""
import math
import os
import pathlib
import random
import signal
import subprocess
import sys
import tempfile
import time

import h5py
import numpy as np

from scenes import MATERIALS, rigid_contact

TALUS = sys.argv[1]
MPIRUN = sys.argv[2] if len(sys.argv) > 2 else None
ENVIRONMENT = dict(os.environ, OMPI_ALLOW_RUN_AS_ROOT="1", OMPI_ALLOW_RUN_AS_ROOT_CONFIRM="1")
G, MU, MASS = 9.81, 0.2, 2600 * 0.5

# A box that slides over the line "road", one that flies over it, one that strikes ground with a memory before it.
SCENE = """schema = 1
[simulation]
duration = "1.2 s"
[[plane]]
normal = [0, 0, 1]
material = "ground"
""" + MATERIALS + """[[material]]
name = "soft"
""" + rigid_contact("rock", "rock", 0.5) + rigid_contact("rock", "ground", 0.2) + """[[interface]]
between = ["rock", "soft"]
friction = 0.3
normal_stiffness = "50 MPa/m"
contact_law = { kind = "crushing", pressure = "0.2 MPa", gradient = "2 MPa/m", thickness = "0.1 m", ploughing = "50 kPa" }
slip_friction = { most = 1.0, length = "0.5 m", recovery = "5 1/s" }
vegetation = { height = "2 m", drag = 200 }
[[plane]]
point = [0, 20, 0]
normal = [0.0, -0.3, 1.0]
material = "soft"
[[block]]
name = "slider"
material = "rock"
shape = "box"
size = [1.0, 1.0, 0.5]
position = [0, 0, 0.25]
velocity = [4, 0, 0]
[[block]]
name = "flyer"
material = "rock"
shape = "box"
size = [1.0, 1.0, 0.5]
position = [0, -20, 30]
velocity = [3, 1, 2]
spin = [0.5, 1, 0]
[[block]]
name = "sinker"
material = "rock"
shape = "box"
size = [1.0, 0.8, 0.6]
position = [0, 24, 2.6]
velocity = [8, -1, -4]
spin = [0.2, 0.7, 0.1]
[[line]]
name = "road"
points = [[2.0, -30.0], [2.0, 30.0]]
[[line]]
name = "none"
points = [[-5.0, -30.0], [-5.0, 30.0]]
[output]
interval = "0.1 s"
history_interval = "INTERVAL"
checkpoint_steps = 2
report = false
"""


def rows(directory):
    found = {}
    with h5py.File(directory / "results.h5") as file:
        file["lines"].visititems(lambda name, node: found.__setitem__(name, node[()]) if isinstance(node, h5py.Dataset) else None)
    return found


def run(scene, out, *more, ranks=1):
    command = [TALUS, "run", str(scene), "-o", str(out), *more]
    if ranks > 1:
        command = [MPIRUN, "--oversubscribe", "-n", str(ranks), *command]
    subprocess.run(command, env=ENVIRONMENT, check=True, capture_output=True, timeout=300)
    return rows(out)


def expect_same(one, other, what):
    assert one.keys() == other.keys(), what
    for name in one:
        assert np.array_equal(one[name], other[name], equal_nan=True), f"{what}: {name} differs: {one[name]} and {other[name]}"


def near(value, exact, relative, what):
    assert abs(value - exact) <= relative * abs(exact), f"{what}: {value}, not {exact}"


with tempfile.TemporaryDirectory(prefix="talus-lines-") as place:
    work = pathlib.Path(place)
    scene = work / "scene.toml"
    scene.write_text(SCENE.replace("INTERVAL", "10 ms"))
    whole = run(scene, work / "whole")
    assert sorted(whole["road/block"]) == [0, 1, 2], whole["road/block"]
    assert list(np.diff(whole["road/time"]) >= 0) == [True, True]
    assert whole["none/block"].size == 0
    at = {int(b): k for k, b in enumerate(whole["road/block"])}
    # Slides: 2 m with v^2 = 16 - 2 mu g s. The run's accuracy is 1e-3.
    k, speed = at[0], math.sqrt(16 - 4 * MU * G)
    near(whole["road/time"][k], (4 - speed) / (MU * G), 2e-3, "time of the slider")
    near(whole["road/velocity"][k][0], speed, 2e-3, "speed of the slider")
    near(whole["road/kinetic_translational"][k], 0.5 * MASS * speed**2, 4e-3, "energy of the slider")
    near(whole["road/height"][k], 0.25, 2e-3, "height of the slider")
    # Flies: the closed form to round-off.
    k, t = at[1], 2 / 3
    near(whole["road/time"][k], t, 1e-12, "time of the flyer")
    near(whole["road/position"][k][2], 30 + 2 * t - 0.5 * G * t * t, 1e-12, "height of the flyer")
    near(whole["road/velocity"][k][2], 2 - G * t, 1e-12, "speed of the flyer")
    # The line itself is met.
    for k in at.values():
        assert abs(whole["road/position"][k][0] - 2) < 1e-9

    expect_same(whole, run(scene, work / "threads", "--threads", "2"), "two threads")
    other = work / "other.toml"
    other.write_text(SCENE.replace("INTERVAL", "37 ms"))
    expect_same(whole, run(other, work / "interval"), "another history interval")
    if MPIRUN:
        expect_same(whole, run(scene, work / "ranks", ranks=2), "two ranks")

    # Killed at random moments, and gone on with.
    rng = random.Random(1)
    start = time.monotonic()
    run(scene, work / "timed")
    length = time.monotonic() - start
    stopped = 0
    for moment in range(6):
        out = work / f"killed{moment}"
        command = [TALUS, "run", str(scene), "-o", str(out)]
        process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        try:
            process.wait(timeout=rng.uniform(0.2, 0.95) * length)
        except subprocess.TimeoutExpired:
            process.send_signal(signal.SIGKILL)
            process.wait()
            stopped += 1
        more = ["--resume"] if (out / ".talus-output").exists() and stopped else []
        expect_same(whole, run(scene, out, *more), f"killed, {moment}")
    print(f"{whole['road/block'].size} crossings, the same in all runs; {stopped} of 6 were killed")
