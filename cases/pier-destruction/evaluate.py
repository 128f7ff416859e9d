#!/usr/bin/env python3
"""A boulder breaks a pier: what came off, and whether mass, momentum and energy close to the end.

usage: evaluate.py DIR [-o FIGURES.json]
"""
import json
import sys

import h5py
import numpy as np


def figures(directory):
    with open(f"{directory}/summary.json") as f:
        summary = json.load(f)
    with h5py.File(f"{directory}/results.h5") as f:
        ledger = {k: f["ledger"][k][:] for k in f["ledger"] if f["ledger"][k].ndim == 1}
        speed = np.linalg.norm(f["history/blocks/velocity"][:], axis=2)
        mass, time = f["history/blocks/mass"][:], f["history/time"][:]
        damaged = f["history/structures/pier/damaged_volume"][:]
    blocks = summary["blocks"]
    pieces = np.array([b["fragment"] for b in blocks])
    start = ledger["kinetic"][0]
    audit = summary["audit"]
    first = np.argmax(damaged > 0)
    return {
        "status": summary["status"],
        "end": float(time[-1]),
        "first_damage_s": float(time[first]) if damaged[first] > 0 else None,
        "pieces": int(pieces.sum()),
        "mass_of_pieces_t": float(mass[pieces].sum() / 1e3),
        "largest_piece_t": float(mass[pieces].max() / 1e3) if pieces.any() else 0.0,
        "damaged_volume_m3": float(damaged[-1]),
        "boulder_speed_at_end": float(speed[-1, 0]),
        "fastest_piece_at_end": float(np.nanmax(speed[-1][pieces])) if pieces.any() else 0.0,
        "share_of_pieces_at_rest": float(mass[pieces][speed[-1][pieces] < 0.05].sum() / mass[pieces].sum()) if pieces.any() else None,
        "share_damage": float(ledger["damage_work"][-1] / start),
        "share_impacts_and_damping": float(ledger["damping_work"][-1] / start),
        "share_friction": float(ledger["friction_work"][-1] / start),
        "share_algorithmic": float(ledger["algorithmic"][-1] / start),
        "residual_over_impact": float(np.abs(ledger["residual"]).max() / start),
        "force_balance": audit["force_imbalance"],
        "moment_balance": audit["moment_imbalance"],
    }


def main():
    out = figures(sys.argv[1])
    for key, value in out.items():
        print(f"{key:28}{value:12.5g}" if isinstance(value, (int, float)) else f"{key:28}{value!s:>12}")
    if "-o" in sys.argv:
        with open(sys.argv[sys.argv.index("-o") + 1], "w") as f:
            json.dump(out, f, indent=1)


if __name__ == "__main__":
    main()
