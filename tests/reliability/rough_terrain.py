#!/usr/bin/env python3
"""Forty blocks tumble down rough terrain of crests, valleys and terraces: boxes, plates and irregular ones, at any friction, restitution and accuracy. Each run ends.

    rough_terrain.py TALUS [--seeds 1-8] [--allow N]    N: how many may end with exit code 3
"""
import argparse
import pathlib
import random
import re
import subprocess
import sys
import tempfile

from scenes import MATERIALS, rigid_contact

HEAD = """schema = 1
[simulation]
duration = "{duration} s"
accuracy = {accuracy}
threads = 1
[site]
terrain = "terrain.obj"
material = "ground"
""" + MATERIALS + rigid_contact("rock", "*", "{friction}", "{restitution}\n") + """[output]
report = false
"""


def terrain(seed, draw, points=18, cell=2.0):
    slope, rough, digits = 0.5 + 0.3 * (seed % 3), (0.3 if seed % 2 else 1.2), draw.randint(2, 8)
    z = [[-slope * cell * j + rough * draw.uniform(-1, 1) for _ in range(points)] for j in range(points)]
    if seed % 4 == 0:    # terraces
        z = [[round(2 * h) / 2 for h in row] for row in z]
    lines = [f"v {cell * i} {cell * j} {z[j][i]:.{digits}f}" for j in range(points) for i in range(points)]
    for j in range(points - 1):
        for i in range(points - 1):
            a, b, c, d = (j * points + i + k + 1 for k in (0, 1, points, points + 1))
            lines += [f"f {a} {b} {d}", f"f {a} {d} {c}"] if (i + j + seed) % 2 else [f"f {a} {b} {c}", f"f {b} {d} {c}"]
    return z, "\n".join(lines) + "\n"


def blocks(z, draw, cell=2.0):
    for k in range(40):
        row, column, layer = k // 10, k // 2 % 5, k % 2
        x, y = 8 + 3.6 * column, 4 + 3.0 * row
        near = [h for line in z[int(y / cell):int(y / cell) + 3] for h in line]
        size = [draw.uniform(0.5, 1.3) for _ in range(3)]
        if draw.random() < 0.25:
            size[2] = 0.12    # a plate
        if draw.random() < 0.5:
            points = [[s * f * 0.9 for s, f in zip(size, signs)] for signs in [(a, b, c) for a in (-1, 1) for b in (-1, 1) for c in (-1, 1)]]
        else:
            points = [[s * draw.uniform(-1, 1) for s in size] for _ in range(10)]
        v, w = [draw.uniform(-2, 2), draw.uniform(0, 4), 0], [draw.uniform(-2, 2), draw.uniform(-2, 2), draw.uniform(-2, 2)]
        rounded = [[round(x, 4) for x in p] for p in points]
        yield (f'[[block]]\nname = "B{k}"\nmaterial = "rock"\nshape = "convex"\nposition = [{x:.4f}, {y:.4f}, {max(near) + 3 + 3.2 * layer:.4f}]\n'
               f"velocity = {[round(a, 3) for a in v]}\nspin = {[round(a, 3) for a in w]}\nvertices = {rounded}\n")


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("talus")
    parser.add_argument("--seeds", default="1-8")
    parser.add_argument("--duration", type=float, default=6)
    parser.add_argument("--allow", type=int, default=0)
    options = parser.parse_args()
    first, last = (int(s) for s in options.seeds.split("-"))
    talus = str(pathlib.Path(options.talus).resolve())
    ended, failed = [], []
    for seed in range(first, last + 1):
        draw = random.Random(seed)
        with tempfile.TemporaryDirectory() as folder:
            z, mesh = terrain(seed, draw)
            pathlib.Path(folder, "terrain.obj").write_text(mesh)
            restitution = [0, 0.3, 0.5][seed % 3]
            head = HEAD.format(duration=options.duration, accuracy=[1e-3, 1e-2, 3e-3][seed // 2 % 3], friction=[0.3, 0.6, 0.9][seed // 3 % 3],
                               restitution=f"restitution = {restitution}" if restitution else "")
            pathlib.Path(folder, "scene.toml").write_text(head + "\n".join(blocks(z, draw)))
            run = subprocess.run([talus, "run", "scene.toml", "-o", "out"], cwd=folder, capture_output=True, text=True)
            said = re.search(r"(?m)^(?:done|failed) .*", run.stdout + run.stderr)
            print(f"{seed}: exit {run.returncode}, {said.group() if said else (run.stdout + run.stderr)[-300:]}", flush=True)
            if run.returncode == 3:
                ended.append(seed)
            elif run.returncode != 0:
                failed.append(seed)
    print(f"{last - first + 1} scenes: {len(ended)} ended with exit code 3 {ended}, {len(failed)} otherwise {failed}")
    return 1 if failed or len(ended) > options.allow else 0


if __name__ == "__main__":
    sys.exit(main())
