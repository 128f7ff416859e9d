#!/usr/bin/env python3
"""Talus beside Bullet, ODE and Yade on the comparison scenes, in one run on one machine.

    python3 bench/run.py --talus build/release/talus s1 s2 s3-100 s4        Talus alone
    python3 bench/run.py --peers bullet64,ode --repeat 3 s3-100             beside the peers (installs and builds them)
    python3 bench/run.py --peers bullet64,ode,yade --markdown table.md s1 s2 s4 s3-100 s3-400
    python3 bench/run.py --peers bullet64,ode --duration 2 s3-1600          the first two seconds

CPU is that of the stepping: reading, writing and (for the peers) the frames are not counted. Overlaps and energies are measured from the poses
(bench/measure.py), those of boxes by separating axes. The ledger's residual is Talus's own, over the energy released.
Scenes are those of bench/scenes.py.
"""
import argparse
import dataclasses
import json
import os
import pathlib
import shutil
import statistics
import subprocess
import sys

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).parent))
import measure
import scenes

HERE = pathlib.Path(__file__).resolve().parent
SOLUTIONS = ("newton", "interior_point", "above_tolerance", "halved", "convex")


def run(command, limit, environment=None):
    """Output of a command."""
    process = subprocess.Popen([str(c) for c in command], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment)
    out, err = process.communicate(timeout=limit)
    if process.returncode != 0:
        raise SystemExit(f"{' '.join(map(str, command))} failed:\n{out[-2000:]}\n{err[-2000:]}")
    return out


def talus(scene, name, options, directory):
    import h5py
    sleeping = name != "s4-awake"
    path = scenes.write_talus(scene, directory / "scene", options.accuracy, options.threads, sleeping, options.interval)
    result = directory / "result"
    usage = directory / "usage.txt"
    run(["time", "-f", "%M", "-o", usage, options.talus, "run", path, "-o", result], options.limit)
    summary = json.loads((result / "summary.json").read_text())
    with h5py.File(result / "results.h5") as f:
        h = f["history/blocks"]
        frames = f["history/time"][:], h["position"][:], h["orientation"][:], h["velocity"][:], h["spin"][:]
    n = summary["counters"]
    out = measure.measure(scene, *frames)
    out.update(code="Talus", step=None, cpu=summary["time"]["cpu_seconds"], steps=n["steps"], contacts=n["contacts"] / max(1, n["steps"]),
               solutions=[n["solutions"][k] for k in SOLUTIONS],
               residual=abs(summary["energy"]["residual_worst"]), rejected=n["rejected"], algorithmic=summary["energy"]["algorithmic"],
               memory=float(usage.read_text().split()[-1]) / 1024, status=summary["status"])
    return out


def yade(scene, text, frames, result, options):
    """Explicit springs need steps of their own; stopped after --yade-limit, since a whole run takes hours."""
    step = 1e-3 if len(scene.position) == 1 else 5e-4
    run(["yade", "-n", "-x", "-j1", HERE / "peers" / "yade_driver.py"], options.limit,
        dict(os.environ, PEER_SCENE=str(text), PEER_STEP=str(step), PEER_FRAMES=str(frames), PEER_INTERVAL=str(options.interval),
             PEER_LIMIT=str(options.yade_limit), PEER_RESULT=str(result)))
    return dict(json.loads(result.read_text()), step=step)


def peer(code, scene, step, options, directory):
    text, frames = directory / "scene.txt", directory / "frames.bin"
    directory.mkdir(parents=True, exist_ok=True)
    scenes.write_text(scene, text)
    if code == "yade":
        out = yade(scene, text, frames, directory / "figures.json", options)
        step = out.pop("step")
    else:
        iterations = 50 if step < 2e-3 or code == "bullet64" else 20
        out = json.loads(run([options.build / code, text, step, iterations, 0, frames, options.interval], options.limit))
    rows = np.fromfile(frames).reshape(-1, 1 + 13 * len(scene.position))
    t, body = rows[:, 0], rows[:, 1:].reshape(len(rows), -1, 13)
    out.update(measure.measure(scene, t, body[..., :3], body[..., 3:7], body[..., 7:10], body[..., 10:]))
    out["end_wanted"] = scene.duration
    out.update(code={"bullet64": "Bullet64", "ode": "ODE", "yade": "Yade"}[code], step=step)
    return out


def median_cpu(runs):
    """The first run with the median CPU of all."""
    return dict(runs[0], cpu=statistics.median(r["cpu"] for r in runs))


HEAD = ["scene", "code", "step", "CPU s", "Talus / peer", "us per block and step", "steps", "contacts", "overlap boxes, ground mm",
        "ledger residual / released",
        "solutions: Newton, interior point, above tolerance, halved, convex", "own figure"]


def row(name, blocks, r, ours):
    figure = ""
    if "slide_error" in r:
        figure = f"slide off by {r['slide_error']:.1e}"
    if "top_drift" in r:
        figure = f"top moved {1e3 * r['top_drift']:.3g} mm"
    if name.startswith("field"):
        figure = f"{r['memory']:.0f} MB" if "memory" in r else ""
    whole = r.get("end_wanted", 0) / r["reached"] if "reached" in r else 1.0
    if whole > 1.001:
        figure = f"stopped at {r['reached']:.2f} s: CPU stretched {whole:.1f} times"
        r = dict(r, cpu=r["cpu"] * whole, steps=round(r["steps"] * whole))
    ratio = "" if r is ours or ours is None else f"{ours['cpu'] / r['cpu']:.2f}"
    ledger = f"{r['residual'] / r['released']:.1e}" if "residual" in r and r["released"] > 1 else (f"{r['residual']:.1e} J" if "residual" in r else "")
    return [name, r["code"], "own" if r["step"] is None else f"1/{1 / r['step']:.0f}", f"{r['cpu']:.3g}", ratio,
            f"{1e6 * r['cpu'] / max(1, r['steps']) / blocks:.3g}", str(r["steps"]), f"{r['contacts']:.0f}",
            f"{1e3 * r['boxes']:.2g}, {1e3 * r['ground']:.2g}", ledger,
            " ".join(map(str, r.get("solutions", []))), figure]


def main():
    parse = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parse.add_argument("scene", nargs="+")
    parse.add_argument("--talus", default="build/release/talus", help="program; 'none' leaves it out")
    parse.add_argument("--peers", default="", help="comma-separated: bullet64, ode, yade")
    parse.add_argument("--peer-steps", default="0.001", help="comma-separated steps of the peers [s]")
    parse.add_argument("--yade-limit", type=float, default=60, help="CPU after which Yade is stopped and its cost stretched to the whole run [s]")
    parse.add_argument("--repeat", type=int, default=1, help="runs of each; the median CPU is told")
    parse.add_argument("--accuracy", type=float, default=1e-3)
    parse.add_argument("--duration", type=float, help="simulated time, in place of the scene's own [s]")
    parse.add_argument("--threads", type=int, default=1)
    parse.add_argument("--interval", type=float, default=0.1, help="between the frames measured [s]")
    parse.add_argument("--limit", type=float, default=3600, help="longest run [s]")
    parse.add_argument("--build", type=pathlib.Path, default=pathlib.Path("build/peers"))
    parse.add_argument("--work", type=pathlib.Path, default=pathlib.Path("build/bench"))
    parse.add_argument("--markdown", type=pathlib.Path, help="table to write")
    parse.add_argument("--json", type=pathlib.Path, help="all figures")
    options = parse.parse_args()
    codes = [c for c in options.peers.split(",") if c]
    if "yade" in codes and not shutil.which("yade"):
        raise SystemExit("yade is not installed: apt-get install --no-install-recommends yade")
    if set(codes) - {"yade"}:
        subprocess.run([HERE / "peers" / "build.sh", options.build], check=True)
    table, figures = [HEAD, ["---"] * len(HEAD)], []
    for name in options.scene:
        scene = scenes.make(name)
        if options.duration:
            scene = dataclasses.replace(scene, duration=options.duration)
        ours = None
        tasks = [] if options.talus == "none" else [lambda: talus(scene, name, options, options.work / name)]
        for code in codes:
            if code == "ode" and scene.hull is not None:
                continue
            steps = options.peer_steps.split(",") if code != "yade" else ["0"]
            tasks += [lambda c=code, h=float(h): peer(c, scene, h, options, options.work / name / c) for h in steps]
        runs = [[task() for task in tasks] for _ in range(options.repeat)]   # interleaved: the machine's noise meets all alike
        for results in zip(*runs):
            r = median_cpu(results)
            if r["code"] == "Talus":
                ours = r
            table.append(row(name, len(scene.position), r, ours))
            print(" | ".join(table[-1]), flush=True)
            figures.append(dict(r, scene=name))
    lines = ["| " + " | ".join(r) + " |" for r in table]
    if options.markdown:
        options.markdown.write_text("\n".join(lines) + "\n")
    if options.json:
        options.json.write_text(json.dumps(figures, indent=1) + "\n")


if __name__ == "__main__":
    main()
