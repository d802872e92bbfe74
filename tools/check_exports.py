#!/usr/bin/env python3
"""Opens every export with a reader that is not ours and holds them against each other.

    python3 -m venv .venv && .venv/bin/pip install laspy lazrs pyproj ezdxf ifcopenshell rasterio pyogrio \
        trimesh scipy pygltflib lxml plyfile pytest \
        openpyxl matplotlib
    cargo run --release -p io --example exports -- exports
    .venv/bin/python tools/check_exports.py exports

The block corners from DXF (ezdxf), GLB (trimesh) and IFC (ifcopenshell) must be the same places; positions, counts,
CRS and columns must be those of the sample in crates/io/tests/files/sample.rs.
"""

import json
import struct
import sys
from pathlib import Path

import numpy as np

FOLDER = Path(sys.argv[1])
ORIGIN = np.array([-35600.5, -12300.25, 2.0])
UNITS = ["R1", "R2", "R3", "R4", "R5", "P1", "P2", "P3"]


def same(what, a, b):
    if a != b:
        sys.exit(f"{what}: {a} instead of {b}")
    print(f"  {what}: {a}")


def close(what, a, b, tolerance):
    worst = float(np.abs(np.asarray(a) - np.asarray(b)).max())
    if not worst <= tolerance:
        sys.exit(f"{what}: off by {worst}, allowed {tolerance}")
    print(f"  {what}: within {worst:.2g}")


def ordered(points):
    points = np.unique(np.round(np.asarray(points, float), 3), axis=0)
    return points[np.lexsort(points.T)]


def cloud():
    import laspy

    print("cloud (laspy)")
    n = 120_001
    t = np.arange(n)
    truth = np.c_[-35678.1234 + np.sin(t * 0.37) * 40, -12345.6789 + t * 0.001, 2.5 + np.cos(t * 0.11)]
    for name, count in [("cloud.laz", n), ("cloud.las", 1000)]:
        las = laspy.read(FOLDER / name)
        same(name, len(las), count)
        close("positions, m", las.xyz, truth[:count], 0.000_051)
        same("instance", las.instance.dtype, np.dtype("uint32"))
        same("model", las.model.dtype, np.dtype("uint16"))
        same("confidence", las.confidence.dtype, np.dtype("float32"))
        same("labels", bool((las.instance == t[:count] % 7 * 1000).all() and (las.model == t[:count] % 3).all()), True)
        same("CRS", las.header.parse_crs().to_epsg(), 6679)
        close("bounds", [las.header.mins, las.header.maxs], [las.xyz.min(0), las.xyz.max(0)], 1e-9)
        same("scale", list(las.header.scales), [0.0001] * 3)
    from plyfile import PlyData

    ply = PlyData.read(FOLDER / "cloud.ply")["vertex"]
    close("cloud.ply positions, m", np.c_[ply["x"], ply["y"], ply["z"]], truth[:1000], 0)
    same("cloud.ply labels", bool((ply["instance"] == t[:1000] % 7 * 1000).all()), True)


def raster():
    import rasterio

    print("height.tif (GDAL through rasterio)")
    with rasterio.open(FOLDER / "height.tif") as image:
        same("CRS", image.crs.to_epsg(), 6679)
        same("size", (image.width, image.height), (7, 5))
        same("nodata", str(image.nodata), "nan")
        data = image.read(1)
        row, column = image.index(-35600.25 + 3 * 0.5, -12300.75 + 4 * 0.5)
        same("value 3 cells east, 4 north of the first", float(data[row, column]), 43.0)
        same("holes", int(np.isnan(data).sum()), 1)


def vectors():
    import pyogrio

    print("blocks.gpkg, blocks.geojson (GDAL through pyogrio)")
    for layer, count in [("blocks", 5), ("placements", 3)]:
        info = pyogrio.read_info(FOLDER / "blocks.gpkg", layer=layer)
        same(layer, info["features"], count)
        same("CRS", info["crs"], "EPSG:6679")
    same("runs", pyogrio.read_info(FOLDER / "blocks.gpkg", layer="runs")["features"], 1)
    info = pyogrio.read_info(FOLDER / "blocks.geojson")
    same("GeoJSON features", info["features"], 8)
    same("CRS", info["crs"], "EPSG:6679")
    same("first x", round(float(info["total_bounds"][0]), 6), -35600.5)


def dxf_corners():
    import ezdxf

    print("blocks.dxf (ezdxf)")
    document = ezdxf.readfile(FOLDER / "blocks.dxf")
    same("errors of the audit", len(document.audit().errors), 0)
    space = document.modelspace()
    solids = [i for i in space.query("INSERT") if i.dxf.layer.endswith("_3D")]
    numbers = [i for i in space.query("INSERT") if i.dxf.layer == "NUMBERS"]
    same("solids", len(solids), 8)
    same("numbers as attributes", sorted(i.get_attrib_text("NO") for i in numbers), sorted(UNITS))
    same("names survive", {ezdxf.lldxf.encoding.decode_dxf_unicode(i.get_attrib_text("TYPE")) for i in numbers}, {"wedge-2m", "wedge 3m (積)"})
    same("layers frozen at first", sorted(l.dxf.name for l in document.layers if l.is_frozen()), ["PLANNED_3D", "RECOGNISED_3D"])
    corners = {}
    for insert in solids:
        label = insert.get_xdata("TSUMU")[0].value
        faces = insert.virtual_entities()
        corners[label] = ordered([v for face in faces for v in face.wcs_vertices()])
    return corners


def glb_corners():
    import pygltflib
    import trimesh

    print("blocks.glb (pygltflib, trimesh)")
    document = pygltflib.GLTF2().load(FOLDER / "blocks.glb")
    same("origin", document.asset.extras["origin_m"], ORIGIN.tolist())
    scene = trimesh.load(FOLDER / "blocks.glb")
    corners = {}
    for label in UNITS:
        transform, geometry = scene.graph[label]
        mesh = scene.geometry[geometry]
        points = trimesh.transform_points(mesh.vertices, transform)
        # The file is y up: x east, y up, z south.
        corners[label] = ordered(np.c_[points[:, 0], -points[:, 2], points[:, 1]] + ORIGIN)
    return corners


def ifc_corners():
    import ifcopenshell
    import ifcopenshell.geom
    import ifcopenshell.validate

    print("blocks.ifc (ifcopenshell)")
    model = ifcopenshell.open(str(FOLDER / "blocks.ifc"))
    same("schema", model.schema_identifier, "IFC4X3_ADD2")
    log = ifcopenshell.validate.json_logger()
    ifcopenshell.validate.validate(model, log, express_rules=True)
    for statement in log.statements[:5]:
        print("   ", statement)
    same("findings of validate with EXPRESS rules", len(log.statements), 0)
    parts = model.by_type("IfcBuildingElementPart")
    same("kind", {p.PredefinedType for p in parts}, {"ARMOURUNIT"})
    same("names", sorted(p.Name for p in parts), sorted(UNITS))
    conversion = model.by_type("IfcMapConversion")[0]
    origin = np.array([conversion.Eastings, conversion.Northings, conversion.OrthogonalHeight])
    close("map conversion", origin, ORIGIN, 0)
    settings = ifcopenshell.geom.settings()
    settings.set("use-world-coords", True)
    corners = {}
    for part in parts:
        shape = ifcopenshell.geom.create_shape(settings, part)
        corners[part.Name] = ordered(np.array(shape.geometry.verts).reshape(-1, 3) + origin)
    return corners


def surface():
    from lxml import etree

    print("surface.xml (lxml)")
    root = etree.parse(str(FOLDER / "surface.xml")).getroot()
    name = {"l": "http://www.landxml.org/schema/LandXML-1.2"}
    same("points", len(root.findall(".//l:Pnts/l:P", name)), 4)
    same("faces", [f.text for f in root.findall(".//l:Faces/l:F", name)], ["1 2 3", "1 3 4"])
    first = [float(v) for v in root.find(".//l:P", name).text.split()]
    same("first point: north, east, up", first, [-12300.0, -35600.125, 1.0])


def drawing():
    """The drawing of the whole set, rendered as a person sees it; the picture is left beside it."""
    import ezdxf
    from ezdxf.addons.drawing import matplotlib

    print("set/blocks.dxf (ezdxf, drawn with matplotlib)")
    document = ezdxf.readfile(FOLDER / "set/blocks.dxf")
    same("errors of the audit", len(document.audit().errors), 0)
    space = document.modelspace()
    words = [ezdxf.lldxf.encoding.decode_dxf_unicode(t.dxf.text) for t in space.query("TEXT")]
    same("title, stations, north, levels", [w for w in ("Sample 積む & \"co\"", "No.0+5", "N", "4.0") if w not in words], [])
    same("layers used", {e.dxf.layer for e in space} >= {"DESIGN", "ALIGNMENT", "UNFILLED", "SECTIONS_LAID_OUT", "TITLE"}, True)
    picture = FOLDER / "blocks-dxf.png"
    matplotlib.qsave(space, str(picture), bg="#FFFFFF", dpi=130)
    same("a picture with something on it", picture.stat().st_size > 10_000, True)


def office():
    """Workbook, styled GeoPackage, alignment: what an office reads."""
    import openpyxl
    import pyogrio
    import rasterio
    from lxml import etree

    print("set/quantities.xlsx (openpyxl)")
    book = openpyxl.load_workbook(FOLDER / "set/quantities.xlsx")
    sheet = book.worksheets[0]
    same("volume as a formula", sheet["E3"].value, "=(D2+D3)/2*C3")
    values = openpyxl.load_workbook(FOLDER / "set/quantities.xlsx", data_only=True).worksheets[0]
    same("and as a value", (values["E3"].value, values["E4"].value), (10, 10))
    same("rows of the schedule", book.worksheets[1].max_row, 4)
    same("order, type", [c.value for c in book.worksheets[1][2]][:3:2], [1, "wedge-2m"])

    print("set/project.gpkg, images (GDAL)")
    for layer, count in [("blocks", 5), ("placements", 3), ("not_judged", 1), ("design", 1), ("alignment", 1), ("sections", 2), ("unfilled", 1)]:
        same(layer, pyogrio.read_info(FOLDER / "set/project.gpkg", layer=layer)["features"], count)
    same("styles", pyogrio.read_info(FOLDER / "set/project.gpkg", layer="layer_styles")["features"], 7)
    with rasterio.open(FOLDER / "set/deficit-before.tif") as image:
        same("band", image.descriptions, ("deficit-before, metres",))
        same("unit", image.units, ("metre",))

    print("set/surfaces.xml (lxml)")
    root = etree.parse(str(FOLDER / "set/surfaces.xml")).getroot()
    name = {"l": "http://www.landxml.org/schema/LandXML-1.2"}
    same("date of the survey", root.get("date"), "2026-11-30")
    same("alignment", root.find(".//l:Alignment", name).get("length"), "20")
    same("cross-section", root.find(".//l:CrossSect", name).get("sta"), "5")


cloud()
raster()
vectors()
surface()
drawing()
office()
dxf, glb, ifc = dxf_corners(), glb_corners(), ifc_corners()
print("corners of every block in DXF, GLB and IFC")
for label in UNITS:
    same(label, (dxf[label].shape, glb[label].shape, ifc[label].shape), ((6, 3),) * 3)
    close("DXF and GLB, m", dxf[label], glb[label], 0.002)
    close("DXF and IFC, m", dxf[label], ifc[label], 0.002)
print("all exports agree")
