#!/usr/bin/env python3
"""Elastic pier under a pulse by CalculiX and by Talus, one after the other: peak, its time, CPU seconds.

usage: calculix.py [--talus PROGRAM] [--cells NX NY NZ] [--modes N] [--steps N] [--out DIR]       (needs Debian's calculix-ccx)

Pier 2 x 2 x 10 m, clamped base, E 30 GPa, nu 0.2, 2500 kg/m^3; 2 MPa on 1 m^2 at 7.5 to 8.5 m of one face, triangle 0-5-10 ms. CalculiX
runs C3D8: modal with N modes over 0.2 s, implicit (HHT, iterative Cholesky) and explicit over --steps steps of 1e-4 s, from which
the time for 0.2 s is scaled. One thread each; CPU seconds of whole processes, start and output included.
"""
import argparse
import os
import pathlib
import re
import resource
import subprocess

SCENE = """schema = 1
title = "Elastic pier under a pulse"
[simulation]
duration = "0.2 s"
threads = 1
[[material]]
name = "concrete"
density = 2500
young = "30 GPa"
poisson = 0.2
[[structure]]
name = "pier"
kind = "column"
material = "concrete"
base = [0.0, 0.0, 0.0]
section = [2.0, 2.0]
height = 10.0
cells = [{}, {}, {}]
preload = "none"
integrator = "{}"
[[structure.probe]]
name = "top"
at = [0.0, 0.0, 10.0]
[[structure.load]]
region = {{ min = [-1.0, -0.5, 7.5], max = [-1.0, 0.5, 8.5] }}
traction = [2.0e6, 0.0, 0.0]
history = [[0.0, 0.0], [0.005, 1.0], [0.01, 0.0]]
[output]
interval = "0.05 s"
history_interval = "0.5 ms"
"""


def deck(cells, steps, kind, modes):
    nx, ny, nz = cells
    number = lambda i, j, k: 1 + i + (nx + 1) * (j + (ny + 1) * k)
    lines = ["*NODE, NSET=ALL"]
    for k in range(nz + 1):
        for j in range(ny + 1):
            lines += [f"{number(i, j, k)}, {-1 + 2 * i / nx:.12g}, {-1 + 2 * j / ny:.12g}, {10 * k / nz:.12g}" for i in range(nx + 1)]
    lines.append("*ELEMENT, TYPE=C3D8, ELSET=PIER")
    element, patch = 0, []
    for k in range(nz):
        for j in range(ny):
            for i in range(nx):
                element += 1
                corners = [(i, j, k), (i + 1, j, k), (i + 1, j + 1, k), (i, j + 1, k)]
                nodes = [number(*c) for c in corners] + [number(a, b, c + 1) for a, b, c in corners]
                lines.append(", ".join(str(n) for n in [element, *nodes]))
                if i == 0 and abs(-1 + 2 * (j + 0.5) / ny) < 0.5 and 7.5 < 10 * (k + 0.5) / nz < 8.5:
                    patch.append(element)
    lines += ["*NSET, NSET=BASE", *[str(number(i, j, 0)) for j in range(ny + 1) for i in range(nx + 1)]]
    lines += ["*NSET, NSET=TOP", str(number(nx // 2, ny // 2, nz)), "*ELSET, ELSET=PATCH", *map(str, patch)]
    lines += ["*MATERIAL, NAME=C", "*ELASTIC", "30e9, 0.2", "*DENSITY", "2500.", "*SOLID SECTION, ELSET=PIER, MATERIAL=C", "*BOUNDARY", "BASE, 1, 3"]
    lines += ["*AMPLITUDE, NAME=PULSE", "0., 0., 0.005, 1., 0.01, 0., 1., 0."]
    if kind == "modal":
        lines += ["*STEP", "*FREQUENCY, STORAGE=YES", str(modes), "*END STEP", "*STEP, INC=100000", "*MODAL DYNAMIC", "1e-4, 0.2", "*MODAL DAMPING, RAYLEIGH", ",,0.,0."]
    else:
        how = {"implicit": "*DYNAMIC, DIRECT, ALPHA=-0.05, SOLVER=ITERATIVE CHOLESKY", "explicit": "*DYNAMIC, EXPLICIT, ALPHA=-0.05"}[kind]
        lines += ["*STEP, INC=1000000", how, f"1e-4, {1e-4 * steps:g}"]
    lines += ["*DLOAD, AMPLITUDE=PULSE", "PATCH, P6, 2e6", "*NODE PRINT, NSET=TOP, FREQUENCY=1", "U", "*END STEP"]
    return "\n".join(lines) + "\n"


def cpu(command, log):
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    environment = dict(os.environ, OMP_NUM_THREADS="1", CCX_NPROC_EQUATION_SOLVER="1")
    with open(log, "w", encoding="utf-8") as f:
        code = subprocess.run(command, stdout=f, stderr=subprocess.STDOUT, env=environment, check=False).returncode
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, code


def peak_of_dat(path):
    time, best, reading = 0.0, (0.0, 0.0), False
    for line in open(path, encoding="utf-8"):
        header = re.search(r"displacements .* time\s+([0-9.E+-]+)", line)
        fields = line.split()
        if header:
            time, reading = float(header.group(1)), True
        elif fields and not fields[0].isdigit():
            reading = False
        elif reading and len(fields) == 4 and abs(float(fields[1])) > abs(best[1]):
            best = (time, float(fields[1]))
    return best


def main():
    parse = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parse.add_argument("--talus", default="build/release/talus")
    parse.add_argument("--cells", type=int, nargs=3, default=[8, 8, 40])
    parse.add_argument("--modes", type=int, default=40)
    parse.add_argument("--steps", type=int, default=50)
    parse.add_argument("--out", default="results/calculix")
    options = parse.parse_args()
    out = pathlib.Path(options.out)
    out.mkdir(parents=True, exist_ok=True)
    print("| code | scheme | CPU s for 0.2 s | largest displacement mm | at ms |\n|---|---|---|---|---|")
    import h5py
    for how in ("auto", "modal", "explicit", "implicit"):
        (out / f"{how}.toml").write_text(SCENE.format(*options.cells, how), encoding="utf-8")
        seconds, code = cpu([options.talus, "run", str(out / f"{how}.toml"), "-o", str(out / how)], out / f"{how}.log")
        if code:
            print(f"| Talus | {how} | exit code {code} | | |")
            continue
        with h5py.File(out / how / "results.h5") as f:
            t, u = f["history/time"][:], f["history/structures/pier/probe_displacement"][:, 0, 0]
        k = abs(u).argmax()
        print(f"| Talus | {how} | {seconds:.2f} | {1e3 * u[k]:.3f} | {1e3 * t[k]:.1f} |", flush=True)
    for kind in ("modal", "implicit", "explicit"):
        name = out / f"ccx-{kind}"
        name.with_suffix(".inp").write_text(deck(options.cells, options.steps, kind, options.modes), encoding="utf-8")
        seconds, code = cpu(["ccx", str(name)], f"{name}.log")
        share = 1.0 if kind == "modal" else 2000 / options.steps
        at, u = peak_of_dat(f"{name}.dat") if code == 0 else (0, 0)
        whole = kind == "modal" or options.steps >= 2000
        print(f"| CalculiX | {kind}{'' if whole else f', {options.steps} steps, scaled'} | {seconds * share:.1f} | {f'{1e3 * u:.3f}' if whole else ''} | {f'{1e3 * at:.1f}' if whole else ''} |", flush=True)


if __name__ == "__main__":
    main()
