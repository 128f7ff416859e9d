#!/usr/bin/env python3
"""What the viaduct suffered: strikes, speeds before and after, damage, base forces, the class of each pier, where blocks and decks end.

usage: evaluate_damage.py DIR... [-o FIGURES.json]         (figures by the name of the directory's last part, after the last dash)
"""
import json
import sys

import h5py
import numpy as np

from evaluate import place


def evaluate(directory):
    with h5py.File(f"{directory}/results.h5") as f:
        t, b = f["history/time"][:], f["history/blocks"]
        names = [n.decode() for n in b["name"][:]]
        p, v, m = b["position"][:], b["velocity"][:], b["mass"][:]
        s = f["history/structures/viaduct"]
        damage, volume = s["damage_max"][:], s["damaged_volume"][:]
        hits = f["history/contacts/structure"]
        when, dt, force, block = hits["time"][:], hits["dt"][:], hits["force"][:], hits["block"][:]
        residual, potential, work = f["ledger/residual"][:], f["ledger/potential"][:], f["ledger/damage_work"][:]
    rocks = [i for i, n in enumerate(names) if n == "boulder" or n.startswith("R")]
    out = {"end_time": float(t[-1]), "damage_max": float(damage.max()), "damaged_volume_m3": float(volume.max()), "fragments": len(names) - len(rocks),
           "damage_work_MJ": float(work[-1] / 1e6),
           "residual_over_energy_released": float(abs(residual[-1]) / max(potential[0] - potential.min(), 1e-300)), "blocks_that_struck": int(len(set(block.tolist()) & set(rocks)))}
    if len(when):
        i = int(block[0])
        before = np.searchsorted(t, when[0]) - 1
        after = min(len(t) - 1, np.searchsorted(t, when[0] + 0.1))
        window = (when >= when[0]) & (when <= when[0] + 0.1) & (block == i)
        out |= {"strike_time": float(when[0]), "strike_block": names[i], "strike_speed": float(np.linalg.norm(v[before, i])),
                "speed_0_1_s_later": float(np.linalg.norm(v[after, i])), "impulse_0_1_s_MNs": float(np.linalg.norm((force[window] * dt[window, None]).sum(axis=0)) / 1e6)}
    deposits = {}
    for i in rocks:
        if np.isfinite(p[-1, i]).all():
            deposits[place(p[-1, i])] = round(deposits.get(place(p[-1, i]), 0.0) + float(m[i]) / 2500, 1)
    out["rock_at_the_end_m3"] = deposits
    out["pieces"] = pieces(names, m, p[-1], v[-1], [i for i in range(len(names)) if i not in rocks])
    with open(f"{directory}/summary.json") as f:
        summary = json.load(f)
    out["status"] = summary["status"]
    viaduct = next(s for s in summary["structures"] if s["name"] == "viaduct")
    out["largest_base_force_change_MN"] = viaduct["peak_base_force"] / 1e6   # of means over 1.5 ms
    piers = viaduct["members"]
    out["piers"] = {q["name"]: {"class": q["damage_class_name"], "crack_width_mm": round(1e3 * q["crack_width_end"], 2), "lost_volume_m3": round(q["lost_volume"], 2),
                                "drift_mm": None if q["residual_drift"] is None else round(1e3 * float(np.hypot(*q["residual_drift"])), 1), "peak_shear_MN": round(q["peak_shear"]["value"] / 1e6, 2),
                                "bars_yielded": q["bars_yielded"], "bars_broken": q["bars_broken"]} for q in piers}
    return out


def pieces(names, m, p, v, which):
    """Where what came off lies: the large ones one by one, and mass and number of all by place."""
    large = {names[i]: {"mass_t": round(float(m[i]) / 1e3, 1), "centroid": [round(float(c), 2) for c in p[i]], "speed": round(float(np.linalg.norm(v[i])), 4)}
             for i in which if m[i] > 1e5 and np.isfinite(p[i]).all()}
    places = {}
    for i in which:
        if np.isfinite(p[i]).all():
            count, mass = places.get(place(p[i]), (0, 0.0))
            places[place(p[i])] = (count + 1, round(mass + float(m[i]) / 1e3, 1))
    moving = max((float(np.linalg.norm(v[i])) for i in which if np.isfinite(v[i]).all()), default=0.0)
    return {"above_100_t": large, "number_and_mass_t": places, "fastest": moving}


def main():
    figures = {}
    words = [a for a in sys.argv[1:] if a != "-o"]
    target = sys.argv[sys.argv.index("-o") + 1] if "-o" in sys.argv else None
    for directory in (w for w in words if w != target):
        kind = directory.rstrip("/").split("-")[-1]
        figures[kind] = evaluate(directory)
        print(kind, json.dumps(figures[kind]))
    if target:
        with open(target, "w") as f:
            json.dump(figures, f, indent=1)


if __name__ == "__main__":
    main()
