#!/usr/bin/env python3
"""Draws the four faces of pier P2 with the widest that each crack was (permanent load closes many again), and its histories.

    plot.py DIR [OUT.png]

Needs h5py, numpy, matplotlib."""
import sys

import h5py
import matplotlib

matplotlib.use("Agg")
matplotlib.rcParams["svg.hashsalt"] = "talus"
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.collections import PolyCollection

from evaluate import widest

FACES = [(0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (2, 3, 7, 6), (0, 4, 7, 3), (1, 2, 6, 5)]


def skin(hexes):
    """Faces that belong to one cell: (cell, four nodes)."""
    count = {}
    for cell, h in enumerate(hexes):
        for f in FACES:
            key = tuple(sorted(h[list(f)]))
            count.setdefault(key, []).append((cell, h[list(f)]))
    return [v[0] for v in count.values() if len(v) == 1]


def main(directory, out):
    f = h5py.File(f"{directory}/results.h5")
    name = f["/geometry/structures/name"][0].decode()
    frames = sorted(k for k in f["fields"] if k != "time")
    first = f[f"/fields/{frames[0]}/structures/{name}"]
    nodes, hexes = first["nodes"][:], first["hexes"][:]
    width = 1e3 * widest(f, frames, name, hexes)
    members = f[f"/history/structures/{name}/members"]
    names = [n.decode() for n in members["name"][:]]
    k = names.index("P2")
    base, ex, ey = members["frame"][k]
    length = members["station"][k][-1]
    half = 0.75
    centre = nodes[hexes].mean(axis=1) - base
    inside = (abs(centre @ ex) < half) & (abs(centre @ ey) < half) & (centre[:, 2] < length + 1.2) & (centre[:, 2] > 0)
    cells = np.where(inside)[0]
    quads = skin(hexes[cells])
    fig, axes = plt.subplots(1, 6, figsize=(19, 9), gridspec_kw={"width_ratios": [1, 1, 1, 1, 1.6, 1.6]})
    views = [("struck face (-y)", ey, -1, ex, 1), ("far face (+y)", ey, 1, ex, -1), ("side (+x)", ex, 1, ey, 1), ("side (-x)", ex, -1, ey, -1)]
    for ax, (title, normal, sign, across, turn) in zip(axes, views):
        polygons, colour = [], []
        for cell, quad in quads:
            x = nodes[quad] - base
            if np.all(abs(x @ normal - sign * half) < 1e-6):
                polygons.append(np.column_stack([turn * (x @ across), x[:, 2]]))
                colour.append(width[cells[cell]])
        c = PolyCollection(polygons, array=np.array(colour), cmap="magma_r", edgecolors="0.8", linewidths=0.3)
        c.set_clim(0, 1.0)
        ax.add_collection(c)
        ax.set_xlim(-1, 1), ax.set_ylim(-0.1, length + 1.3), ax.set_aspect("equal"), ax.set_title(title, fontsize=9)
    fig.colorbar(c, ax=axes[:4], shrink=0.5, label="crack width [mm]", location="left")
    t = f["/history/time"][:]
    v = members["shear"][:, k, :, 1] / 1e3
    at = members["station"][k]
    for s in (0, 2, 4, 8):
        axes[4].plot(t, v[:, s], lw=0.8, label=f"{at[s]:.1f} m")
    axes[4].axhline(members["shear_resistance"][k, 0, 1] / 1e3, color="k", ls="--", lw=0.8)
    axes[4].axhline(-members["shear_resistance"][k, 0, 1] / 1e3, color="k", ls="--", lw=0.8, label="V_Rd")
    axes[4].set_xlim(0.09, 0.4), axes[4].set_title("P2: shear across [kN]"), axes[4].legend(fontsize=7)
    d = 1e3 * members["drift"][:]
    for i, n in enumerate(names):
        axes[5].plot(t, d[:, i, 1] - d[0, i, 1], lw=0.8, label=n)
    axes[5].set_title("drift across [mm]"), axes[5].legend(fontsize=7)
    fig.savefig(out, dpi=80, bbox_inches="tight", metadata={"Date": None} if out.endswith(".svg") else None)
    print(out)


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2] if len(sys.argv) > 2 else "cracks.png")
