#!/usr/bin/env python3
"""Writes the K4580 slope, its rock mass, its viaduct and the scenes of the three K4580 cases.

usage: make_k4580.py            (writes beside itself and into ../k4580-boulder, ../k4580-rock-mass, ../k4580-viaduct-damage)

The paper shows the slope in pictures only. What follows is a reconstruction from its words and numbers; the assumptions are
numbered in README.md and named here by (A1), (A2), ...

Axes: x along the road (east), y down the slope (north, towards the river), z up from the road, which is altitude 3762 m (A1).
A surface is a set of breaklines (rows, constant y but for the two rows of the source area that follow joints) over the columns X;
each quadrilateral is two triangular sub-faces.
"""
import json
import math
import os

HERE = os.path.dirname(os.path.abspath(__file__))
SLOPES = ("before", "shallow", "deep")

# --- measures -------------------------------------------------------------------------------------------------------
CORE, WIDENING = 84.0, 38.0            # width of the modelled slope and the paper's widening each side: 160 m of road (A2)
BRINK_Z = 110.0                        # height of the source area's edge above the road (A3)
J1, J2, J3, J4 = (2.0, 29.0), (3.0, 89.0), (267.0, 87.0), (92.0, 88.0)   # the paper's joints, dip direction/dip
SPACING = {"J1": 4.5, "J2": 6.0, "J3": 3.84, "J4": 2.17}               # J3, J4: paper; J1, J2: (A5)
BACK = -18.0                           # tension crack (J2) behind the rock mass at x = 0 (A4)
WALL = 11.0                            # height of the parent rock behind it (A4)
FRICTION, DENSITY = 28.0, 2500.0       # paper, Table 4
RESTITUTION = 0.3                      # the paper gives none (A8)
X = [-80.0, -56.0, -42.0, -30.0, -18.0, -6.0, 6.0, 18.0, 30.0, 42.0, 56.0, 80.0]
# Rows below the brink: y, side ground (the slope beside the landslide), centre line before the landslide.
ROWS = [(8.0, 92.0, 92.0), (20.0, 85.0, 87.5), (32.0, 77.0, 82.0), (48.0, 60.0, 68.0), (60.0, 47.0, 57.0), (72.0, 32.0, 44.0),
        (82.0, 18.0, 27.0), (92.0, 0.0, 0.0)]
FOOT = [(104.0, 0.0), (106.0, -1.0), (122.0, -4.0), (132.0, -12.0), (176.0, -12.0), (192.0, 0.0), (215.0, 2.0)]   # road, bank, river, far bank (A6)
NOSE = 10.0                            # x of the crest of the slope's nose before the landslide (A3)
# Viaduct (A7): simply supported spans over single piers, along x.
SPAN, SPANS, DECK_WIDTH, DECK_DEPTH, DECK_TOP, AXIS_Y = 20.0, 7, 8.0, 1.5, 10.0, 113.0
PIER_ALONG, PIER_ACROSS, CAP_HEIGHT, CAP_ALONG = 1.5, 3.0, 1.0, 2.0


def rad(a):
    return a * math.pi / 180


def normal(joint):
    a, b = map(rad, joint)
    return (math.sin(a) * math.sin(b), math.cos(a) * math.sin(b), math.cos(b))


def on_j1(x, y, lift=0.0):
    """Height of the source plane (Joint 1) through (0, 0, BRINK_Z)."""
    n = normal(J1)
    return BRINK_Z - (n[0] * x + n[1] * y) / n[2] + lift


def back_y(x):
    """Strike line of Joint 2 behind the rock mass."""
    return BACK - x * math.tan(rad(J2[0]))


def bell(x):
    """Cross-section of the landslide mass: 1 on its crest, 0 at its lateral limits |x| = CORE/2."""
    half = CORE / 2
    if abs(x) >= half:
        return 0.0
    s = (x - NOSE) / (half - NOSE if x > NOSE else half + NOSE)
    return 1 - s * s


def trough(x, floor):
    """1 on the floor of the scar, |x| <= floor, falling to 0 at its lateral scarps."""
    half = CORE / 2
    return max(0.0, min(1.0, (half - abs(x)) / (half - floor)))


def plane_z(y):
    """Shallow landslide: plane sliding surface, from the gentle area (20, 87) to the toe (92, 0) (A3)."""
    return 87.0 - 87.0 * (y - 20.0) / 72.0


def arc_z(y):
    """Deep landslide: circular arc from the foot of the wall (8, 92) to the toe (92, 0), sagitta 14 m (A3)."""
    (ya, za), (yb, zb), f = (8.0, 92.0), (92.0, 0.0), 14.0
    chord = math.hypot(yb - ya, zb - za)
    radius = (chord * chord / 4 + f * f) / (2 * f)
    ux, uz = (yb - ya) / chord, (zb - za) / chord
    nx, nz = -uz, ux                   # up, away from the slope
    cy, cz = (ya + yb) / 2 + nx * (radius - f), (za + zb) / 2 + nz * (radius - f)
    return cz - math.sqrt(radius * radius - (y - cy) ** 2)


def height(kind, x, row):
    y, side, centre = row
    if kind == "before":
        return side + (centre - side) * bell(x)
    if kind == "shallow":
        slide = min(plane_z(y) if y >= 20 else 92.0 - (92.0 - 87.0) * (y - 8.0) / 12.0, side + (centre - side) * bell(x))
        return side + (slide - side) * trough(x, 30.0)
    slide = arc_z(y) if 8 < y < 92 else side
    return side + (slide - side) * trough(x, 18.0) ** 0.8


def surface(kind):
    rows = []
    wall_y = WALL * math.tan(rad(90 - J2[1]))
    rows.append([(x, -40.0, on_j1(x, back_y(x)) + WALL + 4.0) for x in X])
    rows.append([(x, back_y(x) - wall_y, on_j1(x, back_y(x)) + WALL) for x in X])
    rows.append([(x, back_y(x), on_j1(x, back_y(x))) for x in X])
    rows.append([(x, 0.0, on_j1(x, 0.0)) for x in X])
    for row in ROWS:
        rows.append([(x, row[0], height(kind, x, row)) for x in X])
    for y, z in FOOT:
        rows.append([(x, y, z) for x in X])
    return rows


def ground(kind, x, y):
    """Height of the surface between breaklines, for pier bases (rows of constant y only)."""
    rows = surface(kind)
    for lower, upper in zip(rows[3:], rows[4:]):
        if lower[0][1] <= y <= upper[0][1]:
            t = (y - lower[0][1]) / (upper[0][1] - lower[0][1])
            for i in range(len(X) - 1):
                if X[i] <= x <= X[i + 1]:
                    s = (x - X[i]) / (X[i + 1] - X[i])
                    a = lower[i][2] * (1 - s) + lower[i + 1][2] * s
                    b = upper[i][2] * (1 - s) + upper[i + 1][2] * s
                    return a * (1 - t) + b * t
    raise ValueError("outside the surface")


def write_obj(path, points, faces, text):
    with open(path, "w") as f:
        f.write(f"# {text}; written by make_k4580.py\n")
        for p in points:
            f.write("v " + " ".join(f"{c!r}" for c in p) + "\n")
        for face in faces:
            f.write("f " + " ".join(str(i + 1) for i in face) + "\n")


def write_terrain(kind):
    rows = surface(kind)
    n = len(X)
    points = [p for row in rows for p in row]
    faces = []
    for r in range(len(rows) - 1):
        for i in range(n - 1):
            a, b, c, d = r * n + i, r * n + i + 1, (r + 1) * n + i + 1, (r + 1) * n + i
            # Diagonals mirror about the middle, so that they favour no side.
            faces += [(a, c, b), (a, d, c)] if i < (n - 1) / 2 else [(a, d, b), (b, d, c)]
    write_obj(os.path.join(HERE, f"slope-{kind}.obj"), points, faces, f"K4580 slope, {kind}")
    return len(faces)


def solve(planes):
    """Intersection of three planes n.x = d."""
    (a, p), (b, q), (c, r) = planes
    det = a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0]) + a[2] * (b[0] * c[1] - b[1] * c[0])
    cross = lambda u, v: (u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0])
    bc, ca, ab = cross(b, c), cross(c, a), cross(a, b)
    return tuple((p * bc[k] + q * ca[k] + r * ab[k]) / det for k in range(3))


def dot(a, b):
    return sum(u * v for u, v in zip(a, b))


def hexahedron(bottom, top, west, east, south, north):
    """Corners of the six planes, in the order of the faces below."""
    return [solve((z, y, x)) for z in (bottom, top) for y in (south, north) for x in (west, east)]


HEX_FACES = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]


def volume(points):
    total = 0.0
    for f in HEX_FACES:
        a = points[f[0]]
        for i in range(1, len(f) - 1):
            b, c = points[f[i]], points[f[i + 1]]
            total += dot(a, (b[1] * c[2] - b[2] * c[1], b[2] * c[0] - b[0] * c[2], b[0] * c[1] - b[1] * c[0])) / 6
    return total


def centroid(points):
    total, c = 0.0, [0.0, 0.0, 0.0]
    for f in HEX_FACES:
        a = points[f[0]]
        for i in range(1, len(f) - 1):
            b, d = points[f[i]], points[f[i + 1]]
            v = dot(a, (b[1] * d[2] - b[2] * d[1], b[2] * d[0] - b[0] * d[2], b[0] * d[1] - b[1] * d[0])) / 6
            total += v
            for k in range(3):
                c[k] += v * (a[k] + b[k] + d[k]) / 4
    return [v / total for v in c]


def plane(joint, through):
    n = normal(joint)
    return n, dot(n, through)


LIFT = 2e-6     # the blocks start this far above the source plane: open by less than their accuracy, never overlapping


def boulder():
    """115 m3 between Joint 1 (base), Joint 2 (back), Joint 3 and 4 (sides), a front parallel to Joint 2 and a top parallel to Joint 1 (A4)."""
    width, depth = 5.0, 5.2
    base = plane(J1, (0, 0, BRINK_Z + LIFT))
    back, front = plane(J2, (0, -depth - 0.3, BRINK_Z)), plane(J2, (0, -0.3, BRINK_Z))
    # Joint 3 dips west and Joint 4 east: the block between them is wider below.
    west, east = plane(J3, (-width / 2, 0, BRINK_Z)), plane(J4, (width / 2, 0, BRINK_Z))
    low, high = 1.0, 20.0
    for _ in range(200):
        h = (low + high) / 2
        top = (base[0], base[1] + h * base[0][2])
        points = hexahedron(base, top, west, east, back, front)
        if volume(points) < 115.0:
            low = h
        else:
            high = h
    return points, h


def rock_mass_region():
    """Rock mass on Joint 1, against Joint 2, 18 m wide, with a free front of 75 degrees (A4)."""
    base = plane(J1, (0, 0, BRINK_Z + LIFT))
    back = plane(J2, (0, BACK + 0.02, on_j1(0, BACK)))
    front = plane((J2[0], 75.0), (0, -0.4, BRINK_Z))
    west, east = plane((270.0, 90.0), (-9.0, 0, 0)), plane((90.0, 90.0), (9.0, 0, 0))
    top = plane((J1[0], 22.0), (0, -9.0, on_j1(0, -9.0) + 9.0))
    return hexahedron(base, top, west, east, back, front)


def viaduct_boxes(kind):
    """Piers, caps and decks as boxes (lower corner, upper corner), for the rigid viaduct."""
    x0 = -SPAN * SPANS / 2
    boxes = []
    under = DECK_TOP - DECK_DEPTH
    for i in range(SPANS + 1):
        x = x0 + i * SPAN
        base = ground(kind, max(min(x, 80), -80), AXIS_Y) - 2.5
        boxes.append((f"pier{i + 1}", (x - PIER_ALONG / 2, AXIS_Y - PIER_ACROSS / 2, base), (x + PIER_ALONG / 2, AXIS_Y + PIER_ACROSS / 2, under - CAP_HEIGHT)))
        boxes.append((f"cap{i + 1}", (x - CAP_ALONG / 2, AXIS_Y - DECK_WIDTH / 2, under - CAP_HEIGHT), (x + CAP_ALONG / 2, AXIS_Y + DECK_WIDTH / 2, under)))
    for i in range(SPANS):
        x = x0 + i * SPAN
        boxes.append((f"deck{i + 1}", (x, AXIS_Y - DECK_WIDTH / 2, under), (x + SPAN, AXIS_Y + DECK_WIDTH / 2, DECK_TOP)))
    return boxes


def numbers(v):
    return "[" + ", ".join(f"{c:.9g}" for c in v) + "]"


TITLES = {"before": "before the landslide", "shallow": "after the shallow landslide", "deep": "after the deep landslide"}
NOTE = "# Written by ../k4580/make_k4580.py; assumptions in ../k4580/README.md.\n"


def head(title, duration, interval, accuracy=0.01):
    return f"""{NOTE}schema = 1
title = "{title}"

[simulation]
duration = "{duration:g} s"
gravity = [0.0, 0.0, -9.8]
accuracy = {accuracy:g}

[output]
interval = "{interval:g} s"
history_interval = "20 ms"
"""


def site(kind):
    return f"""
[site]
terrain = "../k4580/slope-{kind}.obj"
material = "slope"
"""


MATERIALS = f"""
[[material]]
name = "rock"
density = {DENSITY:g}

[[material]]
name = "slope"
density = {DENSITY:g}
"""


def law(a, b, restitution=RESTITUTION):
    bounce = f"restitution = {restitution:g}\n" if restitution > 0 else ""
    return f"""
[[interface]]
between = ["{a}", "{b}"]
friction = "{FRICTION:g} deg"
normal_stiffness = "hard"
{bounce}"""


def rigid_viaduct(kind):
    text = """
[[material]]
name = "concrete"
density = 2450
"""
    for name, low, high in viaduct_boxes(kind):
        size = [b - a for a, b in zip(low, high)]
        middle = [(a + b) / 2 for a, b in zip(low, high)]
        text += f"""
[[block]]
name = "{name}"
material = "concrete"
shape = "box"
size = {numbers(size)}
position = {numbers(middle)}
fixed = true
"""
    return text


def boulder_block():
    points, _ = boulder()
    c = centroid(points)
    rows = ", ".join(numbers([p[k] - c[k] for k in range(3)]) for p in points)
    return f"""
[[block]]
name = "boulder"
material = "rock"
shape = "convex"
vertices = [{rows}]
position = [{c[0]:.9f}, {c[1]:.9f}, {c[2]:.9f}]
deformable = false
"""


def rock_mass():
    def joint_set(name, joint, origin):
        return f"""
[[rock_mass.joint_set]]
name = "{name}"
orientation = "{joint[0]:g}/{joint[1]:g}"
spacing = "{SPACING[name]:g} m"
origin = {numbers(origin)}
"""
    lift = BRINK_Z + SPACING["J1"] / normal(J1)[2]
    return f"""
[rock_mass]
region = "../k4580/rock-mass.obj"
material = "rock"
deformable = false
least_volume = "2 m^3"
""" + joint_set("J1", J1, (0, 0, lift)) + joint_set("J2", J2, (0, -0.4 - SPACING["J2"], BRINK_Z)) + joint_set("J3", J3, (-1.0, -9, BRINK_Z + 5)) + joint_set("J4", J4, (0.1, -9, BRINK_Z + 5))


def refined(kind, cell):
    """Cells of that size all over the middle pier and its cap."""
    foot, half = ground(kind, 0, AXIS_Y), (PIER_ALONG / 2, PIER_ACROSS / 2)
    return f"""
[[structure.refine]]
cell_size = "{cell:g} m"
region = {{ min = [{-half[0]:g}, {AXIS_Y - half[1]:g}, {foot:.9g}], max = [{half[0]:g}, {AXIS_Y + half[1]:g}, {DECK_TOP - DECK_DEPTH - 0.1:g}] }}
"""


def structure_viaduct(kind, spans, cell, more=""):
    x0 = -SPAN * spans / 2
    return f"""
[[material]]
name = "C40"
f_cm = "48 MPa"

[[structure]]
name = "viaduct"
kind = "viaduct"
material = "C40"
position = [{x0:g}, {AXIS_Y:g}, {ground(kind, 0, AXIS_Y):.9g}]
spans = {spans}
span_length = "{SPAN:g} m"
pier_height = "{DECK_TOP - DECK_DEPTH - CAP_HEIGHT - 0.1 - ground(kind, 0, AXIS_Y):.9g} m"
pier_width = "{PIER_ALONG:g} m"
pier_depth = "{PIER_ACROSS:g} m"
cap_height = "{CAP_HEIGHT:g} m"
cap_width = "{CAP_ALONG:g} m"
cap_length = "{DECK_WIDTH:g} m"
deck_width = "{DECK_WIDTH:g} m"
deck_depth = "{DECK_DEPTH:g} m"
cell_size = "{cell:g} m"
support = ["-z"]
preload = "gravity"
damage = "concrete"
damping_ratio = 0.02
{more}
# The decks: a solid slab of 20 m span would crack under its own weight (4.9 MPa at midspan, f_t 3.5 MPa) without prestress.
[[structure.rebar]]
part = "deck"
kind = "longitudinal"
bars = 44
diameter = "22 mm"
cover = "100 mm"
yield = "1600 MPa"
ultimate_strain = 0.035
prestress = "1000 MPa"

[[structure.rebar]]
kind = "longitudinal"
bars = 28
diameter = "28 mm"
cover = "50 mm"

[[structure.rebar]]
kind = "stirrups"
diameter = "12 mm"
cover = "40 mm"
spacing = "150 mm"

# The cap beams reach 2.5 m out beyond the pier on either side: plain, they broke off when a pier was shaken.
[[structure.rebar]]
part = "cap"
kind = "longitudinal"
bars = 40
diameter = "28 mm"
cover = "50 mm"

[[structure.rebar]]
part = "cap"
kind = "stirrups"
diameter = "12 mm"
cover = "38 mm"
spacing = "150 mm"

[coupling]
scheme = "two-way"
audit = "report"
"""


def write(path, text):
    path = os.path.join(HERE, path)
    os.makedirs(os.path.dirname(path), exist_ok=True)
    with open(path, "w") as f:
        f.write(text)


def main():
    for kind in SLOPES:
        faces = write_terrain(kind)
        print(f"slope-{kind}: {faces} triangular sub-faces")
    region = rock_mass_region()
    write_obj(os.path.join(HERE, "rock-mass.obj"), region, HEX_FACES, "K4580 rock mass, closed region")
    points, h = boulder()
    print(f"boulder: {volume(points):.6f} m3, {h:.3f} m high; rock mass region: {volume(region):.1f} m3")
    breaking = law("rock", "slope") + law("rock", "C40") + law("C40", "C40") + law("C40", "slope")
    for kind in SLOPES:
        laws = law("rock", "slope") + law("rock", "concrete")
        write(f"../k4580-boulder/{kind}.toml", head(f"K4580 boulder, {TITLES[kind]}", 38, 0.1) + site(kind) + MATERIALS + laws + boulder_block() + rigid_viaduct(kind))
        write(f"../k4580-rock-mass/{kind}.toml", head(f"K4580 rock mass, {TITLES[kind]}", 38, 0.1, 0.05) + site(kind) + MATERIALS + law("rock", "rock", 0) + law("rock", "slope", 0) + law("rock", "concrete", 0) + rigid_viaduct(kind) + rock_mass())
        write(f"../k4580-viaduct-damage/{kind}.toml", head(f"K4580 boulder on the breaking viaduct, {TITLES[kind]}", 38, 0.1) + site(kind) + MATERIALS + breaking + boulder_block() + structure_viaduct(kind, 4, 0.5))
    write("../k4580-viaduct-damage/deep-fine.toml", head(f"K4580 boulder on the breaking viaduct, {TITLES['deep']}, finer cells in the middle pier", 38, 0.1) + site("deep") + MATERIALS + breaking + boulder_block() + structure_viaduct("deep", 4, 0.5, refined("deep", 0.25)))
    laws = law("rock", "rock", 0) + law("rock", "slope", 0) + law("rock", "C40", 0) + law("C40", "C40", 0) + law("C40", "slope", 0)
    write("../k4580-viaduct-damage/rock-mass-deep.toml", head(f"K4580 rock mass on the breaking viaduct, {TITLES['deep']}", 38, 0.1, 0.05) + site("deep") + MATERIALS + laws + rock_mass() + structure_viaduct("deep", 4, 0.43))


if __name__ == "__main__":
    main()
