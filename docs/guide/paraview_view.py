"""ParaView macro: terrain by height, blocks by speed, structures by damage or stress, at the first impact.

    pvpython docs/guide/paraview_view.py DIR [PICTURE.png]
    TALUS_RESULTS=DIR paraview --script=docs/guide/paraview_view.py
"""
import json
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
time = min(times, key=lambda t: abs(t - impacts[0]["peak_time"])) if impacts else times[-1]
view.ViewTime = time
GetTimeKeeper().Time = time
data.UpdatePipeline(time)


def show(source, array, title, location="CELLS"):
    display = Show(source, view)
    ColorBy(display, (location, array))
    display.RescaleTransferFunctionToDataRange(False, True)
    bar = GetScalarBar(GetColorTransferFunction(array), view)
    bar.Title, bar.ComponentTitle = title, ""
    display.SetScalarBarVisibility(view, True)


def arrays(information):
    return {information.GetArray(i).Name for i in range(information.GetNumberOfArrays())}


cells = arrays(data.CellData)
# Parts that have an array: terrain has none of its own.
heights = Elevation(Input=data, LowPoint=[0, 0, data.GetDataInformation().GetBounds()[4]], HighPoint=[0, 0, data.GetDataInformation().GetBounds()[5]])
display = Show(heights, view)
ColorBy(display, None)
display.DiffuseColor = [0.72, 0.68, 0.62]
for array, title in (("speed", "speed [m/s]"), ("damage_tension", "damage [-]"), ("stress_von_mises", "von Mises stress [Pa]")):
    if array not in cells or (array == "stress_von_mises" and any(s["damage_max"] > 0 for s in summary["structures"])):
        continue
    part = Threshold(Input=data)
    part.Scalars = ["CELLS", array]
    part.LowerThreshold, part.UpperThreshold = data.CellData[array].GetRange()
    show(part, array, title)
if impacts:
    view.CameraFocalPoint = impacts[0]["point"]
    view.CameraPosition = [c + d for c, d in zip(impacts[0]["point"], (-25, -40, 18))]
    view.CameraViewUp = [0, 0, 1]
else:
    ResetCamera(view)
Render(view)
if "--script" not in " ".join(sys.argv) and "pvpython" in sys.executable + " ".join(sys.argv[:1]) or len(sys.argv) > 1:
    SaveScreenshot(sys.argv[2] if len(sys.argv) > 2 else os.path.join(directory, "paraview.png"), view)
