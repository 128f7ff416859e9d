#!/usr/bin/env python3
"""talus impact from end to end: run.py TALUS SOURCE_DIR WORK_DIR"""
import json
import shutil
import subprocess
import sys

talus, source, work = sys.argv[1:]


def impact(name, scene, *more):
    out = f"{work}/{name}"
    shutil.rmtree(out, ignore_errors=True)
    done = subprocess.run([talus, "impact", scene, "-o", out, *more], capture_output=True, text=True)
    return done, out


def summary(out):
    return json.load(open(f"{out}/summary.json", encoding="utf-8"))


# A block by mass, shape, speed, angle, direction and point.
done, out = impact("given", f"{source}/scene.toml")
assert done.returncode == 0, done.stdout + done.stderr
hits = summary(out)["impacts"]
assert len(hits) == 1 and hits[0]["structure"] == "pier" and hits[0]["block"] == "block", hits
assert abs(hits[0]["speed"] - 20) < 0.2, hits[0]
# The first point of contact lies where it was asked for, within the size of the block.
assert max(abs(a - b) for a, b in zip(hits[0]["point"], [-0.5, 0.1, 3.0])) < 0.3, hits[0]["point"]
# The impulse is the momentum the block lost: more than it brought along x, as it comes back.
assert 0.9 * 500 * 19.3 < hits[0]["impulse"][0] < 2 * 500 * 19.3, hits[0]["impulse"]

# The same block from a row of a trajectories file, the second row smaller and slower.
text = open(f"{source}/scene.toml", encoding="utf-8").read()
head, tail = text.split("[impact]")
rest = tail[tail.index("[output]"):]
path = f"{source}/trajectories.csv"
for row, speed in ((1, (19.3**2 + 5.2**2) ** 0.5), (2, (12**2 + 3**2) ** 0.5)):
    scene = f"{work}/row{row}.toml"
    with open(scene, "w", encoding="utf-8") as file:
        file.write(head + f'[impact]\nmaterial = "rock"\nshape = "EOTA111"\ntrajectories = "{path}"\nrow = {row}\n' + rest)
    done, out = impact(f"row{row}", scene)
    assert done.returncode == 0, done.stdout + done.stderr
    assert abs(summary(out)["impacts"][0]["speed"] - speed) < 0.2

# Flown at a slant, a flank of the block may touch before the point that is foremost along the flight: the gap along the flight is kept all the same.
for slant in ("-70 deg", "-30 deg", "30 deg", "70 deg"):
    done, out = impact("slant", f"{source}/scene.toml", "--set", f'impact.angle="{slant}"', "--set", 'simulation.duration="2 ms"', "--set", "impact.clearance=0.001")
    assert done.returncode == 0, (slant, done.stdout + done.stderr)
    hit = summary(out)["impacts"]
    assert hit and hit[0]["start"] < 2e-4, (slant, hit)

# The second impact on the pier that the first one has struck.
done, again = impact("again", f"{source}/scene.toml", "--set", f'simulation.initial_state="{work}/given/results.h5"')
assert done.returncode == 0, done.stdout + done.stderr
assert "Structure pier: starts from the last state" in done.stdout, done.stdout

# Bad input: exit code 2, nothing written, the key named.
for change, key in (('row = 1', "row = 7"), ("point", None)):
    scene = f"{work}/bad.toml"
    if key:
        body = head + f'[impact]\nmaterial = "rock"\nshape = "EOTA111"\ntrajectories = "{path}"\nrow = 7\n' + rest
    else:
        body = head + rest
    open(scene, "w", encoding="utf-8").write(body)
    done, out = impact("bad", scene)
    assert done.returncode == 2, (done.returncode, done.stdout, done.stderr)
    assert "impact" in done.stderr, done.stderr
print("impact: all well")
