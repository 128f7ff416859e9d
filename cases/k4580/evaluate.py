#!/usr/bin/env python3
"""Evaluates the K4580 runs: deviations, times, contacts, movement range, deposits, and the paper's orderings.

usage: evaluate.py boulder|rock-mass DIR... [-o FILE.json]     (output directories, ...-before, ...-shallow, ...-deep)

  d   |x(end) - x(0)| of the followed block
  t   first time its centroid is less than 5 m above the road
  ts  last time it moves faster than 0.05 m/s between two history rows
  W, S, D contacts: episodes, at least 0.25 s apart, in which its velocity changes by more than 1 m/s beyond gravity's part
  r   width in x that holds the middle 90 % of the volume that has left the source area; also its standard deviation
"""
import json
import sys

import h5py
import numpy as np

KINDS = ("before", "shallow", "deep")
G = 9.8


def read(directory):
    with h5py.File(f"{directory}/results.h5") as f:
        h = f["history"]
        names = [n.decode() for n in h["blocks/name"][:]]
        data = {k: h["blocks"][k][:] for k in ("position", "velocity", "mass", "kinetic_translational", "kinetic_rotational")}
        data["time"] = h["time"][:]
        data["residual"] = float(f["ledger/residual"][-1])
        data["kinetic"] = f["ledger/kinetic"][:]
        data["potential"] = f["ledger/potential"][:]
    data["names"] = names
    with open(f"{directory}/summary.json") as f:
        data["summary"] = json.load(f)
    return data


def follow(data, i):
    left = next((b.get("left") for b in data["summary"]["blocks"] if b["name"] == data["names"][i]), None)
    rows = data["time"] <= (np.inf if left is None else left)   # beyond the edge of the terrain it falls for ever, which says nothing
    t, p, v = data["time"][rows], data["position"][rows, i], data["velocity"][rows, i]
    low = np.nonzero(p[:, 2] < 5.0)[0]
    speed = np.linalg.norm(np.diff(p, axis=0), axis=1) / np.diff(t)
    moving = np.nonzero(speed > 0.05)[0]
    kick = np.diff(v, axis=0) + np.outer(np.diff(t), [0, 0, G])
    hits, last = [], -1.0
    for k in np.nonzero(np.linalg.norm(kick, axis=1) > 1.0)[0]:
        if t[k + 1] - last > 0.25:
            hits.append([round(float(c), 2) for c in (t[k + 1], *p[k + 1])])
        last = t[k + 1]
    energy = data["kinetic_translational"][rows, i] + data["kinetic_rotational"][rows, i]
    return {"end": [round(float(c), 3) for c in p[-1]], "d": float(abs(p[-1, 0] - p[0, 0])), "d_largest": float(np.max(np.abs(p[:, 0] - p[0, 0]))),
            "t": float(t[low[0]]) if len(low) else None, "ts": float(t[moving[-1] + 1]) if len(moving) else 0.0, "still_moving": bool(len(moving) and moving[-1] >= len(speed) - 2),
            "contacts": len(hits), "hits_t_x_y_z": hits, "largest_kinetic_energy_MJ": float(energy.max() / 1e6)}


def place(p):
    x, y, z = p
    if y < 4:
        return "source"
    if y < 94:
        return "slope"
    if 108.5 < y < 117.5:
        return "deck" if z > 8 else "under the viaduct"
    if y < 108.5:
        return "road"
    return "bank" if y < 126 else "river"


def mass_range(data, moving):
    volume = data["mass"][moving] / 2500.0
    end = data["position"][-1, moving]
    gone = end[:, 1] > 4
    out = {"blocks": int(len(moving)), "rock_volume_m3": float(volume.sum()), "left_the_source": int(gone.sum()), "stayed": int((~gone).sum()), "deposits_m3": {}}
    for p, v in zip(end, volume):
        out["deposits_m3"][place(p)] = round(out["deposits_m3"].get(place(p), 0.0) + float(v), 1)
    if gone.any():
        x, w = end[gone, 0], volume[gone]
        order = np.argsort(x)
        c = (np.cumsum(w[order]) - 0.5 * w[order]) / w.sum()
        out["r"] = float(np.interp(0.95, c, x[order]) - np.interp(0.05, c, x[order]))
        mean = (x * w).sum() / w.sum()
        out["r_standard_deviation"] = float(np.sqrt((w * (x - mean) ** 2).sum() / w.sum()))
        out["reach_y"] = float(end[:, 1].max())
    return out


def ordering(values):
    if any(v is None for v in values):
        return "cannot be said: a value is missing"
    return "comes out" if values[0] > values[1] > values[2] else "does not come out"


def main():
    what, directories = sys.argv[1], [a for a in sys.argv[2:] if a != "-o" and not a.endswith(".json")]
    result = {}
    for directory in directories:
        kind = directory.rstrip("/").split("-")[-1]
        data = read(directory)
        names = data["names"]
        if what == "boulder":
            i = names.index("boulder")
        else:
            moving = np.array([k for k, n in enumerate(names) if n.startswith("R")])
            start = data["position"][0]
            # Block #1: the front block nearest the middle, upper layer.
            front = [k for k in moving if start[k, 1] > start[moving, 1].max() - 3.5]
            i = max(front, key=lambda k: start[k, 2] - 2 * abs(start[k, 0]))
        row = follow(data, i)
        row["block"] = names[i]
        if what != "boulder":
            row.update(mass_range(data, moving))
        row["end_time"] = float(data["time"][-1])
        row["status"] = data["summary"].get("status")
        start = data["potential"][0] - data["potential"].min()
        row["energy_residual_over_energy_released"] = float(data["residual"] / start) if start > 0 else None
        result[kind] = row
        print(kind, json.dumps({k: v for k, v in row.items() if k != "hits_t_x_y_z"}))
        for h in row["hits_t_x_y_z"]:
            print("   contact at t = %.2f s, centroid (%.2f, %.2f, %.2f)" % tuple(h))
    for key in ("d", "t", "ts") + (("r", "r_standard_deviation") if what != "boulder" else ()):
        values = [result.get(k, {}).get(key) for k in KINDS]
        print(f"{key}: {values}: before > shallow > deep {ordering(values)}")
        result[key + "_ordering"] = ordering(values)
    if "-o" in sys.argv:
        with open(sys.argv[sys.argv.index("-o") + 1], "w") as f:
            json.dump(result, f, indent=1)


if __name__ == "__main__":
    main()
