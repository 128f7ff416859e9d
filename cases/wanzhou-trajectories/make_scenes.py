#!/usr/bin/env python3
"""Writes the Wanzhou slope (laboratory scale and ten times larger) and the scenes of both Wanzhou cases.

The paper gives the slope as a picture; PROFILE is an assumption with a bench, two steep faces and a platform (see README.md).
x along the fall, y across, z up.
"""
import os

HERE = os.path.dirname(os.path.abspath(__file__))
PROFILE = [(-0.4, 1.50), (0.0, 1.50), (0.20, 1.15), (0.40, 1.05), (0.60, 0.65), (0.90, 0.48), (1.10, 0.10), (1.25, 0.0), (12.0, 0.0)]
SHAPES = [("dodecahedron", 'shape = "dodecahedron"'), ("icosahedron", 'shape = "icosahedron"')]
SHAPES += [(f"sphere{n}x{n}", f'shape = "sphere"\nlongitudes = {n}\nlatitudes = {n}') for n in (4, 5, 6, 7)]
SHAPES += [("convex", 'shape = "random-convex"\nseed = 7\naspect = [1.2, 1.0, 0.9]'), ("concave", 'shape = "random-concave"\nseed = 7\naspect = [1.2, 1.0, 0.9]')]
RELEASE_X, RELEASE_HEIGHT = 0.08, 0.10     # above the upper face; assumption


def ground(x):
    for (a, za), (b, zb) in zip(PROFILE, PROFILE[1:]):
        if a <= x <= b:
            return za + (zb - za) * (x - a) / (b - a)
    raise ValueError(x)


def write_slope(scale, width):
    with open(os.path.join(HERE, f"slope-x{scale}.obj"), "w") as f:
        f.write("# Wanzhou slope, assumed profile; written by make_scenes.py\n")
        for x, z in PROFILE:
            for y in (-0.5, width):
                f.write(f"v {x * scale:.9g} {y * scale:.9g} {z * scale:.9g}\n")
        for i in range(len(PROFILE) - 1):
            a, b, c, d = 2 * i + 1, 2 * i + 2, 2 * i + 3, 2 * i + 4
            f.write(f"f {a} {c} {b}\nf {b} {c} {d}\n")


def scene(title, slope, scale, mass, shapes, physical, duration):
    contact = 'normal_stiffness = "hard"\nrestitution = 0.5' if physical else 'normal_stiffness = "1 GN/m"\nshear_stiffness = "0.5 GN/m"'
    method = "accuracy = 1e-3" if physical else 'method = "dda-1988"\nstep = "1e-4 s"'
    text = f"""# Written by make_scenes.py; assumptions in README.md.
schema = 1
title = "{title}"

[simulation]
duration = "{duration:g} s"
gravity = [0.0, 0.0, -9.8]
{method}

[site]
terrain = "{slope}"
material = "slope"

[[material]]
name = "rock"
density = 2610
young = "54 GPa"
poisson = 0.13

[[material]]
name = "slope"
density = 2400

[[interface]]
between = ["rock", "slope"]
friction = "10 deg"
{contact}

[[interface]]
between = ["rock", "rock"]
friction = "10 deg"
{contact}

[output]
interval = "20 ms"
history_interval = "5 ms"
"""
    for i, (name, shape) in enumerate(shapes):
        text += f"""
[[block]]
name = "{name}"
material = "rock"
{shape}
mass = "{mass}"
position = [{RELEASE_X * scale:.9g}, {i * scale * 0.5:.9g}, {(ground(RELEASE_X) + RELEASE_HEIGHT) * scale:.9g}]
deformable = {"false" if physical else "true"}
"""
    return text


write_slope(1, 4.0)
write_slope(10, 0.5)
for physical, name in ((True, "physical"), (False, "paper")):
    what = "restitution 0.5" if physical else "the paper's parameters, 1988 scheme"
    with open(os.path.join(HERE, f"{name}.toml"), "w") as f:
        f.write(scene(f"Wanzhou trajectories, {what}", "slope-x1.obj", 1, "44.8 g", SHAPES, physical, 2))
    with open(os.path.join(HERE, "..", "wanzhou-energy", f"{name}.toml"), "w") as f:
        f.write(scene(f"Wanzhou energy, {what}", "../wanzhou-trajectories/slope-x10.obj", 10, "10 kg", [SHAPES[5]], physical, 6))
