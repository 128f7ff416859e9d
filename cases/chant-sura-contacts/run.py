#!/usr/bin/env python3
"""Contact events of Chant Sura: velocity after the contact, measured against computed.

    run.py DATA [-o DIR] [--talus PROGRAM] [--orientations N] [--set KEY=VALUE]...

Each event starts just before its contact with the measured velocity, turned another way N times; the spin is unknown and starts at nothing. What is compared is the velocity of the
centroid once the block flies again, taken back to the instant of the contact as if gravity alone had acted.
"""
import argparse
import csv
import math
import pathlib
import random
import subprocess
import sys

HERE = pathlib.Path(__file__).parent
G = 9.81
BACK = 0.10     # flown before the contact [s]
AFTER = 0.20    # from the contact to where the velocity is read [s]


def quaternion(rng):
    u, v, w = rng.random(), 2 * math.pi * rng.random(), 2 * math.pi * rng.random()
    return [math.sqrt(u) * math.cos(w), math.sqrt(1 - u) * math.sin(v), math.sqrt(1 - u) * math.cos(v), math.sqrt(u) * math.sin(w)]


def scene(data, event, turn, origin):
    x, y, z = (float(event[k]) for k in ("x_m", "y_m", "z_m"))
    v = [float(event[f"incoming_v{k}_mps"]) for k in "xyz"]
    # On the parabola that leads to the place and the velocity of the contact.
    start = [x - BACK * v[0] - origin[0], y - BACK * v[1] - origin[1], z - BACK * v[2] - 0.5 * G * BACK**2 - origin[2]]
    velocity = [v[0], v[1], v[2] + G * BACK]
    text = (HERE / "scene.toml").read_text()
    for key, value in (("@TERRAIN@", str(data / "terrain_rf16_contact_extended.asc")), ("@MASS@", event["mass_kg"]), ("@POSITION@", start), ("@VELOCITY@", velocity), ("@TURN@", turn), ("@ORIGIN@", list(origin)), ("@DURATION@", BACK + AFTER + 0.05)):
        text = text.replace(key, str(value))
    return text


def main():
    p = argparse.ArgumentParser()
    p.add_argument("data", type=pathlib.Path)
    p.add_argument("-o", type=pathlib.Path, default=pathlib.Path("results/chant-sura-contacts"))
    p.add_argument("--talus", default=str(HERE / "../../build/release/talus"))
    p.add_argument("--orientations", type=int, default=8)
    p.add_argument("--set", action="append", default=[])
    a = p.parse_args()
    events_file = a.data / "observed_contact_events_extended.csv"
    if not events_file.exists():
        print(f"chant-sura-contacts: skipped, {events_file} is not there (doi 10.16904/envidat.174)")
        return 0
    events = list(csv.DictReader(open(events_file)))
    origin = [math.floor(float(events[0][k])) for k in ("x_m", "y_m", "z_m")]
    a.o.mkdir(parents=True, exist_ok=True)
    rng = random.Random(1)
    errors, rows = [], []
    for event in events:
        measured = [float(event[f"outgoing_v{k}_mps"]) for k in "xyz"]
        found, refused = [], 0
        for n in range(a.orientations):
            q = quaternion(rng)
            file = a.o / f"{event['event_id']}-{n}.toml"
            file.write_text(scene(a.data, event, q, origin))
            out = a.o / f"{event['event_id']}-{n}"
            r = subprocess.run([a.talus, "run", str(file), "-o", str(out), "--threads", "1"] + [w for s in a.set for w in ("--set", s)], capture_output=True, text=True)
            if r.returncode != 0:
                refused += 1
                continue
            table = out / "blocks.csv"
            subprocess.run([a.talus, "convert", f"{out}/results.h5#/history/blocks/velocity", str(table)], check=True, capture_output=True)
            lines = [l.split(",") for l in table.read_text().splitlines() if l and (l[0].isdigit() or l[0] == "-")]
            # First row in which it has left free fall, then AFTER later.
            for k in range(1, len(lines)):
                dt = float(lines[k][0]) - float(lines[k - 1][0])
                jump = [float(lines[k][1 + c]) - float(lines[k - 1][1 + c]) + (G * dt if c == 2 else 0) for c in range(3)]
                if sum(j * j for j in jump) > 1e-4:
                    break
            t0 = float(lines[k][0])
            last = min(lines[k:], key=lambda l: abs(float(l[0]) - t0 - AFTER))
            found.append([float(last[1]), float(last[2]), float(last[3]) + G * (float(last[0]) - t0)])
        if not found:
            print(f"{event['event_id']}: every start was refused")
            continue
        mean = [sum(f[c] for f in found) / len(found) for c in range(3)]
        speeds = sorted(math.dist(f, (0, 0, 0)) for f in found)
        error = sorted(math.dist(f, measured) for f in found)[len(found) // 2]
        errors += [math.dist(f, measured) for f in found]
        rows.append((event["event_id"], float(event["incoming_speed_mps"]), math.dist(measured, (0, 0, 0)), speeds[len(speeds) // 2], error, refused))
    print(f"{'event':28}{'in':>8}{'out':>8}{'computed':>10}{'|error|':>9}  refused")
    for r in rows:
        print(f"{r[0]:28}{r[1]:8.2f}{r[2]:8.2f}{r[3]:10.2f}{r[4]:9.2f}{r[5]:9}")
    errors.sort()
    if errors:
        print(f"median error of the velocity after the contact: {errors[len(errors) // 2]:.2f} m/s, of {len(errors)} runs; measured speeds after: median {sorted(r[2] for r in rows)[len(rows) // 2]:.2f} m/s")
    return 0


if __name__ == "__main__":
    sys.exit(main())
