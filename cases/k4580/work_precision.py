#!/usr/bin/env python3
"""Error against CPU time of the two methods for the boulder: talus by accuracy, the paper's scheme by step.

usage: work_precision.py TALUS DIR [--plot FIGURE.svg]

Sliding, 1 s to 3 s: against the closed form s = v(1) t + 1/2 g (sin a - tan(phi) cos a) t^2 of a block on Joint 1 (dip a = 29 degrees); the first second
holds the fall of 2e-6 m that the scene starts with.
Sliding and tipping over the edge, 6.5 s: against talus at the finest accuracy, since no closed form is known. Later instants hang on the first strike.
CPU time is what the program reports for the stepping, on one thread. A run that is there already is not run again.
"""
import json
import math
import os
import re
import subprocess
import sys

import h5py
import numpy as np

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from make_k4580 import DENSITY, FRICTION, HERE, J1      # noqa: E402

ACCURACIES = (0.1, 0.03, 0.01, 0.003, 1e-3)
STEPS = (4e-3, 2e-3, 1e-3, 4e-4, 1e-4)
MEASURES = {"slides": 3.0, "tips": 6.5}


def as_1988(text, step):
    """The scene by the paper's scheme with the paper's Table 4: deformable blocks, contact springs, fixed step."""
    text = re.sub(r"accuracy = .*", f'method = "dda-1988"\nstep = {step!r}', text)
    text = re.sub(r'normal_stiffness = "hard"\n(restitution = .*\n)?', 'normal_stiffness = "30 GN/m"\nshear_stiffness = "3.5 GN/m"\n', text)
    text = text.replace(f'name = "rock"\ndensity = {DENSITY:g}', f'name = "rock"\ndensity = {DENSITY:g}\nyoung = "3 GPa"\npoisson = 0.3')
    return text.replace("deformable = false\n", "").replace("../k4580/", HERE + "/")


def run(talus, scene, out, seconds):
    """Path of the boulder's centroid since 1 s (3), its velocity then (3), and CPU time [s]; nothing if the run fails."""
    if not os.path.exists(f"{out}/summary.json"):
        subprocess.run([talus, "run", scene, "-o", out, "--threads", "1", "--set", f"simulation.duration={seconds}", "--set", "output.report=false", "--set", "output.interval=1 s"],
                       stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    with open(f"{out}/log.jsonl") as f:
        end = [e for e in map(json.loads, f) if e["event"] == "end"]
    if not end or end[-1]["status"] != "done":
        return None
    with h5py.File(f"{out}/results.h5") as f:
        i = [n.decode() for n in f["history/blocks/name"][:]].index("boulder")
        p, v, t = f["history/blocks/position"][:, i], f["history/blocks/velocity"][:, i], f["history/time"][:]
    k = int(np.searchsorted(t, 1.0 - 1e-9))
    return p[-1] - p[k], v[k], end[-1]["cpu_seconds"]


def main():
    talus, where = sys.argv[1:3]
    os.makedirs(where, exist_ok=True)
    base = open(f"{HERE}/../k4580-boulder/before.toml").read()
    rows = []
    for what, seconds in MEASURES.items():
        runs = []
        for method, values in (("talus", ACCURACIES), ("dda-1988", STEPS)):
            for value in values:
                text = as_1988(base, value) if method != "talus" else re.sub(r"accuracy = .*", f"accuracy = {value!r}", base).replace("../k4580/", HERE + "/")
                name = f"{where}/{what}-{method}-{value:g}"
                with open(name + ".toml", "w") as f:
                    f.write(text)
                found = run(talus, name + ".toml", name, seconds)
                if found:
                    runs.append((method, value, *found))
                else:
                    print(f"{what} {method} {value:g}: failed", flush=True)
        dip = math.radians(J1[1])
        a, down = 9.8 * (math.sin(dip) - math.tan(math.radians(FRICTION)) * math.cos(dip)), seconds - 1.0
        finest = [r for r in runs if r[0] == "talus"][-1]
        for method, value, path, v, cpu in runs:
            error = abs(np.linalg.norm(path) - np.linalg.norm(v) * down - 0.5 * a * down**2) if what == "slides" else float(np.linalg.norm(path - finest[2]))
            if (method, value) == finest[:2] and what != "slides":
                continue
            rows.append({"measure": what, "method": method, "value": value, "error_m": float(error), "cpu_s": cpu})
            print(f"{what} {method} {value:g}: error {error:.3e} m, {cpu:.2f} s of CPU", flush=True)
    with open(f"{where}/work_precision.json", "w") as f:
        json.dump(rows, f, indent=1)
    if "--plot" in sys.argv:
        plot(rows, sys.argv[sys.argv.index("--plot") + 1])


def plot(rows, path):
    import matplotlib
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    plt.rcParams["svg.fonttype"] = "none"       # text stays text
    fig, axes = plt.subplots(1, 2, figsize=(10, 4))
    for ax, what in zip(axes, MEASURES):
        for method, style in (("talus", "o-"), ("dda-1988", "s--")):
            points = [(r["cpu_s"], max(r["error_m"], 1e-16), r["value"]) for r in rows if r["measure"] == what and r["method"] == method]
            ax.loglog([p[0] for p in points], [p[1] for p in points], style, label=method + (", by accuracy" if method == "talus" else ", by step"))
            for x, y, v in points:
                ax.annotate(f"{v:g}", (x, y), fontsize=7)
        ax.set_xlabel("CPU time [s]"), ax.set_ylabel("error of the path [m]"), ax.set_title(f"boulder {what}, {MEASURES[what]:g} s"), ax.legend(fontsize=8)
    fig.tight_layout()
    fig.savefig(path)


if __name__ == "__main__":
    main()
