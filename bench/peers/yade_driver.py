"""Yade's polyhedra on a comparison scene; run by bench/run.py as `yade -n -x -j1 yade_driver.py` with its arguments in the environment.

PEER_SCENE   text of bench/scenes.py          PEER_STEP      [s]
PEER_FRAMES  file of frames                   PEER_INTERVAL  between frames [s]
PEER_LIMIT   CPU [s] after which it stops: the polyhedra cost a hundred times what the other codes do
PEER_RESULT  JSON of figures

Contact stiffness 1e9 N/m^3 of overlap, damping 0.2 on scenes of more than one block, as its own examples take.
"""
import json
import math
import os
import resource
import time

import numpy as np
from yade import polyhedra_utils, utils

scene = {"triangle": [], "body": []}
for line in open(os.environ["PEER_SCENE"]):
    kind, *rest = line.split()
    values = [float(x) for x in rest]
    if kind in ("triangle", "body"):
        scene[kind].append(values)
    else:
        scene[kind] = values
step, interval = float(os.environ["PEER_STEP"]), float(os.environ["PEER_INTERVAL"])
limit, duration = float(os.environ["PEER_LIMIT"]), scene["duration"][0]

material = PolyhedraMat()
material.density, material.young, material.poisson = 2500, 1e9, 0.5
material.frictionAngle = math.atan(scene["friction"][0])
for t in scene["triangle"]:
    O.bodies.append(utils.facet([Vector3(*t[3 * k:3 * k + 3]) for k in range(3)], material=material, fixed=True))
if "hull" in scene:
    corners = np.array(scene["hull"][1:]).reshape(-1, 3)
else:
    a, b, c = (0.5 * e for e in scene["box"])
    corners = [(x * a, y * b, z * c) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
blocks = []
for px, py, pz, w, x, y, z, speed in scene["body"]:
    body = polyhedra_utils.polyhedra(material, v=[tuple(p) for p in corners])
    body.state.pos, body.state.ori = Vector3(px, py, pz), Quaternion(w, x, y, z)
    body.state.vel = Vector3(speed, 0, 0)
    blocks.append(O.bodies.append(body))
O.engines = [
    ForceResetter(),
    InsertionSortCollider([Bo1_Polyhedra_Aabb(), Bo1_Facet_Aabb()], verletDist=0.02),
    InteractionLoop([Ig2_Polyhedra_Polyhedra_PolyhedraGeom(), Ig2_Facet_Polyhedra_PolyhedraGeom()],
                    [Ip2_PolyhedraMat_PolyhedraMat_PolyhedraPhys()], [Law2_PolyhedraGeom_PolyhedraPhys_Volumetric()]),
    NewtonIntegrator(damping=0.2 if len(blocks) > 1 else 0.0, gravity=(0, 0, -9.81), dampGravity=False),
]
O.dt = step


def frame(out):
    row = [O.time]
    for i in blocks:
        s = O.bodies[i].state
        row += [*s.pos, s.ori[3], s.ori[0], s.ori[1], s.ori[2], *s.vel, *s.angVel]
    out.write(np.array(row, dtype=np.float64).tobytes())


every, steps, contacts, frames, cpu = max(1, round(interval / step)), 0, 0, 0, 0.0
with open(os.environ["PEER_FRAMES"], "wb") as out:
    frame(out)
    while steps * step < duration - 0.5 * step and cpu < limit:
        count = min(every, round(duration / step) - steps)
        start = time.process_time()
        O.run(count, True)
        cpu += time.process_time() - start
        steps += count
        frames += 1
        contacts += sum(1 for i in O.interactions if i.isReal)
        frame(out)
figures = {"cpu": cpu, "steps": steps, "contacts": contacts / max(1, frames), "reached": steps * step,
           "memory": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024}
with open(os.environ["PEER_RESULT"], "w") as out:
    json.dump(figures, out)
