#!/usr/bin/env python3
"""Writes the reinforcement of the beams as CSV (docs/guide/rebar.md) beside the scenes: make_bars.py

Beam axes: x along the beam with x = 0 at midspan, y across, z up, z = 0 at mid-depth.
"""
import pathlib

here = pathlib.Path(__file__).resolve().parent.parent


def write(path, bars, stirrups):
    """bars: (name, diameter, y, z, half length, grade); stirrups: (diameter, half width, half height, [x], grade)"""
    lines = ["bar,diameter,x,y,z,grade"]
    for name, d, y, z, half, grade in bars:
        lines += [f"{name},{d},{x:g},{y:g},{z:g},{grade}" for x in (-half, half)]
    if stirrups:
        d, b, h, places, grade = stirrups
        for k, x in enumerate(places):
            corners = [(-b, -h), (b, -h), (b, h), (-b, h), (-b, -h)]
            lines += [f"S{k + 1},{d},{x:g},{y:g},{z:g},{grade}" for y, z in corners]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


# Saatci and Vecchio: two No. 30 (700 mm^2, 464/630 MPa) top and bottom, D-6 stirrups (38.7 mm^2).
folder = here / "experiments-saatci-vecchio"
longitudinal = [(f"L{i + 1}", 0.02985, y, z, 2.40, "464/630/0.1") for i, (y, z) in enumerate([(-0.072, -0.152), (0.072, -0.152), (-0.072, 0.152), (0.072, 0.152)])]
for beam, spacing in (("ss0", 0.0), ("ss1", 0.3), ("ss2", 0.2), ("ss3", 0.1)):
    count = int(2.3 / spacing) if spacing else 0
    ties = (0.00702, 0.0905, 0.1705, [round(spacing * k, 6) for k in range(-count, count + 1)], "605/652/0.05") if spacing else None
    write(folder / f"bars-{beam}.csv", longitudinal, ties)

# Ando, Kishi, Mikami: two bars at the bottom and two at the top, 40 mm from the faces.
folder = here / "experiments-ando-kishi-mikami"
for beam, d, half in (("a24", 0.0191, 0.65), ("a36", 0.0191, 0.90), ("b36", 0.0127, 0.90), ("b48", 0.0127, 1.15)):
    write(folder / f"bars-{beam}.csv", [(f"L{i + 1}", d, y, z, half, "400/560/0.1") for i, (y, z) in enumerate([(-0.035, -0.085), (0.035, -0.085), (-0.035, 0.085), (0.035, 0.085)])], None)
