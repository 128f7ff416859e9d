"""What `talus check` says of scenes that are hardly meant: structures in the air or under ground, slips of units, cells by the billion.
At the end the design checks of a slab: depth and ratio from its bars.

Usage: warnings.py TALUS DIRECTORY
"""
import json
import math
import pathlib
import re
import resource
import shutil
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


# Ground under the column at x = 20: z = 6 in the middle, 6.25 on the high side, 5.75 on the low one.
expect("column on its ground", check(base + column % ("6", "1 m")), 0, "No problems found")
expect("column in the air", check(base + column % ("20.25", "1 m")), 0, "hangs 14 m above the ground under it (z = 6.25)", "1 warning")
expect("column under ground", check(base + column % ("0.75", "1 m")), 0, "lies 5 m below the ground (z = 5.75)", "1 warning")
expect("column beside the terrain", check(base + (column % ("6", "1 m")).replace("base = [20", "base = [2000")), 0, "no ground lies under it")
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
expect("gravity", check(base, "--set", "simulation.gravity=[0, 0, 9.81]"), 0, "points upwards")
expect("sand grain", check(base.replace('"1 m"', '"1 um"')), 0, "smaller than a cubic millimetre")
expect("map height", check(base, "--set", "block.B.position=[80, 80, 2400]"), 0, "starts 2379 m above the terrain under it (z = 21)")
# A box of 1 m: its corner at x = 80.5, z = 39.5 stands over ground at z = 21.125.
expect("height at the start", check(base.replace('"sphere"\ndiameter = "1 m"', '"box"\nsize = [1, 1, 1]')), 0, "Start: 18.4 m above the ground, plumb under the lowest corner.")
expect("no friction", check(base.replace("friction = 0.6\n", "")), 2, "add friction = ...; Friction: an angle with a unit", absent=["(a coefficient"])
expect("in the ground", check(base, "--set", "block.B.position=[80, 80, 21.3]"), 2, "raise it by 0.201 m or more, to z = 21.501")
expect("out of the ground", check(base, "--set", "block.B.position=[80, 80, 21.501]"), 0, "No problems found")
expect("in a column", check(base + column % ("6", "1 m"), "--set", "block.B.position=[21.3, 50, 12]"), 2, "move it by [0.2, 0, 0] m or farther")
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
