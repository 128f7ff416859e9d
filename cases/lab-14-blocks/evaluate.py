#!/usr/bin/env python3
"""Displacement of the monitoring point and failure mode of each run, beside what statics say.

usage: evaluate.py DIR... [-o FIGURES.json] [--plot CURVES.svg]       (output directories named ...-READING-ANGLE)

Monitoring point: middle of the upper face of block top3 (downhill), taken as fixed to the block. Mode, from the motion of the
first 0.2 s at which anything has moved by 2 mm: "slides" if the stack's base moves, "topples" if the top layer turns by more than 2 degrees.
Statics: slides if tan(theta) > tan(24 deg); a free column of three layers, 5 cm wide, topples above atan(5/15) = 18.43 deg,
the stack as one body above atan(10/15) = 33.69 deg.
"""
import json
import math
import sys

import h5py
import numpy as np


def rotate(q, v):
    w, u = q[..., :1], q[..., 1:]
    return v + 2 * np.cross(u, np.cross(u, v) + w * v)


def monitored(directory):
    """Times, displacement of the monitoring point (time, 3) and failure mode of one run."""
    with h5py.File(f"{directory}/results.h5") as f:
        b = f["history/blocks"]
        names = [n.decode() for n in b["name"][:]]
        t, p, q = f["history/time"][:], b["position"][:], b["orientation"][:]
    k = names.index("top3")
    point = p[:, k] + rotate(q[:, k], np.array([0.0, 0.0, 0.025]))
    turn = 2 * np.degrees(np.arccos(np.clip(np.abs((q * q[0]).sum(axis=2)), 0, 1)))
    path = np.linalg.norm(p - p[0], axis=2)
    rows = np.nonzero(path.max(axis=1) > 2e-3)[0]
    mode = "stable"
    if len(rows):
        r = min(len(t) - 1, rows[0] + int(round(0.2 / (t[1] - t[0]))))
        base = [i for i, n in enumerate(names) if n.startswith("bottom")]
        top = [i for i, n in enumerate(names) if n.startswith("top")]
        slides, topples = path[r, base].max() > 2e-3, turn[r, top].max() > 2
        mode = "slides and topples" if slides and topples else "slides" if slides else "topples" if topples else "shears within"
    return t, point - point[0], mode


def plot(curves, path):
    import matplotlib
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    fig, axes = plt.subplots(1, 2, figsize=(10, 4))
    for name, (t, moved, _) in curves.items():
        style = "-" if name.startswith("a") else ":"
        axes[0].plot(t, 100 * np.linalg.norm(moved, axis=1), style, label=name)
        axes[1].plot(t, 100 * moved[:, 1], style)
    for ax, what in zip(axes, ("displacement [cm]", "lateral displacement [cm]")):
        ax.set_xlabel("t [s]"), ax.set_ylabel(what)
    axes[0].legend(fontsize=7, ncol=2)
    fig.tight_layout()
    fig.savefig(path)


def main():
    words = sys.argv[1:]
    options = {w: words[words.index(w) + 1] for w in ("-o", "--plot") if w in words}
    figures, curves = {}, {}
    for directory in (w for w in words if not w.startswith("-") and w not in options.values()):
        reading, angle = directory.rstrip("/").split("-")[-2:]
        t, moved, mode = curves[f"{reading}-{angle}"] = monitored(directory)
        figures[f"{reading}-{angle}"] = {"mode": mode, "displacement_cm": 100 * float(np.linalg.norm(moved[-1])), "lateral_cm": 100 * float(moved[-1, 1]),
                                         "largest_lateral_cm": 100 * float(np.abs(moved[:, 1]).max()), "end_time": float(t[-1])}
        theory = "slides" if math.radians(float(angle)) > math.radians(24) else "holds against sliding"
        print(f"reading {reading}, {angle} deg: {mode:18s} monitoring point at {t[-1]:.2f} s: displacement {np.linalg.norm(moved[-1]) * 100:7.2f} cm, "
              f"lateral {moved[-1, 1] * 100:+7.3f} cm (largest {np.abs(moved[:, 1]).max() * 100:.3f}), statics: {theory}")
    if "-o" in options:
        with open(options["-o"], "w") as f:
            json.dump(figures, f, indent=1)
    if "--plot" in options:
        plot(curves, options["--plot"])


if __name__ == "__main__":
    main()
