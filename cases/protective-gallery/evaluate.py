#!/usr/bin/env python3
"""Bare slab and slab under a cushion, side by side: force, impulse, what the supports feel, energy, span moment, punching.

usage: evaluate.py BARE_DIR CUSHION_DIR [-o FIGURES.json]
"""
import json
import sys

import h5py
import numpy as np


def figures(directory):
    with open(f"{directory}/summary.json") as f:
        summary = json.load(f)
    with h5py.File(f"{directory}/results.h5") as f:
        time, velocity = f["history/time"][:], f["history/blocks/velocity"][:, 0]
        hits = f["history/contacts/structure"]
        when, dt, force = hits["time"][:], hits["dt"][:], hits["force"][:]
        base, probe = f["history/structures/slab/base_force"][:], f["history/structures/slab/probe_displacement"][:, 0]
        member = f["history/structures/slab/members"]
        moment = member["moment"][:, 0]
        ledger = {k: f["ledger"][k][:] for k in ("kinetic", "damping_work", "damage_work", "friction_work", "residual")}
        fragments = [b["fragment"] for b in summary["blocks"]]
    steps, which = np.unique(when, return_inverse=True)
    total = np.zeros((len(steps), 3))
    np.add.at(total, which, force)
    # A hard contact has no peak of its own (it grows as the cells shrink): the largest mean over a millisecond.
    window = 1e-3
    grid = np.arange(0.0, time[-1] + window, window / 20)
    given = np.interp(grid, np.append(0.0, steps), np.append(0.0, np.cumsum(np.bincount(which, weights=-force[:, 2] * dt))))
    means = (given[20:] - given[:-20]) / window
    mass = summary["blocks"][0]["mass"]
    start = 0.5 * mass * float(velocity[0] @ velocity[0])
    punching = [f for f in summary.get("formulas", []) if f["id"] == "en1992-punching"]
    return {
        "peak_force_MN": float(-total[:, 2].min() / 1e6),
        "peak_force_over_1ms_MN": float(means.max() / 1e6),
        "impulse_kNs": float(-(force[:, 2] * dt).sum() / 1e3),
        "contact_time_ms": float(1e3 * (steps[-1] - steps[0])),
        "peak_support_force_MN": float(np.abs(base[:, 2] - base[0, 2]).max() / 1e6),
        "peak_span_moment_MNm": float(np.abs(moment - moment[0]).max() / 1e6),
        "punching_resistance_MN": float(punching[0]["value"] / 1e6) if punching else None,
        "force_over_punching_resistance": float(means.max() / punching[0]["value"]) if punching else None,
        "largest_deflection_mm": float(1e3 * np.abs(probe[:, 2] - probe[0, 2]).max()),
        "deflection_at_end_mm": float(1e3 * abs(probe[-1, 2] - probe[0, 2])),
        "energy_kJ": start / 1e3,
        "crushed_and_damped_share": float(ledger["damping_work"][-1] / start),
        "damage_and_plastic_share": float(ledger["damage_work"][-1] / start),
        "damaged_volume_m3": summary["structures"][0]["damaged_volume"],
        "pieces": sum(fragments),
        "residual_over_largest_kinetic": float(np.abs(ledger["residual"]).max() / ledger["kinetic"].max()),
    }


def main():
    bare, cushion = figures(sys.argv[1]), figures(sys.argv[2])
    print(f"{'':32}{'bare':>12}{'cushion':>12}")
    for key in bare:
        row = [f"{x:12.4g}" if isinstance(x, (int, float)) else f"{'-':>12}" for x in (bare[key], cushion[key])]
        print(f"{key:32}{row[0]}{row[1]}")
    out = {"bare": bare, "cushion": cushion,
           "force_ratio": cushion["peak_force_over_1ms_MN"] / bare["peak_force_over_1ms_MN"],
           "moment_ratio": cushion["peak_span_moment_MNm"] / bare["peak_span_moment_MNm"]}
    if "-o" in sys.argv:
        with open(sys.argv[sys.argv.index("-o") + 1], "w") as f:
            json.dump(out, f, indent=1)


if __name__ == "__main__":
    main()
