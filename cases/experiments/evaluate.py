#!/usr/bin/env python3
"""Measured and computed displacements of beams under drop weights: a table and a plot.

usage: evaluate.py [--talus PROGRAM] [--out DIR] [--only NAME,...] [--plot FILE.svg] [--reuse] [--reduced] [--jobs N] [-o FIGURES.json]

Runs one scene for each test (../experiments-*/scene.toml with the settings below) into DIR/NAME and prints a Markdown table. Peak: the
largest deflection of midspan from its place under the beam's own weight. Residual: its mean over the last 10 ms of the run, which
ends before the beam is quite at rest. Weight: how far it has fallen; "on" where it has not been stopped: it is at its lowest at the end of the run and falls still, by more than a hundredth of its speed of impact. Peak force: the largest over means of 0.2 ms of the contact force. --reuse takes results that are there; --reduced runs
the first 2 ms of one beam; --jobs runs so many at a time, of one thread each. Measured values: see the READMEs.
"""
import argparse
import concurrent.futures
import json
import pathlib
import subprocess
import sys

import h5py
import numpy as np

here = pathlib.Path(__file__).resolve().parent


def saatci(beam, strength, mass, peak, residual, force=None):
    height = mass / (0.3 * 0.25 * 7850)   # of the weight, of steel; its foot starts 0.5 mm above the beam
    return {"scene": "experiments-saatci-vecchio", "peak": peak, "residual": residual, "force": force, "duration": 0.06,
            "set": [f"material.concrete.f_cm={strength}e6", f"block.weight.size=[0.3,0.25,{height:.6f}]", f"block.weight.position=[0.0,0.0,{0.2055 + height / 2:.6f}]", f'structure.beam.rebar="bars-{beam}.csv"']}


def kishi(beam, span, speed, peak, residual):
    half = span / 2
    line = lambda x, z, held: f'{{line=[[{x},-0.075,{z}],[{x},0.075,{z}]],held="{held}"}}'
    support = ",".join([line(-half, -0.125, "yz"), line(half, -0.125, "yz"), line(-half, 0.125, "z"), line(half, 0.125, "z"),
                        '{region={min=[-0.02,-0.08,-0.02],max=[0.02,0.08,0.02]},held="x"}'])
    return {"scene": "experiments-ando-kishi-mikami", "peak": peak, "residual": residual, "force": None, "duration": 0.04,
            "set": [f"block.weight.velocity=[0.0,0.0,{-speed:.1f}]", f"structure.beam.size=[{span + 0.4},0.15,0.25]", f"structure.beam.support=[{support}]",
                    f'structure.beam.rebar="bars-{beam}.csv"', f"structure.beam.refine.0.region.min=[{-half},-0.2,-0.3]", f"structure.beam.refine.0.region.max=[{half},0.2,0.3]"]}


TESTS = {
    "SS0a": saatci("ss0", 50.1, 211, 9.3, 1.6),
    "SS1a": saatci("ss1", 44.7, 211, 12.1, 0.9),
    "SS2a": saatci("ss2", 47.0, 211, 10.0, 0.5),
    "SS3a": saatci("ss3", 46.7, 211, None, None, 1421),
    "SS1b": saatci("ss1", 44.7, 600, 39.5, 17.7),
    "SS2b": saatci("ss2", 47.0, 600, 37.9, 18.5),
    "SS3b": saatci("ss3", 46.7, 600, 35.3, 17.7),
}
for beam, span, rows in (("A24", 1.0, [(3, 11, 8), (4, 16, 11), (5, 29, 25), (6, 54, 48)]), ("A36", 1.5, [(3, 13.5, 9.5), (4, 28, 24), (5, 66, 53)]),
                         ("B36", 1.5, [(3, 16, 11.4), (4, 26, 22.6), (5, 105, 88)]), ("B48", 2.0, [(3, 21, 19), (4, 36, 30), (5, 55, 47), (6, 73, 70)])):
    for speed, peak, residual in rows:
        TESTS[f"{beam}-{speed}"] = kishi(beam.lower(), span, speed, peak, residual)
for name in ("A24-5", "A24-6", "A36-5", "B48-6"):   # which still go down after 40 ms
    TESTS[name]["duration"] = 0.1
    TESTS[name]["set"].append("simulation.duration=0.1")


def run(test, talus, directory, options):
    command = [talus, "run", str(here.parent / test["scene"] / "scene.toml"), "-o", str(directory), *options]
    for setting in test["set"]:
        command += ["--set", setting]
    with open(f"{directory}.log", "w", encoding="utf-8") as log:
        return subprocess.run(command, stdout=log, stderr=subprocess.STDOUT, check=False).returncode


# Relative changes of the speed of impact: rounding, and what a drop test can hold at best.
CHANGES = (0.0, 1e-6, -1e-6, 1e-4, -1e-4, 1e-3, -1e-3, 2e-3)


def spread(names, talus, out, jobs):
    """Peaks of each test under CHANGES: what its single figure is worth."""
    velocity = lambda test: -float(test["set"][0].split(",")[-1].rstrip("]"))
    pool = concurrent.futures.ThreadPoolExecutor(jobs)
    running = {}
    for name in names:
        for k, change in enumerate(CHANGES):
            changed = dict(TESTS[name], set=[*TESTS[name]["set"], f"block.weight.velocity=[0.0,0.0,{-velocity(TESTS[name]) * (1 + change)!r}]"])
            running[name, k] = pool.submit(run, changed, talus, out / f"{name}-spread-{k}", ["--threads", "1"])
    print("| test | measured mm | least | median | greatest | by change of speed " + ", ".join(f"{x:g}" for x in CHANGES) + " |\n|---|---|---|---|---|---|")
    failed = 0
    for name in names:
        codes = [running[name, k].result() for k in range(len(CHANGES))]
        peaks = [measure(out / f"{name}-spread-{k}")["peak"] for k, code in enumerate(codes) if code == 0]
        failed += sum(code != 0 for code in codes)
        if peaks:
            print(f"| {name} | {TESTS[name]['peak']} | {min(peaks):.1f} | {np.median(peaks):.1f} | {max(peaks):.1f} | {', '.join(f'{x:.1f}' for x in peaks)} |", flush=True)
    return 1 if failed else 0


def measure(directory):
    with h5py.File(directory / "results.h5") as f:
        t = f["history/time"][:]
        u = -1e3 * f["history/structures/beam/probe_displacement"][:, 0, 2]
        damage = f["history/structures/beam/damaged_volume"][-1]
        fallen = f["history/blocks/position"][0, 0, 2] - f["history/blocks/position"][:, 0, 2]
        speed = f["history/blocks/velocity"][:, 0, 2]
        rows = f["history/contacts/structure"]
        ct, dt, force = rows["time"][:], rows["dt"][:], rows["force"][:]
    # Mean force over windows of 0.2 ms: impulse of the rows in a window over its length.
    window, peak = 2e-4, 0.0
    if len(ct):
        bins = np.floor(ct / window - 1e-9).astype(int)
        impulse = np.bincount(bins - bins.min(), weights=np.linalg.norm(force, axis=1) * dt)
        peak = impulse.max() / window / 1e3
    return {"time": t, "u": u, "peak": (u - u[0]).max(), "residual": (u - u[0])[t > t[-1] - 0.01].mean(), "force": peak, "end": t[-1], "damage": damage,
            "fallen": 1e3 * fallen.max(), "falls": bool(speed[-1] < 0.01 * speed[0] and fallen[-1] > 0.99 * fallen.max())}


def plot(points, path):
    """Computed over measured, and for each series of beams the course with the measured peak (dashed) and residual (dotted) in the colour of its test."""
    import matplotlib
    matplotlib.use("svg")
    matplotlib.rcParams["svg.hashsalt"] = "talus"
    import matplotlib.pyplot as plt
    figure, axes = plt.subplots(2, 3, figsize=(13, 8))
    series = {"SS": "Saatci and Vecchio", "A24": "A24", "A36": "A36", "B36": "B36", "B48": "B48"}
    overview = axes[0, 0]
    measured = np.array([1.0, 300.0])
    overview.plot(measured, measured, color="#555", lw=0.9)
    overview.fill_between(measured, measured / 1.5, 1.5 * measured, color="#bbb", alpha=0.35, lw=0, label="within 1.5")
    for (prefix, title), axis, colour in zip(series.items(), axes.flat[1:], ("#2a6fb5", "#c8553d", "#588157", "#7b4fa3", "#b8860b")):
        own = [p for p in points if p[0].startswith(prefix)]
        for k, (name, test, m) in enumerate(own):
            line, = axis.plot(1e3 * m["time"], m["u"] - m["u"][0], lw=1.3, color=f"C{k}", label=name)
            if not test["peak"]:
                continue
            axis.axhline(test["peak"], color=line.get_color(), lw=0.8, ls="--")
            axis.axhline(test["residual"], color=line.get_color(), lw=0.8, ls=":")
            overview.plot(test["peak"], m["peak"], "o", color=colour, label="" if k else title)
            if not 1 / 1.5 < m["peak"] / test["peak"] < 1.5:
                overview.annotate(name, (test["peak"], m["peak"]), fontsize=8, xytext=(5, -3), textcoords="offset points")
        axis.set(xlabel="time [ms]", ylabel="deflection of midspan [mm]", title=f"{title}: measured peak dashed, residual dotted")
        axis.title.set_fontsize(10)
        axis.legend(fontsize=8)
    overview.set(xscale="log", yscale="log", xlim=(5, 300), ylim=(5, 300), xlabel="measured peak [mm]", ylabel="computed peak [mm]", title="Peak deflection")
    overview.title.set_fontsize(10)
    overview.legend(fontsize=8, loc="upper left")
    figure.tight_layout()
    figure.savefig(path, metadata={"Date": None})


def main():
    parse = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parse.add_argument("--talus", default=str(here.parents[1] / "build/release/talus"))
    parse.add_argument("--out", default="results/experiments")
    parse.add_argument("--only", default="")
    parse.add_argument("--plot")
    parse.add_argument("--reuse", action="store_true")
    parse.add_argument("--reduced", action="store_true")
    parse.add_argument("--jobs", type=int, default=1)
    parse.add_argument("--spread", action="store_true", help="each test of --only eight times, its speed of impact changed by at most 0.2 %%")
    parse.add_argument("-o", dest="figures")
    options = parse.parse_args()
    out = pathlib.Path(options.out)
    out.mkdir(parents=True, exist_ok=True)
    names = ["A36-4"] if options.reduced else options.only.split(",") if options.only else list(TESTS)
    if options.reduced:
        TESTS["A36-4"]["duration"] = 0.002
        TESTS["A36-4"]["set"].append("simulation.duration=0.002")
    if options.spread:
        return spread(names, options.talus, out, options.jobs)
    show = lambda x, digits=1: "" if x is None else f"{x:.{digits}f}"
    ratio = lambda c, m: "" if not m else f"{c / m:.2f}"
    print("| test | peak measured mm | computed | ratio | residual measured mm | computed | ratio | weight fell mm | peak force measured kN | computed | exit |\n|---|---|---|---|---|---|---|---|---|---|---|")
    points, failed = [], 0
    pool = concurrent.futures.ThreadPoolExecutor(options.jobs)
    extra = ["--threads", "1"] if options.jobs > 1 else []
    running = {name: pool.submit(run, TESTS[name], options.talus, out / name, extra) for name in names if not (options.reuse and (out / name / "results.h5").exists())}
    for name in names:
        test, directory = TESTS[name], out / name
        code = running[name].result() if name in running else 0
        if not (directory / "results.h5").exists():
            print(f"| {name} | {show(test['peak'])} | no result | | {show(test['residual'])} | | | | | | {code} |")
            failed += 1
            continue
        m = measure(directory)
        points.append((name, test, m))
        note = "" if m["end"] > 0.999 * test["duration"] else f", ended at {1e3 * m['end']:.0f} ms"
        print(f"| {name} | {show(test['peak'])} | {show(m['peak'])} | {ratio(m['peak'], test['peak'])} | {show(test['residual'])} | {show(m['residual'])} | {ratio(m['residual'], test['residual'])} "
              f"| {show(m['fallen'])}{' on' if m['falls'] else ''} | {show(test['force'], 0)} | {show(m['force'], 0)} | {code}{note} |", flush=True)
    if options.figures:
        with open(options.figures, "w", encoding="utf-8") as file:
            json.dump({name: {"peak_mm": m["peak"], "residual_mm": m["residual"], "peak_force_kn": m["force"]} for name, _, m in points}, file, indent=1)
    if options.plot and points:
        plot(points, options.plot)
    return 1 if failed else 0


sys.exit(main())
