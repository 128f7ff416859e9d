"""What is said of scenes that are hardly meant: structures in the air or under ground, slips of units, cells by the billion; of runs that show nothing of what was
meant: blows that miss, blocks beside the terrain, piers that are lost.
At the end the design checks of a slab: depth and ratio from its bars.

Usage: warnings.py TALUS DIRECTORY
"""
import json
import math
import pathlib
import re
import resource
import shutil
import struct
import subprocess
import sys

talus, out = sys.argv[1], pathlib.Path(sys.argv[2])
shutil.rmtree(out, ignore_errors=True)
out.mkdir(parents=True)

# A slope of 1 in 4, 1 m at x = 0.
(out / "slope.asc").write_text("ncols 11\nnrows 11\nxllcenter 0\nyllcenter 0\ncellsize 10\n" + "\n".join(" ".join(str(1 + 2.5 * i) for i in range(11)) for _ in range(11)) + "\n")
materials = """[[material]]
name = "rock"
density = "2.6 t/m^3"
[[material]]
name = "C30"
f_cm = "38 MPa"
[[interface]]
between = ["*", "*"]
friction = 0.6
normal_stiffness = "hard"
"""
base = """schema = 1
[simulation]
duration = "1 s"
[site]
terrain = "slope.asc"
material = "ground"
""" + materials + """[[block]]
name = "B"
material = "rock"
shape = "sphere"
diameter = "1 m"
position = [80, 80, 40]
"""
column = """[[structure]]
name = "P"
kind = "column"
material = "C30"
base = [20, 50, %s]
section = [2, 2]
height = 10
cell_size = "%s"
"""
viaduct = """[[structure]]
name = "V"
kind = "viaduct"
material = "C30"
position = [20, 50, %s]
spans = %s
span_length = "20 m"
cell_size = "0.8 m"
"""


def check(text, *settings):
    (out / "scene.toml").write_text(text)
    done = subprocess.run([talus, "check", "scene.toml", *settings], cwd=out, capture_output=True, text=True, timeout=120)
    return done.returncode, done.stdout, done.stderr


failures = 0


def expect(what, got, code, *parts, absent=()):
    """The exit code, parts of what is printed, and parts that are not."""
    global failures
    text = got[1] + got[2]
    wrong = [p for p in parts if p not in text] + [f"not {p}" for p in absent if p in text]
    if got[0] != code or wrong:
        failures += 1
        print(f"{what}: exit code {got[0]}, expected {code}; lacks {wrong}:\n{text}")


# talus impact takes the terrain that a viaduct stands on without the hollow of a rock mass.
hollow = """[rock_mass]
from_terrain = true
box = { min = [70, 60, 0], max = [80, 70, 40] }
material = "rock"
[impact]
material = "rock"
shape = "sphere"
diameter = 1
velocity = [10, 0, 0]
point = [20, 50, 20]
"""
(out / "scene.toml").write_text(base + viaduct % ("0", "2") + 'deck_level = "40 m"\n' + hollow)
done = subprocess.run([talus, "impact", "scene.toml", "-o", "hollow"], cwd=out, capture_output=True, text=True, timeout=120)
expect("a hollow under a viaduct", (done.returncode, done.stdout, done.stderr), 2, "rock_mass", "without the hollow")

# Ground under the column at x = 20: z = 6 in the middle, 6.25 on the high side, 5.75 on the low one.
expect("column on its ground", check(base + column % ("6", "1 m")), 0, "No problems found")
expect("column in the air", check(base + column % ("20.25", "1 m")), 0, "hangs 14 m above the ground under it (z = 6.25)", "1 warning")
expect("column under ground", check(base + column % ("0.75", "1 m")), 0, "lies 5 m below the ground (z = 5.75)", "1 warning")
expect("column beside the terrain", check(base + (column % ("6", "1 m")).replace("base = [20", "base = [2000")), 0, "no ground lies under it")
on_plane = base.replace('[site]\nterrain = "slope.asc"\n', "[[plane]]\npoint = [0, 0, 6]\nnormal = [0, 0, 1]\n")
expect("column on a plane", check(on_plane + column % ("6", "1 m")), 0, "No problems found")
expect("column above a plane", check(on_plane + column % ("20", "1 m")), 0, "hangs 14 m above the ground under it (z = 6)", "1 warning")
expect("millimetres above a plane", check(on_plane, "--set", "block.B.position=[80, 80, 4000]"), 0, "starts 3994 m above the ground under it (z = 6)", "check the unit", "1 warning")
load = "[[structure.load]]\nregion = { min = [18, 48, 5], max = [22, 52, 17] }\ntraction = [2, 0, 0]\nhistory = [[0, 0], [0.005, %s], [0.01, 0]]\n"
expect("traction in MPa", check(base + column % ("6", "1 m") + load % 1), 0, "2 Pa at most is next to nothing", "1 warning")
expect("traction by its history", check(base + column % ("6", "1 m") + load % 1e6), 0, "No problems found")
expect("viaduct in the air", check(base + viaduct % ("30", "2")), 0, "foot P1 at [20, 50, 30]", "hangs 24 m above", "deck_level")
expect("viaduct on its ground", check(base + viaduct % ("0", "2") + 'deck_level = "40 m"\n'), 0, "P2: foot at [40, 50, 11]", "Axis along [1, 0, 0]", "Permanent load on its supports", absent=["hangs"])
expect("half a span", check(base + viaduct % ("6", "2.5")), 2, "spans = 2.5: must be a whole number")
expect("two heights", check(base + viaduct % ("6", "2") + "deck_level = 30\npier_height = 8\n"), 2, "deck_level", "keep one of them")

before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss
expect("cells of 1 mm", check(base + column % ("6", "1 mm")), 2, "structure.P.cell_size = 0.001 m: makes about 4e+04 million cells", "take cells of")
expect("viaduct with cells of 5 mm", check(base + (viaduct % ("6", "2")).replace('"0.8 m"', '"5 mm"')), 2, "million cells", "take cells of")
assert resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss <= max(before, 300e3), "it was meshed"

expect("f_cm in MPa", check(base.replace('"38 MPa"', "38") + column % ("6", "1 m")), 2, 'did you mean "38 MPa"?', absent=["no density", "neither f_cm"])
expect("feet", check(base.replace('"1 m"', '"3 ft"')), 2, 'unknown unit "ft": 1 ft = 0.3048 m')
expect("no unit at all", check(base.replace('"1 m"', '"3 ells"')), 2, 'unknown unit "ells"; known are m g t s')
expect("tonnes as kilograms", check(base.replace('"2.6 t/m^3"', "2.6")), 0, "2.6 kg/m^3 is no rock", "1 warning")
# One cause, one error.
expect("no face", check(base + column % ("6", "1 m") + 'support = ["z"]\npreload = "gravity"\n'), 2, '"z" is no face', absent=["no state at rest", "2 errors"])
expect("no concrete", check(base + (column % ("6", "1 m")).replace("C30", "rock") + 'damage = "concrete"\n[[structure.rebar]]\nkind = "longitudinal"\nbars = 8\ndiameter = "20 mm"\ncover = "40 mm"\n'), 2, "has neither f_cm nor young", absent=["errors;", "needs a concrete", "bars are embedded"])
expect("gravity", check(base, "--set", "simulation.gravity=[0, 0, 9.81]"), 0, "points upwards")
# Numbers that are allowed and hardly meant: one warning each, with the number as it was understood.
for setting, part in (
    ("simulation.gravity=[0, 0, -9810]", "9810 m/s^2 is not that of the earth"),
    ("simulation.gravity=[0, -9.81, 0]", "points sideways; z is up"),
    ("interface.*/*.cohesion=50", 'did you mean "50 kPa"?'),
    ("interface.*/*.vegetation={ height = 3000, drag = 250 }", "3000 m is the height of no plant"),
    ('simulation.step="0.5 s"', "a block falls 1.23 m in one such step"),
    ('simulation.duration="100000 s"', "is 27.8 h: rocks fall for seconds to minutes"),
    ("block.B.velocity=[0, 0, -500]", "500 m/s is faster than rocks fall"),
    ("block.B.spin=[600, 0, 0]", "600 rad/s is faster than rocks turn"),
    ("block.B.orientation={ rotation_vector = [0, 0, 90] }", 'turns by 90 rad, more than once about; bare numbers are in rad: write each with its unit, "30 deg"'),
    ('block.B.orientation={ rotation_vector = [0, 0, "90 deg"] }', "No problems found"),
    ("block.B.velocity=[0, 0, -50]", "No problems found"),
):
    expect(setting, check(base, "--set", setting), 0, part, "1 warning" if "No" not in part else "found", absent=["2 warnings"])
expect("millimetres a second", check(base, "--set", "interface.*/*.restitution=0.3", "--set", "interface.*/*.restitution_half_speed=9144"), 0, "9144 m/s is a speed that no rock strikes with", "1 warning")
expect("half of critical damping", check(base + column % ("6", "1 m") + "damping_ratio = 0.5\n"), 0, "50 % of critical damping has no concrete", "1 warning")
expect("sand grain", check(base.replace('"1 m"', '"1 um"')), 0, "smaller than a cubic millimetre")
expect("map height", check(base, "--set", "block.B.position=[80, 80, 2400]"), 0, "starts 2379 m above the ground under it (z = 21)")
# A box of 1 m: its corner at x = 80.5, z = 39.5 stands over ground at z = 21.125.
# A block from a file that names its unit, or that holds a map's coordinates in single precision.
corners = [(x, y, z) for z in (0, 1) for y in (0, 1) for x in (0, 1)]
faces = [(0, 2, 3), (0, 3, 1), (4, 5, 7), (4, 7, 6), (0, 1, 5), (0, 5, 4), (2, 6, 7), (2, 7, 3), (0, 4, 6), (0, 6, 2), (1, 3, 7), (1, 7, 5)]
(out / "feet.obj").write_text("# units: ft\n" + "".join("v %g %g %g\n" % v for v in corners) + "".join("f %d %d %d\n" % tuple(k + 1 for k in f) for f in faces))
(out / "map.ply").write_bytes(
    b"ply\nformat binary_little_endian 1.0\nelement vertex 8\nproperty float x\nproperty float y\nproperty float z\nelement face 12\nproperty list uchar int vertex_indices\nend_header\n"
    + b"".join(struct.pack("<3f", 600000 + x, 5200000 + y, z) for x, y, z in corners) + b"".join(struct.pack("<B3i", 3, *f) for f in faces))
of_file = base.replace('shape = "sphere"\ndiameter = "1 m"', 'file = "%s"')
expect("a block in feet", check(of_file % "feet.obj"), 0, "ft: is the unit that the head of the file names", "1 warning")
expect("a block in feet, of a mass", check(of_file % "feet.obj" + 'mass = "2 t"\n'), 0, "No problems found")
expect("a block in map coordinates", check(of_file % "map.ply"), 0, "this file keeps seven digits, here steps of 0.5 m", "1 warning")
# A structure from a mesh in millimetres: by its head, or by cells that no structure has.
def plate(head, scale):
    nodes = [(x, y, z) for z in (0, 0.1) for y in (0, 0.5, 1) for x in (0, 0.5, 1)]
    cells = [(i + 3 * j, i + 3 * j + 1, i + 3 * j + 4, i + 3 * j + 3) for j in (0, 1) for i in (0, 1)]
    return (head + "*NODE\n" + "".join("%d, %g, %g, %g\n" % (k + 1, *(scale * c for c in n)) for k, n in enumerate(nodes)) + "*ELEMENT, TYPE=C3D8\n"
            + "".join("%d, %s\n" % (k + 1, ", ".join(str(n + 1 + layer) for layer in (0, 9) for n in c)) for k, c in enumerate(cells)))


meshed = base + '[[structure]]\nname = "M"\nkind = "mesh"\nmaterial = "C30"\nfile = "plate.inp"\nposition = [20, 50, %s]\n'
for head, scale, z, part, absent in (("** Units: mm\n", 1, 7, "mm: is the unit that the head of the file names", []), ("", 200, 60, "no structure is computed by cells of 80 m", []),
                                     ("", 1, 7, "Structure M: 4 elements", ["the unit that", "no structure is"]), ("** cells of 500 mm\n", 1, 7, "Structure M: 4 elements", ["the unit that"])):
    (out / "plate.inp").write_text(plate(head, scale))
    expect(f"a mesh headed {head!r}, of {scale} m", check(meshed % z), 0, part, absent=absent)
# By the mesh as it stands in the file, and before all that follows from its size.
(out / "plate.inp").write_text(plate("", 1000))
expect("a mesh in millimetres", check(meshed % 6000), 0, "warning: structure.M.file = 1000 x 1000 x 100 m: no structure is computed by cells of")
got = check(meshed % 6000 + 'damage = "concrete"\n')
expect("a concrete mesh in millimetres", got, 2, "error: structure.M.file = 1000 x 1000 x 100 m: no structure", "in millimetres it would be 1 x 1 x 0.1 m", absent=["snap back"])
# An area of copies of which a part lies beside the ground; a rock mass beside it: one fault, one warning.
ring = lambda a, b: {"type": "Polygon", "coordinates": [[[a, 20], [b, 20], [b, 80], [a, 80], [a, 20]]]}
copies = base.replace('position = [80, 80, 40]', 'release = { polygon = "copies.geojson", count = 3 }')
for ends, part, absent in (((60, 140), "50 % of the area has no ground below", []), ((20, 80), "No problems found", ["no ground below"])):
    (out / "copies.geojson").write_text(json.dumps(ring(*ends)))
    expect(f"copies from {ends}", check(copies), 0, part, absent=absent)
cut = base + """[rock_mass]
box = { min = [300, 300, 10], max = [306, 306, 16] }
material = "rock"
[[rock_mass.joint_set]]
orientation = "0/0"
spacing = "2 m"
[[rock_mass.joint_set]]
orientation = "90/90"
spacing = "2 m"
%s"""
expect("a rock mass beside the terrain", check(cut % ""), 0, "rock_mass = ", " of its blocks, one at [", "lies beside the terrain", "1 warning", absent=["block.R"])
# Numbers without their unit, wherever a friction or a strength may stand.
for more, part in (("friction = 35", "rock_mass.joint_set.1.friction = 35: a number without a unit is the coefficient"), ('friction = "35 deg"', "1 warning")):
    expect(more, check(cut % more), 0, part)
soft = base.replace('normal_stiffness = "hard"', 'normal_stiffness = "50 MPa/m"\n%s')
for more, part in (("slip_friction = { most = 35, length = 0.5 }", "slip_friction.most = 35: a number without a unit is the coefficient"), ("slip_friction = { most = 2, length = 0.5 }", "No problems found"),
                   ('contact_law = { kind = "crushing", pressure = 0.2 }', '0.2 Pa is the strength of no ground or cushion; a bare number is in Pa: did you mean "0.2 MPa"?'),
                   ('contact_law = { kind = "crushing", pressure = "0.2 MPa" }', "No problems found")):
    expect(more, check(soft % more), 0, part)
expect("friction as a text", check(base.replace("friction = 0.6", 'friction = "1e300"')), 2, "friction", "must not exceed 1e+06")
# What run refuses of a line, check does.
line = '[[line]]\nname = "road"\n'
for crs in ("EPSG:2263", "EPSG:31254"):
    (out / "road.geojson").write_text(json.dumps({"type": "LineString", "crs": {"type": "name", "properties": {"name": crs}}, "coordinates": [[10, 10], [90, 90]]}))
    line_says = check(base + line + 'file = "road.geojson"\n')
    expect(f"a line in {crs}", line_says, *((2, "US survey foot") if crs == "EPSG:2263" else (0, "No problems found")))
(out / "topology.geojson").write_text('{"type": "Topology", "arcs": []}')
expect("a line off the terrain", check(base + line + "points = [[1000, 0], [1000, 60]]\n"), 2, "lies off the terrain")
expect("a line of another system", check(base.replace('terrain = "slope.asc"', 'terrain = "slope.asc"\ncrs = "EPSG:25832"') + line + 'file = "road.geojson"\n'), 2, "is in another coordinate system")
expect("a file without a line", check(base + line + 'file = "topology.geojson"\n'), 2, "holds no line")
expect("a file by another case", check(base.replace("slope.asc", "Slope.asc")), 2, 'there is no file', 'did you mean "slope.asc"?')
expect("milli for mega", check(base.replace('"38 MPa"', '"38 mPa"') + column % ("6", "1 m")), 2, 'm is milli, M mega: did you mean "38 MPa"?')
expect("height at the start", check(base.replace('"sphere"\ndiameter = "1 m"', '"box"\nsize = [1, 1, 1]')), 0, "Start: 18.4 m above the ground, vertically below the lowest corner. The ground under them dips by")
expect("no friction", check(base.replace("friction = 0.6\n", "")), 2, "add friction = ...; Friction: an angle with a unit", absent=["(a coefficient"])
expect("in the ground", check(base, "--set", "block.B.position=[80, 80, 21.3]"), 2, "raise it by 0.201 m or more, to z = 21.501")
expect("out of the ground", check(base, "--set", "block.B.position=[80, 80, 21.501]"), 0, "No problems found")
expect("in a column", check(base + column % ("6", "1 m"), "--set", "block.B.position=[21.3, 50, 12]"), 2, "move it by [0.2, 0, 0] m or farther")
# Fewer than three cells across where damage is asked for; three to five are told in the plan, six and more not at all.
for size, expected, absent in (("0.68 m", "Damage of P: 3 cells across its smallest section (2 m)", "makes 3"), ("0.5 m", "Damage of P: 4 cells across its smallest section (2 m)", "makes 4"), ("0.33 m", "No problems found", "Damage of P")):
    expect(f"cells of {size} with damage", check(base + column % ("6", size) + 'damage = "concrete"\n'), 0, expected, absent=[absent])
# A round section by its facets: what a blow meets.
round_column = column.replace("section = [2, 2]", 'section = "round"\ndiameter = "1.5 m"')
for size, expected, absent in (("0.2 m", "Round section of P: 24 facets of 0.2 m around, 8 cells across.", "wants"), ("0.5 m", "Round section of P: 12 facets of 0.39 m around, 5 cells across; a blow wants 24 facets or more (cells of 0.19 m or less)", "finer")):
    expect(f"round, cells of {size}", check(base + round_column % ("6", size)), 0, expected, absent=[absent])
# The cells by what the file says, and the slip by the block: 5 for 5 t.
small = base.replace('shape = "sphere"\ndiameter = "1 m"', 'shape = "box"\nmass = 5')
expect("5 kg for 5 t", check(small + round_column % ("6", "0.25 m")), 0, "structure.P.cell_size = 0.25 m", "B of 5 kg with 0.124 m the thinnest", "a mass without a unit is in kg", "cells of 0.24 m or less")
expect("cells of 1 m without damage", check(base + column % ("6", "1 m")), 0, "No problems found", absent=["Damage of P"])
expect("fragments off", check(base + column % ("6", "0.33 m") + 'damage = "concrete"\n[coupling]\nfragments = false\n'), 0, "No problems found", "Fragments: off; parts that lose their support stay in the mesh")

# Problems that show when the world is built: all of them at once, each with its place in the file.
text = base.replace("position = [80, 80, 40]", "position = [80, 80, 21.3]") + column % ("6", "0.5 m") + 'damage = "concrete"\n[[structure.rebar]]\nkind = "longitudinal"\nbars = 8\ndiameter = "28 mm"\ncover = "0.99 m"\n[[structure.probe]]\nname = "far"\nat = [500, 50, 12]\n'
text += column.replace('"P"', '"Q"') % ("6", "1 mm")
at = {key: 1 + text[:text.rfind(key)].count("\n") for key in ('cover = "0.99 m"', 'cell_size = "1 mm"', "position = [80, 80, 21.3]")}
expect("several at once", check(text), 2, f"scene.toml:{at['cell_size = ' + chr(34) + '1 mm' + chr(34)]}:", "structure.Q.cell_size", "structure.P.rebar", "leaves no room for the bars")
text = base.replace("position = [80, 80, 40]", "position = [80, 80, 21.3]") + column % ("6", "1 m") + '[[structure.probe]]\nname = "far"\nat = [500, 50, 12]\n'
expect("overlap and probe", check(text), 2, f"scene.toml:{at['position = [80, 80, 21.3]']}:12: error: block.B.position", "raise it by 0.201 m", f"scene.toml:{1 + text[:text.index('at = [500')].count(chr(10))}:", "structure.P.probe.far.at")

# Grids in degrees, and pictures without a place.
degrees = "ncols 11\nnrows 11\nxllcenter 11.2\nyllcenter 47.1\ncellsize 0.0001\n"
(out / "degrees.asc").write_text(degrees + "\n".join(" ".join(str(1500 + 2.5 * i) for i in range(11)) for _ in range(11)) + "\n")
expect("a grid in degrees", check(base.replace("slope.asc", "degrees.asc")), 2, "looks like degrees of longitude and latitude", "gdalwarp")


def tiff(name, extra=()):
    """4 x 4 heights of a byte; `extra` tags as (number, type, values), types 3 (16 bit) and 12 (double)."""
    tags = [(256, 3, [4]), (257, 3, [4]), (258, 3, [8]), (259, 3, [1]), (262, 3, [1]), (273, 4, [0]), (277, 3, [1]), (278, 3, [4]), (279, 4, [16]), *extra]
    data_at, data, entries = 8 + 2 + 12 * len(tags) + 4, bytes(range(16)), b""
    for number, kind, values in tags:
        packed = struct.pack("<%d%s" % (len(values), {3: "H", 4: "I", 12: "d"}[kind]), *(values if number != 273 else [data_at]))
        if len(packed) > 4:
            packed, data = struct.pack("<I", data_at + len(data)), data + packed
        entries += struct.pack("<HHI", number, kind, len(values)) + packed.ljust(4, b"\0")
    (out / name).write_bytes(struct.pack("<2sHIH", b"II", 42, 8, len(tags)) + entries + struct.pack("<I", 0) + data)


tiff("picture.tif")
expect("a TIFF without a place", check(base.replace("slope.asc", "picture.tif")), 2, "is a picture without a place", "gdal_translate", absent=["give an ESRI ASCII grid"])
tiff("wgs84.tif", [(33550, 12, [0.0001, 0.0001, 0]), (33922, 12, [0, 0, 0, 11.2, 47.1, 0]), (34735, 3, [1, 1, 0, 3, 1024, 0, 1, 2, 1025, 0, 1, 1, 2048, 0, 1, 4326])])
expect("a GeoTIFF in degrees", check(base.replace("slope.asc", "wgs84.tif")), 2, "is in degrees of longitude and latitude (EPSG:4326)", "gdalwarp")


def run(name, text, *settings, command="run"):
    (out / f"{name}.toml").write_text(text)
    done = subprocess.run([talus, command, f"{name}.toml", "-o", name, *settings], cwd=out, capture_output=True, text=True, timeout=120)
    return (done.returncode, done.stdout, done.stderr), json.loads((out / name / "summary.json").read_text()) if done.returncode == 0 else {}


def require(what, good, text):
    global failures
    if not good:
        failures += 1
        print(f"{what}:\n{text}")


# What check warns of is told by a run, in its summary and its report too, once.
got, summary = run("slip", base.replace("friction = 0.6", "friction = 35"), "--set", 'simulation.duration="20 ms"')
expect("warned at the start", got, 0, "unusually large")
require("told once", got[2].count("unusually large") == 1, got[2])
require("in the summary", [w.startswith("slip.toml:") and "interface.*/*.friction = 35: " in w for w in summary.get("warnings", [])] == [True], summary.get("warnings"))
require("in the report", "unusually large" in (out / "slip/report.html").read_text(), "report.html")

# A word that is no command.
for word, remedy in [("chek", 'did you mean "check"?'), ("scene.toml", "for example talus run scene.toml"), ("weather", "the commands are ")]:
    done = subprocess.run([talus, word, "scene.toml"], cwd=out, capture_output=True, text=True, timeout=120)
    expect(word, (done.returncode, done.stdout, done.stderr), 2, f'there is no command "{word}"', remedy)

# A grid that cannot be read: what would stand on it is not told beside it.
(out / "comma.asc").write_text((out / "slope.asc").read_text().replace("3.5", "3,5"))
(out / "source.geojson").write_text('{"type": "Polygon", "coordinates": [[[70, 70], [90, 70], [90, 90], [70, 90], [70, 70]]]}')
released = base.replace("slope.asc", "comma.asc").replace("position = [80, 80, 40]", 'release = { polygon = "source.geojson" }')
got = check(released)
expect("a grid with decimal commas", got, 2, "has a decimal comma", absent=["no place of the area", "2 errors"])

# A source area beside the terrain, or of corners on a line: one cause, told once.
released = released.replace("comma.asc", "slope.asc")
square = (out / "source.geojson").read_text()
(out / "source.geojson").write_text(square.replace("[70,", "[970,").replace("[90,", "[990,"))
expect("an area beside the terrain", check(released), 2, "no place of the area lies over the terrain", absent=["warning:"])
(out / "source.geojson").write_text(square.replace("90]", "70]"))
expect("an area of no width", check(released), 2, "holds no polygon that encloses an area", absent=["degrees", "warning:"])

# A grid of one row is no surface, crop or not.
(out / "row.asc").write_text("ncols 11\nnrows 1\nxllcenter 0\nyllcenter 0\ncellsize 10\n" + " ".join("1" for _ in range(11)) + "\n")
expect("a grid of one row", check(base.replace("slope.asc", "row.asc")), 2, "11 columns, 1 rows: is no grid of a surface", absent=["site.crop"])

# A block by the name of a structure: no sentence could tell which struck which.
expect("a block by the name of a structure", check((base + column % ("6", "1 m")).replace('name = "B"', 'name = "P"')), 2, "another block or a structure has this name")

# [impact] in a run without it.
impact = """[impact]
material = "rock"
shape = "sphere"
mass = 100
velocity = "5 m/s"
point = [%s, 50, 12]
"""
expect("check with [impact] and a block", check(base + column % ("6", "1 m") + impact % 19), 0, "only talus impact takes the block of [impact]", "talus run leaves it out", "1 warning", "talus impact: the block is aimed at P with 5 m/s, 1.25 kJ", "Mass and size: B ")
alone = "schema = 1\n[simulation]\nduration = 1\n" + materials + column % ("6", "1 m") + (impact % 19).replace("mass = 100", 'mass = "5 t"')
expect("check of a blow", check(alone), 0, "Mass and size: block 5 t, 1.6", "with 5 m/s, 62.5 kJ; it starts at [18", "No problems found", absent=["talus run"])
expect("a blow beside the structure", check(alone.replace("19, 50, 12", "19, 58, 12")), 0, "impact.point = [19, 58, 12]: on its line of flight through this point the block passes P by", "1 warning")
expect("a blow above the structure", check(alone.replace("19, 50, 12", "19, 50, 25")), 0, "impact.point = [19, 50, 25]", "passes P by")
expect("a blow that flies away", check(alone.replace("19, 50, 12", "26, 50, 12")), 2, "impact.point", "the block flies away: P lies behind it there")
expect("the speed of a blow", check(alone.replace("5 m/s", "500 m/s")), 0, "impact.velocity", "500 m/s is faster than rocks fall")
for spin, speed, part, absent in ((300, 5, "impact.trajectories", ["m/s is faster"]), (3, 500, "500 m/s is faster than rocks fall", ["rocks turn"]), (3, 5, "No problems found", [])):
    (out / "rows.csv").write_text(f"x,y,z,vx,vy,vz,wx,wy,wz,mass\n18.5,50,12,{speed},0,0,0,0,{spin},5000\n")
    rows = alone.replace('velocity = "5 m/s"\n', 'trajectories = "rows.csv"\n').replace('mass = "5 t"\n', "").replace("point = [19, 50, 12]\n", "")
    expect(f"a row of {speed} m/s, {spin} rad/s", check(rows), 0, part, *(["300 rad/s is faster than rocks turn"] if spin == 300 else []), absent=absent)
# Mass holds, and the size says the ratios alone: what comes out of both is stated.
both = base.replace('shape = "sphere"\ndiameter = "1 m"', 'shape = "box"\nmass = "5 t"\nsize = [1.2, 1.2, 1.2]')
expect("mass and size", check(both), 0, "Mass and size: B 5 t, 1.244 x 1.244 x 1.244 m.")
got, summary = run("left-out", base + column % ("6", "1 m") + impact % 19, "--set", 'simulation.duration="20 ms"', "--set", "output.report=false")
require("run with [impact]", len(summary.get("warnings", [])) == 1 and "[impact]" in summary["warnings"][0], summary.get("warnings"))
miss = base + column % ("6", "1 m") + impact % 19
got, summary = run("miss", miss.replace("19, 50, 12", "19, 58, 12"), "--set", 'simulation.duration="20 ms"', "--set", "output.report=false", command="impact")
expect("a miss", got, 0, "the block passes P by", "never touched P within 0.02 s")
require("a miss in the summary", sum("never touched P" in w for w in summary.get("warnings", [])) == 1, summary.get("warnings"))
got, summary = run("hit", miss, "--set", 'simulation.duration="20 ms"', "--set", "output.report=false", command="impact")
require("a hit", summary.get("hit") and not any("touched" in w or "[impact]" in w for w in summary["warnings"]), got)

# Beside the terrain: it falls, and is not at rest.
got, summary = run("beside", base.replace("position = [80, 80, 40]", "position = [300, 80, 40]").replace('duration = "1 s"', 'duration = "60 s"\nuntil = "rest"'))
expect("beside the terrain", got, 0, "lies beside the terrain", "every block has left the model", absent=["at rest"])
require("beside, in the summary", summary.get("status") == "all left" and any("started beside the terrain" in h for h in summary["headline"]) and not any("at rest" in h for h in summary["headline"]), summary.get("headline"))

# A thin pier that a boulder snaps: while its pieces stay in the mesh, the run says so; its pier is lost, and has no reserve.
thin = """schema = 1
[simulation]
duration = "0.3 s"
[[plane]]
normal = [0, 0, 1]
material = "ground"
""" + materials + """[[block]]
name = "B"
material = "rock"
shape = "box"
size = [1, 1, 1]
position = [-0.7, 0, 1.5]
velocity = [25, 0, 0]
[[structure]]
name = "P"
kind = "column"
material = "C30"
base = [0, 0, 0]
section = [0.3, 0.3]
height = 3
cell_size = "0.1 m"
damage = "concrete"
damping_ratio = 0.02
"""
got, summary = run("hanging", thin + "[coupling]\nfragments = false\n", "--set", "output.report=false")
told = [w for w in summary.get("warnings", []) if "have lost their support" in w]
require("a part without support", len(told) == 1 and told[0] in got[2].replace("warning: ", ""), got[2] + str(summary.get("warnings")))
push = """[[structure.load]]
region = { min = [-0.15, -0.15, 2.0], max = [-0.15, 0.15, 3.0] }
traction = [1e6, 0, 0]
history = [[0, 0], [0.02, 1]]
[coupling]
scheme = "one-way"
"""
got, summary = run("hanging-one-way", thin + push, "--set", "output.report=false")   # nothing comes off there either
told = [w for w in summary.get("warnings", []) if "have lost their support" in w]
require("a part without support, one-way", len(told) == 1 and 'scheme = "one-way"' in told[0], str(summary.get("warnings")))
got, summary = run("snapped", thin)
expect("a pier that is gone", got, 0, absent=["lost their support"])
member = summary["structures"][0]["members"][0]
require("lost", member["damage_class_name"] == "lost" and member["top_came_off"] and member["residual_drift"] is None, member)
done = subprocess.run([talus, "capacity", "snapped"], cwd=out, capture_output=True, text=True, timeout=120)
expect("its capacity", (done.returncode, done.stdout, done.stderr), 0, " lost ", "Report, renewed: snapped/report.html", "as a pier it is not to be counted on", "what is left bears")
require("its capacity in the report", '"capacity_built"' in (out / "snapped/report.html").read_text(), "report.html")
member = json.loads((out / "snapped/capacity.json").read_text())["members"][0]
require("no reserve", member["lost"] and member["reserve"] is None and member["capacity_now"] is None and member["ratio"] is None, member)

# A run without a structure has no pier to press.
plain = """schema = 1
[simulation]
duration = "10 ms"
[[material]]
name = "rock"
density = 2600
[[block]]
name = "B"
material = "rock"
shape = "box"
size = [1, 1, 1]
position = [0, 0, 2]
"""
got, summary = run("plain", plain, "--set", "output.report=false")
expect("a block alone", got, 0)
done = subprocess.run([talus, "capacity", "plain"], cwd=out, capture_output=True, text=True, timeout=120)
expect("its capacity", (done.returncode, done.stdout, done.stderr), 2, "structure", absent=["Load on the top"])
require("no table of nothing", not (out / "plain/capacity.json").exists(), "capacity.json")

# A resolved scene of talus impact holds the block where it starts; what it says goes by that.
done = subprocess.run([talus, "impact", "snapped/scene.resolved.json", "-o", "again"], cwd=out, capture_output=True, text=True, timeout=120)
expect("impact by a resolved scene", (done.returncode, done.stdout, done.stderr), 2, "talus run takes it")

# A deck that lies on a pier without a preload over both; springs in N/m at it; bars that slip, without bars; a cap beam of no height.
lying = """schema = 1
[simulation]
duration = "10 ms"
""" + materials.replace('normal_stiffness = "hard"', 'normal_stiffness = "100 MN/m"') + """[[structure]]
name = "pier"
kind = "column"
material = "C30"
base = [0, 0, 0]
section = [2, 2]
height = 4
cell_size = 1
bond = "mc2010"
[[structure]]
name = "deck"
kind = "box"
material = "C30"
position = [0, 0, %s]
size = [4, 4, 1]
cells = [4, 4, 1]
support = []
preload = "none"
[[block]]
name = "B"
material = "rock"
shape = "box"
size = [1, 1, 1]
position = [0, 0, 9]
"""
expect("a deck on a pier", check(lying % 4.5), 0, "structure.deck.preload = none", "no preload covers both it and what holds it (pier)", "simulation.initial_state", "one for each node of the mesh", "there are no bars")
expect("a deck above a pier", check(lying % 5.5), 0, absent=["no preload covers both"])
expect("per area", check(lying.replace("100 MN/m", "100 MPa/m") % 4.5), 0, absent=["one for each node of the mesh"])
expect("a cap beam of no height", check(base + viaduct % ("0", "2") + 'deck_level = "40 m"\ncap_height = 0\n'), 2, "cap_height", "0.1 m")
# Prestress that crushes what it presses: no state at rest.
pressed = """schema = 1
[simulation]
duration = "10 ms"
gravity = [0, 0, 0]
""" + materials + """[[structure]]
name = "P"
kind = "column"
material = "C30"
base = [0, 0, 0]
section = [0.8, 0.8]
height = 4
cell_size = "0.2 m"
damage = "concrete"
[[structure.rebar]]
kind = "longitudinal"
bars = 8
diameter = "36 mm"
cover = "60 mm"
yield = "1500 MPa"
prestress = "%s MPa"
"""
expect("too much prestress", check(pressed % 900), 0, "no state at rest was found", "crack or yield by themselves from t = 0 on", "before any block arrives")
expect("little prestress", check(pressed % 50), 0, absent=["no state at rest was found"])

# A slab of 0.5 m, bars of 20 mm each 0.5 m both ways, 40 mm and 60 mm from both faces to their middle: d = (0.46 + 0.44)/2, rho = sqrt(rho_x rho_y).
rows = ["bar,diameter,x,y,z,grade"]
for z, axis in ((0.21, "x"), (-0.21, "x"), (0.19, "y"), (-0.19, "y")):
    for k in range(4):
        at = -0.75 + 0.5 * k
        for end in (-0.95, 0.95):
            x, y = (end, at) if axis == "x" else (at, end)
            rows.append(f"{axis}{z}{k},0.020,{x},{y},{z},B500B")
(out / "bars.csv").write_text("\n".join(rows) + "\n")
(out / "slab.toml").write_text("""schema = 1
[simulation]
duration = "4 ms"
""" + materials + """[[structure]]
name = "slab"
kind = "box"
material = "C30"
position = [0, 0, 0]
size = [2, 2, 0.5]
cell_size = "0.25 m"
support = ["-x", "+x"]
rebar = "bars.csv"
[impact]
material = "rock"
shape = "sphere"
mass = 100
velocity = "5 m/s"
angle = "90 deg"
point = [0, 0, 0.25]
""")
done = subprocess.run([talus, "impact", "slab.toml", "-o", "slab", "--set", "output.report=false"], cwd=out, capture_output=True, text=True, timeout=120)
assert done.returncode == 0, done.stderr
summary = json.loads((out / "slab/summary.json").read_text())
assert summary["structures"][0]["form"] == "slab"
assert {f["id"] for f in summary["formulas"]} == {"hertz", "en1991-hard", "en1992-punching"}, "there is no cushion"
inputs = next(f for f in summary["formulas"] if f["id"] == "en1992-punching")["inputs"]
steel = 4 * math.pi * 0.02**2 / 4
ratio = math.sqrt(steel / (2 * 0.46) * steel / (2 * 0.44))
for symbol, expected in (("d", 0.45), ("rho", ratio)):
    found = float(re.search(rf"(?:^|; ){symbol} = ([0-9.e+-]+) ", inputs).group(1))
    if abs(found / expected - 1) > 1e-3:
        failures += 1
        print(f"{symbol} = {found}, expected {expected}: {inputs}")
sys.exit(f"{failures} failures" if failures else 0)
