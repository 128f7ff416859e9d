"""ParaView macro: terrain, blocks by speed, structures by damage or stress, at the first impact.

    pvpython docs/guide/paraview_view.py DIR [PICTURE.png]
    TALUS_RESULTS=DIR paraview --script=docs/guide/paraview_view.py
"""
import json
import math
import os
import sys

from paraview.simple import *  # noqa: F403: what ParaView's own macros do

directory = sys.argv[1] if len(sys.argv) > 1 else os.environ.get("TALUS_RESULTS", ".")
summary = json.load(open(os.path.join(directory, "summary.json")))
data = PVDReader(FileName=os.path.join(os.path.abspath(directory), "results.pvd"))
view = GetActiveViewOrCreate("RenderView")
view.ViewSize = [1600, 1000]
view.OrientationAxesVisibility = 1
times = list(data.TimestepValues)
impacts = summary.get("impacts", [])
moving = [b for b in summary["blocks"] if not b["fixed"]]
time = min(times, key=lambda t: abs(t - impacts[0]["peak_time"])) if impacts else times[-1]   # the first impact, or the end
view.ViewTime = time
GetTimeKeeper().Time = time
data.UpdatePipeline(time)


def names(information):
    return {information.GetArray(i).Name for i in range(information.GetNumberOfArrays())}


def part_with(array):
    """The cells of the parts that have the array."""
    part = Threshold(Input=data)
    part.Scalars = ["CELLS", array]
    part.LowerThreshold, part.UpperThreshold = -1e300, 1e300
    return part


def show(source, array, title, most):
    display = Show(source, view)
    ColorBy(display, ("CELLS", array))
    GetColorTransferFunction(array).RescaleTransferFunction(0, most)
    bar = GetScalarBar(GetColorTransferFunction(array), view)
    bar.Title, bar.ComponentTitle = title, ""
    display.SetScalarBarVisibility(view, True)


cells = names(data.CellData)
if "height" in names(data.PointData):
    ground = Threshold(Input=data)
    ground.Scalars = ["POINTS", "height"]
    ground.LowerThreshold, ground.UpperThreshold = -1e300, 1e300
    display = Show(ground, view)
    display.ColorArrayName = ["POINTS", ""]
    display.DiffuseColor = [0.72, 0.68, 0.62]
fastest = max((b.get("max_speed", 0) for b in summary["blocks"]), default=0)
damaged = any(s["damage_max"] > 0 for s in summary["structures"])
for array, title, most in (("speed", "speed [m/s]", fastest or 1), ("damage_tension", "damage [-]", 1), ("stress_von_mises", "von Mises stress [Pa]", None)):
    if array not in cells or array == ("stress_von_mises" if damaged else "damage_tension"):
        continue
    show(part_with(array), array, title, most or data.CellData[array].GetRange()[1] or 1)
Render(view)
ResetCamera(view)   # before the camera is placed: the first picture would move it
if impacts:
    # From downhill and beside the path, where the slope hides nothing.
    point, (vx, vy, _) = impacts[0]["point"], impacts[0]["velocity"]
    n = math.hypot(vx, vy) or 1
    view.CameraFocalPoint = point
    view.CameraPosition = [point[0] + (18 * vx - 24 * vy) / n, point[1] + (18 * vy + 24 * vx) / n, point[2] + 14]
    view.CameraViewUp = [0, 0, 1]
elif moving:
    # Nothing was struck: the block that went farthest, where it lies, from downhill.
    block = max(moving, key=lambda b: b["runout"])
    (x0, y0, _), (x, y, z) = block["start"], block["end"]
    n, size = math.hypot(x - x0, y - y0) or 1, block["volume"] ** (1 / 3)
    view.CameraFocalPoint = [x, y, z]
    view.CameraPosition = [x + 25 * size * (x - x0) / n, y + 25 * size * (y - y0) / n, z + 20 * size]
    view.CameraViewUp = [0, 0, 1]
Render(view)
if len(sys.argv) > 1 or "pvpython" in sys.executable:
    SaveScreenshot(sys.argv[2] if len(sys.argv) > 2 else os.path.join(directory, "paraview.png"), view)
