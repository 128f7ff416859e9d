#!/usr/bin/env python3
"""Writes the scenes of the 14 aluminium blocks: readings a and b, slope angles 20 to 50 degrees.

Stack axes: s down the slope, y across it, n normal to it. Metres, from the middle of the stack's base.
Reading a: the paper's six cuboids 2.5 x 5 x 5 cm in the middle layer; they fill 375 of its 500 cm3, and the gap is left at the uphill end.
Reading b: four such cuboids and two 5 cm cubes, which fill the layer; still 14 blocks.
"""
import math
import os

HERE = os.path.dirname(os.path.abspath(__file__))
ANGLES = (20, 25, 30, 35, 40, 45, 50)
CUBE, THIN = (0.05, 0.05, 0.05), (0.025, 0.05, 0.05)


def blocks(reading):
    out = []
    for layer, n in (("bottom", 0.025), ("top", 0.125)):
        for i, s in enumerate((-0.025, 0.025)):
            for j, y in enumerate((-0.025, 0.025)):
                out.append((f"{layer}{2 * i + j + 1}", CUBE, (s, y, n)))
    k = 0
    for y in (-0.025, 0.025):
        row = [(-0.0125, THIN), (0.0125, THIN), (0.0375, THIN)] if reading == "a" else [(-0.0375, THIN), (0.0, CUBE), (0.0375, THIN)]
        for s, size in row:
            k += 1
            out.append((f"middle{k}", size, (s, y, 0.075)))
    return out


def scene(reading, angle):
    a = math.radians(angle)
    down, normal = (math.cos(a), 0.0, -math.sin(a)), (math.sin(a), 0.0, math.cos(a))
    text = f"""# Written by make_scenes.py; assumptions in README.md.
schema = 1
title = "14 aluminium blocks, reading {reading}, slope {angle} degrees"

[simulation]
duration = "0.3 s"
gravity = [0.0, 0.0, -9.8]
accuracy = 3e-5

[[plane]]
point = [0.0, 0.0, 0.0]
dip_direction = "90 deg"
dip = "{angle} deg"
material = "plate"

[[material]]
name = "aluminium"
density = 2700
young = "68 GPa"
poisson = 0.34

[[interface]]
between = ["aluminium", "aluminium"]
friction = "24 deg"
normal_stiffness = "hard"

[[interface]]
between = ["aluminium", "plate"]
friction = "24 deg"
normal_stiffness = "hard"

[output]
interval = "20 ms"
history_interval = "5 ms"
"""
    for name, size, (s, y, n) in blocks(reading):
        p = [s * down[i] + n * normal[i] for i in range(3)]
        p[1] = y
        text += f"""
[[block]]
name = "{name}"
material = "aluminium"
shape = "box"
size = [{size[0]}, {size[1]}, {size[2]}]
position = [{p[0]!r}, {p[1]!r}, {p[2]!r}]
orientation = {{ dip_direction = "90 deg", dip = "{angle} deg" }}
deformable = false
"""
    return text


for reading in "ab":
    for angle in ANGLES:
        with open(os.path.join(HERE, f"{reading}-{angle}.toml"), "w") as f:
            f.write(scene(reading, angle))
