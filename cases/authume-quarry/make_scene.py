#!/usr/bin/env python3
"""Profile P2 of the Authume quarry as an ensemble: four scanned blocks, four drop points, 64 orientations.

    make_scene.py DATA OUT    DATA: the published data set, with terrain/, blocks/, positions_P2.xyz, orientations.txt; writes OUT/scene.toml
                           (the program is build/release/talus, or what the environment variable TALUS names)

The data have no licence that would let them be carried along: without them the case is skipped, with a message and exit code 0.
y is up in the data; the scene turns them so that z is: (x, y, z) -> (x, -z, y).
"""
import os
import pathlib
import re
import subprocess
import sys

if len(sys.argv) != 3:
    sys.exit(__doc__)
data, out = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
if not (data / "positions_P2.xyz").is_file():
    print(f"skipped: no data in {data}. They are published by V. Richefeu as AuthumeQuarryRockfalls_Data-in-Brief (Garcia et al. 2022, Eng. Geol. 310:106855)")
    sys.exit(0)
out.mkdir(parents=True, exist_ok=True)
TALUS = os.environ.get("TALUS", str(pathlib.Path(__file__).parent / "../../build/release/talus"))
ZONES = {"hard": "DTM_Gray_zone.stl", "rocky": "DTM_Red_zone.stl", "vegetated": "DTM_Blue_zone.stl"}


def triangles(path):
    points = [tuple(map(float, m)) for m in re.findall(r"vertex\s+(\S+)\s+(\S+)\s+(\S+)", path.read_text())]
    return [points[k:k + 3] for k in range(0, len(points), 3)]


def write_obj(path, faces_of):
    index, vertices, faces = {}, [], []
    for t in faces_of:
        face = []
        for p in t:
            key = tuple(round(v, 4) for v in p)
            if key not in index:
                index[key] = len(vertices) + 1
                vertices.append(p)
            face.append(index[key])
        if len(set(face)) == 3:
            faces.append(face)
    path.write_text("".join("v %.6f %.6f %.6f\n" % v for v in vertices) + "".join("f %d %d %d\n" % tuple(f) for f in faces))


# Scans keep their own axes; they are turned as the world is.
for file in sorted((data / "blocks").glob("*.stl")):
    target = out / (file.stem + ".obj")
    write_obj(target, [[(x, -z, y) for x, y, z in t] for t in triangles(file)])
    # One scan lacks a face.
    repaired = out / (file.stem + "-closed.obj")
    subprocess.run([TALUS, "convert", "--repair", str(target), str(repaired)], check=True, capture_output=True)
    repaired.replace(target)
places = [tuple(map(float, line.split())) for line in (data / "positions_P2.xyz").read_text().split("\n") if line.strip()]
quaternions = [tuple(map(float, line.split())) for line in (data / "orientations.txt").read_text().split("\n")[1:] if line.strip()]
blocks = sorted(f.stem for f in (data / "blocks").glob("*.stl"))


def listed(key, values):
    return f'[[ensemble.vary]]\nkey = "{key}"\nlist = [\n' + "".join(f"  {v},\n" for v in values) + "]\n"


interfaces = "".join(f'''[[interface]]
between = ["rock", "{name}"]
friction = {friction}
restitution = {restitution}
rolling_resistance = {rolling}
normal_stiffness = "hard"
''' for name, friction, restitution, rolling in (("hard", 0.55, 0.25, 0.25), ("rocky", 0.75, 0.15, 0.15), ("vegetated", 0.7, 0.05, 0.25)))
areas = "".join(f'[[site.area]]\nmesh = "{(data / "terrain" / file).resolve()}"\nmaterial = "{name}"\n' for name, file in ZONES.items() if name != "hard")
(out / "scene.toml").write_text(f'''schema = 1
title = "Authume quarry, profile P2"
[simulation]
duration = "30 s"
until = "rest"
[site]
terrain = "{(data / "terrain" / ZONES["hard"]).resolve()}"
up = "y"
material = "hard"
{areas}[[material]]
name = "rock"
density = 2600
{interfaces}[[block]]
name = "B"
material = "rock"
shape = "file"
file = "{blocks[0]}.obj"
position = [0.0, 0.0, 0.0]
[output]
interval = "0.5 s"
history_interval = "50 ms"
report = false
[ensemble]
design = "factorial"
seed = 1
map_cell = "1 m"
''' + listed("block.B.file", [f'"{b}.obj"' for b in blocks]) + listed("block.B.position", [f"[{x}, {-z}, {y}]" for x, y, z in places]) +
    # A turn of the data's axes becomes one of the scene's: the vector part turns along.
    listed("block.B.orientation", [f"{{ quaternion = [{w}, {x}, {-z}, {y}] }}" for w, x, y, z in quaternions]))
print(f"{len(blocks)} blocks, {len(places)} places, {len(quaternions)} orientations: {len(blocks) * len(places) * len(quaternions)} members in {out / 'scene.toml'}")
