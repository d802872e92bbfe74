"""Odd but real files of every kind, made here by independent writers, through the built program: each must be read as what it means or be
refused by name with exit 2.

pip install laspy[lazrs] numpy pyproj rasterio ezdxf plyfile pye57
python tools/check_siblings.py target/release/tsumu examples/breakwater/survey.laz [NAME…]
"""

import json
import pathlib
import struct
import subprocess
import sys
import tempfile
import traceback

import laspy
import numpy as np
import pyproj

SITE, ZONE_9 = 6679, 6677
CATALOG = '[[block]]\nname = "tetrapod"\nshape = {{ kind = "tetrapod", size = {size} }}\n'
# A block too small for the survey spares the search for its size, the dear part of a check.
SMALL_M = 0.3
LEVEL = """[design]
kind = "level"
level_m = 3.4
boundary = [[41247.5, -98762.5], [41252.5, -98762.5], [41252.5, -98757.5], [41247.5, -98757.5]]
"""
CASES = []


def case(function):
    CASES.append(function)
    return function


class World:
    """The program, the points of the reference, and a folder for one case."""

    def __init__(self, program, survey, folder):
        self.program, self.folder = program, folder
        las = laspy.read(survey)
        all_points = np.column_stack([las.x, las.y, las.z])
        near = (np.abs(all_points[:, 0] - 41250) < 2.5) & (np.abs(all_points[:, 1] + 98760) < 2.5)
        self.points = all_points[near]

    def tsumu(self, *words):
        ran = subprocess.run([self.program, *map(str, words)], capture_output=True, text=True, errors="replace", timeout=300)
        return ran.returncode, ran.stdout, ran.stderr

    def site(self, surveys, crs="EPSG:6679", axes="east-north", design=LEVEL, more="", extra="", size=SMALL_M):
        text = f'name = "case"\ncrs = "{crs}"\naxis_order = "{axes}"\n{extra}\n' if crs is not None else f'name = "case"\naxis_order = "{axes}"\n'
        for file in [surveys] if isinstance(surveys, str) else surveys:
            text += f'[[survey]]\nfile = "{file}"\nsensor = "uav"\nvertical_offset_m = 0.0\n{more}\n'
        (self.folder / "catalog.toml").write_text(CATALOG.format(size=size))
        (self.folder / "site.toml").write_text(text + design)

    def check(self):
        code, out, err = self.tsumu("check", self.folder, "--json", "--threads", 1)
        value = {}
        for line in out.splitlines():
            if line.startswith("{"):
                event = json.loads(line)
                value = event.get("value", value) if event.get("event") in ("check", "checked", "preflight") else value
        return Seen(code, out + err, value)

    def path(self, name):
        return self.folder / name


class Seen:
    def __init__(self, code, text, value):
        self.code, self.text, self.value = code, text, value
        surveys = value.get("surveys") or [{}]
        self.levels, self.low, self.high = (surveys[0].get(k) for k in ("levels_m", "low", "high"))
        self.points = surveys[0].get("points")
        self.complaints = value.get("complaints", [])
        refusals = {c["code"] for c in self.complaints if c["severity"] == "refusal"}
        if code == 2 and refusals == {"limit"}:
            self.code = 0  # the small block of this test alone

    def line(self):
        refusals = [l for l in self.value.get("because", [])] or [l for l in self.text.splitlines() if "tsumu:" in l][:2]
        return f"exit {self.code}, levels {self.levels}, low {self.low}, points {self.points} {refusals}"


def refused(seen, *words):
    assert seen.code == 2, "is not refused"
    for word in words:
        assert word in seen.text, f"does not name `{word}`"


def as_reference(world, seen, points=None):
    assert seen.code == 0, "is refused"
    low, high = world.points.min(0), world.points.max(0)
    assert np.abs(np.array(seen.low) - low).max() < 0.02, f"lower corner is not {low}"
    assert np.abs(np.array(seen.high) - high).max() < 0.02, f"upper corner is not {high}"
    assert seen.points == (points or len(world.points)), f"{seen.points} points"


def said(seen, *words):
    for word in words:
        assert word in seen.text, f"does not say `{word}`"


# --- writers ---------------------------------------------------------------------------------------------------------------------


def las(world, name, points=None, point_format=6, version=None, crs=None, wkt=None, edit=None, scales=0.001, evlr=False, geokeys=None):
    points = world.points if points is None else points
    header = laspy.LasHeader(point_format=point_format, version=version or ("1.4" if point_format > 5 else "1.2"))
    header.offsets, header.scales = [41250, -98760, 0], [scales] * 3 if np.isscalar(scales) else scales
    text = wkt or (pyproj.CRS.from_epsg(crs).to_wkt("WKT1_GDAL") if crs else None)
    if text and not evlr:
        header.vlrs.append(laspy.VLR("LASF_Projection", 2112, "", text.encode() + b"\0"))
    if text:
        header.global_encoding.wkt = True
    if geokeys:
        keys = [1, 1, 0, len(geokeys)]
        for key, value in geokeys:
            keys += [key, 0, 1, value]
        header.vlrs.append(laspy.VLR("LASF_Projection", 34735, "", struct.pack(f"<{len(keys)}H", *keys)))
    data = laspy.LasData(header)
    data.x, data.y, data.z = points.T
    if text and evlr:
        header.evlrs = laspy.vlrs.vlrlist.VLRList()
        data.evlrs = laspy.vlrs.vlrlist.VLRList()
        data.evlrs.append(laspy.VLR("LASF_Projection", 2112, "", text.encode() + b"\0"))
    if edit:
        edit(data)
    data.write(world.path(name))


def with_strays(world, places):
    return np.vstack([world.points, places])


def text(world, name, lines, encoding="utf-8", end="\n"):
    world.path(name).write_bytes(end.join(lines).encode(encoding) + end.encode(encoding))


def rows(world, form="{:.3f} {:.3f} {:.3f}", points=None):
    return [form.format(*p) for p in (world.points if points is None else points)]


# --- K1: metadata ---------------------------------------------------------------------------------------------------------------


@case
def k1_evlr_only_wkt_of_another_zone(w):
    las(w, "a.laz", crs=ZONE_9, evlr=True)
    w.site("a.laz")
    refused(w.check(), "6677", "6679")


def esri(zone):
    wkt = pyproj.CRS.from_epsg(6668 + zone).to_wkt("WKT1_ESRI")
    assert "AUTHORITY" not in wkt
    return wkt


@case
def k1_esri_wkt_without_authority(w):
    las(w, "a.laz", wkt=esri(11))
    w.site("a.laz")
    as_reference(w, w.check())


@case
def k1_esri_wkt_of_another_zone(w):
    las(w, "a.laz", wkt=esri(9))
    w.site("a.laz")
    refused(w.check(), "6677", "6679")


@case
def k1_wkt2_of_another_zone(w):
    las(w, "a.laz", wkt=pyproj.CRS.from_epsg(ZONE_9).to_wkt("WKT2_2019"))
    w.site("a.laz")
    refused(w.check(), "6677", "6679")


@case
def k1_wkt2_simplified_without_id(w):
    wkt = pyproj.CRS.from_epsg(ZONE_9).to_wkt("WKT2_2019_SIMPLIFIED").replace('ID["EPSG",6677]', 'REMARK["x"]')
    las(w, "a.laz", wkt=wkt)
    w.site("a.laz")
    refused(w.check(), "6679")


@case
def k1_tokyo_datum(w):
    las(w, "a.laz", crs=30171)
    w.site("a.laz")
    refused(w.check(), "30171", "6679")


@case
def k1_jgd2000(w):
    las(w, "a.laz", crs=2453)
    w.site("a.laz")
    refused(w.check(), "2453", "6679")


@case
def k1_utm(w):
    las(w, "a.laz", crs=6691)
    w.site("a.laz")
    refused(w.check(), "6691", "6679")


@case
def k1_feet_in_z_alone_by_compound_wkt2(w):
    wkt = f'COMPOUNDCRS["x",{pyproj.CRS.from_epsg(SITE).to_wkt("WKT2_2019")},{pyproj.CRS.from_epsg(8228).to_wkt("WKT2_2019")}]'
    las(w, "a.laz", w.points / [1, 1, 0.3048], wkt=wkt)
    w.site("a.laz")
    as_reference(w, w.check())


@case
def k1_feet_in_z_alone_by_geokeys(w):
    las(w, "a.las", w.points / [1, 1, 1200 / 3937], point_format=1, geokeys=[(1024, 1), (3072, SITE), (4099, 9003)])
    w.site("a.las")
    as_reference(w, w.check())


@case
def k1_millimetres_in_z_by_geokeys(w):
    las(w, "a.las", w.points * [1, 1, 1000], point_format=1, geokeys=[(1024, 1), (3072, SITE), (4099, 1025)])
    w.site("a.las")
    seen = w.check()
    as_reference(w, seen) if seen.code == 0 else refused(seen, "illimet")


@case
def k1_geographic(w):
    las(w, "a.laz", crs=6668)
    w.site("a.laz")
    refused(w.check(), "6668", "degrees")


@case
def k1_degrees_without_any_crs(w):
    points = np.column_stack([140.1 + w.points[:, 0] * 1e-5, 41.2 + w.points[:, 1] * 1e-5, w.points[:, 2]])
    text(w, "a.csv", ["lon,lat,height"] + rows(w, "{:.9f},{:.9f},{:.3f}", points))
    w.site("a.csv")
    refused(w.check(), "latitude")


@case
def k1_state_plane_feet(w):
    las(w, "a.laz", crs=2227)
    w.site("a.laz")
    refused(w.check(), "foot")


@case
def k1_geokeys_projected_in_feet(w):
    las(w, "a.las", point_format=1, geokeys=[(1024, 1), (3072, 32767), (3076, 9003)])
    w.site("a.las")
    refused(w.check(), "foot")


@case
def k1_depths_positive_down_by_vertical_code(w):
    wkt = f'COMPD_CS["x",{pyproj.CRS.from_epsg(SITE).to_wkt("WKT1_GDAL")},VERT_CS["Depth",VERT_DATUM["x",2005],UNIT["metre",1],AXIS["Depth",DOWN],AUTHORITY["EPSG","5706"]]]'
    las(w, "a.laz", w.points * [1, 1, -1], wkt=wkt)
    w.site("a.laz")
    as_reference(w, w.check())


@case
def k1_two_surveys_of_two_zones(w):
    las(w, "a.laz", crs=SITE)
    las(w, "b.laz", crs=ZONE_9)
    for crs in ("EPSG:6679", None):
        w.site(["a.laz", "b.laz"], crs=crs)
        refused(w.check(), "6677", "6679", "b.laz")


@case
def k1_two_vertical_datums(w):
    for name, code in (("a.laz", 6695), ("b.laz", 5705)):
        wkt = f'COMPD_CS["x",{pyproj.CRS.from_epsg(SITE).to_wkt("WKT1_GDAL")},{pyproj.CRS.from_epsg(code).to_wkt("WKT1_GDAL")}]'
        las(w, name, wkt=wkt)
    w.site(["a.laz", "b.laz"])
    said(w.check(), "6695", "5705")


@case
def k1_ply_comment_names_another_zone(w):
    ply(w, "a.ply", comments=["crs EPSG:6677"])
    w.site("a.ply")
    refused(w.check(), "6677", "6679")


@case
def k1_ply_comment_with_a_proj_string(w):
    ply(w, "a.ply", comments=["proj4 +proj=tmerc +lat_0=36 +lon_0=139.833333333333 +k=0.9999 +x_0=0 +y_0=0 +ellps=GRS80 +units=m +no_defs"])
    w.site("a.ply")
    refused(w.check(), "6679")


@case
def k1_text_comment_with_a_proj_string_in_degrees(w):
    text(w, "a.xyz", ["# +proj=longlat +datum=WGS84 +no_defs"] + rows(w))
    w.site("a.xyz")
    refused(w.check(), "degrees")


@case
def k1_text_comment_with_a_proj_string_in_feet(w):
    text(w, "a.xyz", ["# +proj=lcc +lat_1=38.43 +lat_2=37.07 +lat_0=36.5 +lon_0=-120.5 +x_0=2000000 +y_0=500000 +datum=NAD83 +units=us-ft"] + rows(w))
    w.site("a.xyz")
    refused(w.check(), "foot")


@case
def k1_text_comment_with_an_epsg_code(w):
    text(w, "a.xyz", ["# exported in EPSG:6677"] + rows(w))
    w.site("a.xyz")
    refused(w.check(), "6677", "6679")


@case
def k1_prj_file_beside_a_text_cloud(w):
    text(w, "a.xyz", rows(w))
    w.path("a.prj").write_text(esri(9))
    w.site("a.xyz")
    refused(w.check(), "6677", "6679")


@case
def k1_e57_names_another_zone(w):
    e57(w, "a.e57", wkt=pyproj.CRS.from_epsg(ZONE_9).to_wkt("WKT1_GDAL"))
    w.site("a.e57")
    refused(w.check(), "6677", "6679")


@case
def k1_pcd_comment_names_another_zone(w):
    pcd(w, "a.pcd", comments=["# crs EPSG:6677"])
    w.site("a.pcd")
    refused(w.check(), "6677", "6679")


# --- K2: flags and classes ------------------------------------------------------------------------------------------------------


def noisy(w, mark, name="a.laz", point_format=6, more="", extra=300):
    noise = w.points[:extra] + [0, 0, 6]
    points = np.vstack([w.points, noise])

    def edit(data):
        flags = np.zeros(len(points), bool)
        flags[len(w.points):] = True
        mark(data, flags)

    las(w, name, points, point_format, edit=edit, crs=SITE if point_format > 5 else None)
    w.site(name, more=more)
    return w.check()


def set_class(number):
    def mark(data, flags):
        data.classification = np.where(flags, number, 1).astype(np.uint8)

    return mark


@case
def k2_withheld_in_format_1(w):
    seen = noisy(w, lambda d, f: setattr(d, "withheld", f), point_format=1)
    as_reference(w, seen)
    said(seen, "withheld", "300")


@case
def k2_withheld_in_format_7(w):
    seen = noisy(w, lambda d, f: setattr(d, "withheld", f), point_format=7)
    as_reference(w, seen)


@case
def k2_class_18(w):
    seen = noisy(w, set_class(18))
    as_reference(w, seen)
    said(seen, "class 18")


@case
def k2_class_9(w):
    seen = noisy(w, set_class(9))
    as_reference(w, seen)
    said(seen, "class 9")


@case
def k2_keep_water(w):
    seen = noisy(w, set_class(9), more="keep = [9]")
    assert seen.points == len(w.points) + 300


@case
def k2_overlap_left_out_by_setting(w):
    as_reference(w, noisy(w, lambda d, f: setattr(d, "overlap", f), more='leave_out = ["overlap"]'))


@case
def k2_overlap_is_kept(w):
    seen = noisy(w, lambda d, f: setattr(d, "overlap", f))
    assert seen.points == len(w.points) + 300


@case
def k2_class_12_of_old_formats_is_overlap(w):
    as_reference(w, noisy(w, set_class(12), point_format=3, more='leave_out = ["overlap"]'))


@case
def k2_everything_is_noise(w):
    las(w, "a.laz", edit=lambda d: setattr(d, "classification", np.full(len(w.points), 7, np.uint8)))
    w.site("a.laz")
    refused(w.check(), "class 7")


@case
def k2_ply_with_a_column_of_classes(w):
    points = with_strays(w, w.points[:300] + [0, 0, 6])
    classes = np.r_[np.ones(len(w.points)), np.full(300, 7)].astype("f4")
    ply(w, "a.ply", points, extra={"scalar_Classification": classes})
    w.site("a.ply")
    seen = w.check()
    as_reference(w, seen)
    said(seen, "class 7")


@case
def k2_text_with_a_column_of_classes(w):
    lines = ["X,Y,Z,Classification"] + [r + ",1" for r in rows(w, "{:.3f},{:.3f},{:.3f}")]
    lines += [r + ",7" for r in rows(w, "{:.3f},{:.3f},{:.3f}", w.points[:300] + [0, 0, 6])]
    text(w, "a.csv", lines)
    w.site("a.csv")
    seen = w.check()
    as_reference(w, seen)
    said(seen, "class 7")


@case
def k2_pcd_with_a_column_of_classes(w):
    points = with_strays(w, w.points[:300] + [0, 0, 6])
    pcd(w, "a.pcd", points, extra=("classification", np.r_[np.ones(len(w.points)), np.full(300, 18)].astype("u1")))
    w.site("a.pcd")
    as_reference(w, w.check())


# --- K4: text -------------------------------------------------------------------------------------------------------------------


def text_case(w, lines, encoding="utf-8", end="\n", name="a.csv", axes="east-north"):
    text(w, name, lines, encoding, end)
    w.site(name, axes=axes)
    return w.check()


@case
def k4_decimal_comma_semicolon(w):
    as_reference(w, text_case(w, ["X;Y;Z"] + [r.replace(".", ",") for r in rows(w, "{:.3f};{:.3f};{:.3f}")]))


@case
def k4_decimal_comma_blanks(w):
    as_reference(w, text_case(w, [r.replace(".", ",") for r in rows(w)], name="a.xyz"))


@case
def k4_thousands_and_tabs(w):
    as_reference(w, text_case(w, ["x\ty\tz"] + [f"{a:,.3f}\t{b:,.3f}\t{c:.3f}" for a, b, c in w.points], name="a.txt"))


@case
def k4_thousands_in_quotes(w):
    as_reference(w, text_case(w, ["x,y,z"] + [f'"{a:,.3f}","{b:,.3f}",{c:.3f}' for a, b, c in w.points]))


@case
def k4_full_width(w):
    wide = str.maketrans("0123456789.-,XYZ", "０１２３４５６７８９．－，ＸＹＺ")
    lines = [l.translate(wide) for l in ["X,Y,Z"] + rows(w, "{:.3f},{:.3f},{:.3f}")]
    as_reference(w, text_case(w, lines))


@case
def k4_japanese_header_shift_jis(w):
    turned = w.points[:, [1, 0, 2]]
    lines = ["点番,Ｘ座標（北）,Ｙ座標（東）,標高（ｍ）"] + [f"{i},{r}" for i, r in enumerate(rows(w, "{:.3f},{:.3f},{:.3f}", turned), 1)]
    for axes in ("east-north", "north-east"):
        as_reference(w, text_case(w, lines, "cp932", "\r\n", axes=axes))


@case
def k4_japanese_letters_follow_axis_order(w):
    lines = ["測点,X座標,Y座標,標高"] + [f"P{i},{r}" for i, r in enumerate(rows(w, "{:.3f},{:.3f},{:.3f}", w.points[:, [1, 0, 2]]), 1)]
    as_reference(w, text_case(w, lines, "cp932", axes="north-east"))


@case
def k4_utf_16_with_mark(w):
    as_reference(w, text_case(w, ["X,Y,Z"] + rows(w, "{:.3f},{:.3f},{:.3f}"), "utf-16"))


@case
def k4_utf_16_big_endian_tabs(w):
    as_reference(w, text_case(w, ["X\tY\tZ"] + rows(w, "{:.3f}\t{:.3f}\t{:.3f}"), "utf-16-be"))


@case
def k4_utf_8_with_mark(w):
    as_reference(w, text_case(w, ["X,Y,Z"] + rows(w, "{:.3f},{:.3f},{:.3f}"), "utf-8-sig"))


@case
def k4_lone_cr_with_header(w):
    as_reference(w, text_case(w, ["x y z"] + rows(w), end="\r", name="a.xyz"))


@case
def k4_number_first_named(w):
    lines = ["No,Easting,Northing,Height"] + [f"{i},{r}" for i, r in enumerate(rows(w, "{:.3f},{:.3f},{:.3f}"), 1)]
    as_reference(w, text_case(w, lines, axes="north-east"))


@case
def k4_number_first_from_1000(w):
    lines = [f"{i} {r}" for i, r in enumerate(rows(w), 1000)]
    seen = text_case(w, lines, name="a.xyz")
    refused(seen, "number")


@case
def k4_number_first_by_tens(w):
    lines = [f"{10 * i},{r}" for i, r in enumerate(rows(w, "{:.3f},{:.3f},{:.3f}"), 1)]
    refused(text_case(w, lines), "number")


@case
def k4_point_count_in_the_first_line(w):
    seen = text_case(w, [str(len(w.points))] + rows(w, "{:.3f} {:.3f} {:.3f} -1200 120 121 118"), name="a.pts")
    as_reference(w, seen)


@case
def k4_depth_positive(w):
    lines = ["East,North,Depth"] + rows(w, "{:.3f},{:.3f},{:.3f}", w.points * [1, 1, -1] + [0, 0, 10])
    seen = text_case(w, lines)
    assert seen.code == 0 and seen.levels[1] < 0, "depths are no heights"
    said(seen, "depth")


@case
def k4_depth_japanese(w):
    lines = ["Ｘ座標(北)、Ｙ座標(東)、水深".replace("、", ",")] + rows(w, "{:.3f},{:.3f},{:.3f}", w.points[:, [1, 0, 2]] * [1, 1, -1] + [0, 0, 10])
    seen = text_case(w, lines, "cp932")
    assert seen.code == 0 and seen.levels[1] < 0, "depths are no heights"


@case
def k4_header_after_comments(w):
    as_reference(w, text_case(w, ["# made by x", "//X Y Z Intensity"] + rows(w, "{:.3f} {:.3f} {:.3f} 12"), name="a.asc"))


@case
def k4_cloudcompare_header(w):
    as_reference(w, text_case(w, ["//X Y Z R G B", str(len(w.points))] + rows(w, "{:.3f} {:.3f} {:.3f} 1 2 3"), name="a.asc"))


@case
def k4_intensity_first(w):
    as_reference(w, text_case(w, ["Intensity,X,Y,Z"] + rows(w, "12,{:.3f},{:.3f},{:.3f}")))


@case
def k4_exponents(w):
    as_reference(w, text_case(w, rows(w, "{:.9e} {:.9e} {:.9e}"), name="a.xyz"))


@case
def k4_fortran_exponents(w):
    seen = text_case(w, [r.replace("e", "D") for r in rows(w, "{:.9e} {:.9e} {:.9e}")], name="a.xyz")
    as_reference(w, seen) if seen.code == 0 else refused(seen, "line 1")


@case
def k4_rows_of_unlike_length(w):
    lines = rows(w, "{:.3f},{:.3f},{:.3f}")
    lines[7] = "41250.0,-98760.0"
    refused(text_case(w, lines), "line 8")


@case
def k4_empty_columns(w):
    lines = ["x,y,z"] + rows(w, "{:.3f},{:.3f},{:.3f}")
    lines[7] = "41250.0,,2.0"
    refused(text_case(w, lines), "line 8")


@case
def k4_nan_height(w):
    lines = ["x,y,z"] + rows(w, "{:.3f},{:.3f},{:.3f}")
    lines[7] = "41250.0,-98760.0,NaN"
    refused(text_case(w, lines), "line 8")


@case
def k4_millimetres_named(w):
    refused(text_case(w, ["X(mm),Y(mm),Z(mm)"] + rows(w, "{:.0f},{:.0f},{:.0f}", w.points * 1000)), "millimetre")


@case
def k4_heights_in_feet_named(w):
    refused(text_case(w, ["Easting,Northing,Elevation (ft)"] + rows(w, "{:.3f},{:.3f},{:.3f}", w.points / [1, 1, 0.3048])), "foot")


@case
def k4_degrees_as_plain_numbers(w):
    points = np.column_stack([140.1 + w.points[:, 0] * 1e-5, 41.2 + w.points[:, 1] * 1e-5, w.points[:, 2]])
    seen = text_case(w, rows(w, "{:.9f} {:.9f} {:.3f}", points), name="a.xyz")
    assert seen.code == 2


@case
def k4_east_and_north_swapped_without_names(w):
    refused(text_case(w, rows(w, points=w.points[:, [1, 0, 2]]), name="a.xyz"), "axis_order")


@case
def k4_comma_twice(w):
    lines = ["x,y,z"] + rows(w, "{:.3f},,{:.3f},{:.3f}")
    refused(text_case(w, lines), "line 2")


@case
def k4_quotes_and_blanks(w):
    as_reference(w, text_case(w, ['"X", "Y", "Z"'] + rows(w, '"{:.3f}", "{:.3f}", "{:.3f}"')))


@case
def k4_trailing_separator(w):
    as_reference(w, text_case(w, ["X;Y;Z;"] + rows(w, "{:.3f};{:.3f};{:.3f};")))


@case
def k4_header_and_unit_rows(w):
    seen = text_case(w, ["X,Y,Z", "m,m,m"] + rows(w, "{:.3f},{:.3f},{:.3f}"))
    as_reference(w, seen)


@case
def k4_binary_named_csv(w):
    w.path("a.csv").write_bytes(bytes(range(256)) * 50)
    w.site("a.csv")
    refused(w.check(), "a.csv")


@case
def k4_las_named_xyz(w):
    las(w, "a.las", crs=SITE)
    w.path("a.las").rename(w.path("a.xyz"))
    w.site("a.xyz")
    refused(w.check(), "a.xyz")


# --- K5: strays -----------------------------------------------------------------------------------------------------------------


def stray_case(w, places):
    points = with_strays(w, places)
    text(w, "a.xyz", [f"{a!r} {b!r} {c!r}" for a, b, c in points.tolist()])
    w.site("a.xyz")
    seen = w.check()
    as_reference(w, seen, len(points))
    said(seen, "far")


@case
def k5_stray_at_minus_9999_in_all(w):
    stray_case(w, [[-9999.0, -9999.0, -9999.0]])


@case
def k5_stray_at_1e30(w):
    stray_case(w, [[41250.0, -98760.0, 1e30], [1e30, 1e30, 1e30]])


@case
def k5_strays_at_zero_and_20_km(w):
    stray_case(w, [[0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [61250.0, -98760.0, 2.0], [41250.0, -99760.0, 2.0]])


@case
def k5_stray_below(w):
    stray_case(w, [[41250.0, -98760.0, -32768.0], [41251.0, -98760.0, -32768.0]])


@case
def k5_stray_first_point(w):
    points = np.vstack([[[0.0, 0.0, 0.0]], w.points])
    text(w, "a.xyz", [f"{a!r} {b!r} {c!r}" for a, b, c in points.tolist()])
    w.site("a.xyz")
    as_reference(w, w.check(), len(points))


@case
def k5_many_scattered_strays(w):
    rng = np.random.default_rng(3)
    stray_case(w, rng.uniform(-5e4, 5e4, (50, 3)) + [41250, -98760, 0])


# --- K6, K7, K8: designs --------------------------------------------------------------------------------------------------------


def design_case(w, file, more="", crs="EPSG:6679"):
    las(w, "s.laz", crs=SITE)
    w.site("s.laz", design=f'[design_file]\nfile = "{file}"\ncell_m = 0.1\n{more}', crs=crs)
    return w.check()


def at_level(seen, low=3.4, high=None, tolerance=0.005):
    assert seen.code == 0, "is refused"
    levels = seen.value.get("design_levels_m")
    assert levels and abs(levels[0] - low) < tolerance and abs(levels[1] - (high or low)) < tolerance, f"design {levels}"


def tif(w, name, values, nodata=None, scale=None, offset=None, unit=None, crs=SITE, mask=None, transform=None, **more):
    import rasterio
    from rasterio.transform import from_origin

    values = np.asarray(values)
    transform = transform or from_origin(41246, -98756, 0.5, 0.5)
    with rasterio.open(
        w.path(name), "w", driver="GTiff", height=values.shape[0], width=values.shape[1], count=1,
        dtype=values.dtype, crs=f"EPSG:{crs}" if crs else None, transform=transform, nodata=nodata, **more,
    ) as out:
        out.write(values, 1)
        if scale is not None:
            out.scales = (scale,)
        if offset is not None:
            out.offsets = (offset,)
        if unit:
            out.units = (unit,)
        if mask is not None:
            out.write_mask(mask)


def half(dtype, value, hole):
    out = np.full((16, 16), value, dtype)
    out[:, :4] = hole
    return out


@case
def k6_int16_no_data_with_scale_and_offset(w):
    tif(w, "d.tif", half("int16", 240, -32768), nodata=-32768, scale=0.01, offset=1.0)
    at_level(design_case(w, "d.tif"))


@case
def k6_uint16_no_data_0(w):
    tif(w, "d.tif", half("uint16", 3400, 0), nodata=0, scale=0.001)
    at_level(design_case(w, "d.tif"))


@case
def k6_float32_lowest(w):
    tif(w, "d.tif", half("float32", 3.4, np.finfo("f4").min), nodata=float(np.finfo("f4").min))
    at_level(design_case(w, "d.tif"))


@case
def k6_no_data_not_declared(w):
    tif(w, "d.tif", half("float32", 3.4, -9999.0))
    seen = design_case(w, "d.tif")
    at_level(seen) if seen.code == 0 else refused(seen, "-9999")


@case
def k6_no_data_1e20_not_declared(w):
    tif(w, "d.tif", half("float32", 3.4, 1e20))
    seen = design_case(w, "d.tif")
    at_level(seen) if seen.code == 0 else refused(seen, "d.tif")


@case
def k6_nan(w):
    tif(w, "d.tif", half("float64", 3.4, np.nan), nodata=np.nan)
    at_level(design_case(w, "d.tif"))


@case
def k6_unit_of_the_band_millimetres(w):
    tif(w, "d.tif", half("int32", 3400, -1), nodata=-1, unit="mm")
    at_level(design_case(w, "d.tif"))


@case
def k6_unit_of_the_band_feet(w):
    tif(w, "d.tif", half("float32", 3.4 / 0.3048, -9999), nodata=-9999, unit="ft")
    at_level(design_case(w, "d.tif"))


@case
def k6_mask_inside(w):
    import rasterio

    with rasterio.Env(GDAL_TIFF_INTERNAL_MASK=True):
        tif(w, "d.tif", half("float32", 3.4, 0.0), mask=half("uint8", 255, 0))
    seen = design_case(w, "d.tif")
    at_level(seen) if seen.code == 0 else refused(seen, "mask", "d.tif")


@case
def k6_mask_beside(w):
    import rasterio

    with rasterio.Env(GDAL_TIFF_INTERNAL_MASK=False):
        tif(w, "d.tif", half("float32", 3.4, 0.0), mask=half("uint8", 255, 0))
    refused(design_case(w, "d.tif"), "mask")


@case
def k6_white_is_zero(w):
    tif(w, "d.tif", half("uint8", 3, 255), nodata=255, photometric="MINISWHITE")
    at_level(design_case(w, "d.tif"), 3.0)


@case
def k6_centimetres_without_scale(w):
    tif(w, "d.tif", half("int16", 340, -1), nodata=-1)
    refused(design_case(w, "d.tif"), "340")


@case
def k6_another_zone(w):
    tif(w, "d.tif", half("float32", 3.4, -9999), nodata=-9999, crs=ZONE_9)
    refused(design_case(w, "d.tif"), "6677", "6679")


@case
def k6_turned(w):
    from rasterio.transform import from_origin
    from rasterio import Affine

    tif(w, "d.tif", half("float32", 3.4, -9999), transform=from_origin(41246, -98756, 0.5, 0.5) * Affine.rotation(10))
    refused(design_case(w, "d.tif"), "north-up")


@case
def k6_cells_not_square(w):
    from rasterio.transform import from_origin

    tif(w, "d.tif", half("float32", 3.4, -9999), transform=from_origin(41246, -98756, 0.5, 0.25))
    refused(design_case(w, "d.tif"), "square")


@case
def k6_several_bands(w):
    import rasterio
    from rasterio.transform import from_origin

    with rasterio.open(w.path("d.tif"), "w", driver="GTiff", height=16, width=16, count=3, dtype="uint8", crs="EPSG:6679", transform=from_origin(41246, -98756, 0.5, 0.5)) as out:
        out.write(np.full((3, 16, 16), 3, "uint8"))
    refused(design_case(w, "d.tif"), "band")


@case
def k6_tiled_compressed_bigtiff(w):
    tif(w, "d.tif", np.full((256, 256), 3.4, "float32"), tiled=True, compress="deflate", predictor=3, BIGTIFF="YES", blockxsize=128, blockysize=128)
    at_level(design_case(w, "d.tif"))


@case
def k6_lzw_predictor_2(w):
    tif(w, "d.tif", half("int16", 340, -1), nodata=-1, scale=0.01, compress="lzw", predictor=2)
    at_level(design_case(w, "d.tif"))


@case
def k6_zstd(w):
    tif(w, "d.tif", half("float32", 3.4, -1), nodata=-1, compress="zstd")
    seen = design_case(w, "d.tif")
    at_level(seen) if seen.code == 0 else refused(seen, "d.tif")


@case
def k6_lerc(w):
    tif(w, "d.tif", half("float32", 3.4, -1), nodata=-1, compress="lerc")
    seen = design_case(w, "d.tif")
    at_level(seen) if seen.code == 0 else refused(seen, "d.tif", "ompress")


@case
def k6_crs_in_a_file_beside(w):
    tif(w, "d.tif", half("float32", 3.4, -9999), nodata=-9999, crs=None)
    wkt = pyproj.CRS.from_epsg(ZONE_9).to_wkt("WKT1_GDAL").replace('"', "&quot;")
    w.path("d.tif.aux.xml").write_text(f"<PAMDataset><SRS>{wkt}</SRS></PAMDataset>")
    refused(design_case(w, "d.tif"), "6679")


@case
def k6_world_file_alone(w):
    import rasterio

    with rasterio.open(w.path("d.tif"), "w", driver="GTiff", height=16, width=16, count=1, dtype="float32") as out:
        out.write(np.full((1, 16, 16), 3.4, "float32"))
    w.path("d.tfw").write_text("0.5\n0\n0\n-0.5\n41246.25\n-98756.25\n")
    seen = design_case(w, "d.tif")
    at_level(seen) if seen.code == 0 else refused(seen, "d.tif")


def plate(space, z=3.4, layer="FG", scale=1.0, at=(41246, -98764), size=8):
    x, y = at
    corners = [(x, y, z), (x + size, y, z), (x + size, y + size, z), (x, y + size, z)]
    space.add_3dface([tuple(v * scale for v in c) for c in corners], dxfattribs={"layer": layer})


def dxf(w, fill, units=6):
    import ezdxf

    doc = ezdxf.new("R2010")
    doc.units = units
    fill(doc, doc.modelspace())
    doc.saveas(w.path("d.dxf"))
    return design_case(w, "d.dxf")


@case
def k7_inches(w):
    at_level(dxf(w, lambda d, m: plate(m, scale=1 / 0.0254), units=1))


@case
def k7_millimetres(w):
    at_level(dxf(w, lambda d, m: plate(m, scale=1000), units=4))


@case
def k7_millimetres_said_to_be_unitless(w):
    assert dxf(w, lambda d, m: plate(m, scale=1000), units=0).code == 2


@case
def k7_frozen_layer(w):
    def fill(d, m):
        d.layers.add("OLD").freeze()
        plate(m)
        plate(m, 5.0, "OLD")

    seen = dxf(w, fill)
    at_level(seen)
    said(seen, "OLD")


@case
def k7_paper_space(w):
    def fill(d, m):
        plate(m)
        plate(d.layout("Layout1"), 5.0)

    at_level(dxf(w, fill))


@case
def k7_insert_scaled_and_raised(w):
    def fill(d, m):
        block = d.blocks.new("B")
        plate(block, 0.0, at=(0, 0), size=1)
        m.add_blockref("B", (41246, -98764, 3.4), dxfattribs={"xscale": 8, "yscale": 8})

    at_level(dxf(w, fill))


@case
def k7_nested_insert_of_frozen_layer(w):
    def fill(d, m):
        d.layers.add("OLD").freeze()
        inner, outer = d.blocks.new("I"), d.blocks.new("O")
        plate(inner, 5.0, "0", at=(0, 0))
        outer.add_blockref("I", (0, 0, 0), dxfattribs={"layer": "OLD"})
        plate(outer, 3.4, "FG", at=(0, 0))
        m.add_blockref("O", (41246, -98764, 0))

    at_level(dxf(w, fill))


@case
def k7_mesh_and_polyface(w):
    from ezdxf.render import MeshBuilder

    def fill(d, m):
        a = MeshBuilder()
        a.add_mesh(vertices=[(41246, -98764, 3.4), (41250, -98764, 3.4), (41250, -98756, 3.4), (41246, -98756, 3.4)], faces=[(0, 1, 2, 3)])
        a.render_mesh(m)
        b = MeshBuilder()
        b.add_mesh(vertices=[(41250, -98764, 3.4), (41254, -98764, 3.4), (41254, -98756, 3.4), (41250, -98756, 3.4)], faces=[(0, 1, 2, 3)])
        b.render_polyface(m)

    at_level(dxf(w, fill))


@case
def k7_invisible_entity(w):
    def fill(d, m):
        plate(m)
        plate(m, 5.0)
        m[-1].dxf.invisible = 1

    seen = dxf(w, fill)
    at_level(seen)


@case
def k7_solid_body(w):
    def fill(d, m):
        m.add_line((41246, -98764, 3.4), (41250, -98760, 3.4))

    refused(dxf(w, fill), "d.dxf")


@case
def k7_two_revisions_on_two_layers(w):
    def fill(d, m):
        plate(m, 3.4, "FG_REV2")
        plate(m, 5.0, "FG_REV1")

    seen = dxf(w, fill)
    said(seen, "FG_REV1", "FG_REV2")


@case
def k7_binary_dxf(w):
    import ezdxf

    doc = ezdxf.new("R2010")
    doc.units = 6
    plate(doc.modelspace())
    doc.saveas(w.path("d.dxf"), fmt="bin")
    seen = design_case(w, "d.dxf")
    at_level(seen) if seen.code == 0 else refused(seen, "binary")


@case
def k7_r12(w):
    import ezdxf

    doc = ezdxf.new("R12")
    plate(doc.modelspace())
    doc.saveas(w.path("d.dxf"))
    at_level(design_case(w, "d.dxf"))


@case
def k7_dwg_named_dxf(w):
    w.path("d.dxf").write_bytes(b"AC1027" + bytes(4000))
    refused(design_case(w, "d.dxf"), "DWG")


def surface(name, z, factor=1.0, swap=False, attributes=""):
    corners = [(-98764, 41246), (-98764, 41254), (-98756, 41254), (-98756, 41246)]
    points = "".join(f'<P id="{i}">{n / factor} {e / factor} {z / factor}</P>' for i, (n, e) in enumerate(corners, 1))
    return f'<Surface name="{name}" {attributes}><Definition surfType="TIN"><Pnts>{points}</Pnts><Faces><F>1 2 3</F><F>1 3 4</F></Faces></Definition></Surface>'


def landxml(w, surfaces, units='<Units><Metric linearUnit="meter"/></Units>', head="", more="", encoding="utf-8"):
    body = f'<?xml version="1.0" encoding="{encoding}"?><LandXML xmlns="http://www.landxml.org/schema/LandXML-1.2" version="1.2">{units}{head}<Surfaces>{"".join(surfaces)}</Surfaces></LandXML>'
    w.path("d.xml").write_bytes(body.encode(encoding))
    return design_case(w, "d.xml", more)


FEET = '<Units><Imperial linearUnit="foot" areaUnit="squareFoot"/></Units>'
US_FEET = '<Units><Imperial linearUnit="USSurveyFoot" areaUnit="squareFoot"/></Units>'


@case
def k8_feet(w):
    at_level(landxml(w, [surface("FG", 3.4, 0.3048)], FEET))


@case
def k8_us_feet(w):
    at_level(landxml(w, [surface("FG", 3.4, 1200 / 3937)], US_FEET))


@case
def k8_three_surfaces_in_feet(w):
    surfaces = [surface(n, z, 0.3048) for n, z in (("EG", 1.2), ("FG", 3.4), ("Subgrade", 2.0))]
    refused(landxml(w, surfaces, FEET), "EG", "FG", "Subgrade")
    at_level(landxml(w, surfaces, FEET, more='surface = "FG"\n'))


@case
def k8_japanese_names_utf_16(w):
    surfaces = [surface("現況", 1.2), surface("計画面", 3.4)]
    refused(landxml(w, surfaces, encoding="utf-16"), "現況", "計画面")
    at_level(landxml(w, surfaces, encoding="utf-16", more='surface = "計画面"\n'))


@case
def k8_shift_jis(w):
    surfaces = [surface("現況", 1.2), surface("計画面", 3.4)]
    refused(landxml(w, surfaces, encoding="shift_jis"), "現況", "計画面")
    at_level(landxml(w, surfaces, encoding="shift_jis", more='surface = "計画面"\n'))


@case
def k8_elevation_in_feet(w):
    text = surface("FG", 3.4).replace(" 3.4<", f" {3.4 / 0.3048}<")
    at_level(landxml(w, [text], '<Units><Metric linearUnit="meter" elevationUnit="feet"/></Units>'))


@case
def k8_another_zone(w):
    refused(landxml(w, [surface("FG", 3.4)], head='<CoordinateSystem epsgCode="6677"/>'), "6677", "6679")


@case
def k8_another_zone_by_japanese_name(w):
    refused(landxml(w, [surface("FG", 3.4)], head='<CoordinateSystem horizontalDatum="JGD2011" horizontalCoordinateSystemName="9(X,Y)" name="計算座標系"/>'), "6679")


@case
def k8_east_first(w):
    corners = [(41246, -98764), (41254, -98764), (41254, -98756), (41246, -98756)]
    points = "".join(f'<P id="{i}">{e} {n} 3.4</P>' for i, (e, n) in enumerate(corners, 1))
    text = f'<Surface name="FG"><Definition surfType="TIN"><Pnts>{points}</Pnts><Faces><F>1 2 3</F><F>1 3 4</F></Faces></Definition></Surface>'
    refused(landxml(w, [text]), "axis_order")


@case
def k8_no_faces(w):
    text = '<Surface name="FG"><SourceData><DataPoints><PntList3D>-98764 41246 3.4 -98756 41254 3.4</PntList3D></DataPoints></SourceData></Surface>'
    refused(landxml(w, [text]), "faces")


@case
def k8_holes_are_not_designed(w):
    text = surface("FG", 3.4).replace("<F>1 3 4</F>", '<F i="1">1 3 4</F>')
    seen = landxml(w, [text])
    at_level(seen)


@case
def k8_state_of_existing_ground_only(w):
    seen = landxml(w, [surface("EG", 1.2, attributes='state="existing"')])
    assert seen.code == 0


@case
def k8_comma_decimals(w):
    refused(landxml(w, [surface("FG", 3.4).replace(".4<", ",4<")]), "line")


# --- K9: places of sensors ------------------------------------------------------------------------------------------------------


def e57(w, name, points=None, scans=None, wkt=None, invalid=None):
    import pye57

    class File(pye57.E57):
        def write_default_header(self):
            image, root = self.image_file, self.root
            image.extensionsAdd("", pye57.libe57.E57_V1_0_URI)
            libe57 = pye57.libe57
            for key, text in (("formatName", "ASTM E57 3D Imaging Data File"), ("guid", "{0}"), ("coordinateMetadata", wkt or "")):
                root.set(key, libe57.StringNode(image, text))
            for key, number in (("versionMajor", 1), ("versionMinor", 0)):
                root.set(key, libe57.IntegerNode(image, number))
            root.set("data3D", libe57.VectorNode(image, True))
            root.set("images2D", libe57.VectorNode(image, True))

    file = File(str(w.path(name)), mode="w")
    for place, rotation in scans or [((0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0))]:
        p = (w.points if points is None else points) - place
        data = {"cartesianX": p[:, 0].copy(), "cartesianY": p[:, 1].copy(), "cartesianZ": p[:, 2].copy()}
        if invalid is not None:
            data["cartesianInvalidState"] = invalid.astype("u1")
        file.write_scan_raw(data, translation=np.array(place), rotation=np.array(rotation))
    file.close()


def pcd(w, name, points=None, data="binary", viewpoint="0 0 0 1 0 0 0", comments=(), extra=None, size=8):
    points = w.points if points is None else points
    kind = f"f{size}"
    names, sizes, types = ["x", "y", "z"], [size] * 3, ["F"] * 3
    columns = [points[:, k].astype(kind) for k in range(3)]
    if extra:
        names.append(extra[0])
        sizes.append(extra[1].dtype.itemsize)
        types.append({"u": "U", "i": "I", "f": "F"}[extra[1].dtype.kind])
        columns.append(extra[1])
    n = len(points)
    head = "\n".join(
        ["# .PCD v0.7", *comments, "VERSION 0.7", "FIELDS " + " ".join(names), "SIZE " + " ".join(map(str, sizes)), "TYPE " + " ".join(types),
         "COUNT " + " ".join("1" for _ in names), f"WIDTH {n}", "HEIGHT 1", f"VIEWPOINT {viewpoint}", f"POINTS {n}", f"DATA {data}"]
    ) + "\n"
    if data == "binary":
        record = np.rec.fromarrays(columns, names=names)
        body = record.tobytes()
    else:
        raw = b"".join(c.tobytes() for c in columns)
        packed = b"".join(bytes([min(32, len(raw) - i) - 1]) + raw[i : i + 32] for i in range(0, len(raw), 32))
        body = struct.pack("<II", len(packed), len(raw)) + packed
    w.path(name).write_bytes(head.encode() + body)


@case
def k9_e57_two_scans_each_with_a_shift(w):
    e57(w, "a.e57", scans=[((41200.0, -98700.0, 0.0), (1, 0, 0, 0)), ((41200.0, -98700.0, 0.0), (1, 0, 0, 0))])
    w.site("a.e57")
    seen = w.check()
    as_reference(w, seen, 2 * len(w.points))
    said(seen, "shift")


@case
def k9_pcd_viewpoint_on_another_continent(w):
    pcd(w, "a.pcd", viewpoint="41000 -98000 0 1 0 0 0")
    w.site("a.pcd")
    seen = w.check()
    as_reference(w, seen)
    said(seen, "shift")


@case
def k9_e57_invalid_states(w):
    points = with_strays(w, np.zeros((100, 3)))
    state = np.r_[np.zeros(len(w.points)), np.full(100, 2)]
    e57(w, "a.e57", points=points, invalid=state)
    w.site("a.e57")
    seen = w.check()
    as_reference(w, seen)
    said(seen, "invalid")


@case
def k9_pcd_compressed_with_nan(w):
    points = with_strays(w, np.full((100, 3), np.nan))
    pcd(w, "a.pcd", points, "binary_compressed")
    w.site("a.pcd")
    seen = w.check()
    as_reference(w, seen)
    said(seen, "invalid")


@case
def k9_pcd_float32_far(w):
    pcd(w, "a.pcd", size=4)
    w.site("a.pcd")
    seen = w.check()
    assert seen.code == 0
    said(seen, "32-bit")


@case
def k9_two_scanners_stand_below_their_points(w):
    e57(w, "a.e57", scans=[((41249.37, -98760.21, 3.913), (1, 0, 0, 0))])
    w.site("a.e57")
    as_reference(w, w.check())


# --- K3 and other clouds --------------------------------------------------------------------------------------------------------


def ply(w, name, points=None, order="<", text=False, comments=(), extra=None, kind="f8", lists=False):
    import plyfile

    points = w.points if points is None else points
    fields = [("x", kind), ("y", kind), ("z", kind)] + [(k, v.dtype.str[1:]) for k, v in (extra or {}).items()]
    if lists:
        fields.append(("seen_by", "O"))
    vertex = np.zeros(len(points), dtype=fields)
    vertex["x"], vertex["y"], vertex["z"] = points.T
    for k, v in (extra or {}).items():
        vertex[k] = v
    types = {}
    if lists:
        vertex["seen_by"] = [np.arange(i % 4, dtype="u2") for i in range(len(points))]
        types = {"len_types": {"seen_by": "u1"}, "val_types": {"seen_by": "u2"}}
    element = plyfile.PlyElement.describe(vertex, "vertex", **types)
    camera = plyfile.PlyElement.describe(np.zeros(3, dtype=[("a", "f4"), ("b", "i2")]), "camera")
    plyfile.PlyData([camera, element], text=text, byte_order=order, comments=list(comments)).write(str(w.path(name)))


@case
def k3_ply_big_endian_with_lists(w):
    head = f"ply\nformat binary_big_endian 1.0\nelement camera 2\nproperty float a\nproperty short b\nelement vertex {len(w.points)}\n"
    head += "property list uchar ushort seen_by\nproperty double x\nproperty double y\nproperty double z\nproperty uchar red\nend_header\n"
    lists = [struct.pack(f">B{i % 4}H", i % 4, *range(i % 4)) for i in range(len(w.points))]
    body = b"".join(l + struct.pack(">3dB", *p, 9) for l, p in zip(lists, w.points))
    w.path("a.ply").write_bytes(head.encode() + struct.pack(">fhfh", 0, 0, 0, 0) + body)
    w.site("a.ply")
    as_reference(w, w.check())


@case
def k3_ply_text_with_lists(w):
    ply(w, "a.ply", text=True, lists=True)
    w.site("a.ply")
    as_reference(w, w.check())


@case
def k3_ply_named_columns(w):
    seen_extra = {"label": np.full(len(w.points), -1, "i4"), "scalar_Intensity": np.ones(len(w.points), "f4")}
    ply(w, "a.ply", extra=seen_extra)
    w.site("a.ply")
    as_reference(w, w.check())


@case
def k3_ply_nan(w):
    ply(w, "a.ply", with_strays(w, [[np.nan] * 3]))
    w.site("a.ply")
    refused(w.check(), str(len(w.points) + 1))


@case
def k3_las_cut_short(w):
    las(w, "a.las", crs=SITE)
    bytes_ = w.path("a.las").read_bytes()
    w.path("a.las").write_bytes(bytes_[:-1000])
    w.site("a.las")
    refused(w.check(), "a.las")


@case
def k3_laz_cut_short(w):
    las(w, "a.laz", crs=SITE)
    bytes_ = w.path("a.laz").read_bytes()
    w.path("a.laz").write_bytes(bytes_[:-1000])
    w.site("a.laz")
    refused(w.check(), "a.laz")


@case
def k3_empty_file(w):
    for name in ("a.laz", "a.csv", "a.ply", "a.e57", "a.pcd"):
        w.path(name).write_bytes(b"")
        w.site(name)
        refused(w.check(), name)


# --- K10: meshes ----------------------------------------------------------------------------------------------------------------


def cube(size=2.0, at=(0, 0, 0)):
    import trimesh

    mesh = trimesh.creation.box((size, size, size))
    mesh.apply_translation(at)
    return np.array(mesh.vertices), np.array(mesh.faces)


def binary_stl(vertices, faces, count=None, header=b"x"):
    body = b"".join(struct.pack("<12fH", 0, 0, 0, *vertices[f].ravel(), 0) for f in faces)
    return header.ljust(80)[:80] + struct.pack("<I", len(faces) if count is None else count) + body


def mesh_case(w, name, data, unit="m"):
    w.path(name).write_bytes(data if isinstance(data, bytes) else data.encode())
    las(w, "s.laz", crs=SITE)
    w.site("s.laz")
    (w.folder / "catalog.toml").write_text(f'[[block]]\nname = "own"\nmesh = "{name}"\nunit = "{unit}"\n')
    code, out, err = w.tsumu("segment", w.path("s.laz"), "--catalog", w.path("catalog.toml"), "--out", w.path("o.laz"), "-v", "--threads", 1)
    seen = w.check()
    return Seen(code, out + err, {}), seen


def obj(vertices, faces):
    return "".join("v {} {} {}\n".format(*v) for v in vertices) + "".join("f {} {} {}\n".format(*(f + 1)) for f in faces)


@case
def k10_stl_wrong_count_low_and_high(w):
    v, f = cube()
    for count in (11, 13, 1):
        for seen in mesh_case(w, "m.stl", binary_stl(v, f, count)):
            refused(seen, "m.stl")


@case
def k10_stl_count_zero_and_all_ones(w):
    v, f = cube()
    for count in (0, 0xFFFFFFFF):
        said(mesh_case(w, "m.stl", binary_stl(v, f, count))[0], "8.0000 m³")


@case
def k10_obj_in_millimetres_said_to_be_metres(w):
    v, f = cube(2000.0)
    seen, checked = mesh_case(w, "m.obj", obj(v, f))
    refused(checked, "own", "unit")
    refused(seen, "own")


@case
def k10_obj_in_millimetres(w):
    v, f = cube(2000.0)
    said(mesh_case(w, "m.obj", obj(v, f), "mm")[0], "8.0000 m³")


@case
def k10_obj_far_away(w):
    v, f = cube(2.0, (41250.0, -98760.0, 2.0))
    said(mesh_case(w, "m.obj", obj(v, f))[0], "8.0000 m³")


@case
def k10_stl_far_away(w):
    v, f = cube(2.0, (4.12e6, -9.876e6, 2.0))
    refused(mesh_case(w, "m.stl", binary_stl(v, f))[1], "m.stl", "origin")


@case
def k10_inside_out(w):
    v, f = cube()
    seen, checked = mesh_case(w, "m.stl", binary_stl(v, f[:, ::-1]))
    if seen.code == 2:
        refused(seen, "m.stl")
    else:
        said(seen, "8.0000 m³")


@case
def k10_one_triangle_turned(w):
    v, f = cube()
    f = f.copy()
    f[3] = f[3][::-1]
    seen, _ = mesh_case(w, "m.obj", obj(v, f))
    if seen.code == 2:
        refused(seen, "own", "mesh")
    else:
        said(seen, "8.0000 m³")


@case
def k10_open(w):
    v, f = cube()
    refused(mesh_case(w, "m.obj", obj(v, f[:-1]))[1], "own", "mesh")


@case
def k10_two_cubes_overlap(w):
    a, fa = cube()
    b, fb = cube(2.0, (1.0, 0, 0))
    seen, checked = mesh_case(w, "m.obj", obj(np.vstack([a, b]), np.vstack([fa, fb + len(a)])))
    if seen.code == 2:
        refused(checked, "own", "mesh")
    else:
        said(seen, "12.0000 m³")


@case
def k10_shell_twice_turned(w):
    v, f = cube()
    seen, _ = mesh_case(w, "m.stl", binary_stl(v, np.vstack([f, f[:, ::-1]])))
    refused(seen, "own", "mesh") if seen.code == 2 else said(seen, "8.0000 m³")


@case
def k10_hollow(w):
    a, fa = cube()
    b, fb = cube(1.0)
    seen, _ = mesh_case(w, "m.obj", obj(np.vstack([a, b]), np.vstack([fa, fb[:, ::-1] + len(a)])))
    refused(seen, "m.obj") if seen.code == 2 else said(seen, "7.0000 m³")


@case
def k10_quads_negative_indices_and_texture(w):
    text_ = "o cube\nvt 0 0\nvn 0 0 1\n"
    v = [(-1, -1, -1), (1, -1, -1), (1, 1, -1), (-1, 1, -1), (-1, -1, 1), (1, -1, 1), (1, 1, 1), (-1, 1, 1)]
    text_ += "".join("v {} {} {} 0.5 0.5 0.5\n".format(*p) for p in v)
    for q in [(4, 3, 2, 1), (5, 6, 7, 8), (1, 2, 6, 5), (2, 3, 7, 6), (3, 4, 8, 7), (4, 1, 5, 8)]:
        text_ += "f " + " ".join(f"{i - 9}/1/1" for i in q) + "\n"
    said(mesh_case(w, "m.obj", text_)[0], "8.0000 m³")


@case
def k10_text_stl_upper_case_cr_lf(w):
    v, f = cube()
    lines = ["SOLID x"]
    for t in f:
        lines += ["FACET NORMAL 0 0 0", "OUTER LOOP", *("VERTEX {} {} {}".format(*v[i]) for i in t), "ENDLOOP", "ENDFACET"]
    said(mesh_case(w, "m.stl", "\r\n".join(lines + ["ENDSOLID x"]) + "\r\n")[0], "8.0000 m³")


@case
def k10_ply_mesh_big_endian_quads(w):
    v = np.array([(-1, -1, -1), (1, -1, -1), (1, 1, -1), (-1, 1, -1), (-1, -1, 1), (1, -1, 1), (1, 1, 1), (-1, 1, 1)], ">f4")
    quads = [(3, 2, 1, 0), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]
    head = "ply\nformat binary_big_endian 1.0\nelement vertex 8\nproperty float x\nproperty float y\nproperty float z\nelement face 6\nproperty list uchar int vertex_indices\nproperty uchar red\nend_header\n"
    body = v.tobytes() + b"".join(b"\4" + np.array(q, ">i4").tobytes() + b"\0" for q in quads)
    said(mesh_case(w, "m.ply", head.encode() + body)[0], "8.0000 m³")


# --- K11: steps -----------------------------------------------------------------------------------------------------------------


@case
def k11_step_of_1_cm_is_fine(w):
    las(w, "a.laz", crs=SITE, scales=0.01)
    w.site("a.laz", size=2.0)
    as_reference(w, w.check())


@case
def k11_step_of_5_cm_in_height(w):
    las(w, "a.laz", crs=SITE, scales=[0.001, 0.001, 0.05])
    w.site("a.laz", size=2.0)
    seen = w.check()
    assert seen.code in (0, 2)
    said(seen, "steps of 0.05")


@case
def k11_text_with_one_decimal(w):
    text(w, "a.xyz", rows(w, "{:.1f} {:.1f} {:.1f}"))
    w.site("a.xyz", size=2.0)
    refused(w.check(), "steps of 0.1")


@case
def k11_whole_metres_in_plan(w):
    text(w, "a.xyz", rows(w, "{:.0f} {:.0f} {:.3f}"))
    w.site("a.xyz", size=2.0)
    refused(w.check(), "steps of 1")


@case
def k11_ply_float32_far(w):
    ply(w, "a.ply", kind="f4")
    w.site("a.ply")
    seen = w.check()
    assert seen.code == 0
    said(seen, "32-bit")


@case
def k11_ply_float32_utm(w):
    ply(w, "a.ply", w.points + [0, 4.3e6, 0], kind="f4")
    w.site("a.ply", design="")
    seen = w.check()
    assert seen.code == 2 or "32-bit" in seen.text, "says nothing"


# --------------------------------------------------------------------------------------------------------------------------------


def main():
    program, survey, wanted = pathlib.Path(sys.argv[1]).absolute(), sys.argv[2], sys.argv[3:]
    failed = tried = 0
    with tempfile.TemporaryDirectory() as name:
        for function in CASES:
            if wanted and not any(word in function.__name__ for word in wanted):
                continue
            folder = pathlib.Path(name) / function.__name__
            folder.mkdir()
            world = World(program, survey, folder)
            last, check = [], world.check

            def keeping():
                last[:] = [check()]
                return last[0]

            world.check = keeping
            tried += 1
            try:
                function(world)
                print(f"right {function.__name__}", flush=True)
            except Exception as error:  # noqa: BLE001
                failed += 1
                where = last[0].line() if last else ""
                print(f"WRONG {function.__name__}: {type(error).__name__} {error}: {where}", flush=True)
                if not isinstance(error, AssertionError):
                    traceback.print_exc()
    print(f"{tried - failed} of {tried} right")
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
