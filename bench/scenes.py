"""The comparison scenes S1 to S4, written for Talus (TOML and OBJ) and for the peers' drivers (one line a thing).

SI, z up, gravity 9.81, friction tan 28 deg, 2500 kg/m^3, no restitution.

  s1       cube of 1 m slides 10 m down a plane of 35 deg
  s2       rounded boulder of 115 m^3 and 60 faces down a slope of 400 triangles, 20 s
  s3-N     N cubes on a slope of 45 deg, 5 m above its toe, collapse; N = 27, 100, 400, 1600, 10000; 10 s
  s4       tower of 50 cubes, 10 s
  field-N  N cubes in a square grid on a plane, each at rest: memory and sleep
"""
import dataclasses
import math
import pathlib

import numpy as np

GRAVITY = 9.81
FRICTION = math.tan(math.radians(28))
DENSITY = 2500.0
S3_COUNTS = {27: (3, 3, 3), 100: (5, 5, 4), 400: (10, 8, 5), 1600: (20, 10, 8), 10000: (25, 20, 20)}


@dataclasses.dataclass
class Scene:
    name: str
    duration: float
    position: np.ndarray                 # [n, 3] centroids
    orientation: np.ndarray              # [n, 4] w, x, y, z
    size: np.ndarray = None              # [3] edges of every box
    hull: np.ndarray = None              # [k, 3] corners about the centroid, in place of a box
    vertices: np.ndarray = None          # [v, 3] of the ground
    triangles: np.ndarray = None         # [t, 3] counter-clockwise seen from above
    planes: list = dataclasses.field(default_factory=list)  # (normal, offset) of the ground's pieces, for the measure
    nudge: float = 0.0                   # velocity of the uppermost block at t = 0, along x [m/s]

    @property
    def corners(self):
        """Corners of a block in body axes, [k, 3]."""
        if self.hull is not None:
            return self.hull
        signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
        return 0.5 * signs * self.size


def about_y(angle):
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])


def turned_about_y(angle):
    return np.array([math.cos(angle / 2), 0, math.sin(angle / 2), 0])


def grid(points):
    """Triangles of a grid of points [nx, ny, 3], normals upward for x and y growing."""
    nx, ny = points.shape[:2]
    number = np.arange(nx * ny).reshape(nx, ny)
    a, b, c, d = number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]
    triangles = np.stack([np.stack([a, b, c], -1), np.stack([a, c, d], -1)], 2).reshape(-1, 3)
    return points.reshape(-1, 3), triangles


def strip(xs, zs, ys):
    return grid(np.array([[[x, y, z] for y in ys] for x, z in zip(xs, zs)]))


def plane(normal, point):
    n = np.asarray(normal, float) / np.linalg.norm(normal)
    return n, float(n @ np.asarray(point, float))


def s1():
    angle = math.radians(35)
    turn = about_y(angle)
    duration = math.sqrt(2 * 10 / (GRAVITY * (math.sin(angle) - FRICTION * math.cos(angle))))
    flat = np.array([[[-4 + 4.0 * i, -4 + 4.0 * j, 0] for j in range(3)] for i in range(8)])
    vertices, triangles = grid(flat @ turn.T)
    return Scene("s1", duration, (turn @ [2, 0.1, 0.5])[None], turned_about_y(angle)[None], np.ones(3), None, vertices, triangles,
                 [plane(turn @ [0, 0, 1], [0, 0, 0])])


def boulder(volume=115.0, count=32):
    """Fibonacci sphere scaled by (1.1, 1, 0.9): corners about the centroid."""
    from scipy.spatial import ConvexHull
    i = np.arange(count) + 0.5
    z, longitude = 1 - 2 * i / count, i * math.pi * (3 - math.sqrt(5))
    r = np.sqrt(1 - z * z)
    x = np.c_[1.1 * r * np.cos(longitude), r * np.sin(longitude), 0.9 * z]
    x *= (volume / ConvexHull(x).volume) ** (1 / 3)
    faces = x[ConvexHull(x).simplices]
    parts = np.abs(np.linalg.det(faces)) / 6
    return x - (parts[:, None] * faces.sum(1) / 4).sum(0) / parts.sum()


def s2():
    pieces = [(80 / math.tan(math.radians(60)), 80.0, 4), (55 / math.tan(math.radians(40)), 55.0, 4),
              (15 / math.tan(math.radians(20)), 15.0, 3), (720.0, 0.0, 9)]
    xs, zs, planes = [0.0], [150.0], []
    for run, drop, cells in pieces:
        for _ in range(cells):
            xs.append(xs[-1] + run / cells)
            zs.append(zs[-1] - drop / cells)
        planes.append(plane([drop, 0, run], [xs[-1], 0, zs[-1]]))
    vertices, triangles = strip(xs, zs, [-100 + 20.0 * j for j in range(11)])
    hull = boulder()
    normal = np.array([math.sin(math.radians(60)), 0, math.cos(math.radians(60))])
    foot = np.array([6.0, 0, 150 - 6 * math.tan(math.radians(60))])
    centre = foot + normal * (max(-(hull @ normal)) + 0.5)
    return Scene("s2", 20.0, centre[None], np.array([[1.0, 0, 0, 0]]), None, hull, vertices, triangles, planes)


def s3(count):
    nx, ny, nz = S3_COUNTS[count]
    angle, pitch = math.radians(45), 1.01
    turn = about_y(angle)
    slope = [turn @ [-40 + 4.0 * i, 0, 0] for i in range(11)]
    xs = [p[0] for p in slope[:-1]] + [4.0 * i for i in range(16)]
    zs = [p[2] for p in slope[:-1]] + [0.0] * 16
    vertices, triangles = strip(xs, zs, [-20 + 4.0 * j for j in range(11)])
    position = [turn @ [-5.5 - i * pitch, (j - (ny - 1) / 2) * pitch, 0.51 + k * pitch]
                for k in range(nz) for j in range(ny) for i in range(nx)]
    return Scene(f"s3-{count}", 10.0, np.array(position), np.tile(turned_about_y(angle), (count, 1)), np.ones(3), None, vertices,
                 triangles, [plane(turn @ [0, 0, 1], [0, 0, 0]), plane([0, 0, 1], [0, 0, 0])])


def s4(nudge=0.0):
    vertices, triangles = strip([-4.0, 0, 4], [0.0] * 3, [-4.0, 0, 4])
    position = np.array([[0.1, 0.2, 0.5 + k] for k in range(50)])
    return Scene("s4", 10.0, position, np.tile([1.0, 0, 0, 0], (50, 1)), np.ones(3), None, vertices, triangles,
                 [plane([0, 0, 1], [0, 0, 0])], nudge)


def field(count):
    side = math.ceil(math.sqrt(count))
    position = np.array([[1.5 * (k % side), 1.5 * (k // side), 0.5] for k in range(count)])
    far = 1.5 * side + 4
    vertices, triangles = strip([-4.0, far], [0.0, 0.0], [-4.0, far])
    return Scene(f"field-{count}", 1.0, position, np.tile([1.0, 0, 0, 0], (count, 1)), np.ones(3), None, vertices, triangles,
                 [plane([0, 0, 1], [0, 0, 0])])


def make(name):
    """The scene of that name."""
    if name == "s1":
        return s1()
    if name == "s2":
        return s2()
    if name in ("s4", "s4-awake", "s4-nudge"):
        return dataclasses.replace(s4(0.05 if name == "s4-nudge" else 0.0), name=name)
    kind, _, count = name.partition("-")
    if kind == "s3" and int(count) in S3_COUNTS:
        return s3(int(count))
    if kind == "field":
        return field(int(count))
    raise SystemExit(f"no scene {name}: s1, s2, s3-N with N of {list(S3_COUNTS)}, s4, s4-awake, s4-nudge, field-N")


def mass_properties(scene):
    """Mass [kg] and inertia [3, 3] of a block."""
    if scene.hull is None:
        a, b, c = scene.size
        mass = DENSITY * a * b * c
        return mass, mass / 12 * np.diag([b * b + c * c, a * a + c * c, a * a + b * b])
    from scipy.spatial import ConvexHull
    second, volume = np.zeros((3, 3)), 0.0
    for face in scene.hull[ConvexHull(scene.hull).simplices]:
        det = abs(np.linalg.det(face))
        volume += det / 6
        total = face.sum(0)
        second += det / 120 * (np.outer(total, total) + face.T @ face)
    return DENSITY * volume, DENSITY * (np.trace(second) * np.eye(3) - second)


def numbers(values):
    return " ".join(format(float(v), ".17g") for v in np.ravel(values))


def listed(values):
    return "[" + ", ".join(repr(float(v)) for v in values) + "]"


def write_talus(scene, directory, accuracy=1e-3, threads=1, sleeping=True, interval=0.1):
    """scene.toml and ground.obj in `directory`; returns the path of the scene file."""
    directory = pathlib.Path(directory)
    directory.mkdir(parents=True, exist_ok=True)
    with open(directory / "ground.obj", "w") as f:
        f.writelines(f"v {numbers(v)}\n" for v in scene.vertices)
        f.writelines("f {} {} {}\n".format(*(t + 1)) for t in scene.triangles)
    shape = (f'shape = "convex"\nvertices = [{", ".join(listed(v) for v in scene.hull)}]' if scene.hull is not None
             else f'shape = "box"\nsize = {listed(scene.size)}')
    with open(directory / "scene.toml", "w") as f:
        f.write(f"""schema = 1
title = "{scene.name}"

[simulation]
duration = {scene.duration!r}
accuracy = {accuracy!r}
threads = {threads}
sleeping = {str(sleeping).lower()}

[output]
interval = {scene.duration!r}
history_interval = {interval!r}
report = false

[site]
terrain = "ground.obj"
material = "ground"

[[material]]
name = "rock"
density = {DENSITY!r}

[[material]]
name = "ground"
density = {DENSITY!r}

[[interface]]
between = ["*", "*"]
friction = {FRICTION!r}
restitution = 0.0
normal_stiffness = "hard"
""")
        uppermost = int(np.argmax(scene.position[:, 2]))
        for i, (position, orientation) in enumerate(zip(scene.position, scene.orientation)):
            f.write(f'\n[[block]]\nmaterial = "rock"\n{shape}\nposition = {listed(position)}\n')
            f.write(f"orientation = {{ quaternion = {listed(orientation)} }}\n")
            if scene.nudge and i == uppermost:
                f.write(f"velocity = [{scene.nudge!r}, 0.0, 0.0]\n")
    return directory / "scene.toml"


def write_text(scene, path):
    """The same scene for the drivers in bench/peers."""
    with open(path, "w") as f:
        mass, inertia = mass_properties(scene)
        f.write(f"duration {scene.duration!r}\nfriction {FRICTION!r}\nmass {mass!r}\ninertia {numbers(np.diag(inertia))}\n")
        for t in scene.triangles:
            f.write(f"triangle {numbers(scene.vertices[t])}\n")
        if scene.hull is not None:
            f.write(f"hull {len(scene.hull)} {numbers(scene.hull)}\n")
        else:
            f.write(f"box {numbers(scene.size)}\n")
        uppermost = int(np.argmax(scene.position[:, 2]))
        for i, (position, orientation) in enumerate(zip(scene.position, scene.orientation)):
            speed = scene.nudge if i == uppermost else 0.0
            f.write(f"body {numbers(position)} {numbers(orientation)} {speed!r}\n")
