#!/usr/bin/env python3
"""Figures of the run: forces against resistance, cracks by place, drift, ring-down, energy.

usage: evaluate.py DIR -o FIGURES.json

Crack widths are the widest that each cell ever was: permanent load closes many again. Needs h5py and numpy."""
import argparse
import json

import h5py
import numpy as np

HALF = 0.75          # of the pier's section [m]
HEIGHT = 9.0         # of the pier [m]
FORCE = (1.8, 2.7)   # the struck patch [m]
ENDS = 0.14          # the force is over [s]


def last(f, frames, name, what):
    """What did not change since an earlier frame is written there alone."""
    return next(f[p][:] for p in (f"/fields/{k}/structures/{name}/{what}" for k in reversed(frames)) if p in f)


def widest(f, frames, name, hexes):
    """Largest crack width of each cell of `hexes` over all frames [m]; cells that have gone keep what they had."""
    place = {tuple(h): i for i, h in enumerate(hexes)}
    width, now = np.zeros(len(hexes)), np.arange(len(hexes))
    for k in frames:
        cells, crack = (f"/fields/{k}/structures/{name}/{what}" for what in ("hexes", "crack_width"))
        if cells in f:
            now = np.array([place[tuple(h)] for h in f[cells][:]])
        if crack in f:
            width[now] = np.maximum(width[now], f[crack][:])
    return width


def figures(directory):
    f = h5py.File(f"{directory}/results.h5")
    name = f["/geometry/structures/name"][0].decode()
    frames = sorted(k for k in f["fields"] if k != "time")
    nodes, hexes = last(f, frames[:1], name, "nodes"), last(f, frames[:1], name, "hexes")
    width = 1e3 * widest(f, frames, name, hexes)
    centre = nodes[hexes].mean(axis=1)
    x, y, z = centre.T
    pier = (abs(x) < HALF) & (abs(y) < HALF) & (z < HEIGHT)
    struck, far, core = pier & (y < -HALF / 2), pier & (y > HALF / 2), pier & (abs(y) < 0.4 * HALF)
    deck = z > HEIGHT + 1.2
    other = (abs(x - 16) < HALF) & (abs(y) < HALF) & (z < HEIGHT)
    most = lambda where: float(width[where].max()) if where.any() else 0.0
    t = f["/history/time"][:]
    members = f[f"/history/structures/{name}/members"]
    k = [n.decode() for n in members["name"][:]].index("P2")
    shear = members["shear"][:, k, :, 1]
    drift = 1e3 * members["drift"][:, k, 1]
    ledger = f["/ledger"]
    after = t > ENDS
    crossings = np.count_nonzero(np.diff(np.sign(drift[after] - drift[after].mean())))
    return {
        "end": float(t[-1]),
        "shear_foot_over_design": float(abs(shear[:, 0]).max() / members["shear_resistance"][k, 0, 1]),
        "shear_foot_mn": float(abs(shear[:, 0]).max() / 1e6),
        "crack_mm": {
            "foot_struck_face": most(struck & (z < 0.9)),
            "foot_far_face": most(far & (z < 0.6)),
            "far_face_at_force": most(far & (z > FORCE[0]) & (z < FORCE[1] + 0.6)),
            "core_between": most(core & (z > 0.3) & (z < FORCE[1])),
            "upper_half": most(pier & (z > HEIGHT / 2)),
            "other_pier": most(other),
            "deck": most(deck),
        },
        "cracked_share_of_deck": float((width[deck] > 0.2).mean()),
        "cracked_share_of_pier": float((width[pier] > 0.2).mean()),
        "bars_yielded": int(members["bars_yielded"][-1, k]),
        "lost_volume": float(members["lost_volume"][-1, k]),
        "drift_mm": float(abs(drift - drift[0]).max()),
        "drift_residual_mm": float(np.mean(drift[t > t[-1] - 0.3] - drift[0])) if t[-1] > 1 else 0.0,
        "ring_down_hz": float(crossings / 2 / (t[-1] - ENDS)) if t[-1] > 1 else 0.0,
        "kinetic_end_over_largest": float(ledger["kinetic"][-1] / ledger["kinetic"][:].max()),
        "residual_over_external_work": float(abs(ledger["residual"][:]).max() / abs(ledger["external_work"][-1])),
    }


def main():
    parse = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parse.add_argument("directory")
    parse.add_argument("-o", required=True)
    options = parse.parse_args()
    with open(options.o, "w", encoding="utf-8") as out:
        json.dump(figures(options.directory), out, indent=1)


if __name__ == "__main__":
    main()
