#!/usr/bin/env python3
"""The first strike on the pier: when, how fast, what force, and how well the books are kept.

usage: evaluate.py DIR [-o FIGURES.json]
"""
import json
import sys

import h5py
import numpy as np


def main():
    directory = sys.argv[1]
    with h5py.File(f"{directory}/results.h5") as f:
        t, v = f["history/time"][:], f["history/blocks/velocity"][:, 0]
        hits = f["history/contacts/structure"]
        when, dt, force = hits["time"][:], hits["dt"][:], hits["force"][:]
        kinetic, residual, top = f["ledger/kinetic"][:], f["ledger/residual"][:], f["history/structures/P1/probe_displacement"][:, 0]
    figures = {"end_time": float(t[-1]), "largest_speed": float(np.linalg.norm(v, axis=1).max()), "strikes": bool(len(when)),
               "residual_over_largest_kinetic": float(np.abs(residual).max() / kinetic.max())}
    if len(when):
        row = np.searchsorted(t, when[0]) - 1
        figures |= {"strike_time": float(when[0]), "strike_speed": float(np.linalg.norm(v[row])), "impulse_MNs": float(np.linalg.norm((force * dt[:, None]).sum(axis=0)) / 1e6),
                    "largest_top_displacement_mm": 1000 * float(np.linalg.norm(top - top[0], axis=1).max())}
    print(json.dumps(figures))
    if "-o" in sys.argv:
        with open(sys.argv[sys.argv.index("-o") + 1], "w") as f:
            json.dump(figures, f, indent=1)


if __name__ == "__main__":
    main()
