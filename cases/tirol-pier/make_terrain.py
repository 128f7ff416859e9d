#!/usr/bin/env python3
"""Cuts the case's terrain out of the full grid: rows 306 to 384 and columns 306 to 394, unchanged heights.

usage: make_terrain.py tirol-hit-5m.asc terrain.asc
The full grid is data of Land Tirol (data.tirol.gv.at, CC BY 4.0), as carried by the AvaFrame project.
"""
import sys

ROWS, COLUMNS = range(306, 385), range(306, 395)
source, target = sys.argv[1:3]
with open(source) as f:
    header = dict(f.readline().split() for _ in range(6))
    rows = [line.split() for line in f]
cell = float(header["cellsize"])
x = float(header["xllcenter"]) + COLUMNS[0] * cell
y = float(header["yllcenter"]) + (int(header["nrows"]) - 1 - ROWS[-1]) * cell
with open(target, "w") as f:
    f.write(f"ncols {len(COLUMNS)}\nnrows {len(ROWS)}\nxllcenter {x!r}\nyllcenter {y!r}\n"
            f"cellsize {cell!r}\nNODATA_value {header.get('NODATA_value', '-9999')}\n")
    for i in ROWS:
        f.write(" ".join(rows[i][j] for j in COLUMNS) + "\n")
