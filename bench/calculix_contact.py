#!/usr/bin/env python3
"""A cube of elements strikes an elastic pier, by CalculiX and by Talus, one after the other: impulse, rebound, peak force, CPU seconds and their ratio.

usage: calculix_contact.py [--talus PROGRAM] [--step S] [--repeat N] [--out DIR]       (needs Debian's calculix-ccx)

Pier 2 x 2 x 10 m of 8 x 8 x 40 elements, clamped base; cube of 1 m, 4 x 4 x 4 elements, at 20 m/s flat onto z = 7.5 to 8.5 m; both E 30 GPa, nu 0.2, 2500 kg/m^3; linear
penalty 1e11 Pa/m, no friction; 1.5 ms. CalculiX: C3D8, explicit, surface to surface, NLGEOM, increments of --step. Talus: the same meshes, the cube as a second structure. The
peak is that of the cube's change of momentum over 0.05 ms. One thread each; CPU seconds of whole processes, the least of --repeat runs.
"""
import argparse
import pathlib
import re

import numpy as np

from calculix import cpu

MASS, SPEED, END = 2500.0, 20.0, 1.5e-3
SCENE = """schema = 1
title = "Cube of elements on an elastic pier"
[simulation]
duration = "1.5 ms"
gravity = [0.0, 0.0, 0.0]
threads = 1
[[material]]
name = "pier"
density = 2500
young = "30 GPa"
poisson = 0.2
[[material]]
name = "cube"
density = 2500
young = "30 GPa"
poisson = 0.2
[[interface]]
between = ["cube", "pier"]
friction = 0.0
normal_stiffness = "100 GPa/m"
[[structure]]
name = "pier"
kind = "box"
material = "pier"
position = [0.0, 0.0, 5.0]
size = [2.0, 2.0, 10.0]
cells = [8, 8, 40]
support = ["-z"]
preload = "none"
[[structure]]
name = "cube"
kind = "box"
material = "cube"
position = [-1.501, 0.0, 8.0]
size = [1.0, 1.0, 1.0]
cells = [4, 4, 4]
support = []
preload = "none"
initial_velocity = [20.0, 0.0, 0.0]
PROBES[output]
report = false
interval = "1.5 ms"
history_interval = "15 us"
"""


def ends(i):
    return 1 if i in (0, 4) else 2


# The cube's nodes with the mass of the elements around them, in one order for both codes.
NODES = [(i, j, k, MASS / 512 * ends(i) * ends(j) * ends(k)) for k in range(5) for j in range(5) for i in range(5)]


def scene():
    probes = "".join(f'[[structure.probe]]\nname = "n{i}{j}{k}"\nat = [{-2.001 + 0.25 * i:.3f}, {-0.5 + 0.25 * j:.2f}, {7.5 + 0.25 * k:.2f}]\n' for i, j, k, _ in NODES)
    return SCENE.replace("PROBES", probes)


class Grid:
    """Nodes and hexahedra of a box, numbered from `start`."""

    def __init__(self, cells, low, high, start):
        self.cells, self.start = cells, start
        self.nodes = [(self.node(i, j, k), *(low[d] + (high[d] - low[d]) * t / cells[d] for d, t in enumerate((i, j, k))))
                      for k in range(cells[2] + 1) for j in range(cells[1] + 1) for i in range(cells[0] + 1)]
        places = [(i, j, k) for k in range(cells[2]) for j in range(cells[1]) for i in range(cells[0])]
        self.elements = {place: start + 1 + n for n, place in enumerate(places)}

    def node(self, i, j, k):
        return self.start + 1 + i + (self.cells[0] + 1) * (j + (self.cells[1] + 1) * k)

    def corners(self, i, j, k):
        return [self.node(i + a, j + b, k + c) for c in (0, 1) for a, b in ((0, 0), (1, 0), (1, 1), (0, 1))]


def deck(step):
    pier, cube = Grid((8, 8, 40), (-1, -1, 0), (1, 1, 10), 0), Grid((4, 4, 4), (-2.001, -0.5, 7.5), (-1.001, 0.5, 8.5), 100000)
    lines = ["*NODE, NSET=ALL"] + [f"{n}, {x:.9g}, {y:.9g}, {z:.9g}" for g in (pier, cube) for n, x, y, z in g.nodes]
    for name, g in (("PIER", pier), ("CUBE", cube)):
        lines.append(f"*ELEMENT, TYPE=C3D8, ELSET={name}")
        lines += [", ".join(map(str, [e, *g.corners(*place)])) for place, e in g.elements.items()]
    lines += ["*NSET, NSET=BASE", *(str(pier.node(i, j, 0)) for j in range(9) for i in range(9))]
    lines += ["*NSET, NSET=MOVING", *(str(n) for n, *_ in cube.nodes)]
    lines += ["*SURFACE, NAME=STRUCK", *(f"{e}, S6" for (i, j, k), e in pier.elements.items() if i == 0 and 7.0 <= 0.25 * k < 9.0)]
    lines += ["*SURFACE, NAME=STRIKING", *(f"{e}, S4" for (i, j, k), e in cube.elements.items() if i == 3)]
    lines += ["*MATERIAL, NAME=C", "*ELASTIC", "30e9, 0.2", "*DENSITY", "2500."]
    lines += [f"*SOLID SECTION, ELSET={name}, MATERIAL=C" for name in ("PIER", "CUBE")]
    lines += ["*SURFACE INTERACTION, NAME=PENALTY", "*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR", "1e11"]
    lines += ["*CONTACT PAIR, INTERACTION=PENALTY, TYPE=SURFACE TO SURFACE", "STRIKING, STRUCK"]
    lines += ["*BOUNDARY", "BASE, 1, 3", "*INITIAL CONDITIONS, TYPE=VELOCITY", f"MOVING, 1, {SPEED}"]
    lines += ["*STEP, INC=1000000, NLGEOM", "*DYNAMIC, EXPLICIT", f"{step:g}, {END:g}", "*NODE PRINT, NSET=MOVING", "V", "*END STEP"]
    return "\n".join(lines) + "\n"


def momenta_of_dat(path):
    """Times and the cube's momentum along x, nodes weighed by the elements around them."""
    weight = {100001 + i + 5 * (j + 5 * k): mass for i, j, k, mass in NODES}
    times, momenta = [0.0], [MASS * SPEED]
    for line in open(path, encoding="utf-8"):
        header, fields = re.search(r"velocities .* time\s+([0-9.E+-]+)", line), line.split()
        if header:
            times.append(float(header.group(1)))
            momenta.append(0.0)
        elif len(fields) == 4 and fields[0].isdigit():
            momenta[-1] += weight[int(fields[0])] * float(fields[1])
    return times, momenta


def row(name, seconds, times, momenta):
    t = np.arange(0.0, times[-1], 5e-5)
    peak = (-np.diff(np.interp(t, times, momenta)) / 5e-5).max()
    print(f"| {name} | {1e-3 * (momenta[0] - momenta[-1]):.2f} | {-momenta[-1] / MASS:.2f} | {1e-6 * peak:.0f} | {seconds:.3f} |", flush=True)


def main():
    parse = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parse.add_argument("--talus", default="build/release/talus")
    parse.add_argument("--step", type=float, default=1e-5)
    parse.add_argument("--repeat", type=int, default=3)
    parse.add_argument("--out", default="results/calculix")
    options = parse.parse_args()
    out = pathlib.Path(options.out)
    out.mkdir(parents=True, exist_ok=True)
    import h5py
    toml, name = out / "cube.toml", out / "ccx-cube"
    toml.write_text(scene(), encoding="utf-8")
    name.with_suffix(".inp").write_text(deck(options.step), encoding="utf-8")
    least = {}
    for _ in range(options.repeat):
        for code, command in (("CalculiX", ["ccx", str(name)]), ("Talus", [options.talus, "run", str(toml), "-o", str(out / "cube")])):
            seconds, status = cpu(command, out / f"{code}-cube.log")
            if status:
                raise SystemExit(f"{code} ended with exit code {status}: see {out / f'{code}-cube.log'}")
            least[code] = min(seconds, least.get(code, seconds))
    print("| code | impulse kN s | rebound m/s | peak MN, mean over 0.05 ms | CPU s |\n|---|---|---|---|---|")
    row(f"CalculiX, explicit, {options.step:g} s", least["CalculiX"], *momenta_of_dat(f"{name}.dat"))
    with h5py.File(out / "cube" / "results.h5") as f:
        times, u = f["history/time"][:], f["history/structures/cube/probe_displacement"][:, :, 0]
    masses = np.array([mass for *_, mass in NODES])
    momenta = np.concatenate([[MASS * SPEED], np.diff(u @ masses) / np.diff(times)])   # mean of each interval, at its middle
    times = np.concatenate([[0.0], 0.5 * (times[1:] + times[:-1])])
    row("Talus", least["Talus"], times, momenta)
    print(f"\nCalculiX takes {least['CalculiX'] / least['Talus']:.0f} times the CPU of Talus.")


if __name__ == "__main__":
    main()
