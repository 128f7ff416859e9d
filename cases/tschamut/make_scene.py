#!/usr/bin/env python3
"""Writes scene.toml: an ensemble whose members start as the 62 measured runs did, several times over with another orientation.

    make_scene.py [REPEATS]   runs of each start (4)
"""
import csv
import pathlib
import sys

HERE = pathlib.Path(__file__).parent
REPEATS = int(sys.argv[1]) if len(sys.argv) > 1 else 4

rows = list(csv.DictReader(open(HERE / "release_points.csv")))
blocks = {r["block_id"]: r for r in csv.DictReader(open(HERE / "block_metadata.csv"))}


def vector(values):
    return "[" + ", ".join(f"{float(v):.6g}" for v in values) + "]"


places, velocities, sizes, masses = [], [], [], []
for r in rows:
    b = blocks[r["block_id"]]
    # The measured centre lies a mean radius above the ground: turned at random, and on a 5 m grid, a block would start in it.
    half = 0.5 * sum(float(b[f"size_{k}_m"]) ** 2 for k in "xyz") ** 0.5
    places.append(vector([r["x_m"], r["y_m"], float(r["ground_z_m"]) + 2.6 * half]))
    velocities.append(vector([r["vx_mps"], r["vy_mps"], r["vz_mps"]]))
    sizes.append(vector(b[f"size_{k}_m"] for k in "xyz"))
    masses.append(float(b["mass_kg"]))


def listed(key, values, like=None):
    text = f'[[ensemble.vary]]\nkey = "{key}"\nlist = [\n' + "".join(f"  {v},\n" for v in values) + "]\n"
    return text + (f"like = {like}\n" if like is not None else "")


# The lengths are the block's; the mass decides, by a box of them cut down at its corners.
scene = f'''# Written by make_scene.py from the measured starts. Terrain and starts: Volkwein & Gerber, Repetitive trajectory testing in Tschamut 2014,
# doi 10.16904/envidat.34, ODbL with DbCL.
schema = 1
title = "Tschamut 2014: 62 runs of three blocks"

[simulation]
duration = "60 s"
until = "rest"

[site]
terrain = "terrain.asc"
material = "meadow"

[[material]]
name = "rock"
density = 2700

# What is rough below the grid, and the rolling resistance: chosen by hand on the measured run-outs.
[[material]]
name = "meadow"
roughness = {{ amplitude = "0.25 m", length = "1.5 m" }}

[[interface]]
between = ["rock", "meadow"]
friction = 0.9
restitution = 0.1
rolling_resistance = 0.05
normal_stiffness = "hard"

[[block]]
name = "B"
material = "rock"
shape = "EOTA111"
mass = 69
position = [0.0, 0.0, 0.0]

[[line]]
name = "foot"
points = [[-20.0, 150.0], [160.0, 150.0]]

[output]
interval = "0.5 s"
history_interval = "50 ms"
report = false

[ensemble]
design = "factorial"
members = {REPEATS * len(rows)}
seed = 1
map_cell = "5 m"
'''
scene += listed("block.B.position", places) + listed("block.B.velocity", velocities, 0) + listed("block.B.mass", masses, 0)
scene += '[[ensemble.vary]]\nkey = "block.B.orientation"\nrotation = "uniform"\n'
(HERE / "scene.toml").write_text(scene)
print(f"{len(rows)} starts, {REPEATS} times each")
