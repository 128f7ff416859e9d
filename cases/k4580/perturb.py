#!/usr/bin/env python3
"""Perturbed releases of the boulder: shifted up the source plane and across by up to 0.2 m, with a push of up to 0.02 m/s across.

usage: perturb.py TALUS NUMBER DIR [SECONDS]     (writes DIR/<slope>-<n>, prints d, t and ts of each and the spread, which DIR/spread.json keeps)

A run that is there already is not run again, so that a series can be cut short and gone on with. One that takes more than LIMIT seconds of CPU is stopped and
told: it counts as still moving at the time that it has reached.
"""
import json
import math
import os
import random
import re
import signal
import subprocess
import sys
import time

import numpy as np

sys.path.insert(0, __file__.rsplit("/", 1)[0] if "/" in __file__ else ".")
from evaluate import KINDS, follow, read            # noqa: E402
from make_k4580 import HERE, J1, normal             # noqa: E402

LIMIT = 40   # s of CPU for one release; most take 2 to 4


def run_limited(command):
    """Runs it; False if it was stopped at the limit, its results written."""
    process, stopped = subprocess.Popen(command, stdout=subprocess.DEVNULL), False
    while process.poll() is None:
        time.sleep(0.1)
        try:
            with open(f"/proc/{process.pid}/stat") as f:
                used = sum(int(ticks) for ticks in f.read().rsplit(")", 1)[1].split()[11:13]) / os.sysconf("SC_CLK_TCK")
        except FileNotFoundError:
            continue
        if used > LIMIT and not stopped:
            process.send_signal(signal.SIGINT)
            stopped = True
    if process.returncode != 0 and not stopped:
        raise subprocess.CalledProcessError(process.returncode, command)
    return not stopped


def main():
    talus, number, where = sys.argv[1], int(sys.argv[2]), sys.argv[3]
    seconds = sys.argv[4] if len(sys.argv) > 4 else "38"
    n = normal(J1)
    table, stopped = {k: [] for k in KINDS}, []
    for i in range(number):
        rng = random.Random(i + 1)                  # the same releases on every slope
        up, across, push = rng.uniform(0, 0.2), rng.uniform(-0.2, 0.2), rng.uniform(-0.02, 0.02)
        for kind in KINDS:
            scene = f"{HERE}/../k4580-boulder/{kind}.toml"
            text = open(scene).read()
            p = [float(c) for c in re.search(r'vertices.*\nposition = \[(.*)\]', text).group(1).split(",")]
            x, y = p[0] + across, p[1] - up
            z = p[2] - (n[0] * across - n[1] * up) / n[2]       # along the source plane
            out = f"{where}/{kind}-{i + 1}"
            if not os.path.exists(f"{out}/summary.json"):
                run_limited([talus, "run", scene, "-o", out, "--threads", "1", "--set", f"simulation.duration={seconds} s", "--set", f"block.boulder.position=[{x!r},{y!r},{z!r}]",
                                "--set", f"block.boulder.velocity=[{push!r},0,{-n[0] / n[2] * push!r}]", "--set", "output.report=false", "--set", "output.interval=1 s"])
            data = read(out)
            row = follow(data, data["names"].index("boulder"))
            reached = float(data["time"][-1])
            if reached < float(seconds) * (1 - 1e-9) and row["still_moving"]:
                stopped.append(f"{kind} {i + 1} at {reached:.1f} s")
            table[kind].append((row["d"], row["t"] if row["t"] is not None else math.nan, row["ts"]))
            print(f"{kind} {i + 1}: d {row['d']:.2f} m, t {row['t']} s, ts {row['ts']:.2f} s{', still moving' if row['still_moving'] else ''}", flush=True)
    spread = {"releases": number, "stopped_while_moving": stopped}
    for k, name in enumerate(("d", "t", "ts")):
        for kind in KINDS:
            v = np.array([r[k] for r in table[kind]])
            spread[f"{name}_{kind}"] = {"mean": float(np.nanmean(v)), "standard_deviation": float(np.nanstd(v)), "least": float(np.nanmin(v)), "largest": float(np.nanmax(v))}
            print(f"{name} {kind}: mean {np.nanmean(v):.2f}, standard deviation {np.nanstd(v):.2f}, least {np.nanmin(v):.2f}, largest {np.nanmax(v):.2f}")
        spread[f"{name}_ordered"] = sum(table["before"][i][k] > table["shallow"][i][k] > table["deep"][i][k] for i in range(number))
        print(f"{name}: before > shallow > deep in {spread[f'{name}_ordered']} of {number} releases")
    with open(f"{where}/spread.json", "w") as f:
        json.dump(spread, f, indent=1)


if __name__ == "__main__":
    main()
