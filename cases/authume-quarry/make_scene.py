#!/usr/bin/env python3
"""Profile P2 of the Authume quarry as an ensemble: four scanned blocks, four drop points, 64 orientations.

    make_scene.py DATA OUT    DATA: the published data set, with terrain/, blocks/, positions_P2.xyz, orientations.txt; writes OUT/scene.toml

The data have no licence that would let them be carried along: without them the case is skipped, with a message and exit code 0.
y is up in the data; the scene turns them so that z is: (x, y, z) -> (x, -z, y).
"""
import pathlib
import re
import sys

if len(sys.argv) != 3:
    sys.exit(__doc__)
data, out = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
if not (data / "positions_P2.xyz").is_file():
    print(f"skipped: no data in {data}. They are published by V. Richefeu as AuthumeQuarryRockfalls_Data-in-Brief (Garcia et al. 2022, Eng. Geol. 310:106855)")
    sys.exit(0)
out.mkdir(parents=True, exist_ok=True)
ZONES = {"hard": "DTM_Gray_zone.stl", "rocky": "DTM_Red_zone.stl", "vegetated": "DTM_Blue_zone.stl"}
CELL = 0.5


def triangles(path):
    points = [tuple(map(float, m)) for m in re.findall(r"vertex\s+(\S+)\s+(\S+)\s+(\S+)", path.read_text())]
    turned = [(x, -z, y) for x, y, z in points]
    return [turned[k:k + 3] for k in range(0, len(turned), 3)]


def write_obj(path, groups):
    index, vertices, faces = {}, [], []
    for t in groups:
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


zones = {name: triangles(data / "terrain" / file) for name, file in ZONES.items()}
write_obj(out / "terrain.obj", [t for z in zones.values() for t in z])

# The class of the ground as a grid: the zone whose triangle covers the centre of a cell in plan, the upper one of several.
everything = [p for z in zones.values() for t in z for p in t]
x0, y0 = (min(p[k] for p in everything) for k in (0, 1))
columns, rows = (int((max(p[k] for p in everything) - (x0, y0)[k]) / CELL) + 1 for k in (0, 1))
grid = [[(0, -1e9)] * columns for _ in range(rows)]
for number, z in enumerate(zones.values(), 1):
    for a, b, c in z:
        det = (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1])
        if abs(det) < 1e-9:
            continue
        for i in range(max(0, int((min(a[1], b[1], c[1]) - y0) / CELL)), min(rows, int((max(a[1], b[1], c[1]) - y0) / CELL) + 1)):
            for j in range(max(0, int((min(a[0], b[0], c[0]) - x0) / CELL)), min(columns, int((max(a[0], b[0], c[0]) - x0) / CELL) + 1)):
                x, y = x0 + (j + 0.5) * CELL, y0 + (i + 0.5) * CELL
                u = ((x - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (y - a[1])) / det
                v = ((b[0] - a[0]) * (y - a[1]) - (x - a[0]) * (b[1] - a[1])) / det
                if u < -1e-9 or v < -1e-9 or u + v > 1 + 1e-9:
                    continue
                height = a[2] + u * (b[2] - a[2]) + v * (c[2] - a[2])
                if height > grid[i][j][1]:
                    grid[i][j] = (number, height)
(out / "zones.asc").write_text(f"ncols {columns}\nnrows {rows}\nxllcorner {x0}\nyllcorner {y0}\ncellsize {CELL}\nNODATA_value -9999\n" +
                               "".join(" ".join(str(c[0]) if c[0] else "-9999" for c in row) + "\n" for row in reversed(grid)))

for file in sorted((data / "blocks").glob("*.stl")):
    # Scans keep their own axes; orientations and places are turned instead.
    write_obj(out / (file.stem + ".obj"), [[(x, -z, y) for x, y, z in t] for t in
                                           ([tuple(map(float, m)) for m in re.findall(r"vertex\s+(\S+)\s+(\S+)\s+(\S+)", file.read_text())][k:k + 3] for k in
                                            range(0, len(re.findall(r"vertex\s", file.read_text())), 3))])
places = [tuple(map(float, line.split())) for line in (data / "positions_P2.xyz").read_text().split("\n") if line.strip()]
quaternions = [tuple(map(float, line.split())) for line in (data / "orientations.txt").read_text().split("\n")[1:] if line.strip()]
blocks = sorted(f.stem for f in (data / "blocks").glob("*.stl"))


def listed(key, values):
    return f'[[ensemble.vary]]\nkey = "{key}"\nlist = [\n' + "".join(f"  {v},\n" for v in values) + "]\n"


interfaces = "".join(f'''[[interface]]
between = ["rock", "{name}"]
friction = {friction}
restitution = {restitution}
normal_stiffness = "hard"
''' for name, friction, restitution in (("hard", 0.55, 0.25), ("rocky", 0.75, 0.15), ("vegetated", 0.9, 0.05)))
areas = "".join(f'[[site.area]]\nraster = "zones.asc"\nvalue = {number}\nmaterial = "{name}"\n' for number, name in enumerate(ZONES, 1) if name != "hard")
(out / "scene.toml").write_text(f'''schema = 1
title = "Authume quarry, profile P2"
[simulation]
duration = "30 s"
until = "rest"
[site]
terrain = "terrain.obj"
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
