"""Surveys, designs and meshes by independent writers, through `tsumu check`: read as what they mean, or refused by name.

pip install laspy[lazrs] plyfile pye57 rasterio ezdxf numpy; python tools/check_readers.py target/release/tsumu [NAME…]
"""

import json
import pathlib
import struct
import subprocess
import sys
import tempfile

import ezdxf
import laspy
import numpy as np
import plyfile
import pye57
import rasterio
from rasterio.transform import from_origin

EAST, NORTH, LEVEL = 41250.0, -98760.0, 3.4
WKT_6677 = 'PROJCS["JGD2011 / Japan Plane Rectangular CS IX",AUTHORITY["EPSG","6677"]]'


def surface(count=6000, seed=7):
    """A wavy heap of 10 m by 10 m: east, north, height."""
    rng = np.random.default_rng(seed)
    xy = rng.uniform(-5, 5, (count, 2))
    xy[:4] = [[-5, -5], [5, -5], [5, 5], [-5, 5]]
    z = 2 - 0.04 * (xy**2).sum(1) + 0.5 * np.sin(2 * xy[:, 0]) * np.sin(2 * xy[:, 1])
    return np.column_stack([xy + [EAST, NORTH], z])


POINTS = surface()
SITE = 'name = "case"\ncrs = "{crs}"\naxis_order = "{axes}"\n[[survey]]\nfile = "{survey}"\nsensor = "uav"\nvertical_offset_m = 0.0\n{more}'
CATALOG = '[[block]]\nname = "{name}"\n{block}\n'
TETRAPOD = 'shape = "tetrapod 2m"'
CASES = {}


def case(expected, crs="EPSG:6679", axes="east-north", more=""):
    """A case: the function writes files into a folder and returns the survey's name, or (survey, design, lines of [design_file])."""

    def register(function):
        CASES[function.__name__] = (function, expected, crs, axes, more)
        return function

    return register


# ---- what is right

def as_meant(points=POINTS, within=0.011):
    low, high = points.min(0), points.max(0)

    def holds(code, found, text):
        if code != 0 or len(found["surveys"]) != 1:
            return False
        look = found["surveys"][0]
        return np.abs(np.array(look["low"]) - low).max() < within and np.abs(np.array(look["high"]) - high).max() < within

    return holds


def refused(*words):
    return lambda code, found, text: code == 2 and all(w.lower() in text.lower() for w in words)


def either(*checks):
    return lambda *r: any(c(*r) for c in checks)


def also(check, *words):
    return lambda code, found, text: check(code, found, text) and all(w.lower() in text.lower() for w in words)


def design_at(level=LEVEL, within=0.006):
    def holds(code, found, text):
        levels = (found or {}).get("design_levels_m")
        return code == 0 and levels and abs(levels[0] - level) < within and abs(levels[1] - level) < within

    return holds


# ---- text

def text(folder, name, lines, end="\n", encoding="utf-8", head=b""):
    (folder / name).write_bytes(head + (end.join(lines) + end).encode(encoding))
    return name


def comma(v, digits=3, thousands=""):
    s = f"{v:,.{digits}f}".replace(",", "\x00").replace(".", ",")
    return s.replace("\x00", thousands)


@case(as_meant())
def tab_and_decimal_comma(f):
    return text(f, "a.txt", ["X\tY\tZ", *("\t".join(comma(v) for v in p) for p in POINTS)])


@case(as_meant())
def blank_and_decimal_comma(f):
    return text(f, "a.xyz", [" ".join(comma(v) for v in p) for p in POINTS])


@case(either(as_meant(), refused("line 2")))
def semicolon_and_thousands_dots(f):
    return text(f, "a.csv", ["East;North;Height", *(";".join(comma(v, 3, ".") for v in p) for p in POINTS)])


@case(as_meant())
def quoted_cells(f):
    return text(f, "a.csv", ['"x","y","z"', *(",".join(f'"{v:.3f}"' for v in p) for p in POINTS)])


@case(as_meant())
def german_names(f):
    return text(f, "a.csv", ["Punkt;Rechtswert;Hochwert;Höhe", *(";".join([f"P{i}", *(comma(v) for v in p)]) for i, p in enumerate(POINTS))])


@case(as_meant(), axes="north-east")
def german_names_whatever_the_order_of_axes(f):
    return german_names(f)


@case(as_meant())
def names_with_units(f):
    return text(f, "a.csv", ["Easting (m),Northing (m),Elevation (m)", *(",".join(f"{v:.3f}" for v in p) for p in POINTS)])


@case(either(as_meant(), refused("f")))
def heights_named_in_feet(f):
    return text(f, "a.csv", ["Easting (m),Northing (m),Elevation (ft)", *(f"{e:.3f},{n:.3f},{z / 0.3048:.4f}" for e, n, z in POINTS)])


@case(as_meant(), axes="north-east")
def japanese_names_in_shift_jis(f):
    return text(f, "a.csv", ["点番号,X座標,Y座標,標高", *(f"{i + 1},{n:.3f},{e:.3f},{z:.3f}" for i, (e, n, z) in enumerate(POINTS))], encoding="cp932")


@case(as_meant())
def cloudcompare_header(f):
    return text(f, "a.txt", ["//X Y Z R G B Intensity", str(len(POINTS)), *(f"{e:.3f} {n:.3f} {z:.3f} 10 20 30 0.5" for e, n, z in POINTS)])


@case(as_meant())
def pts_with_count(f):
    return text(f, "a.pts", [str(len(POINTS)), *(f"{e:.3f} {n:.3f} {z:.3f} -1200 10 20 30" for e, n, z in POINTS)])


@case(as_meant())
def byte_order_mark_and_crlf(f):
    return text(f, "a.csv", ["x,y,z", *(",".join(f"{v:.3f}" for v in p) for p in POINTS)], "\r\n", head=b"\xef\xbb\xbf")


@case(either(as_meant(), refused("UTF-16")))
def utf_16_big_endian_without_mark(f):
    return text(f, "a.txt", ["x\ty\tz", *("\t".join(f"{v:.3f}" for v in p) for p in POINTS)], encoding="utf-16-be")


@case(either(as_meant(), refused("UTF-32")))
def utf_32_with_mark(f):
    return text(f, "a.txt", ["x\ty\tz", *("\t".join(f"{v:.3f}" for v in p) for p in POINTS)], encoding="utf-32")


@case(as_meant())
def latin_names_in_latin_1(f):
    return text(f, "a.csv", ["Punkt;Rechtswert;Hochwert;Höhe", *(";".join([f"P{i}", *(comma(v) for v in p)]) for i, p in enumerate(POINTS))], encoding="latin-1")


@case(as_meant())
def trailing_separators(f):
    return text(f, "a.csv", ["x,y,z,", *(",".join(f"{v:.3f}" for v in p) + "," for p in POINTS)])


@case(either(as_meant(POINTS[3:]), refused("line")))
def not_a_number_here_and_there(f):
    lines = [",".join(f"{v:.3f}" for v in p) for p in POINTS[3:]]
    return text(f, "a.csv", ["x,y,z", "1,2,nan", "41250.0,-98760.0,NaN", *lines])


def no_value(f, value):
    lines = [f"{e:.3f},{n:.3f},{z:.3f}" for e, n, z in POINTS]
    lines[5:5] = [f"{EAST:.3f},{NORTH:.3f},{value}", f"{EAST + 1:.3f},{NORTH:.3f},{value}"]
    return text(f, "a.csv", ["x,y,z", *lines])


NO_VALUE = either(as_meant(), refused("line"))


@case(NO_VALUE)
def no_value_minus_32768(f):
    return no_value(f, "-32768")


@case(NO_VALUE)
def no_value_99999(f):
    return no_value(f, "99999.0")


@case(NO_VALUE)
def no_value_largest_float(f):
    return no_value(f, "-3.4028234663852886e+38")


@case(refused("latitude"))
def degrees_by_name(f):
    return text(f, "a.csv", ["lon,lat,height", *(f"{140 + (e - EAST) / 9e4:.8f},{41 + (n - NORTH) / 1.1e5:.8f},{z:.3f}" for e, n, z in POINTS)])


@case(either(refused("deg"), refused("m large, the survey only")))
def degrees_without_names(f):
    return text(f, "a.xyz", [f"{140 + (e - EAST) / 9e4:.8f} {41 + (n - NORTH) / 1.1e5:.8f} {z:.3f}" for e, n, z in POINTS])


@case(also(as_meant(POINTS - [0, 0, 10]), "depth"))
def depths_counted_downwards(f):
    return text(f, "a.csv", ["easting,northing,depth", *(f"{e:.3f},{n:.3f},{10 - z:.3f}" for e, n, z in POINTS)])


@case(refused("depth"))
def depths_that_may_be_heights(f):
    return text(f, "a.csv", ["easting,northing,depth", *(f"{e:.3f},{n:.3f},{-z:.3f}" for e, n, z in POINTS)])


@case(refused("counts"))
def point_number_first_tabs(f):
    return text(f, "a.txt", ["\t".join([str(i + 1), *(f"{v:.3f}" for v in p)]) for i, p in enumerate(POINTS)])


@case(either(as_meant(), refused("counts")))
def point_number_from_1000_in_tens(f):
    return text(f, "a.txt", [" ".join([str(1000 + 10 * i), *(f"{v:.3f}" for v in p)]) for i, p in enumerate(POINTS)])


@case(as_meant())
def columns_after_others(f):
    return text(f, "a.csv", ["code,time,x,y,z,red", *(f"ARM,12:30:0{i % 9},{e:.3f},{n:.3f},{z:.3f},7" for i, (e, n, z) in enumerate(POINTS))])


@case(as_meant())
def numpy_exponents(f):
    np.savetxt(f / "a.txt", POINTS, header="x y z", fmt="%.12e")
    return "a.txt"


@case(as_meant())
def names_in_capitals_with_blanks(f):
    return text(f, "a.csv", [" EASTING , NORTHING , ELEV ", *(f" {e:.3f} , {n:.3f} , {z:.3f} " for e, n, z in POINTS)])


@case(as_meant(), axes="north-east")
def x_is_north_when_the_site_says_so(f):
    return text(f, "a.csv", ["x,y,z", *(f"{n:.3f},{e:.3f},{z:.3f}" for e, n, z in POINTS)])


@case(as_meant(), axes="north-east")
def japanese_full_width_names(f):
    return text(f, "a.csv", ["測点，Ｘ，Ｙ，標高".replace("，", ","), *(f"T{i},{n:.3f},{e:.3f},{z:.3f}" for i, (e, n, z) in enumerate(POINTS))])


@case(as_meant())
def semicolon_with_points_and_percent_comment(f):
    return text(f, "a.txt", ["% scanner 3", "% x;y;z", *(";".join(f"{v:.3f}" for v in p) for p in POINTS)])


@case(either(as_meant(), refused("nowhere on earth")))
def intensity_before_the_coordinates(f):
    return text(f, "a.txt", [f"{i % 90} {e:.3f} {n:.3f} {z:.3f}" for i, (e, n, z) in enumerate(POINTS)])


@case(refused("line 4"))
def a_line_that_ends_early(f):
    lines = [f"{e:.3f},{n:.3f},{z:.3f}" for e, n, z in POINTS]
    lines[2] = lines[2].rsplit(",", 1)[0]
    return text(f, "a.csv", ["x,y,z", *lines])


@case(refused("a.csv"))
def two_columns_only(f):
    return text(f, "a.csv", ["x,y", *(f"{e:.3f},{n:.3f}" for e, n, z in POINTS)])


# ---- LAS

def las(folder, points=POINTS, name="a.laz", point_format=6, wkt=None, change=None, scale=0.001, **header):
    head = laspy.LasHeader(point_format=point_format, version="1.4" if point_format > 5 else "1.2")
    head.offsets, head.scales = [41250, -98760, 0], [scale] * 3
    if wkt:
        head.vlrs.append(laspy.vlrs.known.WktCoordinateSystemVlr(wkt))
        head.global_encoding.wkt = True
    data = laspy.LasData(head)
    data.x, data.y, data.z = points.T
    if change:
        change(data)
    data.write(folder / name)
    return name


def geo_keys(folder, keys, doubles=(), texts=b""):
    head = laspy.LasHeader(point_format=1, version="1.2")
    head.offsets, head.scales = [41250, -98760, 0], [0.001] * 3
    body = struct.pack("<4H", 1, 1, 0, len(keys)) + b"".join(struct.pack("<4H", *k) for k in keys)
    head.vlrs.append(laspy.VLR("LASF_Projection", 34735, "", body))
    if texts:
        head.vlrs.append(laspy.VLR("LASF_Projection", 34737, "", texts))
    data = laspy.LasData(head)
    data.x, data.y, data.z = POINTS.T
    data.write(folder / "a.las")
    return "a.las"


@case(refused("6677", "6679"))
def wkt_of_zone_9(f):
    return las(f, wkt=WKT_6677)


@case(refused("6677", "6679"))
def keys_of_zone_9(f):
    return geo_keys(f, [(1024, 0, 1, 1), (3072, 0, 1, 6677)])


@case(as_meant())
def keys_of_the_site(f):
    return geo_keys(f, [(1024, 0, 1, 1), (3072, 0, 1, 6679), (3076, 0, 1, 9001)])


@case(refused("foot"))
def keys_in_feet(f):
    return geo_keys(f, [(1024, 0, 1, 1), (3072, 0, 1, 2227), (3076, 0, 1, 9003)])


@case(refused("deg"))
def keys_geographic(f):
    return geo_keys(f, [(1024, 0, 1, 2), (2048, 0, 1, 4326)])


@case(either(refused("deg"), refused("geographic")))
def wkt_geographic(f):
    return las(f, wkt='GEOGCS["WGS 84",DATUM["WGS_1984",SPHEROID["WGS 84",6378137,298.257223563]],PRIMEM["Greenwich",0],UNIT["degree",0.0174532925199433],AUTHORITY["EPSG","4326"]]')


@case(as_meant())
def vertical_key_in_feet_is_converted(f):
    points = POINTS.copy()
    name = geo_keys(f, [(1024, 0, 1, 1), (3072, 0, 1, 6679), (4099, 0, 1, 9003)])
    data = laspy.read(f / name)
    data.z = points[:, 2] / (1200 / 3937)
    data.write(f / name)
    return name


@case(also(as_meant(), "class 7"))
def noise_of_format_3(f):
    noise = np.vstack([POINTS, POINTS[:300] + [0, 0, 40]])
    return las(f, noise, point_format=3, change=lambda d: d.__setattr__("classification", np.r_[np.full(len(POINTS), 2), np.full(300, 7)].astype(np.uint8)))


@case(also(as_meant(), "withheld"))
def withheld_of_format_8(f):
    noise = np.vstack([POINTS, POINTS[:300] - [0, 0, 30]])
    return las(f, noise, point_format=8, change=lambda d: d.__setattr__("withheld", np.r_[np.zeros(len(POINTS)), np.ones(300)].astype(bool)))


@case(also(as_meant(within=0.06), "steps of 0.05"))
def steps_of_5_cm(f):
    return las(f, scale=0.05)


@case(refused("steps of 0.1"))
def steps_of_10_cm(f):
    return las(f, scale=0.1)


@case(refused("steps of 1"))
def whole_metres(f):
    return las(f, scale=1.0)


@case(either(as_meant(), refused("a.laz")))
def cut_extended_record(f):
    name = las(f, wkt=None)
    data = (f / name).read_bytes()
    raw = bytearray(data)
    raw[235:243], raw[243:247] = struct.pack("<Q", len(data)), struct.pack("<I", 1)
    (f / name).write_bytes(bytes(raw) + struct.pack("<H16sHQ32s", 0, b"LASF_Projection", 2112, 4000, b"") + b"PROJCS[")
    return name


@case(refused("a.laz"))
def cut_in_the_middle(f):
    name = las(f)
    data = (f / name).read_bytes()
    (f / name).write_bytes(data[: len(data) // 2])
    return name


@case(refused("a.las"))
def las_cut_in_the_middle(f):
    name = las(f, name="a.las")
    data = (f / name).read_bytes()
    (f / name).write_bytes(data[: len(data) // 2])
    return name


@case(also(as_meant(), "far"))
def strays_at_zero_and_20_km(f):
    return las(f, np.vstack([POINTS, [[0, 0, 0], [EAST + 20_000, NORTH, 2], [EAST, NORTH, 900]]]))


@case(also(as_meant(), "water"))
def water_of_format_1(f):
    points = np.vstack([POINTS, POINTS[:500] * [1, 1, 0] + [0, 0, -6]])
    return las(f, points, point_format=1, change=lambda d: d.__setattr__("classification", np.r_[np.zeros(len(POINTS)), np.full(500, 9)].astype(np.uint8)))


@case(as_meant())
def las_box_of_the_header_is_wrong(f):
    name = las(f, name="a.las")
    raw = bytearray((f / name).read_bytes())
    raw[179:227] = struct.pack("<6d", 9, 8, 7, 6, 5, 4)
    (f / name).write_bytes(bytes(raw))
    return name


@case(either(as_meant(), refused("a.las")))
def las_header_counts_too_many(f):
    name = las(f, name="a.las", point_format=3)
    raw = bytearray((f / name).read_bytes())
    raw[107:111] = struct.pack("<I", len(POINTS) + 1000)
    (f / name).write_bytes(bytes(raw))
    return name


WKT2 = 'COMPOUNDCRS["x",PROJCRS["JGD2011 / Japan Plane Rectangular CS XI",BASEGEOGCRS["JGD2011",DATUM["JGD2011",ELLIPSOID["GRS 1980",6378137,298.257222101]]],CONVERSION["XI",METHOD["Transverse Mercator"]],CS[Cartesian,2],AXIS["northing (X)",north],AXIS["easting (Y)",east],LENGTHUNIT["metre",1],ID["EPSG",6679]],VERTCRS["JGD2011 (vertical) height",VDATUM["x"],CS[vertical,1],AXIS["height",up],LENGTHUNIT["{unit}",{metres}],ID["EPSG",6695]]]'


@case(as_meant())
def compound_wkt_2(f):
    return las(f, wkt=WKT2.format(unit="metre", metres=1))


@case(also(as_meant(), "foot"))
def compound_wkt_2_with_heights_in_feet(f):
    return las(f, POINTS / [1, 1, 0.3048], wkt=WKT2.format(unit="foot", metres=0.3048))


# ---- PLY, PCD, E57

def ply(folder, fields, text=False, order="<", comments=()):
    vertex = np.zeros(len(POINTS), dtype=[(n, t) for n, t, _ in fields])
    for name, _, values in fields:
        vertex[name] = values
    element = plyfile.PlyElement.describe(vertex, "vertex")
    plyfile.PlyData([element], text=text, byte_order=order, comments=list(comments)).write(str(folder / "a.ply"))
    return "a.ply"


XYZ = [("x", "f8", POINTS[:, 0]), ("y", "f8", POINTS[:, 1]), ("z", "f8", POINTS[:, 2])]


@case(as_meant())
def ply_with_negative_labels_and_classes(f):
    return ply(f, [*XYZ, ("label", "i4", -1), ("scalar_Classification", "f4", 2)])


@case(as_meant())
def ply_big_endian_after_colours(f):
    return ply(f, [("red", "u1", 3), *XYZ], order=">")


@case(refused("6677"))
def ply_with_comment_of_zone_9(f):
    return ply(f, XYZ, text=True, comments=["crs EPSG:6677"])


def pcd(folder, viewpoint, points=POINTS, kind="ascii"):
    head = f"# .PCD v0.7\nVERSION 0.7\nFIELDS x y z\nSIZE 8 8 8\nTYPE F F F\nCOUNT 1 1 1\nWIDTH {len(points)}\nHEIGHT 1\nVIEWPOINT {viewpoint} 1 0 0 0\nPOINTS {len(points)}\nDATA {kind}\n"
    body = points.astype("<f8").tobytes() if kind == "binary" else "".join(f"{e:.3f} {n:.3f} {z:.3f}\n" for e, n, z in points).encode()
    (folder / "a.pcd").write_bytes(head.encode() + body)
    return "a.pcd"


@case(as_meant())
def pcd_binary(f):
    return pcd(f, "0 0 0", kind="binary")


@case(as_meant())
def pcd_with_a_place_far_away(f):
    return pcd(f, "0 0 5000")


def e57(folder, translation, local, turn=None):
    writer = pye57.E57(str(folder / "a.e57"), mode="w")
    data = {"cartesianX": local[:, 0], "cartesianY": local[:, 1], "cartesianZ": local[:, 2]}
    writer.write_scan_raw(data, rotation=np.array(turn or [1.0, 0, 0, 0]), translation=np.array(translation))
    writer.close()
    return "a.e57"


@case(as_meant())
def e57_with_a_shift(f):
    return e57(f, [EAST, NORTH, 0.0], POINTS - [EAST, NORTH, 0])


@case(as_meant())
def e57_turned_by_a_quarter(f):
    local = POINTS - [EAST, NORTH, 0]
    half = np.sqrt(0.5)
    return e57(f, [EAST, NORTH, 0.0], np.column_stack([local[:, 1], -local[:, 0], local[:, 2]]), [half, 0, 0, half])


@case(as_meant())
def e57_two_scans_of_one_site(f):
    writer = pye57.E57(str(f / "a.e57"), mode="w")
    for part, shift in ((POINTS[::2], [EAST, NORTH, 0.0]), (POINTS[1::2], [EAST + 3, NORTH, 1.0])):
        local = part - shift
        data = {"cartesianX": local[:, 0], "cartesianY": local[:, 1], "cartesianZ": local[:, 2]}
        writer.write_scan_raw(data, rotation=np.array([1.0, 0, 0, 0]), translation=np.array(shift))
    writer.close()
    return "a.e57"


# ---- designs

def with_design(folder, design, more="cell_m = 0.1"):
    return las(folder), design, more


def tif(folder, values, epsg="EPSG:6679", size=32, origin=(EAST - 4, NORTH + 4), edge=8.0, tags=None, scale=None, offset=None, **profile):
    values = np.full((size, size), values) if np.isscalar(values) else values
    profile = {"driver": "GTiff", "height": size, "width": size, "count": 1, "dtype": values.dtype, "crs": epsg,
               "transform": from_origin(*origin, edge / size, edge / size), **profile}
    with rasterio.open(folder / "d.tif", "w", **profile) as out:
        out.write(values, 1)
        if scale is not None:
            out.scales, out.offsets = [scale], [offset or 0.0]
        if tags:
            out.update_tags(1, **tags)
    return with_design(folder, "d.tif", "")


@case(design_at())
def tif_float_deflate_tiled(f):
    return tif(f, np.full((32, 32), LEVEL, np.float32), compress="deflate", tiled=True, blockxsize=16, blockysize=16)


@case(design_at())
def tif_predictor_3(f):
    return tif(f, np.full((32, 32), LEVEL, np.float32), compress="lzw", predictor=3)


@case(design_at())
def tif_uint16_scale_and_offset(f):
    return tif(f, np.full((32, 32), 1340, np.uint16), scale=0.01, offset=-10.0)


@case(design_at())
def tif_int32_millimetres_by_scale(f):
    return tif(f, np.full((32, 32), 3400, np.int32), scale=0.001)


def holed(value, dtype):
    values = np.full((32, 32), LEVEL, dtype)
    values[:10] = value
    return values


@case(design_at())
def tif_no_data_lowest_float(f):
    return tif(f, holed(-3.4028234663852886e38, np.float32), nodata=-3.4028234663852886e38)


@case(design_at())
def tif_no_data_nan(f):
    return tif(f, holed(np.nan, np.float32), nodata=np.nan)


@case(design_at())
def tif_nan_without_no_data(f):
    return tif(f, holed(np.nan, np.float64))


@case(either(design_at(), refused("-9999")))
def tif_minus_9999_not_declared(f):
    return tif(f, holed(-9999, np.float32))


@case(either(design_at(), refused("foot"), refused("feet")))
def tif_unit_of_the_band_feet(f):
    def make(f):
        with_design(f, "d.tif", "")
        profile = {"driver": "GTiff", "height": 32, "width": 32, "count": 1, "dtype": "float32", "crs": "EPSG:6679", "transform": from_origin(EAST - 4, NORTH + 4, 0.25, 0.25)}
        with rasterio.open(f / "d.tif", "w", **profile) as out:
            out.write(np.full((32, 32), LEVEL / 0.3048, np.float32), 1)
            out.units = ["ft"]
        return with_design(f, "d.tif", "")

    return make(f)


@case(refused("6677"))
def tif_of_zone_9(f):
    return tif(f, np.full((32, 32), LEVEL, np.float32), epsg="EPSG:6677")


@case(either(refused("deg"), refused("geographic")))
def tif_geographic(f):
    return tif(f, np.full((32, 32), LEVEL, np.float32), epsg="EPSG:4326", origin=(140, 41), edge=1e-4)


@case(refused("height"))
def tif_of_another_height(f):
    return tif(f, np.full((32, 32), 340.0, np.float32))


@case(design_at())
def tif_big_endian_int16_whole_metres_by_scale(f):
    return tif(f, np.full((32, 32), 34, np.int16), scale=0.1, ENDIANNESS="BIG")


@case(either(design_at(), refused("mask")))
def tif_with_a_mask(f):
    values = np.full((32, 32), LEVEL, np.float32)
    values[:8] = 900
    made = tif(f, values)
    with rasterio.Env(GDAL_TIFF_INTERNAL_MASK=True), rasterio.open(f / "d.tif", "r+") as out:
        mask = np.full((32, 32), 255, np.uint8)
        mask[:8] = 0
        out.write_mask(mask)
    return made


@case(either(design_at(), refused("band")))
def tif_of_two_bands(f):
    made = with_design(f, "d.tif", "")
    profile = {"driver": "GTiff", "height": 32, "width": 32, "count": 2, "dtype": "float32", "crs": "EPSG:6679", "transform": from_origin(EAST - 4, NORTH + 4, 0.25, 0.25)}
    with rasterio.open(f / "d.tif", "w", **profile) as out:
        out.write(np.full((32, 32), LEVEL, np.float32), 1)
        out.write(np.full((32, 32), 900, np.float32), 2)
    return made


@case(either(design_at(), refused("north-up")))
def tif_turned(f):
    return tif(f, np.full((32, 32), LEVEL, np.float32), transform=rasterio.Affine.translation(EAST - 4, NORTH + 4) * rasterio.Affine.rotation(10) * rasterio.Affine.scale(0.25, -0.25))


@case(refused("d.tif"))
def tif_without_a_place(f):
    return tif(f, np.full((32, 32), LEVEL, np.float32), transform=rasterio.Affine.identity())


def landxml(folder, surfaces, units='<Metric linearUnit="meter" areaUnit="squareMeter" volumeUnit="cubicMeter"/>', more="cell_m = 0.1", factor=1.0, system="", faces=None, space="http://www.landxml.org/schema/LandXML-1.2", swap=False):
    def points(level):
        corners = [(-4, -4), (4, -4), (4, 4), (-4, 4)]
        rows = [(NORTH + n, EAST + e, level) for e, n in corners]
        return "".join(f'<P id="{i + 1}">{" ".join(f"{v / factor:.6f}" for v in r)}</P>' for i, r in enumerate(rows))

    faces = faces or "<F>1 2 3</F><F>1 3 4</F>"
    body = "".join(f'<Surface name="{n}"><Definition surfType="TIN"><Pnts>{points(z)}</Pnts><Faces>{faces}</Faces></Definition></Surface>' for n, z in surfaces)
    (folder / "d.xml").write_text(f'<?xml version="1.0"?><LandXML xmlns="{space}" version="1.2"><Units>{units}</Units>{system}<Surfaces>{body}</Surfaces></LandXML>')
    return with_design(folder, "d.xml", more)


@case(design_at())
def landxml_1_0(f):
    return landxml(f, [("FG", LEVEL)], space="http://www.landxml.org/schema/LandXML-1.0")


@case(either(design_at(), refused("foot")))
def landxml_in_us_feet(f):
    return landxml(f, [("FG", LEVEL)], '<Imperial linearUnit="USSurveyFoot"/>', factor=1200 / 3937)


@case(either(design_at(), refused("entimet")))
def landxml_in_centimetres(f):
    return landxml(f, [("FG", LEVEL)], '<Metric linearUnit="centimeter"/>', factor=0.01)


@case(refused("EG", "FG", "Datum"))
def landxml_three_surfaces(f):
    return landxml(f, [("EG", 1.2), ("FG", LEVEL), ("Datum", 0.0)])


@case(refused("EG", "FG"))
def landxml_surface_that_is_not_there(f):
    return landxml(f, [("EG", 1.2), ("FG", LEVEL)], more='surface = "Top"\ncell_m = 0.1')


@case(design_at())
def landxml_quadrilateral(f):
    return landxml(f, [("FG", LEVEL)], faces="<F>1 2 3 4</F>")


@case(either(refused("6677")))
def landxml_of_zone_9(f):
    return landxml(f, [("FG", LEVEL)], system='<CoordinateSystem epsgCode="6677" name="IX"/>')


@case(either(refused("face"), refused("triangle")))
def landxml_points_only(f):
    name = landxml(f, [("FG", LEVEL)])
    whole = (f / "d.xml").read_text()
    start, end = whole.index("<Faces>"), whole.index("</Faces>") + len("</Faces>")
    (f / "d.xml").write_text(whole[:start] + whole[end:])
    return name


def dxf(folder, draw, units=6, more="cell_m = 0.1", version="R2010"):
    doc = ezdxf.new(version)
    doc.header["$INSUNITS"] = units
    draw(doc)
    doc.saveas(folder / "d.dxf")
    return with_design(folder, "d.dxf", more)


def faces(space, level=LEVEL, factor=1.0, **attributes):
    e, n, z = EAST / factor, NORTH / factor, level / factor
    h = 4 / factor
    space.add_3dface([(e - h, n - h, z), (e + h, n - h, z), (e + h, n + h, z), (e - h, n + h, z)], dxfattribs=attributes)


@case(design_at())
def dxf_plain(f):
    return dxf(f, lambda d: faces(d.modelspace()))


@case(design_at())
def dxf_in_millimetres(f):
    return dxf(f, lambda d: faces(d.modelspace(), factor=0.001), units=4)


@case(either(design_at(), refused("inch")))
def dxf_in_inches(f):
    return dxf(f, lambda d: faces(d.modelspace(), factor=0.0254), units=1)


@case(either(design_at(), refused("foot"), refused("feet")))
def dxf_in_us_survey_feet(f):
    return dxf(f, lambda d: faces(d.modelspace(), factor=1200 / 3937), units=21)


@case(design_at())
def dxf_paper_space_is_no_design(f):
    def draw(d):
        faces(d.modelspace())
        faces(d.layout("Layout1"), 9.0)

    return dxf(f, draw)


@case(also(design_at(), "old"))
def dxf_frozen_layer(f):
    def draw(d):
        d.layers.add("old").freeze()
        faces(d.modelspace(), 9.0, layer="old")
        faces(d.modelspace())

    return dxf(f, draw)


@case(also(design_at(), "old"))
def dxf_layer_off(f):
    def draw(d):
        d.layers.add("old").off()
        faces(d.modelspace(), 9.0, layer="old")
        faces(d.modelspace())

    return dxf(f, draw)


@case(design_at())
def dxf_insert_scaled_and_nested(f):
    def draw(d):
        inner, outer = d.blocks.new("inner"), d.blocks.new("outer")
        inner.add_3dface([(-2, -2, 0), (2, -2, 0), (2, 2, 0), (-2, 2, 0)])
        outer.add_blockref("inner", (0, 0, 1.4), dxfattribs={"xscale": 2, "yscale": 2, "zscale": 1})
        d.modelspace().add_blockref("outer", (EAST, NORTH, 2.0))

    return dxf(f, draw)


@case(design_at())
def dxf_mesh_entity(f):
    def draw(d):
        mesh = d.modelspace().add_mesh()
        with mesh.edit_data() as data:
            data.vertices = [(EAST - 4, NORTH - 4, LEVEL), (EAST + 4, NORTH - 4, LEVEL), (EAST + 4, NORTH + 4, LEVEL), (EAST - 4, NORTH + 4, LEVEL)]
            data.faces = [(0, 1, 2, 3)]

    return dxf(f, draw)


@case(design_at())
def dxf_polyface(f):
    def draw(d):
        corners = [(EAST - 4, NORTH - 4, LEVEL), (EAST + 4, NORTH - 4, LEVEL), (EAST + 4, NORTH + 4, LEVEL), (EAST - 4, NORTH + 4, LEVEL)]
        polyface = d.modelspace().add_polyface()
        polyface.append_face(corners)

    return dxf(f, draw)


@case(either(design_at(), refused("mesh")))
def dxf_polygon_mesh(f):
    def draw(d):
        mesh = d.modelspace().add_polymesh((3, 3))
        for i in range(3):
            for j in range(3):
                mesh.set_mesh_vertex((i, j), (EAST - 4 + 4 * i, NORTH - 4 + 4 * j, LEVEL))

    return dxf(f, draw)


@case(refused("d.dxf"))
def dxf_lines_only(f):
    return dxf(f, lambda d: d.modelspace().add_line((EAST, NORTH, LEVEL), (EAST + 5, NORTH, LEVEL)))


@case(design_at())
def dxf_of_r12(f):
    return dxf(f, lambda d: faces(d.modelspace()), version="R12")


@case(either(design_at(), refused("unit")))
def dxf_in_millimetres_that_says_nothing(f):
    return dxf(f, lambda d: faces(d.modelspace(), factor=0.001), units=0)


@case(design_at())
def dxf_in_millimetres_said_by_the_site(f):
    return dxf(f, lambda d: faces(d.modelspace(), factor=0.001), units=0, more='cell_m = 0.1\nunit = "mm"')


@case(design_at())
def dxf_one_layer_of_two(f):
    def draw(d):
        faces(d.modelspace(), 1.0, layer="EG")
        faces(d.modelspace(), layer="FG")

    return dxf(f, draw, more='cell_m = 0.1\nsurface = "FG"')


@case(design_at())
def dxf_insert_turned_and_mirrored(f):
    def draw(d):
        d.blocks.new("b").add_3dface([(-4, -4, 1.4), (4, -4, 1.4), (4, 4, 1.4), (-4, 4, 1.4)])
        d.modelspace().add_blockref("b", (EAST, NORTH, 2.0), dxfattribs={"rotation": 90, "xscale": -1})

    return dxf(f, draw)


# ---- meshes

def mesh(folder, name, content, unit="m"):
    (folder / name).write_bytes(content if isinstance(content, bytes) else content.encode())
    (folder / "catalog.toml").write_text(CATALOG.format(name="own", block=f'mesh = "{name}"\nunit = "{unit}"'))
    return las(folder)


CUBE = [(x, y, z) for z in (0, 2) for y in (0, 2) for x in (0, 2)]
QUADS = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]


def obj(at=(0, 0, 0), negative=False, digits=6, corner="{0}"):
    lines = [f"v {x + at[0]:.{digits}f} {y + at[1]:.{digits}f} {z + at[2]:.{digits}f}" for x, y, z in CUBE]
    index = (lambda i: i - 8) if negative else (lambda i: i + 1)
    lines += ["f " + " ".join(corner.format(index(i)) for i in q) for q in QUADS]
    return "\n".join(lines) + "\n"


def fine(code, found, text):
    return code == 0 and not any(c["code"] == "block" for c in found["complaints"])


@case(fine)
def obj_with_negative_indices(f):
    return mesh(f, "m.obj", obj(negative=True))


@case(fine)
def obj_far_away(f):
    return mesh(f, "m.obj", obj((EAST, NORTH, 3)))


@case(fine)
def obj_with_textures(f):
    return mesh(f, "m.obj", "mtllib a.mtl\nvt 0 0\nvn 0 0 1\n" + obj(corner="{0}/1/1"))


@case(also(fine))
def obj_in_groups_with_crlf(f):
    return mesh(f, "m.obj", ("o cube\ng all\ns off\n" + obj()).replace("\n", "\r\n"))


@case(fine)
def obj_with_corners_a_thousandth_apart(f):
    lines = []
    for n, quad in enumerate(QUADS):
        lines += [f"v {CUBE[i][0]} {CUBE[i][1]} {CUBE[i][2] + 5e-6 * (n % 2)}" for i in quad]
        lines.append("f " + " ".join(str(4 * n + k + 1) for k in range(4)))
    return mesh(f, "m.obj", "\n".join(lines) + "\n")


@case(refused("m.obj"))
def obj_that_names_no_vertex(f):
    return mesh(f, "m.obj", obj() + "f 1 2 99\n")


def stl(triangles, head=b"", count=None, tail=b""):
    body = b"".join(struct.pack("<12fH", 0, 0, 0, *np.ravel(t), 0) for t in triangles)
    return head.ljust(80, b"\0")[:80] + struct.pack("<I", len(triangles) if count is None else count) + body + tail


TRIANGLES = [[CUBE[i] for i in t] for a, b, c, d in QUADS for t in ((a, b, c), (a, c, d))]


@case(fine)
def stl_count_of_zero(f):
    return mesh(f, "m.stl", stl(TRIANGLES, count=0))


@case(fine)
def stl_that_begins_with_solid(f):
    return mesh(f, "m.stl", stl(TRIANGLES, b"solid exported", tail=b"\r\n"))


@case(fine)
def stl_as_text_with_capitals(f):
    facets = "".join("FACET NORMAL 0 0 0\nOUTER LOOP\n" + "".join(f"VERTEX {x} {y} {z}\n" for x, y, z in t) + "ENDLOOP\nENDFACET\n" for t in TRIANGLES)
    return mesh(f, "m.stl", f"SOLID cube\n{facets}ENDSOLID cube\n")


@case(refused("m.stl"))
def stl_cut_in_the_middle(f):
    return mesh(f, "m.stl", stl(TRIANGLES)[:-120])


@case(refused("each other"))
def stl_shell_in_a_shell_turned_the_same_way(f):
    inner = [[tuple(0.5 + 0.5 * v for v in p) for p in t] for t in TRIANGLES]
    return mesh(f, "m.stl", stl(TRIANGLES + inner))


@case(refused("watertight"))
def stl_open(f):
    return mesh(f, "m.stl", stl(TRIANGLES[:-1]))


@case(refused("size"))
def stl_millimetres_said_to_be_metres(f):
    return mesh(f, "m.stl", stl([[tuple(1000 * v for v in p) for p in t] for t in TRIANGLES]))


@case(refused("m.stl"))
def far_stl_of_rounded_floats(f):
    return mesh(f, "m.stl", stl([[(x + 4.1e6, y - 9.8e6, z) for x, y, z in t] for t in TRIANGLES]))


# ----

def run(program, folder, name):
    make, expected, crs, axes, more = CASES[name]
    made = make(folder)
    survey, design, lines = made if isinstance(made, tuple) else (made, None, "")
    block = "" if design is None else f'[design_file]\nfile = "{design}"\n{lines}\n'
    (folder / "site.toml").write_text(SITE.format(crs=crs, axes=axes, survey=survey, more=more + block))
    if not (folder / "catalog.toml").exists():
        (folder / "catalog.toml").write_text(CATALOG.format(name="tetrapod", block=TETRAPOD))
    ran = subprocess.run([program, "check", folder, "--json"], capture_output=True, text=True, errors="replace")
    events = [json.loads(line) for line in ran.stdout.splitlines() if line.startswith("{")]
    found = next((e["value"] for e in events if e["event"] == "check"), None)
    text = ran.stdout + ran.stderr
    return expected(ran.returncode, found, text), ran.returncode, ran.stderr, found


def main():
    program, wanted = sys.argv[1], sys.argv[2:]
    wrong = 0
    for name in CASES:
        if wanted and not any(w in name for w in wanted):
            continue
        with tempfile.TemporaryDirectory() as folder:
            right, code, err, found = run(program, pathlib.Path(folder), name)
        wrong += not right
        looks = (found or {}).get("surveys") or [{}]
        told = err.strip().splitlines()[-1][:260] if err.strip() else ""
        more = "" if right else f" {looks[0].get('low')} {looks[0].get('high')} design {(found or {}).get('design_levels_m')}"
        print(f"{'right' if right else 'WRONG'} {name}: exit {code} {told}{more}", flush=True)
    sys.exit(f"{wrong} are wrong" if wrong else 0)


if __name__ == "__main__":
    main()
