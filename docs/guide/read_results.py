#!/usr/bin/env python3
"""Reads results.h5 with h5py and plots what happened: python3 docs/guide/read_results.py DIR [PICTURE.png]

Needs Debian's python3-h5py, python3-numpy, python3-matplotlib. Every dataset carries the attributes `unit` and `description`;
their names and shapes are listed in docs/output.md.
"""
import json
import pathlib
import sys

import h5py
import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

directory = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else "results/tirol-pier")
picture = sys.argv[2] if len(sys.argv) > 2 else str(directory / "results.png")
summary = json.loads((directory / "summary.json").read_text())
print(*summary["headline"], sep="\n")


def rotation(q):
    """Matrices from unit quaternions (w, x, y, z), body to world: [..., 4] -> [..., 3, 3]."""
    w, x, y, z = np.moveaxis(q, -1, 0)
    rows = [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y),
            2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
            2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]
    return np.stack(rows, -1).reshape(q.shape[:-1] + (3, 3))


def world_vertices(f, block, row):
    """Vertices of a block at a row of the histories (strain left out): [n, 3]."""
    offset = f["geometry/blocks/vertex_offset"]
    body = f["geometry/blocks/vertices"][offset[block]:offset[block + 1]]
    position = f["history/blocks/position"][row, block]
    return position + body @ rotation(f["history/blocks/orientation"][row, block]).T


with h5py.File(directory / "results.h5") as f:
    time = f["history/time"][:]
    names = [n.decode() for n in f["history/blocks/name"][:]]
    position, velocity = f["history/blocks/position"][:], f["history/blocks/velocity"][:]
    structures = sorted(f["history/structures"]) if "history/structures" in f else []
    fig, axes = plt.subplots(2, 2, figsize=(12, 8), constrained_layout=True)

    for b in range(min(len(names), 12)):
        travelled = np.concatenate([[0], np.cumsum(np.hypot(*np.diff(position[:, b, :2], axis=0).T))])
        axes[0, 0].plot(travelled, position[:, b, 2], label=names[b])
        axes[0, 1].plot(time, np.linalg.norm(velocity[:, b], axis=1), label=names[b])
    axes[0, 0].set(xlabel="distance travelled in plan [m]", ylabel="height of the centroid [m]")
    axes[0, 1].set(xlabel="time [s]", ylabel="speed [m/s]")
    if names:
        axes[0, 0].legend()
        print("lowest corner of", names[0], "at the end: z =", world_vertices(f, 0, len(time) - 1)[:, 2].min(), "m")

    for entry in ("kinetic", "strain", "friction_work", "damping_work", "damage_work", "residual"):
        axes[1, 0].plot(time, f["ledger"][entry][:] / 1e3, label=entry)
    axes[1, 0].set(xlabel="time [s]", ylabel="energy [kJ]")
    axes[1, 0].legend()

    contacts = f["history/contacts/structure"]
    if len(contacts["time"]):
        # Rows of one coupled step share their time: their forces add up to the force on the structure.
        t, step = np.unique(contacts["time"][:], return_inverse=True)
        force = np.stack([np.bincount(step, contacts["force"][:, k]) for k in range(3)], -1)
        axes[1, 1].plot(t, np.linalg.norm(force, axis=1) / 1e3, ".-")
        axes[1, 1].set(xlabel="time [s]", ylabel="contact force, mean per step [kN]")
        print("impulse on structures [N s]:", (contacts["force"][:] * contacts["dt"][:][:, None]).sum(axis=0))
    elif structures:
        axes[1, 1].plot(time, f[f"history/structures/{structures[0]}/base_force"][:] / 1e3)
        axes[1, 1].set(xlabel="time [s]", ylabel="base force [kN]")
    else:
        axes[1, 1].plot(position[:, :12, 0], position[:, :12, 1])
        axes[1, 1].set(xlabel="x [m]", ylabel="y [m]", aspect="equal")

fig.suptitle(summary["title"])
fig.savefig(picture, dpi=130)
print("written:", picture)
