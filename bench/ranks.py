#!/usr/bin/env python3
"""One rank beside two on explicit steps of a structure, as CPU time of the dynamics alone.

usage: ranks.py [--talus PROGRAM] [--mpirun PROGRAM] [--cells NX NY NZ] [--steps N] [--ranks N,...] [--repeat N] [--apart N] [--out DIR]
       ranks.py --scene FILE --between FROM TO [...]

An elastic pier of 2 x 2 x 10 m in 36 x 36 x 154 cells, 200,000 hexahedra, is struck by a prescribed pulse and followed by `--steps`
explicit sub-steps. Each figure is the difference of a run of that length and one of a tenth of it, so that mesh, mass and output do
not count; the two are run one after the other and the numbers of ranks alternate, `--repeat` times. With `--scene` it is that scene
between two times [s]. Reported for each rank:

  computed   CPU of its main thread outside MPI [s]: what the work itself costs, whatever else runs on the machine
  in MPI     CPU and wall time inside MPI [s]: exchange and waiting for the other rank
  peak       memory of the process at its greatest, of the longer run [MB]

and for the run: wall time, and how many times less the slowest rank computes than one rank alone (`split`).

`--apart N` adds the machine's own limit: N processes that know nothing of each other, each the whole structure on one rank. N times the wall time of one alone over
that of the slowest is the most that N ranks can gain here, whatever they exchange: beyond it the memory or the cores are shared with others.
mpi_share.c is compiled by mpicc on the way. Needs mpicc, mpirun.
"""
import argparse
import concurrent.futures
import os
import pathlib
import shutil
import statistics
import subprocess
import time

here = pathlib.Path(__file__).resolve().parent
SCENE = """schema = 1
title = "Elastic pier, {cells} cells, prescribed impact"
[simulation]
duration = "{duration:.17g} s"
threads = 1
[[material]]
name = "C30"
density = 2500
young = "30 GPa"
poisson = 0.2
[[interface]]
between = ["C30", "C30"]
friction = 0.5
normal_stiffness = "hard"
[[structure]]
name = "pier"
kind = "column"
material = "C30"
base = [0.0, 0.0, 0.0]
section = [2.0, 2.0]
height = 10.0
cells = [{nx}, {ny}, {nz}]
integrator = "explicit"
preload = "none"
[[structure.load]]
region = {{ min = [-1.01, -0.51, 7.49], max = [-0.99, 0.51, 8.51] }}
traction = ["2 MPa", 0.0, 0.0]
history = [[0.0, 0.0], [0.001, 1.0], [0.002, 0.0]]
[output]
report = false
interval = "{duration:.17g} s"
history_interval = "{duration:.17g} s"
"""


def launch(options, directory, count, duration):
    """Wall time [s] and, for each rank, (CPU, CPU in MPI, wall in MPI) of a run over `duration` [s]."""
    nx, ny, nz = options.cells
    name = f"{count}-{duration:.3g}"
    scene, share = directory / f"{name}.toml", directory / f"{name}.share"
    if options.scene:
        scene = pathlib.Path(options.scene).resolve()
    else:
        scene.write_text(SCENE.format(cells=nx * ny * nz, nx=nx, ny=ny, nz=nz, duration=duration), encoding="utf-8")
    environment = dict(os.environ, OMPI_ALLOW_RUN_AS_ROOT="1", OMPI_ALLOW_RUN_AS_ROOT_CONFIRM="1", OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1")
    command = [options.mpirun, *(["--oversubscribe"] if count > os.cpu_count() else ["--bind-to", "none"]), "-n", str(count), "-x", f"LD_PRELOAD={directory / 'libmpi_share.so'}", "-x", f"MPI_SHARE_OUT={share}",
               options.talus, "run", str(scene), "-o", str(directory / name), "--set", f"simulation.duration={duration:.17g}"]
    start = time.monotonic()
    subprocess.run(command, env=environment, stdout=subprocess.DEVNULL, check=True)
    wall = time.monotonic() - start
    return wall, [tuple(float(x) for k, x in enumerate(pathlib.Path(f"{share}.{r}").read_text().split()) if k != 3) for r in range(count)]


def launch_apart(options, directory, count, duration):
    """Wall time [s] of the slowest of `count` runs on one rank each, all at the same time."""
    with concurrent.futures.ThreadPoolExecutor(count) as pool:
        places = [directory / f"apart-{k}" for k in range(count)]
        for place in places:
            place.mkdir(exist_ok=True)
            shutil.copy(directory / "libmpi_share.so", place)
        return max(wall for wall, _ in pool.map(lambda place: launch(options, place, 1, duration), places))


def main():
    parse = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parse.add_argument("--talus", default=str(here.parent / "build/release/talus"))
    parse.add_argument("--mpirun", default="mpirun")
    parse.add_argument("--cells", type=int, nargs=3, default=[36, 36, 154])
    parse.add_argument("--steps", type=int, default=300)
    parse.add_argument("--ranks", default="1,2")
    parse.add_argument("--repeat", type=int, default=3)
    parse.add_argument("--step", type=float, default=1.36e-5, help="the sub-step the run takes [s]")
    parse.add_argument("--apart", type=int, default=0, help="also so many runs of one rank at the same time; 0: none")
    parse.add_argument("--scene", default="", help="in place of the elastic pier")
    parse.add_argument("--between", type=float, nargs=2, metavar=("FROM", "TO"), help="times of that scene [s]")
    parse.add_argument("--out", default="results/ranks")
    options = parse.parse_args()
    directory = pathlib.Path(options.out).resolve()
    directory.mkdir(parents=True, exist_ok=True)
    subprocess.run(["mpicc", "-O2", "-shared", "-fPIC", "-o", str(directory / "libmpi_share.so"), str(here / "mpi_share.c")], check=True)
    if bool(options.scene) != bool(options.between):
        parse.error("--scene and --between go together")
    short, long = options.between or (0.1 * options.steps * options.step, options.steps * options.step)
    alone, walls = [], []
    print("| run | ranks | wall s | computed s, each rank | CPU in MPI s | wall in MPI s | peak MB | split |\n|---|---|---|---|---|---|---|---|")
    for k in range(options.repeat):
        for count in (int(n) for n in options.ranks.split(",")):
            (w1, a), (w0, b) = launch(options, directory, count, long), launch(options, directory, count, short)
            each = [[x - y for x, y in zip(p, q)] for p, q in zip(a, b)]
            computed = [cpu - inside for cpu, inside, *_ in each]
            if count == 1:
                alone.append(computed[0])
                walls.append(w1 - w0)
            split = statistics.median(alone) / max(computed) if alone else float("nan")
            show = lambda values: ", ".join(f"{x:.2f}" for x in values)
            print(f"| {k + 1} | {count} | {w1 - w0:.2f} | {show(computed)} | {show(e[1] for e in each)} | {show(e[2] for e in each)} | {', '.join(f'{p[3]:.0f}' for p in a)} | {split:.2f} |", flush=True)
        if options.apart:
            wall = launch_apart(options, directory, options.apart, long) - launch_apart(options, directory, options.apart, short)
            limit = f"{options.apart * statistics.median(walls) / wall:.2f}" if walls else ""
            print(f"| {k + 1} | {options.apart} apart | {wall:.2f} | | | | | at most {limit} |", flush=True)


if __name__ == "__main__":
    main()
