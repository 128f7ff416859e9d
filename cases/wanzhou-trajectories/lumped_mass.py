#!/usr/bin/env python3
"""Lumped-mass reference: a point falls on the profile and rebounds with a normal and a tangential factor that scatter.

  flight      x'' = 0, z'' = -g
  rebound     v_n+ = -R_n v_n-,  v_t+ = R_t v_t-
  sliding     below v_n = 0.05 sqrt(g h): along the face with a = g (sin a - tan(phi) cos a) until it leaves it or stops

R_n ~ N(0.35, 0.04), R_t ~ N(0.85, 0.04), values usual in practice for a hard slope (assumption); phi 10 degrees (paper).
Release: x ~ N(0.08, 0.01) m, 0.10 m above the face.

usage: lumped_mass.py [number] [scale] > paths.csv
"""
import math
import sys

import numpy as np

from make_scenes import PROFILE, RELEASE_HEIGHT, RELEASE_X, ground

G = 9.8


def face(x, scale):
    for (a, za), (b, zb) in zip(PROFILE, PROFILE[1:]):
        if x <= b * scale:
            return math.atan2(zb - za, b - a), b * scale
    return 0.0, math.inf


def path(rng, scale):
    rn, rt = rng.normal(0.35, 0.04), rng.normal(0.85, 0.04)
    x = scale * rng.normal(RELEASE_X, 0.01)
    z, vx, vz, t = scale * (ground(x / scale) + RELEASE_HEIGHT), 0.0, 0.0, 0.0
    dt, rows, slide = 1e-3, [], False
    mu, threshold = math.tan(math.radians(10)), 0.05 * math.sqrt(G * scale)
    while t < 2 * math.sqrt(scale) and x < 12 * scale - 0.1:
        rows.append((t, x, z, math.hypot(vx, vz)))
        angle, end = face(x, scale)
        if slide:
            v = math.hypot(vx, vz) + dt * G * (-math.sin(angle) - mu * math.cos(angle))
            if v <= 0:
                break
            vx, vz = v * math.cos(angle), v * math.sin(angle)
            x += dt * vx
            z = scale * ground(x / scale)
            if x > end:                       # a steeper face lets it fly
                slide = face(x, scale)[0] >= angle
        else:
            x, z, vz = x + dt * vx, z + dt * (vz - 0.5 * G * dt), vz - G * dt
            angle, _ = face(x, scale)
            if z < scale * ground(x / scale):
                z = scale * ground(x / scale)
                vt, vn = vx * math.cos(angle) + vz * math.sin(angle), -vx * math.sin(angle) + vz * math.cos(angle)
                if vn < 0:
                    slide = -vn < threshold
                    vn, vt = (0.0 if slide else -rn * vn), rt * vt
                    vx, vz = vt * math.cos(angle) - vn * math.sin(angle), vt * math.sin(angle) + vn * math.cos(angle)
        t += dt
    return rows


def paths(number=50, scale=1.0, seed=1):
    rng = np.random.default_rng(seed)
    return [path(rng, scale) for _ in range(number)]


if __name__ == "__main__":
    number = int(sys.argv[1]) if len(sys.argv) > 1 else 50
    scale = float(sys.argv[2]) if len(sys.argv) > 2 else 1.0
    print("path,t_s,x_m,z_m,speed_m_s")
    for i, rows in enumerate(paths(number, scale)):
        for row in rows[::10]:
            print(f"{i + 1}," + ",".join(f"{c:.5g}" for c in row))
