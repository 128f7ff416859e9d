#!/usr/bin/env python3
"""Measured, published and computed run-out of profile P2: evaluate.py DATA DIR (output of talus ensemble)."""
import csv
import pathlib
import sys

import h5py
import numpy as np

data, directory = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
places = np.loadtxt(data / "positions_P2.xyz")
centre = places.mean(axis=0)
measured = np.loadtxt(data / "Endpoints_P2.txt")[:, :3] - centre
with open(data / "rockable-P2.csv") as f:
    published = np.array([[float(r["x_end_m"]), float(r["y_end_m"]), float(r["z_end_m"])] for r in csv.DictReader(f)]) - centre
with h5py.File(directory / "ensemble.h5") as f:
    status = np.array([s.decode() if isinstance(s, bytes) else s for s in f["/members/status"][()]])
    end = f["/members/end_position"][()][:, 0, :]
computed = np.column_stack([end[:, 0], end[:, 2], -end[:, 1]]) - centre
computed = computed[np.isin(status, ["done", "at rest", "suspect"])]
print(", ".join(f"{(status == s).sum()} {s}" for s in sorted(set(status))))
print(f"{'':14}{'measured':>10}{'Rockable':>10}{'computed':>10}")


def row(name, of):
    print(f"{name:14}" + "".join(f"{of(x):10.1f}" for x in (measured, published, computed)))


runout = lambda x: np.hypot(x[:, 0], x[:, 2])
row("mean", lambda x: runout(x).mean())
row("sd", lambda x: runout(x).std(ddof=1))
for p in (5, 50, 95):
    row(f"p{p}", lambda x: np.percentile(runout(x), p))
row("across, mean", lambda x: x[:, 2].mean())
row("across, sd", lambda x: x[:, 2].std(ddof=1))
