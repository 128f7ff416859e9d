#!/usr/bin/env python3
"""Measured against computed run-out of the Tschamut runs: evaluate.py DIR (output of talus ensemble)."""
import csv
import pathlib
import sys

import h5py
import numpy as np

HERE = pathlib.Path(__file__).parent
directory = pathlib.Path(sys.argv[1])
measured = np.array([float(r["observed_runout_m"]) for r in csv.DictReader(open(HERE / "observed_deposition.csv"))])
with h5py.File(directory / "ensemble.h5") as f:
    status = np.array([s.decode() if isinstance(s, bytes) else s for s in f["/members/status"][()]])
    runout = f["/members/runout"][()][:, 0]
good = np.isin(status, ["done", "at rest", "left", "suspect"])
computed = runout[good]
print(f"{good.sum()} of {len(status)} members came to an end: " + ", ".join(f"{(status == s).sum()} {s}" for s in sorted(set(status))))
print(f"{'':8}{'measured':>10}{'computed':>10}")
for name, of in (("mean", np.mean), ("sd", lambda x: np.std(x, ddof=1)), ("p5", lambda x: np.percentile(x, 5)), ("p50", np.median), ("p95", lambda x: np.percentile(x, 95))):
    print(f"{name:8}{of(measured):10.1f}{of(computed):10.1f}")
