#!/usr/bin/env python3
"""What `talus check` says a run takes of memory at most, beside the largest resident set of that run: never below it, at most twice it.

    memory.py TALUS [--only NAME...] [SCENE...]

Without SCENE the kinds of scenes below: rigid, deformable, on terrain, elastic, ringing, damaging, coupled, small and larger. With SCENE those files, for the
record (a run in full each).
"""
import argparse
import math
import os
import pathlib
import random
import re
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
GROUND = """
[[plane]]
point = [0, 0, 0]
normal = [0, 0, 1]
material = "slope"
[[material]]
name = "rock"
density = 2600
young = "20 GPa"
poisson = 0.25
[[material]]
name = "C30"
f_cm = "38 MPa"
[[interface]]
between = ["*", "*"]
friction = 0.5
normal_stiffness = "hard"
"""
PIER = """
[[structure]]
name = "pier"
kind = "column"
material = "C30"
base = [0, 0, 0]
section = [{0}, {0}]
height = {1}
cell_size = "{2} m"
"""


def simulation(duration, more="", output=""):
    return f'schema = 1\n[simulation]\nduration = "{duration} s"\nthreads = 1\n{more}\n[output]\n{output}\n{GROUND}'


def box(name, size, position, more=""):
    return f'[[block]]\nname = "{name}"\nmaterial = "rock"\nshape = "box"\nsize = {list(size)}\nposition = {list(position)}\n{more}\n'


def pile(count, more=""):
    draw, side = random.Random(1), math.ceil(count ** (1 / 3))
    return "".join(box(f"B{i}", (0.8, 0.7, 0.6), (i % side + draw.uniform(-0.05, 0.05), i // side % side + draw.uniform(-0.05, 0.05), 0.6 + 0.9 * (i // side**2)), more) for i in range(count))


def terrain(folder, side):
    lines = [f"ncols {side}", f"nrows {side}", "xllcorner 0", "yllcorner 0", "cellsize 1", "NODATA_value -9999"]
    lines += [" ".join(f"{0.5 * j + 0.3 * math.sin(0.7 * i) * math.cos(0.4 * j):.3f}" for j in range(side)) for i in range(side)]
    (folder / "terrain.asc").write_text("\n".join(lines) + "\n")
    return '[site]\nterrain = "terrain.asc"\nmaterial = "slope"\n'


def scenes(folder):
    """Name and text of each scene; they lie in `folder`."""
    far = box("B", (1, 1, 1), (0, 0, 4))
    strike = box("B", (0.6, 0.6, 0.6), (-1.0, 0.05, 2.0), "velocity = [20, 0, 0]")
    yield "one rigid block", simulation(3) + far
    yield "one rigid block, no report, few rows", simulation(1, output='report = false\nhistory_interval = "0.1 s"') + far
    yield "one deformable block, penalty springs", simulation(1).replace('"hard"', '"1 GPa/m"') + box("B", (1, 1, 1), (0, 0, 1), "deformable = true")
    yield "scheme of 1988", simulation(0.2, 'method = "dda-1988"\nstep = 1e-4').replace('"hard"', '"1e9 N/m"') + far
    yield "pile of 60 rigid blocks", simulation(0.3, "step = 2e-3") + pile(60)
    yield "pile of 60 deformable blocks", simulation(0.05, "step = 1e-3").replace('"hard"', '"1 GPa/m"') + pile(60, "deformable = true")
    yield "a block on terrain of 90,000 heights", simulation(2).replace("[[plane]]\npoint = [0, 0, 0]\nnormal = [0, 0, 1]\nmaterial = \"slope\"\n", terrain(folder, 300)) + box("B", (2, 2, 2), (150, 200, 110))
    yield "small elastic pier, one blow", simulation(0.02, output='report = false\nhistory_interval = "0.1 ms"') + PIER.format(1.0, 6.0, 0.25) + strike
    yield "small elastic pier that rings on", simulation(0.5) + PIER.format(1.0, 6.0, 0.25) + strike
    yield "elastic pier of 10,000 elements", simulation(0.01) + PIER.format(2.0, 10.0, 0.16) + box("B", (0.6, 0.6, 0.6), (-1.5, 0.05, 5.0), "velocity = [20, 0, 0]")
    yield "elastic pier that rings, 2,000 elements", simulation(0.5) + PIER.format(2.0, 8.0, 0.25) + box("B", (0.6, 0.6, 0.6), (-1.5, 0.05, 5.0), "velocity = [20, 0, 0]")
    yield "pier that nothing meets", simulation(0.5) + PIER.format(1.0, 6.0, 0.25) + box("B", (0.6, 0.6, 0.6), (-6, 0, 0.5))
    yield "pier that breaks", (ROOT / "tests/reliability/scene.toml").read_text()
    yield "reinforced pier with damage", simulation(0.05) + PIER.format(1.0, 6.0, 0.25) + 'damage = "concrete"\n[[structure.rebar]]\nkind = "longitudinal"\nbars = 12\ndiameter = "20 mm"\ncover = "50 mm"\n' + strike


def bound(talus, scene):
    check = subprocess.run([talus, "check", scene], capture_output=True, text=True)
    found = re.search(r"Memory: at most about (\d+) MB, of which (\d+) MB", check.stdout)
    if not found:
        sys.exit(f"{scene}: talus check told no memory\n{check.stdout}{check.stderr}")
    return int(found[1]), int(found[2])


def peak(talus, scene, out):
    """Largest resident set of the run [MB of 10^6 bytes], as the kernel has it (VmHWM), and its exit code."""
    program = os.posix_spawn(talus, [talus, "run", str(scene), "-o", str(out)], os.environ, file_actions=[(os.POSIX_SPAWN_OPEN, fd, "/dev/null", os.O_WRONLY, 0) for fd in (1, 2)])
    _, status, used = os.wait4(program, 0)
    return used.ru_maxrss * 1024e-6, os.waitstatus_to_exitcode(status)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("talus")
    parser.add_argument("files", nargs="*", metavar="SCENE")
    parser.add_argument("--only", nargs="*")
    options = parser.parse_args()
    short = 0
    with tempfile.TemporaryDirectory() as made:
        folder = pathlib.Path(made)
        chosen = [(f, pathlib.Path(f)) for f in options.files]
        for i, (name, text) in enumerate(() if options.files else scenes(folder)):
            if options.only and not any(word in name for word in options.only):
                continue
            (folder / f"scene-{i}.toml").write_text(text)
            chosen.append((name, folder / f"scene-{i}.toml"))
        for i, (name, file) in enumerate(chosen):
            most, built = bound(options.talus, file)
            taken, code = peak(options.talus, file, folder / f"out-{i}")
            well = code == 0 and taken <= most <= 2 * taken
            short += not well
            print(f"{'ok   ' if well else 'SHORT'}  {name:45s} bound {most:5d} MB, of it built {built:4d}, peak {taken:6.1f}, bound/peak {most / taken:.2f}" + (f", exit code {code}" if code else ""), flush=True)
    return 1 if short else 0


if __name__ == "__main__":
    sys.exit(main())
