#!/usr/bin/env python3
"""Runs on several ranks, as a user starts them: the same motion to the last bit as on one, a stop and a resume with another number of
ranks, and one message and the right exit code when something is wrong.

    run.py TALUS MPIRUN DIRECTORY [CHECK...]
"""
import os
import pathlib
import re
import signal
import subprocess
import sys
import time

import h5py
import numpy as np

TALUS, MPIRUN, WORK = sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3])
ENVIRONMENT = dict(os.environ, OMPI_ALLOW_RUN_AS_ROOT="1", OMPI_ALLOW_RUN_AS_ROOT_CONFIRM="1")

COLUMN = """schema = 1
[[material]]
name = "rock"
density = "2.6 t/m^3"
[[material]]
name = "C30"
f_cm = "38 MPa"
[[interface]]
between = ["rock", "C30"]
friction = 0.5
normal_stiffness = "hard"
[[interface]]
between = ["C30", "C30"]
friction = 0.5
normal_stiffness = "hard"
[[structure]]
name = "pier"
kind = "column"
material = "C30"
base = [0.0, 0.0, 0.0]
section = [1.0, 1.0]
height = 3.0
cell_size = "0.125 m"
[[structure.probe]]
name = "mid"
at = [0.1, 0.0, 1.5]
[output]
report = false
"""

ELASTIC = COLUMN.replace("[output]", """[[structure.load]]
region = { min = [-0.6, -0.6, 2.0], max = [-0.4, 0.6, 2.5] }
traction = ["2 MPa", 0.0, 0.0]
history = [[0.0, 0.0], [0.001, 1.0], [0.002, 0.0]]
[simulation]
duration = "DURATION"
[output]
interval = "2 ms"
history_interval = "0.5 ms"
""")

STRUCK = COLUMN.replace('cell_size', 'damage = "concrete"\ncell_size').replace("[output]", """[[structure.rebar]]
kind = "longitudinal"
bars = 12
diameter = "25 mm"
cover = "40 mm"
[[structure.rebar]]
kind = "stirrups"
diameter = "10 mm"
cover = "30 mm"
spacing = "200 mm"
[[block]]
name = "boulder"
material = "rock"
shape = "EOTA111"
mass = 2000
position = [-1.1, 0.1, 1.5]
velocity = [25.0, 0.0, 0.0]
[simulation]
duration = "7 ms"
[output]
interval = "2 ms"
history_interval = "0.25 ms"
""")


# Explicit alone, and nothing to be brought to rest: memory is divided too.
ALONE = [('cell_size', 'integrator = "explicit"\npreload = "none"\ncell_size')]
BARE = ELASTIC.replace("DURATION", "4 ms").replace(*ALONE[0])
REINFORCED = STRUCK.replace(*ALONE[0])
CRACKING = REINFORCED[: REINFORCED.index("[[structure.rebar]]")] + REINFORCED[REINFORCED.index("[[block]]") :]
SLIPPING = REINFORCED.replace("cell_size =", 'bond = "mc2010"\ncell_size =').replace('duration = "7 ms"', 'duration = "4 ms"')
# A deck that slides on its bearings: every rank computes these, whatever part of piers and deck it holds.
VIADUCT = CRACKING.replace(CRACKING[CRACKING.index('kind = "column"') : CRACKING.index("[[structure.probe]]")], """kind = "viaduct"
material = "C30"
position = [0.0, 0.0, 0.0]
spans = 1
span_length = "8 m"
pier_height = "4 m"
section = [1.0, 1.0]
cap_width = "1.5 m"
cap_length = "4 m"
deck_width = "4 m"
deck_depth = "1 m"
bearing_friction = 0.001
cell_size = "0.25 m"
damage = "concrete"
integrator = "explicit"
preload = "none"
support = ["-z"]
""").replace("position = [-1.1, 0.1, 1.5]", "position = [-1.1, 0.1, 3.0]")
LARGE = ELASTIC.replace("DURATION", "2 ms").replace("section = [1.0, 1.0]\nheight = 3.0", "section = [4.5, 4.5]\nheight = 4.75").replace(
    "region = { min = [-0.6, -0.6, 2.0], max = [-0.4, 0.6, 2.5] }", "region = { min = [-2.3, -0.6, 2.0], max = [-2.2, 0.6, 2.5] }")


def started(scene, directory, ranks, *options, limit=""):
    """The command as a process of its own; `limit` is a shell command that rank 0 runs first."""
    command = [TALUS, "run", str(scene), "-o", str(directory), *options]
    if limit:
        command = ["sh", "-c", f'[ "$OMPI_COMM_WORLD_RANK" = 0 ] && {limit}; exec "$@"', "sh", *command]
    if ranks > 1:
        command = [MPIRUN, "--oversubscribe", "-n", str(ranks), *command]
    return subprocess.Popen(command, env=ENVIRONMENT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def run(scene, directory, ranks, *options, expect=0, limit=""):
    process = started(scene, directory, ranks, *options, limit=limit)
    out, err = process.communicate(timeout=200)
    assert process.returncode == expect, f"{ranks} ranks: exit code {process.returncode}, not {expect}\n{out}\n{err}"
    return out, err


def differences(one, other):
    """(dataset, largest difference over largest value) where the two results are not the same bits."""
    found = []
    a, b = h5py.File(one / "results.h5"), h5py.File(other / "results.h5")

    def compare(name, node):
        if not isinstance(node, h5py.Dataset) or node.dtype.kind not in "fiu":
            return
        x, y = node[()], b[name][()]
        assert x.shape == y.shape, f"{name}: {x.shape} and {y.shape}"
        if not np.array_equal(x, y, equal_nan=True):
            found.append((name, float(np.nanmax(np.abs(x - y)) / np.nanmax(np.abs(x)))))

    a.visititems(compare)
    assert a["history/time"].shape[0] > 3
    return found


def sums_only(found):
    """Motion, damage and contacts are the same bits; sums over ranks are rounded otherwise."""
    sums = ("ledger/", "history/structures/pier/base_", "history/structures/pier/members/", "history/structures/pier/damaged_volume", "state/structures/pier/history")
    for name, difference in found:
        assert name.startswith(sums), f"{name} differs by {difference:g}"
        # What is a difference of large numbers, the residual, has fewer digits.
        assert difference < 1e-10 or name in ("ledger/residual", "ledger/algorithmic", "ledger/potential"), f"{name} differs by {difference:g}"


def write(name, text):
    path = WORK / f"{name}.toml"
    path.write_text(text)
    return path


def same_motion_when_elastic():
    scene = write("elastic", ELASTIC.replace("DURATION", "4 ms").replace("cell_size", 'integrator = "explicit"\ncell_size'))
    run(scene, WORK / "elastic1", 1)
    for ranks in (2, 3):
        out, _ = run(scene, WORK / f"elastic{ranks}", ranks)
        assert f"divided over {ranks} ranks" in out
        sums_only(differences(WORK / "elastic1", WORK / f"elastic{ranks}"))


def held(out):
    """MB that the plan says rank 0 holds: all, and by name."""
    line = re.search(r"pier: ([0-9.]+) MB on this process: (.*)", out)
    return float(line[1]), {name: float(size) for name, size in (part.rsplit(" ", 1) for part in line[2].split(", "))}


def memory_divides():
    """Large enough to be held whole without being told: what one rank holds of the same cells is in its plan."""
    large = ('cell_size = "0.125 m"', "cells = [24, 24, 40]")
    divides("bare", BARE.replace(*large), ("mesh", "fields", "elements"))
    stirrups = ('spacing = "200 mm"', 'spacing = "75 mm"')   # as evenly divided as the cells
    divides("barred", REINFORCED.replace(*large).replace(*stirrups).replace('duration = "7 ms"', 'duration = "3.5 ms"'), ("mesh", "fields", "elements", "bars"))


def divides(name, scene, tables):
    scene = write(name, scene)
    outs = {ranks: run(scene, WORK / f"{name}{ranks}", ranks)[0] for ranks in (1, 2, 3)}
    whole, parts = held(outs[1])
    for ranks in (2, 3):
        assert f"divided over {ranks} ranks, its memory too" in outs[ranks]
        here, mine = held(outs[ranks])
        for table in tables:
            assert mine[table] < (1 / ranks + 0.1) * parts[table], f"{table}: {mine[table]} of {parts[table]} MB on {ranks} ranks"
        sums_only(differences(WORK / f"{name}1", WORK / f"{name}{ranks}"))


def same_cracks_and_resume_in_parts(name="cracking", text=CRACKING, damaged=0.01):
    scene = write(name, text)
    run(scene, WORK / f"{name}1", 1)
    process = started(scene, WORK / f"{name}2", 2)
    until = time.time() + 100
    while time.time() < until and not (WORK / f"{name}2" / "journal.bin").exists():
        time.sleep(0.01)
    ranks = subprocess.run(["pgrep", "-P", str(process.pid)], capture_output=True, text=True).stdout.split()
    os.kill(int(ranks[-1]), signal.SIGTERM)
    out, err = process.communicate(timeout=200)
    assert process.returncode == 143 and "its memory too" in out, f"{process.returncode}\n{out}\n{err}"
    run(scene, WORK / f"{name}2", 3, "--resume")
    sums_only(differences(WORK / f"{name}1", WORK / f"{name}2"))
    run(scene, WORK / f"{name}whole", 4)   # some of which have no cracks
    sums_only(differences(WORK / f"{name}1", WORK / f"{name}whole"))
    with h5py.File(WORK / f"{name}whole" / "results.h5") as results:
        assert results["history/structures/pier/damaged_volume"][-1] > damaged


def same_bars_in_parts():
    same_cracks_and_resume_in_parts("reinforced", REINFORCED)


def same_slips_in_parts():
    same_cracks_and_resume_in_parts("slipping", SLIPPING, 0.001)


def same_viaduct_in_parts():
    same_cracks_and_resume_in_parts("viaduct", VIADUCT, 0.001)


def same_rest_in_parts():
    """Too large to factor: brought to rest by multigrid on all ranks together, whose aggregates differ with their number."""
    scene = write("large", LARGE)
    run(scene, WORK / "large1", 1)
    out, _ = run(scene, WORK / "large2", 2)
    assert "its memory too" in out
    for name, difference in differences(WORK / "large1", WORK / "large2"):
        one_rounding = 2.0**-23 if name.startswith("fields/") else 0   # fields are of single precision; the state is compared in double
        assert difference < max(1e-10, one_rounding) or name in ("ledger/residual", "ledger/algorithmic", "ledger/step_dependence"), f"{name} differs by {difference:g}"


def same_motion_by_modes():
    scene = write("modes", ELASTIC.replace("DURATION", "40 ms"))
    run(scene, WORK / "modes1", 1)
    run(scene, WORK / "modes2", 2)
    # When the structure rings on by modes is decided by its energy, and so is where its velocities are brought to full steps.
    for name, difference in differences(WORK / "modes1", WORK / "modes2"):
        assert difference < 1e-10 or name in ("ledger/residual", "ledger/algorithmic", "ledger/potential"), f"{name} differs by {difference:g}"


def same_damage_and_resume():
    scene = write("struck", STRUCK)
    run(scene, WORK / "struck1", 1)
    process = started(scene, WORK / "struck2", 2)
    until = time.time() + 100
    while time.time() < until and not (WORK / "struck2" / "journal.bin").exists():
        time.sleep(0.01)
    ranks = subprocess.run(["pgrep", "-P", str(process.pid)], capture_output=True, text=True).stdout.split()
    os.kill(int(ranks[-1]), signal.SIGTERM)   # one of them; all stop
    out, err = process.communicate(timeout=200)
    assert process.returncode == 143 and out.count("stopped by signal 15") == 1, f"{process.returncode}\n{out}\n{err}"
    run(scene, WORK / "struck2", 1, "--resume")
    sums_only(differences(WORK / "struck1", WORK / "struck2"))
    run(scene, WORK / "struck3", 3)
    sums_only(differences(WORK / "struck1", WORK / "struck3"))
    with h5py.File(WORK / "struck3" / "results.h5") as results:
        assert results["history/structures/pier/damaged_volume"][-1] > 0.01


def one_message():
    scene = write("wrong", STRUCK.replace("f_cm", "fcm"))
    _, err = run(scene, WORK / "wrong", 2, expect=2)
    assert err.count("material.C30.fcm") == 1 and not (WORK / "wrong").exists(), err
    # Only rank 0 writes, and it cannot: the other one is ended too.
    scene = write("full", STRUCK)
    _, err = run(scene, WORK / "full", 2, expect=3, limit="ulimit -f 100")
    assert err.count("talus: cannot write") == 1, err


def mpi_starts_with_mpirun_alone():
    """deal.II maps Open MPI; what Open MPI loads as it is started (mca_*) shows whether it was."""
    scene = write("alone", ELASTIC.replace("DURATION", "0.5 ms"))
    for ranks in (1, 2):
        command = [TALUS, "run", str(scene), "-o", str(WORK / f"alone{ranks}")]
        command = command if ranks == 1 else [MPIRUN, "--oversubscribe", "-np", "2", "-x", "LD_DEBUG=files"] + command
        environment = dict(ENVIRONMENT, LD_DEBUG="files") if ranks == 1 else ENVIRONMENT
        process = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=200)
        assert process.returncode == 0, process.stderr[-2000:]
        assert "libtalus_fem.so" in process.stderr
        assert ("/mca_btl" in process.stderr) == (ranks == 2), f"{ranks} ranks"
        assert ("libtalus_mpi.so" in process.stderr) == (ranks == 2), f"{ranks} ranks"


subprocess.run(["rm", "-rf", str(WORK)], check=True)
WORK.mkdir(parents=True)
CHECKS = (mpi_starts_with_mpirun_alone, one_message, memory_divides, same_motion_when_elastic, same_motion_by_modes, same_damage_and_resume, same_cracks_and_resume_in_parts, same_bars_in_parts, same_slips_in_parts, same_viaduct_in_parts, same_rest_in_parts)
for check in [c for c in CHECKS if not sys.argv[4:] or c.__name__ in sys.argv[4:]]:
    begin = time.time()
    check()
    print(f"{check.__name__}: {time.time() - begin:.1f} s", flush=True)
