#!/usr/bin/env python3
"""Opens every file of a run folder with a reader that is not ours and holds it against blocks.csv and placements.csv.

    python3 -m venv .venv && .venv/bin/pip install -r tools/requirements-exports.txt
    target/release/tsumu run examples/breakwater --out run
    .venv/bin/python tools/check_run.py run
"""

import csv
import json
import sys
from pathlib import Path

import numpy as np

RUN = Path(sys.argv[1])
EXPORTS = RUN / "exports"


def same(what, a, b):
    if a != b:
        sys.exit(f"{what}: {a} instead of {b}")
    shown = str(a)
    print(f"  {what}: {shown if len(shown) < 100 else shown[:97] + '…'}")


def table(name):
    with open(RUN / name, newline="") as file:
        return list(csv.DictReader(file))


blocks = table("recognise/blocks.csv")
kept = [p for p in table("plan/placements.csv") if p["state"] == "kept"]
labels = sorted([f"R{b['block_id']}" for b in blocks] + [f"P{p['order']}" for p in kept])
print(f"{len(blocks)} blocks, {len(kept)} placements")


def clouds():
    import laspy

    summary = json.loads((RUN / "recognise/summary.json").read_text())
    for name in ["segment/cloud.laz", "recognise/cloud.laz"]:
        print(f"{name} (laspy)")
        las = laspy.read(RUN / name)
        same("points", len(las), summary["points"])
        same("extra dimensions", {"instance", "confidence"} <= set(las.point_format.extra_dimension_names), True)
        crs = las.header.parse_crs()
        print("  CRS:", crs.to_epsg() if crs else None)
        if name.startswith("recognise"):
            known = {0} | {int(b["block_id"]) for b in blocks}
            same("labels are those of blocks.csv", set(np.unique(las.instance).tolist()) <= known, True)
        else:
            same("instances", int(las.instance.max()), summary["instances"])
    return crs.to_epsg() if crs else None


def maps(epsg):
    import rasterio

    rasters = {}
    for path in sorted(EXPORTS.glob("*.tif")):
        with rasterio.open(path) as image:
            same(f"{path.name} (GDAL through rasterio): CRS", image.crs.to_epsg() if image.crs else None, epsg)
            rasters[path.stem] = (image.read(1).astype(float), image.transform)
    same("maps", sorted(rasters), ["as-surveyed", "deficit-after", "deficit-before", "design", "planned"])
    return rasters


def vectors(epsg):
    import pyogrio

    print("project.gpkg, blocks.geojson (GDAL through pyogrio)")
    for layer, count in [("blocks", len(blocks)), ("placements", len(kept)), ("runs", 1)]:
        info = pyogrio.read_info(EXPORTS / "project.gpkg", layer=layer)
        same(layer, info["features"], count)
        if layer != "runs" and epsg:
            same("CRS", info["crs"], f"EPSG:{epsg}")
    same("GeoJSON features", pyogrio.read_info(EXPORTS / "blocks.geojson")["features"], len(labels))


def dxf():
    import ezdxf

    print("blocks.dxf (ezdxf)")
    document = ezdxf.readfile(EXPORTS / "blocks.dxf")
    same("errors of the audit", len(document.audit().errors), 0)
    # Numbers in the plan are INSERTs too, with attributes and without a unit of their own.
    inserts = [i for i in document.modelspace().query("INSERT") if i.has_xdata("TSUMU")]
    same("INSERTs", sorted(i.get_xdata("TSUMU")[0].value for i in inserts), labels)
    same("sections", len(document.modelspace().query("POLYLINE")) > 0, True)


def glb():
    import trimesh

    print("blocks.glb (trimesh)")
    scene = trimesh.load(EXPORTS / "blocks.glb")
    same("nodes", sorted(scene.graph.nodes_geometry), labels)


def ifc():
    import ifcopenshell
    import ifcopenshell.validate

    print("blocks.ifc (ifcopenshell)")
    model = ifcopenshell.open(str(EXPORTS / "blocks.ifc"))
    log = ifcopenshell.validate.json_logger()
    ifcopenshell.validate.validate(model, log)
    same("findings of validate", len(log.statements), 0)
    parts = model.by_type("IfcBuildingElementPart")
    same("units", sorted(p.Name for p in parts), labels)
    same("kind", {p.PredefinedType for p in parts} <= {"ARMOURUNIT"}, True)


def surfaces(rasters):
    from lxml import etree

    path = EXPORTS / "surfaces.xml"
    if not path.exists():
        print("no surfaces.xml: no map has a surface")
        return
    print(f"surfaces.xml (lxml): {path.stat().st_size / 1e6:.1f} MB")
    n = {"l": "http://www.landxml.org/schema/LandXML-1.2"}
    for surface in etree.parse(str(path)).getroot().findall(".//l:Surface", n):
        name, note = surface.get("name"), surface.get("desc")
        points = np.array([[float(v) for v in p.text.split()] for p in surface.findall(".//l:P", n)])
        faces = np.array([[int(v) - 1 for v in f.text.split()] for f in surface.findall(".//l:F", n)])
        tolerance = float(note.split()[1])
        value, transform = rasters[name]
        worst, cells = 0.0, 0
        for corners in points[faces]:
            north, east, up = corners.T
            column, row = ~transform * (east, north)
            # Points lie on middles of cells, in whole millimetres.
            column, row = np.rint(column - 0.5), np.rint(row - 0.5)
            i = np.arange(column.min(), column.max() + 1)
            j = np.arange(row.min(), row.max() + 1)
            x, y = (g.ravel() for g in np.meshgrid(i, j))
            area = (column[1] - column[0]) * (row[2] - row[0]) - (column[2] - column[0]) * (row[1] - row[0])
            b = ((x - column[0]) * (row[2] - row[0]) - (column[2] - column[0]) * (y - row[0])) / area
            c = ((column[1] - column[0]) * (y - row[0]) - (x - column[0]) * (row[1] - row[0])) / area
            inside = (b > -1e-9) & (c > -1e-9) & (b + c < 1 + 1e-9)
            level = (up[0] + b * (up[1] - up[0]) + c * (up[2] - up[0]))[inside]
            truth = value[y[inside].astype(int), x[inside].astype(int)]
            worst, cells = max(worst, float(np.abs(level - truth).max())), cells + int(inside.sum())
        same(f"{name}: {len(points)} points, {len(faces)} faces, {note}; worst {worst:.4f} m: kept", worst <= tolerance + 0.002, True)
        covered = cells >= np.isfinite(value).sum() * 0.9
        same(f"{name}: covers its map", bool(covered), True)


epsg = clouds()
rasters = maps(epsg)
vectors(epsg)
dxf()
glb()
ifc()
surfaces(rasters)
print("every file of the run opens and agrees")
