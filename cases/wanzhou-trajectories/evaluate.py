#!/usr/bin/env python3
"""Trajectories and energies of the Wanzhou runs against 50 lumped-mass paths.

usage: evaluate.py [--energy] PHYSICAL PAPER [-o FIGURES.json] [--plot FIGURE.png]      (output directories of the two runs)
"""
import json
import sys

import h5py
import numpy as np

sys.path.insert(0, __file__.rsplit("/", 1)[0] if "/" in __file__ else ".")
from lumped_mass import paths          # noqa: E402
from make_scenes import PROFILE        # noqa: E402

energy = "--energy" in sys.argv
options = {w: sys.argv[sys.argv.index(w) + 1] for w in ("-o", "--plot") if w in sys.argv}
figure = options.get("--plot")
directories = [a for a in sys.argv[1:] if not a.startswith("-") and a not in options.values()]
figures = {}
scale = 10.0 if energy else 1.0
stations = np.array([0.5, 1.0, 1.5, 2.0]) * scale
lumped = [np.array(p) for p in paths(50, scale)]


def height_at(x, z):
    """Height of the path where it first passes each station; NaN where it never does."""
    out = []
    for s in stations:
        k = np.nonzero(x >= s)[0]
        out.append(z[k[0]] if len(k) else np.nan)
    return np.array(out)


table = np.array([height_at(p[:, 1], p[:, 2]) for p in lumped])
low, high = np.nanmin(table, axis=0), np.nanmax(table, axis=0)
print("heights at x =", stations, "m; 50 lumped-mass paths: from", np.round(low, 3), "to", np.round(high, 3))
tracks = {}
for label, directory in zip(("physical", "1988"), directories):
    with h5py.File(f"{directory}/results.h5") as f:
        b = f["history/blocks"]
        t, p = f["history/time"][:], b["position"][:]
        kt, kr, m = b["kinetic_translational"][:], b["kinetic_rotational"][:], b["mass"][:]
        names = [n.decode() for n in b["name"][:]]
    within, gains, rotational = 0, [], []
    for i, name in enumerate(names):
        total = kt[:, i] + kr[:, i] + m[i] * 9.8 * p[:, i, 2]
        gain = (total.max() - total[0]) / (m[i] * 9.8 * p[0, i, 2])
        h = height_at(p[:, i, 0], p[:, i, 2])
        inside = int(np.sum((h >= low) & (h <= high)))
        share = float(kr[:, i].sum() / max((kt + kr)[:, i].sum(), 1e-300))
        within += inside
        gains.append(max(float(gain), 0.0))
        rotational.append(share)
        tracks[label, name] = (p[:, i, 0], p[:, i, 2], t, kt[:, i], kr[:, i])
        print(f"{label:9s}{name:13s} heights {np.round(h, 3)}: {inside} of {len(stations)} within the lumped-mass paths; largest kinetic energy {np.max((kt + kr)[:, i]):.4g} J; "
              f"rotational share {share:.3f}; energy gained {max(gain, 0):.3g} of the potential energy at the start; ended t = {t[-1]:.3f} s")
    figures[label] = {"heights_within": within, "heights": len(names) * len(stations), "largest_energy_gain": max(gains), "rotational_share": max(rotational),
                      "end_time": float(t[-1])}


def restitution(omega):
    """Rebound of one mass on one spring by the scheme of the paper's Eqs. (6) to (8), averaged over where in a step it lands.

    In units of dt: contact spring omega^2 per unit mass; a step ends with the spring if it closes, open-close iterated.
    """
    out = []
    for phase in np.linspace(0.005, 0.995, 100):
        gap, v = phase, -1.0                            # gap in v dt
        for _ in range(100000):
            d = v                                       # free step
            if gap + d < 0:
                d = (2 * v - omega**2 * gap) / (2 + omega**2)   # d'' = 2 (d - v), d'' + omega^2 (gap + d) = 0
            v = 2 * d - v
            gap += d
            if gap > 0 and v > 0:
                break
        out.append(v)
    return np.mean(out), np.min(out), np.max(out)


for omega in (0.032, 0.3, 1.0, 14.9):
    mean, least, largest = restitution(omega)
    figures[f"restitution_{omega:g}".replace(".", "_")] = {"mean": float(mean), "least": float(least), "largest": float(largest)}
    print("restitution of the 1988 scheme at Omega = %g: mean %.3f, from %.3f to %.3f" % (omega, mean, least, largest))
if "-o" in options:
    with open(options["-o"], "w") as f:
        json.dump(figures, f, indent=1)
if figure:
    import matplotlib
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    fig, ax = plt.subplots(figsize=(9, 5))
    if energy:
        for (label, name), (_, _, t, kt, kr) in tracks.items():
            style = "-" if label == "physical" else ":"
            for v, what in ((kt + kr, "total"), (kt, "translational"), (kr, "rotational")):
                ax.plot(t, v, style, label=f"{label}, {what}")
        ax.set_xlabel("t [s]"), ax.set_ylabel("kinetic energy [J]")
    else:
        for p in lumped:
            ax.plot(p[:, 1], p[:, 2], color="0.8", lw=0.6)
        ax.plot(*(scale * np.array(PROFILE)).T, "k")
        for (label, name), (x, z, *_) in tracks.items():
            if label == "physical":
                ax.plot(x, z, label=name)
        ax.set_xlim(-0.2 * scale, 4 * scale), ax.set_ylim(-0.1 * scale, 1.8 * scale)
        ax.set_xlabel("x [m]"), ax.set_ylabel("z [m]")
    ax.legend(fontsize=7)
    fig.savefig(figure, dpi=120)
