#!/usr/bin/env python3
"""Scenes, meshes, grids, polygons and command lines that cannot be right. Each must end with exit code 2 (or the one named), say where, what and
what to do, quickly and without a trace left behind; never crash, hang, or be taken as it is.

    hostile.py TALUS [NAME...]       with names, only these cases, with what was said
"""
import os
import pathlib
import re
import struct
import subprocess
import sys
import tempfile
import time

SECONDS = 20          # a refusal takes no longer, on a crowded machine
MEMORY = 4 << 30      # bytes of address space

SIMULATION = '[simulation]\nduration = "0.1 s"\n'
PLANE = '[[plane]]\nnormal = [0, 0, 1]\nmaterial = "ground"\n'
ROCK = '[[material]]\nname = "rock"\ndensity = 2500\n'
LAWS = '[[interface]]\nbetween = ["*", "*"]\nfriction = 0.5\n'
BLOCK = '[[block]]\nname = "B"\nmaterial = "rock"\nshape = "box"\nsize = [1, 1, 1]\nposition = [0, 0, 3]\n'
CONCRETE = '[[material]]\nname = "C40"\nf_cm = "48 MPa"\n'
COLUMN = ('[[structure]]\nname = "P"\nkind = "column"\nmaterial = "C40"\nbase = [9, 0, 0]\nsection = [1, 1]\nheight = 4\n'
          'cell_size = 0.5\nsupport = ["-z"]\n')
FREE = CONCRETE + ('[[structure]]\nname = "P"\nkind = "box"\nmaterial = "C40"\nposition = {}\nsize = [1, 1, 1]\ncells = [2, 2, 2]\nsupport = []\n'
                   'preload = "none"\ndamage = "none"\ninitial_velocity = [0, 0, 0]\n')
HEAD = "schema = 1\n" + SIMULATION + LAWS + ROCK


def block(**keys):
    """The block with keys replaced (None: left out)."""
    table = {"name": '"B"', "material": '"rock"', "shape": '"box"', "size": "[1, 1, 1]", "position": "[0, 0, 3]", **keys}
    return "[[block]]\n" + "".join(f"{k} = {v}\n" for k, v in table.items() if v is not None)


def column(extra="", **keys):
    table = {"name": '"P"', "kind": '"column"', "material": '"C40"', "base": "[9, 0, 0]", "section": "[1, 1]", "height": "4", "cell_size": "0.5",
             "support": '["-z"]', **keys}
    return CONCRETE + "[[structure]]\n" + "".join(f"{k} = {v}\n" for k, v in table.items() if v is not None) + extra


def site(file, extra=""):
    return f'[site]\nterrain = "{file}"\nmaterial = "ground"\n' + extra


def mass(*lines, sets='[[rock_mass.joint_set]]\norientation = "30/40"\nspacing = 1.0\n'):
    return '[rock_mass]\nmaterial = "rock"\n' + "\n".join(lines) + "\n" + sets


BOX = "box = { min = [0, 0, 1], max = [4, 4, 5] }"
CUBE = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n"
FACES = ["1 4 3 2", "5 6 7 8", "1 2 6 5", "2 3 7 6", "3 4 8 7", "4 1 5 8"]


def cube(faces=FACES, vertices=CUBE):
    return vertices + "".join(f"f {f}\n" for f in faces)


def grid(values="1 2 3\n4 5 6\n7 8 9\n", **keys):
    table = {"ncols": 3, "nrows": 3, "xllcorner": 0, "yllcorner": 0, "cellsize": 5, "NODATA_value": -9999, **keys}
    return "".join(f"{k} {v}\n" for k, v in table.items() if v is not None) + values


def tiff(columns, rows):
    """A GeoTIFF whose header promises so many heights, of which it holds none; cells of 1 m."""
    double, short, long = 12, 3, 4
    tags = [(256, long, 1, columns), (257, long, 1, rows), (258, short, 1, 32), (259, short, 1, 1), (262, short, 1, 1), (273, long, 1, 400), (277, short, 1, 1), (278, long, 1, rows),
            (279, long, 1, 4), (339, short, 1, 3), (33550, double, 3, 200), (33922, double, 6, 224)]
    head = b"II*\0" + struct.pack("<IH", 8, len(tags)) + b"".join(struct.pack("<HHII", *t) for t in tags) + b"\0" * 4
    return head.ljust(200, b"\0") + struct.pack("<9d", 1, 1, 1, 0, 0, 0, 0, 0, 0) + b"\0" * 200


GOOD_GRID = grid()
VIRTUAL = ('<VRTDataset rasterXSize="3" rasterYSize="3"><GeoTransform>0, 5, 0, 15, 0, -5</GeoTransform><VRTRasterBand dataType="Float64" band="1"><SimpleSource>'
           '<SourceFilename relativeToVRT="1">g.asc</SourceFilename><SourceBand>1</SourceBand></SimpleSource></VRTRasterBand></VRTDataset>')
BODY = block()          # the ordinary block
MESH = lambda file: block(shape=None, size=None, file=f'"{file}"')
POLYGON = '{"type": "Polygon", "coordinates": [[[0, 0], [9, 0], [9, 9], [0, 9], [0, 0]]]}'
HEX = ("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n8\n1 0 0 0\n2 1 0 0\n3 1 1 0\n4 0 1 0\n5 0 0 1\n6 1 0 1\n7 1 1 1\n8 0 1 1\n$EndNodes\n"
       "$Elements\n1\n1 5 2 1 1 {}\n$EndElements\n")
MESHED = lambda file: CONCRETE + f'[[structure]]\nname = "M"\nkind = "mesh"\nmaterial = "C40"\nfile = "{file}"\nsupport = ["-z"]\n'
STRIKE = '[impact]\nmaterial = "rock"\nshape = "EOTA111"\ntrajectories = "t.csv"\n'

# name: (scene or arguments, files, words that must be said[, exit code: 0 for what is only warned of])
CASES = {
    # block meshes
    "obj-index-zero": (HEAD + PLANE + MESH("a.obj"), {"a.obj": cube(["0 1 2"])}, ["a.obj"]),
    "obj-index-beyond": (HEAD + PLANE + MESH("a.obj"), {"a.obj": cube(FACES[:5] + ["4 1 5 99"])}, ["a.obj"]),
    "obj-inside-out": (HEAD + PLANE + MESH("a.obj"), {"a.obj": cube([" ".join(reversed(f.split())) for f in FACES])}, ["inside out", "--repair"]),
    "obj-one-face-turned": (HEAD + PLANE + MESH("a.obj"), {"a.obj": cube(["1 2 3 4"] + FACES[1:])}, ["a.obj", "--repair"]),
    "obj-open": (HEAD + PLANE + MESH("a.obj"), {"a.obj": cube(FACES[1:])}, ["a.obj", "--repair"]),
    "obj-flat": (HEAD + PLANE + MESH("a.obj"), {"a.obj": "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 3 2 1\n"}, ["a.obj", "volume"]),
    "obj-two-pieces": (HEAD + PLANE + MESH("a.obj"), {"a.obj": cube() + CUBE.replace("v 0", "v 5").replace("v 1", "v 6") + "".join("f " + " ".join(str(int(i) + 8) for i in f.split()) + "\n" for f in FACES)}, ["a.obj", "pieces"]),
    "obj-crosses-itself": (HEAD + PLANE + MESH("a.obj"), {"a.obj": cube(vertices=CUBE.replace("v 0 0 1\nv 1 0 1", "v 1 0.9 1\nv 0 0.9 1"))}, ["a.obj"]),
    "obj-nan": (HEAD + PLANE + MESH("a.obj"), {"a.obj": cube().replace("v 1 1 1", "v 1 nan 1")}, ["a.obj", "finite"]),
    "obj-huge": (HEAD + PLANE + MESH("a.obj"), {"a.obj": cube().replace("v 1 1 1", "v 1e200 1e200 1e200")}, ["a.obj"]),
    "obj-empty": (HEAD + PLANE + MESH("a.obj"), {"a.obj": ""}, ["a.obj"]),
    "obj-is-a-picture": (HEAD + PLANE + MESH("a.obj"), {"a.obj": b"\x89PNG\r\n\x1a\n\x00\x00" + bytes(range(256))}, ["a.obj"]),
    "mesh-of-unknown-kind": (HEAD + PLANE + MESH("a.dxf"), {"a.dxf": "0\nSECTION\n"}, ["a.dxf", "OBJ"]),
    "stl-count-lies": (HEAD + PLANE + MESH("a.stl"), {"a.stl": b" " * 80 + (4000000000).to_bytes(4, "little") + b"\0" * 100}, ["a.stl"]),
    "stl-cut-short": (HEAD + PLANE + MESH("a.stl"), {"a.stl": "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0"}, ["a.stl"]),
    "ply-negative-count": (HEAD + PLANE + MESH("a.ply"), {"a.ply": "ply\nformat ascii 1.0\nelement vertex -5\nproperty float x\nproperty float y\nproperty float z\nend_header\n"}, ["a.ply"]),
    "off-counts-lie": (HEAD + PLANE + MESH("a.off"), {"a.off": "OFF\n8 999999999 0\n0 0 0\n"}, ["a.off"]),
    # terrain
    "grid-no-columns": (HEAD + site("g.asc") + BODY, {"g.asc": grid(ncols=0)}, ["g.asc"]),
    "grid-negative-cell": (HEAD + site("g.asc") + BODY, {"g.asc": grid(cellsize=-5)}, ["g.asc"]),
    "grid-cell-nan": (HEAD + site("g.asc") + BODY, {"g.asc": grid(cellsize="nan")}, ["g.asc"]),
    "grid-too-few-values": (HEAD + site("g.asc") + BODY, {"g.asc": grid("1 2 3\n4 5\n")}, ["g.asc"]),
    "grid-too-many-values": (HEAD + site("g.asc") + BODY, {"g.asc": grid("1 2 3\n4 5 6\n7 8 9\n10 11 12\n")}, ["g.asc"]),
    "grid-up-to-the-stars": (HEAD + site("g.asc") + BODY, {"g.asc": grid("1 2 3\n4 1e200 6\n7 8 9\n")}, ["g.asc", "1e+200 in row 2, column 2", "NODATA"]),
    "grid-hole-without-nodata": (HEAD + site("g.asc") + BODY, {"g.asc": grid("501 502 503\n504 -9999 506\n507 508 509\n", NODATA_value=None)}, ["g.asc", "1 node of -9999", "for nodes without data"]),
    "grid-words": (HEAD + site("g.asc") + BODY, {"g.asc": grid("1 2 3\n4 five 6\n7 8 9\n")}, ["g.asc"]),
    "grid-gigantic": (HEAD + site("g.asc") + BODY, {"g.asc": grid(ncols=2000000000, nrows=2000000000)}, ["g.asc"]),
    "block-under-terrain": (HEAD + site("g.asc") + block(position="[5, 5, -2]"), {"g.asc": grid()}, ["block.B.position", "below the terrain, which is solid and stands at z = ", "raise it to about z = "]),
    "grid-all-nodata": (HEAD + site("g.asc") + BODY, {"g.asc": grid("-9999 " * 9)}, ["g.asc", "NODATA"]),
    "grid-one-row": (HEAD + site("g.asc") + BODY, {"g.asc": grid("1 2 3\n", nrows=1)}, ["g.asc"]),
    "tif-of-nothing": (HEAD + site("g.tif") + BODY, {"g.tif": b"II*\0" + b"\xff" * 60}, ["g.tif"]),
    "tif-empty": (HEAD + site("g.tif") + BODY, {"g.tif": b""}, ["g.tif"]),
    "json-number-beyond-numbers": (["check", "{dir}/r.json"], {"r.json": '{"schema": 1, "title": 17e439}'}, ["r.json", "17e439"]),
    "tif-of-an-earth": (HEAD + site("g.tif") + BODY, {"g.tif": tiff(60000, 60000)}, ["g.tif", "heights"]),
    "tif-that-names-another": (HEAD + site("g.tif") + BODY, {"g.asc": GOOD_GRID, "g.tif": VIRTUAL}, ["g.tif", "GeoTIFF"]),
    "terrain-is-a-pipe": (HEAD + site("pipe.asc") + BODY, {"pipe.asc": os.mkfifo}, ["pipe.asc", "not a file"]),
    "terrain-is-itself": (HEAD + site("loop.stl") + BODY, {"loop.stl": lambda p: os.symlink("loop.stl", p)}, ["loop.stl"]),
    "terrain-endless": (HEAD + site("/dev/zero") + BODY, {}, ["/dev/zero"]),
    "crop-off-the-map": (HEAD + site("g.asc", "crop = { min = [500, 500], max = [600, 600] }\n") + BODY, {"g.asc": GOOD_GRID}, ["site.crop"]),
    "breaklines-flat": (HEAD + '[site]\nmaterial = "ground"\nbreaklines = "l.geojson"\n' + BODY, {"l.geojson": '{"type": "LineString", "coordinates": [[0, 0], [9, 9]]}'}, ["l.geojson"]),
    "area-two-corners": (HEAD + site("g.asc", 'area = [{ polygon = "p.geojson", material = "rock" }]\n') + BODY, {"g.asc": GOOD_GRID, "p.geojson": '{"type": "Polygon", "coordinates": [[[0, 0], [9, 9]]]}'}, ["p.geojson"]),
    "area-in-degrees": (HEAD + site("g.asc", 'area = [{ polygon = "p.geojson", material = "rock" }]\norigin = [600000, 5200000, 0]\n') + BODY, {"g.asc": grid(xllcorner=600000, yllcorner=5200000), "p.geojson": POLYGON}, ["p.geojson", "degrees of longitude and latitude"]),
    "area-of-nulls": (HEAD + site("g.asc", 'area = [{ polygon = "p.geojson", material = "rock" }]\n') + BODY, {"g.asc": GOOD_GRID, "p.geojson": '{"type": "FeatureCollection", "features": [null, {"type": "Feature", "geometry": null}]}'}, ["p.geojson"]),
    "area-of-texts": (HEAD + site("g.asc", 'area = [{ polygon = "p.geojson", material = "rock" }]\n') + BODY, {"g.asc": GOOD_GRID, "p.geojson": '{"type": "Polygon", "coordinates": [[["a", "b"], [1, 2], [3, 4], [1, 2]]]}'}, ["p.geojson"]),
    "release-beside-the-ground": (HEAD + site("g.asc") + block(position=None, release='{ polygon = "p.geojson", count = 3 }'), {"g.asc": GOOD_GRID, "p.geojson": POLYGON.replace("9", "-900").replace("[0, 0]", "[-990, -990]")}, ["p.geojson"]),
    "release-too-many": (HEAD + site("g.asc") + block(position=None, release='{ polygon = "p.geojson", count = 5000 }'), {"g.asc": GOOD_GRID, "p.geojson": POLYGON}, ["release.count"]),
    # numbers
    "position-out-of-this-world": (HEAD + PLANE + block(position="[1e300, 0, 3]"), {}, ["block.B.position"]),
    "size-like-an-atom": (HEAD + PLANE + block(size="[1e-200, 1e-200, 1e-200]"), {}, ["block.B.size"]),
    "size-like-a-galaxy": (HEAD + PLANE + block(size="[1e200, 1e200, 1e200]", position="[0, 0, 1e201]"), {}, ["block.B"]),
    "plate-without-thickness": (HEAD + PLANE + block(size="[1, 1, 1e-14]"), {}, ["block.B.size"]),
    "density-beyond-stars": (HEAD.replace("2500", "1e300") + PLANE + BODY, {}, ["material.rock.density"]),
    "faster-than-light": (HEAD + PLANE + block(velocity="[1e200, 0, 0]"), {}, ["block.B.velocity"]),
    "spin-like-an-electron": (HEAD + PLANE + block(spin="[0, 0, 1e200]"), {}, ["block.B.spin"]),
    "gravity-of-a-black-hole": (HEAD.replace('"0.1 s"\n', '"0.1 s"\ngravity = [0, 0, -1e200]\n') + PLANE + BODY, {}, ["simulation.gravity"]),
    "rows-without-end": (HEAD + PLANE + BODY + '[output]\nhistory_interval = 1e-300\n', {}, ["output.history_interval"]),
    "fields-without-end": (HEAD + PLANE + BODY + '[output]\ninterval = "1 fs"\n', {}, ["output.interval"]),
    "step-below-rounding": (HEAD.replace('"0.1 s"\n', '"0.1 s"\nstep = 1e-300\n') + PLANE + BODY, {}, ["simulation.step"]),
    "duration-of-ages": (HEAD.replace('"0.1 s"', "1e300") + PLANE + BODY, {}, ["simulation.duration"]),
    "cohesion-infinite": (HEAD.replace("friction = 0.5\n", "friction = 0.5\ncohesion = inf\n") + PLANE + BODY, {}, ["cohesion"]),
    "friction-huge": (HEAD.replace("friction = 0.5", "friction = 1e300") + PLANE + BODY, {}, ["friction"]),
    "vertices-in-a-plane": (HEAD + PLANE + block(shape='"convex"', size=None, vertices="[[0,0,0],[1,0,0],[0,1,0],[1,1,0],[2,1,0]]"), {}, ["block.B.vertices"]),
    "vertices-all-one": (HEAD + PLANE + block(shape='"convex"', size=None, vertices="[[1,1,1],[1,1,1],[1,1,1],[1,1,1]]"), {}, ["block.B.vertices"]),
    "aspect-of-a-hair": (HEAD + PLANE + block(shape='"random-convex"', size=None, volume="1", aspect="[1e12, 1, 1]"), {}, ["block.B.aspect"]),
    "sphere-of-a-million-faces": (HEAD + PLANE + block(shape='"sphere"', size=None, diameter="1", longitudes="1000", latitudes="1000"), {}, ["block.B"]),
    # rock masses
    "joints-without-number": (HEAD + PLANE + mass(BOX, sets='[[rock_mass.joint_set]]\norientation = "30/40"\nspacing = "1 nm"\n'), {}, ["rock_mass.joint_set", "spacing"]),
    "blocks-without-number": (HEAD + PLANE + mass(BOX, sets="".join(f'[[rock_mass.joint_set]]\norientation = "{o}"\nspacing = "5 mm"\n' for o in ("0/90", "90/90", "0/0"))), {}, ["rock_mass.joint_set", "spacing"]),
    "box-inside-out": (HEAD + PLANE + mass("box = { min = [4, 4, 5], max = [0, 0, 1] }"), {}, ["rock_mass.box"]),
    "box-flat": (HEAD + PLANE + mass("box = { min = [0, 0, 1], max = [4, 4, 1] }"), {}, ["rock_mass.box"]),
    "joint-beside-the-rock": (HEAD + PLANE + mass(BOX, sets='[[rock_mass.joint]]\norientation = "30/40"\nthrough = [900, 900, 900]\n'), {}, ["warning: rock_mass.joint", "separates no blocks"], 0),
    "joint-polygon-knotted": (HEAD + PLANE + mass(BOX, sets='[[rock_mass.joint]]\norientation = "0/0"\nthrough = [2, 2, 3]\npolygon = [[1,1,3],[3,3,3],[3,1,3],[1,3,3]]\n'), {}, ["rock_mass.joint", "polygon"]),
    "blocks-obj-of-open-groups": (HEAD + PLANE + mass('blocks = "b.obj"', sets=""), {"b.obj": CUBE + "g R1\nf 1 2 3\ng R2\nf 4 5 6\n"}, ["b.obj"]),
    **{f"group-{name}": (HEAD + PLANE + mass('blocks = "b.obj"', sets=""), {"b.obj": CUBE.encode() + b"# one block\ng " + group + b"\n" + "".join(f"f {f}\n" for f in FACES).encode()}, ["b.obj:10", "a name has 1 to 100 bytes"])
       for name, group in {"of-escape-sequences": b"a\x1b[31mRED\x07", "up-the-directory": b"../x", "of-300-letters": b"x" * 300, "without-name": b"", "in-latin-1": b"Fels\xe9"}.items()},
    "groups-of-one-name": (HEAD + PLANE + mass('blocks = "b.obj"', sets=""), {"b.obj": CUBE + CUBE.replace("v 0", "v 5").replace("v 1", "v 6") + "g a\n" + "".join(f"f {f}\n" for f in FACES) + "g a\n" + "".join("f " + " ".join(str(int(i) + 8) for i in f.split()) + "\n" for f in FACES)}, ["b.obj:24", "group a", "2 pieces"]),
    "blocks-overlap": (HEAD + PLANE + BODY + block(name='"C"', position="[0.3, 0.2, 3.4]"), {}, ["overlaps"]),
    "block-in-the-ground": (HEAD + PLANE + block(position="[0, 0, -5]"), {}, ["block.B"]),
    # structures
    "cells-without-number": (HEAD + PLANE + BODY + column(cell_size=None, cells="[100000, 100000, 100000]"), {}, ["structure.P.cells"]),
    "cells-of-microns": (HEAD + PLANE + BODY + column(cell_size='"1 um"'), {}, ["structure.P.cell_size"]),
    "cells-of-microns-in-a-zone": (HEAD + PLANE + BODY + column("[[structure.refine]]\nregion = { min = [8, -1, 3], max = [10, 1, 5] }\ncell_size = 1e-6\n"), {}, ["scene.toml:", "structure.P.refine", "million cells"]),
    "zone-that-finds-its-own-place-with-a-region": (HEAD + PLANE + BODY + column('[[structure.refine]]\nwhere = "impact"\nregion = { min = [8, -1, 3], max = [10, 1, 5] }\ncell_size = 0.1\n'), {}, ["structure.P.refine.0.region", "finds its own places"]),
    "zone-without-a-place": (HEAD + PLANE + BODY + column('[[structure.refine]]\ncell_size = 0.1\n'), {}, ["structure.P.refine.0.region", "needs its place"]),
    "local-zone-beside-the-structure": (HEAD + PLANE + BODY + column('[[structure.refine]]\nregion = { min = [80, -1, 3], max = [90, 1, 5] }\ncell_size = 0.1\nlocal = true\n'), {}, ["structure.P.refine", "no cell lies in them"]),
    "zones-of-both-kinds": (HEAD + PLANE + BODY + column('[[structure.refine]]\nregion = { min = [8, -1, 3], max = [10, 1, 5] }\ncell_size = 0.1\nlocal = true\n[[structure.refine]]\nregion = { min = [8, -1, 0], max = [10, 1, 1] }\ncell_size = 0.1\n'), {}, ["structure.P.refine.1.local", "same for all zones"]),
    "structure-that-is-held-everywhere": (HEAD + PLANE + BODY + column(cells="[1, 1, 1]", cell_size=None, support='["-z", "+z"]'), {}, ["structure.P.support", "holds every node", 'scheme = "rigid"']),
    "structure-that-is-held-everywhere-and-weightless": (HEAD + PLANE + BODY + column(cells="[4, 4, 1]", cell_size=None, support='["-x", "+x", "-y", "+y", "-z", "+z"]', preload='"none"', damping_ratio="0.02"), {}, ["structure.P.support", "holds every node"]),
    "obstacle-that-is-held-everywhere": (HEAD + PLANE + BODY + column("[[structure.load]]\nregion = { min = [8, -1, 3], max = [9, 1, 4] }\ntraction = [1e6, 0, 0]\n[coupling]\nscheme = \"rigid\"\n", cells="[1, 1, 1]", cell_size=None, support='["-z", "+z"]'), {}, ["structure.P.load", "has no effect"], 0),
    "free-structure-without-a-law": (HEAD.replace(LAWS, '[[interface]]\nbetween = ["rock", "*"]\nfriction = 0.5\n') + PLANE + FREE.format("[9, 0, 0.52]"), {}, ["structure.P.support", "plane 1", "[[interface]]"]),
    "spans-without-number": (HEAD + PLANE + BODY + CONCRETE + '[[structure]]\nname = "V"\nkind = "viaduct"\nmaterial = "C40"\nposition = [20, 0, 0]\ncell_size = 1\nspans = 1e9\n', {}, ["structure.V.spans", "1000"]),
    "bars-by-the-wrong-keys": (HEAD + PLANE + BODY + column("".join(f'[[structure.rebar]]\nkind = "{kind}"\nbars = 8\nspacing = 0.2\ndiameter = "20 mm"\ncover = "40 mm"\n' for kind in ("longitudinal", "stirrups"))), {}, ["structure.P.rebar.0.spacing = 0.2: only stirrups", "structure.P.rebar.1.bars = 8: only longitudinal"], 0),
    "bars-that-break-at-once": (HEAD + PLANE + BODY + column('[[structure.rebar]]\nkind = "longitudinal"\nbars = 8\ndiameter = "20 mm"\ncover = "40 mm"\nultimate_strain = 1e-9\n'), {}, ["structure.P.rebar.0.ultimate_strain"]),
    "support-on-nothing": (HEAD + PLANE + BODY + column(support="[{ point = [500, 0, 0] }]"), {}, ["structure.P.support"]),
    "load-on-what-is-rigid": (HEAD + PLANE + BODY + column("[[structure.load]]\nregion = { min = [8, -1, 3], max = [9, 1, 4] }\ntraction = [1e6, 0, 0]\n[coupling]\nscheme = \"rigid\"\n"), {}, ["structure.P.load", "has no effect"], 0),
    "load-on-nothing": (HEAD + PLANE + BODY + column("[[structure.load]]\nregion = { min = [50, 50, 50], max = [51, 51, 51] }\ntraction = [1e6, 0, 0]\n"), {}, ["structure.P.load"]),
    "probe-far-away": (HEAD + PLANE + BODY + column('[[structure.probe]]\nname = "p"\nat = [5000, 0, 0]\n'), {}, ["structure.P.probe"]),
    "probe-far-away-by-offset": (HEAD + PLANE + BODY + column('[[structure.probe]]\nname = "p"\noffset = [0, 0, 40]\n'), {}, ["structure.P.probe.p.offset = [0, 0, 40]"]),
    "aggregate-without-its-law": (HEAD + PLANE + BODY + column('aggregate = "16 mm"\n'), {}, ["structure.P.aggregate"]),
    "bars-thicker-than-cover": (HEAD + PLANE + BODY + column('[[structure.rebar]]\nkind = "longitudinal"\nbars = 8\ndiameter = "20 mm"\ncover = "700 mm"\n'), {}, ["structure.P.rebar"]),
    "bars-outside": (HEAD + PLANE + BODY + column(rebar='"bars.csv"'), {"bars.csv": "bar,x,y,z,diameter\n1,500,0,0,0.02\n1,500,0,4,0.02\n"}, ["bars.csv"]),
    "bars-of-decimal-commas": (HEAD + PLANE + BODY + column(rebar='"bars.csv"'), {"bars.csv": "bar,x,y,z,diameter,grade\n1,8,7,0,3,0,1,0,02,B500\n"}, ["bars.csv:2", "are the commas decimal ones?"]),
    "bars-of-words": (HEAD + PLANE + BODY + column(rebar='"bars.csv"'), {"bars.csv": "these are\nno bars\n"}, ["bars.csv"]),
    "msh-inside-out": (HEAD + PLANE + BODY + MESHED("m.msh"), {"m.msh": HEX.format("5 6 7 8 1 2 3 4")}, ["m.msh"]),
    "msh-cell-twice": (HEAD + PLANE + BODY + MESHED("m.msh"), {"m.msh": HEX.format("1 2 3 4 5 6 7 8").replace("$Elements\n1\n", "$Elements\n2\n2 5 2 1 1 1 2 3 4 5 6 7 8\n")}, ["m.msh", "cell 1", "cell 2"]),
    "msh-node-missing": (HEAD + PLANE + BODY + MESHED("m.msh"), {"m.msh": HEX.format("1 2 3 4 5 6 7 99")}, ["m.msh"]),
    "msh-without-cells": (HEAD + PLANE + BODY + MESHED("m.msh"), {"m.msh": HEX.format("")}, ["m.msh"]),
    "inp-of-shells": (HEAD + PLANE + BODY + MESHED("m.inp"), {"m.inp": "*NODE\n1,0,0,0\n2,1,0,0\n3,1,1,0\n4,0,1,0\n*ELEMENT, TYPE=S4\n1,1,2,3,4\n"}, ["m.inp"]),
    "impact-that-flies-away": (["impact", "{scene}", "-o", "{dir}/out"], {"scene.toml": HEAD + column() + STRIKE, "t.csv": "x,y,z,vx,vy,vz,mass\n8,0,2,-10,0,0,500\n"}, ["scene.toml:", "impact.trajectories", "row 1 (line 2)", "flies away"]),
    "impact-faster-than-light": (["impact", "{scene}", "-o", "{dir}/out"], {"scene.toml": HEAD + column() + STRIKE, "t.csv": "x,y,z,vx,vy,vz,mass\n8,0,2,1e200,0,0,500\n"}, ["impact.trajectories", "row 1 (line 2)", "vx = 1e+200"]),
    # texts, paths, references
    "names-of-control-characters": (HEAD + PLANE + block(name='"B\\u0007\\u001b[31m"'), {}, ["name"]),
    "title-of-escape-sequences": ('schema = 1\ntitle = "\\u001b[31mred"\n' + SIMULATION + LAWS + ROCK + PLANE + BODY, {}, ["title", "one line"]),
    "title-of-two-lines": ('schema = 1\ntitle = """a\nb"""\n' + SIMULATION + LAWS + ROCK + PLANE + BODY, {}, ["title", "one line"]),
    "block-named-like-a-piece": (HEAD + PLANE + block(name='"P.fragment1"') + column(), {}, ["block.P.fragment1.name", "pieces of structure P"]),
    "rock-mass-named-like-pieces": (HEAD + PLANE + mass(BOX, 'prefix = "P.fragment"') + column(), {}, ["rock_mass.prefix", "pieces of structure P"]),
    "group-named-like-a-piece": (HEAD + PLANE + mass('blocks = "b.obj"', sets="") + column(), {"b.obj": "g P.fragment12\n" + cube()}, ["b.obj:1", "pieces of structure P"]),
    "names-alike-but-for-case-of-unicode": (HEAD + PLANE + block(name='"\u00e9"') + block(name='"\u00e9"', position="[5, 0, 3]"), {}, ["taken already"]),
    "name-of-a-thousand-letters": (HEAD + PLANE + block(name='"' + "x" * 1000 + '"'), {}, ["name"]),
    "utf-16-cut-short": (("\ufeff" + HEAD + PLANE + BODY).encode("utf-16-le")[:-1], {}, ["scene.toml", "cut short"]),
    "utf-32": (("\ufeff" + HEAD + PLANE + BODY).encode("utf-32-le"), {}, ["scene.toml", "UTF-32"]),
    "zero-bytes": ((HEAD + PLANE + BODY).replace("rock", "ro\0ck"), {}, ["scene.toml"]),
    "state-of-itself": (HEAD.replace('"0.1 s"\n', '"0.1 s"\ninitial_state = "scene.toml"\n') + PLANE + BODY, {}, ["no HDF5 file"]),
    "state-of-noise": (HEAD.replace('"0.1 s"\n', '"0.1 s"\ninitial_state = "r.h5"\n') + PLANE + BODY, {"r.h5": b"\x89HDF\r\n\x1a\n" + b"\x07" * 500}, ["r.h5"]),
    "output-in-a-file": (["run", "{scene}", "-o", "{scene}"], {"scene.toml": HEAD + PLANE + BODY}, ["scene.toml"]),
    # command lines
    "set-nothing": (["check", "{scene}", "--set", "=5"], {"scene.toml": HEAD + PLANE + BODY}, ["--set"]),
    "set-no-such-block": (["check", "{scene}", "--set", "block.B9.size=[1,1,1]"], {"scene.toml": HEAD + PLANE + BODY}, ["B9"]),
    "set-words": (["check", "{scene}", "--set", "simulation.step=soon"], {"scene.toml": HEAD + PLANE + BODY}, ["simulation.step"]),
    "threads-of-words": (["run", "{scene}", "--threads", "many"], {"scene.toml": HEAD + PLANE + BODY}, ["--threads"]),
    "report-of-nothing": (["report", "{dir}/nowhere"], {}, ["nowhere"]),
    "report-of-a-stranger": (["report", "{dir}"], {"photo.jpg": "x"}, ["holds no results"]),
    "capacity-without-structure": (["capacity", "{dir}"], {"photo.jpg": "x"}, ["Talus"]),
    "convert-unknown": (["convert", "{dir}/a.obj", "{dir}/a.xyz"], {"a.obj": cube()}, ["a.xyz"]),
    "convert-surface-to-solid": (["convert", "{dir}/a.obj", "{dir}/a.msh"], {"a.obj": cube()}, ["a.msh"]),
    "convert-empty-solid": (["convert", "{dir}/a.inp", "{dir}/a.msh"], {"a.inp": "*NODE\n1, 0, 0, 0\n"}, ["a.inp"]),
    "convert-onto-itself": (["convert", "{dir}/a.obj", "{dir}/a.obj"], {"a.obj": cube()}, ["a.obj"]),
    "formulas-negative": (["formulas", "--mass", "-5", "--velocity", "10"], {}, ["--mass"]),
    "formulas-nan": (["formulas", "--mass", "5", "--velocity", "nan"], {}, ["--velocity"]),
    "explain-nonsense": (["explain", "blok.size"], {}, ["block"]),
    "verify-of-nothing": (["verify", "coupling/C2b", "--quick"], {}, ["--quick", "C2b"]),
    "verify-nonsense": (["verify", "everything"], {}, ["everything"]),
}


def lay_out(directory, files):
    for name, content in files.items():
        path = directory / name
        if callable(content):
            content(str(path))
        elif isinstance(content, bytes):
            path.write_bytes(content)
        else:
            path.write_text(content)


def limited():
    import resource
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))


def attempt(talus, name, directory):
    """None, or what is wrong with the answer; and the answer."""
    what, files, words, *code = CASES[name]
    code = code[0] if code else 2
    lay_out(directory, files)
    scene = directory / "scene.toml"
    if isinstance(what, list):
        arguments = [a.format(scene=scene, dir=directory) for a in what]
    else:
        scene.write_bytes(what if isinstance(what, bytes) else what.encode())
        arguments = ["check", str(scene)]
    before = {p: p.lstat().st_mtime_ns for p in directory.rglob("*")}
    start = time.monotonic()
    try:
        result = subprocess.run([talus, *arguments], capture_output=True, timeout=SECONDS, preexec_fn=limited, cwd=directory)
    except subprocess.TimeoutExpired:
        return f"no answer in {SECONDS} s", ""
    text = (result.stdout + result.stderr).decode("utf-8", "replace")
    if result.returncode != code:
        return f"exit code {result.returncode}", text
    if not re.search(r"\berror\b" if code else r"\bwarning\b", text):
        return "no error named", text
    if "; " not in text:
        return "no remedy", text
    missing = [w for w in words if w not in text]
    if missing:
        return f"says nothing of {missing}", text
    if "\x1b" in text or "\x07" in text:
        return "control characters of the input in the message", text
    if {p: p.lstat().st_mtime_ns for p in directory.rglob("*")} != before:
        return "left something behind", text
    return None, f"{text}({time.monotonic() - start:.1f} s)"


def main():
    talus, wanted = str(pathlib.Path(sys.argv[1]).resolve()), sys.argv[2:]
    failures = 0
    for name in wanted or CASES:
        with tempfile.TemporaryDirectory(prefix="talus-hostile-") as work:
            wrong, text = attempt(talus, name, pathlib.Path(work))
        if wrong:
            failures += 1
            print(f"FAIL {name}: {wrong}\n{text[-1200:]}")
        elif wanted:
            print(f"ok   {name}\n{text}")
    print(f"{len(wanted or CASES) - failures} of {len(wanted or CASES)} refused as they should be")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
