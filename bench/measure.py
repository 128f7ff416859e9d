"""What a run did, measured from the poses alone, whichever code made them.

frames: time [f], position [f, n, 3], orientation [f, n, 4] (w, x, y, z), velocity and spin [f, n, 3] in world axes.
"""
import numpy as np

from scenes import FRICTION, GRAVITY, mass_properties


def rotations(q):
    q = q / np.linalg.norm(q, axis=-1, keepdims=True)
    w, x, y, z = np.moveaxis(q, -1, 0)
    rows = [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y),
            2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
            2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]
    return np.stack(rows, -1).reshape(q.shape[:-1] + (3, 3))


def box_overlap(position, rotation, half, i, j):
    """Least overlap over the fifteen separating axes of every pair of boxes (negative: apart) [m]."""
    between, A, B = position[j] - position[i], rotation[i], rotation[j]
    axes = np.concatenate([A, B, np.cross(A[:, :, :, None], B[:, :, None, :], axis=1).reshape(len(i), 3, 9)], axis=2)
    length = np.linalg.norm(axes, axis=1)
    usable = length > 1e-3
    axes = axes / np.maximum(length, 1e-12)[:, None]
    # Columns of A and B are the boxes' axes: projections of the half extents on each candidate axis.
    reach = sum(np.einsum("a,pax->px", half, np.abs(np.einsum("pka,pkx->pax", R, axes))) for R in (A, B))
    overlap = reach - np.abs(np.einsum("pk,pkx->px", between, axes))
    return np.where(usable, overlap, np.inf).min(axis=1)


def ground_overlap(scene, corners):
    """Greatest depth of corners [k, 3] below the ground, over the plan of its mesh [m]. The ground is concave: the least of the
    signed distances to its planes is the distance."""
    low, high = scene.vertices.min(0), scene.vertices.max(0)
    over = np.all((corners[:, :2] >= low[:2]) & (corners[:, :2] <= high[:2]), axis=1)
    if not over.any():
        return -np.inf
    distance = np.min([corners[over] @ n - d for n, d in scene.planes], axis=0)
    return -distance.min()


def measure(scene, time, position, orientation, velocity, spin):
    """Independent figures of a run, as a dictionary; lengths in m, energies in J."""
    from scipy.spatial import cKDTree
    mass, inertia = mass_properties(scene)
    energy, ground, boxes = [], [], [0.0]
    for f in range(len(time)):
        R = rotations(orientation[f])
        body_spin = np.einsum("nij,ni->nj", R, spin[f])
        kinetic = 0.5 * mass * (velocity[f] ** 2).sum() + 0.5 * np.einsum("ni,ij,nj", body_spin, inertia, body_spin)
        energy.append(kinetic + mass * GRAVITY * position[f, :, 2].sum())
        corners = position[f][:, None] + np.einsum("nij,kj->nki", R, scene.corners)
        ground.append(ground_overlap(scene, corners.reshape(-1, 3)))
        if scene.hull is None and len(position[f]) > 1:
            pairs = cKDTree(position[f]).query_pairs(np.linalg.norm(scene.size), output_type="ndarray")
            if len(pairs):
                boxes.append(box_overlap(position[f], R, 0.5 * scene.size, pairs[:, 0], pairs[:, 1]).max())
    rise = np.diff(energy)
    out = {"frames": len(time), "end": float(time[-1]), "ground": max(0.0, *ground), "boxes": max(boxes),
           "energy_rise": float(rise[rise > 0].sum()) if len(rise) else 0.0,
           "released": float(mass * GRAVITY * (position[0, :, 2].sum() - position[-1, :, 2].sum()))}
    if scene.name == "s1":
        down = np.array([np.cos(np.radians(35)), 0, -np.sin(np.radians(35))])
        exact = 0.5 * GRAVITY * (np.sin(np.radians(35)) - FRICTION * np.cos(np.radians(35))) * time[-1] ** 2
        out["slide_error"] = float(abs((position[-1, 0] - position[0, 0]) @ down / exact - 1))
    if scene.name.startswith("s4"):
        out["top_drift"] = float(np.linalg.norm(position[-1, -1] - position[0, -1]))
    return out
