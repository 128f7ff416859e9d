#!/usr/bin/env python3
"""Displacements of the top of a column that a ball strikes, beside those of Sun and others; the column is assumed (README.md).

usage: evaluate.py [--talus PROGRAM] [--out DIR] [--columns NAME,...] [--heights NAME,...] [--speeds N] [--successive] [--reuse]

Runs scene.toml for each column below, height of impact and speed, and prints one Markdown table for each column: largest displacement of the top
along the blow [mm] from its place before the first blow. --successive strikes one column with growing speeds; between blows it comes to rest (REST below), and
where it stands then is told too, in brackets of its own. Otherwise each blow finds a sound column. --speeds 2 stops after the second."""
import argparse
import pathlib
import subprocess
import sys

import h5py

here = pathlib.Path(__file__).resolve().parent
SPEEDS = (4.43, 6.26, 7.67, 8.85)
MEASURED = {"1/4": (0.25, (4.3, 8.2, 17.4, 35.3)), "3/8": (0.375, (4.6, 8.6, 17.0, 48.5)), "1/2": (0.5, (6.4, 13.6, 45.1, 82.5))}
RADIUS, GAP = 0.12, 0.001
REST = ["simulation.duration=0.15", "structure.column.damping_ratio=0.5"]   # between blows: swings die out within it, so that the next ball meets a column at rest
COLUMNS = {   # side, height [m]; 8 bars of this diameter [m]; cells across and along
    "slender": (0.20, 2.5, 0.008, (4, 4, 50)),
    "middle": (0.25, 2.5, 0.010, (5, 5, 50)),
    "stout": (0.30, 2.5, 0.012, (6, 6, 50)),
    "strong bars": (0.25, 2.5, 0.014, (5, 5, 50)),
}


def settings(column, place, speed):
    side, height, bar, cells = COLUMNS[column]
    return [f"structure.column.section=[{side},{side}]", f"structure.column.height={height}", f"structure.column.cells={list(cells)}", f"structure.column.rebar.0.diameter={bar}",
            f"structure.column.probe.0.at=[0.0,0.0,{height}]", f"block.ball.position=[{-(side / 2 + RADIUS + GAP):.6g},0.0,{place * height:.6g}]", f"block.ball.velocity=[{speed},0.0,0.0]"]


def run(talus, directory, sets, reuse):
    """Runs the scene with `sets` into `directory`, unless its results are there and `reuse`; whether it went well."""
    if reuse and (directory / "results.h5").exists():
        return True
    command = [talus, "run", str(here / "scene.toml"), "-o", str(directory)]
    for setting in sets:
        command += ["--set", setting]
    with open(f"{directory}.log", "w", encoding="utf-8") as log:
        return subprocess.run(command, stdout=log, stderr=subprocess.STDOUT, check=False).returncode == 0


def from_state(directory, ball):
    """Settings that start from the last state of `directory`; the ball gets a name of its own, or it would go on where it was."""
    return [f'simulation.initial_state="{directory / "results.h5"}"', f'block.ball.name="{ball}"']


def top(file):
    """Displacement of the top along the blow [m], over time; not a number where there are no results."""
    if not file.exists():
        return [float("nan")]
    with h5py.File(file) as f:
        return f["history/structures/column/probe_displacement"][:, 0, 0]


def main():
    parse = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parse.add_argument("--talus", default=str(here.parents[1] / "build/release/talus"))
    parse.add_argument("--out", default="results/experiments-sun")
    parse.add_argument("--columns", default=",".join(COLUMNS))
    parse.add_argument("--heights", default=",".join(MEASURED))
    parse.add_argument("--speeds", type=int, default=len(SPEEDS))
    parse.add_argument("--successive", action="store_true")
    parse.add_argument("--reuse", action="store_true")
    options = parse.parse_args()
    out = pathlib.Path(options.out).resolve()
    out.mkdir(parents=True, exist_ok=True)
    failed = 0
    for column in options.columns.split(","):
        side, height, bar, _ = COLUMNS[column]
        print(f"\n{column}: {side:g} x {side:g} x {height:g} m, 8 bars of {1e3 * bar:g} mm\n")
        print("| struck at | " + " | ".join(f"{v} m/s" for v in SPEEDS[:options.speeds]) + " |\n|---" * 1 + "|---" * options.speeds + "|")
        for name in options.heights.split(","):
            place, measured = MEASURED[name]
            cells, before = [], None
            for speed, mm in list(zip(SPEEDS, measured))[:options.speeds]:
                directory = out / f"{column.replace(' ', '-')}-{name.replace('/', '.')}-{speed}{'-successive' if options.successive else ''}"
                failed += not run(options.talus, directory, settings(column, place, speed) + (from_state(before, f"ball at {speed}") if before else []), options.reuse)
                u = top(directory / "results.h5")
                stands = ""
                if options.successive:
                    before = pathlib.Path(f"{directory}-rest")
                    failed += not run(options.talus, before, settings(column, place, -speed) + REST + from_state(directory, f"ball gone after {speed}"), options.reuse)
                    stands = f" [{1e3 * top(before / 'results.h5')[-1]:.1f}]"
                cells.append(f"{1e3 * max(u):.1f}{stands} ({mm})")
            print(f"| {name} | " + " | ".join(cells) + " |", flush=True)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
