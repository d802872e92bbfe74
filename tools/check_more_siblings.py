"""More odd but real files, in the manner of `check_siblings.py` and with its writers: each must be read as what it means or be refused by name.

pip install laspy[lazrs] numpy pyproj rasterio ezdxf plyfile pye57 trimesh
python tools/check_more_siblings.py target/release/tsumu examples/breakwater/survey.laz [NAME…]
"""

import struct

import check_siblings
import laspy
import numpy as np
import pyproj
from check_siblings import (
    SITE, ZONE_9, as_reference, at_level, binary_stl, case, cube, design_case, dxf, e57, half, landxml, las, mesh_case, obj, pcd,
    plate, ply, refused, rows, said, surface, text, tif,
)

check_siblings.CASES.clear()
WKT = {code: pyproj.CRS.from_epsg(code) for code in (SITE, ZONE_9)}


def refused_or_reference(w, seen, *words, points=None):
    as_reference(w, seen, points) if seen.code == 0 else refused(seen, *words)


# --- K1 -------------------------------------------------------------------------------------------------------------------------


@case
def k1_bound_system_of_another_zone(w):
    inner = WKT[ZONE_9].to_wkt("WKT2_2019")
    base = pyproj.CRS.from_epsg(4326).to_wkt("WKT2_2019")
    las(w, "a.laz", wkt=f'BOUNDCRS[SOURCECRS[{inner}],TARGETCRS[{base}],ABRIDGEDTRANSFORMATION["x",METHOD["Geocentric translations"],PARAMETER["X-axis translation",0],PARAMETER["Y-axis translation",0],PARAMETER["Z-axis translation",0]]]')
    w.site("a.laz")
    refused(w.check(), "6677", "6679")


@case
def k1_wkt1_with_towgs84_of_another_zone(w):
    wkt = WKT[ZONE_9].to_wkt("WKT1_GDAL").replace('SPHEROID["GRS 1980",6378137,298.257222101,AUTHORITY["EPSG","7019"]]', 'SPHEROID["GRS 1980",6378137,298.257222101,AUTHORITY["EPSG","7019"]],TOWGS84[0,0,0,0,0,0,0]')
    assert "TOWGS84" in wkt
    las(w, "a.laz", wkt=wkt)
    w.site("a.laz")
    refused(w.check(), "6677", "6679")


@case
def k1_wkt_with_line_breaks_and_round_brackets(w):
    las(w, "a.laz", wkt=WKT[ZONE_9].to_wkt("WKT2_2019", pretty=True).replace("[", "(").replace("]", ")"))
    w.site("a.laz")
    refused(w.check(), "6677", "6679")


@case
def k1_vertical_code_in_us_feet_without_a_unit_key(w):
    las(w, "a.las", w.points / [1, 1, 1200 / 3937], point_format=1, geokeys=[(1024, 1), (3072, SITE), (4096, 6360)])
    w.site("a.las")
    refused_or_reference(w, w.check(), "foot")


@case
def k1_plane_coordinates_in_kilometres(w):
    wkt = WKT[SITE].to_wkt("WKT1_GDAL").replace('UNIT["metre",1,AUTHORITY["EPSG","9001"]],AUTHORITY["EPSG","6679"]', 'UNIT["kilometre",1000]')
    assert "kilometre" in wkt
    las(w, "a.laz", wkt=wkt)
    w.site("a.laz")
    refused(w.check(), "kilomet")


@case
def k1_earth_centred(w):
    las(w, "a.laz", wkt=pyproj.CRS.from_epsg(4978).to_wkt("WKT2_2019"))
    w.site("a.laz")
    refused(w.check(), "4978")


@case
def k1_engineering_system_of_a_scanner(w):
    las(w, "a.laz", wkt='LOCAL_CS["Scan Position 1",LOCAL_DATUM["Scan",32767],UNIT["metre",1],AXIS["X",EAST],AXIS["Y",NORTH]]')
    w.site("a.laz")
    seen = w.check()
    assert seen.code in (0, 2)
    said(seen, "Scan Position 1")


@case
def k1_design_and_survey_agree_against_the_site(w):
    las(w, "s.laz", crs=ZONE_9)
    tif(w, "d.tif", np.full((16, 16), 3.4, "f4"), crs=ZONE_9)
    w.site("s.laz", design='[design_file]\nfile = "d.tif"\n')
    refused(w.check(), "s.laz", "d.tif", "6677")


@case
def k1_site_without_crs_takes_that_of_the_second_survey(w):
    text(w, "a.xyz", rows(w))
    las(w, "b.laz", crs=SITE)
    w.site(["a.xyz", "b.laz"], crs=None)
    seen = w.check()
    assert seen.code == 0
    as_reference(w, seen)


@case
def k1_geotiff_of_a_compound_system_in_feet(w):
    import rasterio
    from rasterio.transform import from_origin

    values = np.full((16, 16), 3.4 / (1200 / 3937), "f4")
    with rasterio.open(w.path("d.tif"), "w", driver="GTiff", height=16, width=16, count=1, dtype="float32",
                       crs=rasterio.crs.CRS.from_user_input("EPSG:6679+6360"), transform=from_origin(41246, -98756, 0.5, 0.5)) as out:
        out.write(values, 1)
    seen = design_case(w, "d.tif")
    at_level(seen) if seen.code == 0 else refused(seen, "foot")


@case
def k1_qgis_project_file_beside_says_another_zone(w):
    ply(w, "a.ply")
    w.path("a.prj").write_text(WKT[ZONE_9].to_wkt("WKT1_GDAL"))
    w.site("a.ply")
    refused(w.check(), "6677", "6679")


@case
def k1_keys_with_nothing_but_a_citation(w):
    header = laspy.LasHeader(point_format=1, version="1.2")
    header.offsets, header.scales = [41250, -98760, 0], [0.001] * 3
    words = b"JGD2011 / Japan Plane Rectangular CS IX|\0"
    keys = [1, 1, 0, 3, 1024, 0, 1, 1, 3072, 0, 1, 32767, 3073, 34737, len(words) - 1, 0]
    header.vlrs.append(laspy.VLR("LASF_Projection", 34735, "", struct.pack(f"<{len(keys)}H", *keys)))
    header.vlrs.append(laspy.VLR("LASF_Projection", 34737, "", words))
    data = laspy.LasData(header)
    data.x, data.y, data.z = w.points.T
    data.write(w.path("a.las"))
    w.site("a.las")
    refused(w.check(), "6679", "IX")


# --- K2 -------------------------------------------------------------------------------------------------------------------------


def with_noise(w, edit, name="a.laz", point_format=6, more="", n=300, lift=6):
    points = np.vstack([w.points, w.points[:n] + [0, 0, lift]])
    flags = np.arange(len(points)) >= len(w.points)
    las(w, name, points, point_format, edit=lambda d: edit(d, flags))
    w.site(name, more=more)
    return w.check()


@case
def k2_noise_and_synthetic_in_one_byte_of_old_formats(w):
    def edit(d, flags):
        d.classification = np.where(flags, 7, 2).astype(np.uint8)
        d.synthetic = flags

    seen = with_noise(w, edit, "a.las", 3)
    as_reference(w, seen)
    said(seen, "class 7", "300")


@case
def k2_synthetic_left_out_by_setting(w):
    seen = with_noise(w, lambda d, f: setattr(d, "synthetic", f), more='leave_out = ["synthetic"]')
    as_reference(w, seen)


@case
def k2_a_class_of_the_user_left_out(w):
    seen = with_noise(w, lambda d, f: setattr(d, "classification", np.where(f, 64, 1).astype(np.uint8)), more="leave_out = [64]")
    as_reference(w, seen)


@case
def k2_keep_and_leave_out_the_same(w):
    refused(with_noise(w, lambda d, f: None, more="leave_out = [7]\nkeep = [7]"), "site.toml", "7")


@case
def k2_word_that_is_no_flag(w):
    refused(with_noise(w, lambda d, f: None, more='leave_out = ["noise"]'), "site.toml", "withheld")


@case
def k2_class_beyond_255(w):
    refused(with_noise(w, lambda d, f: None, more="leave_out = [700]"), "site.toml", "255")


@case
def k2_withheld_and_kept_by_setting(w):
    seen = with_noise(w, lambda d, f: setattr(d, "withheld", f), more='keep = ["withheld"]')
    assert seen.points == len(w.points) + 300, seen.points


@case
def k2_classes_as_floats_in_a_text(w):
    noise = w.points[:300] + [0, 0, 6]
    lines = ["//X Y Z Classification"] + rows(w, "{:.3f} {:.3f} {:.3f} 2.000000") + rows(w, "{:.3f} {:.3f} {:.3f} 7.000000", noise)
    text(w, "a.txt", lines)
    w.site("a.txt")
    seen = w.check()
    as_reference(w, seen)
    said(seen, "class 7")


@case
def k2_every_point_withheld(w):
    las(w, "a.laz", edit=lambda d: setattr(d, "withheld", np.ones(len(d.x), bool)))
    w.site("a.laz")
    refused(w.check(), "a.laz", "withheld")


# --- K3: what goes in comes out -------------------------------------------------------------------------------------------------


def labelled(w, name, out):
    (w.folder / "catalog.toml").write_text('[[block]]\nname = "tetrapod"\nshape = { kind = "tetrapod", size = 2.0 }\n')
    code, said_, err = w.tsumu("segment", w.path(name), "--catalog", w.path("catalog.toml"), "--out", w.path(out), "--threads", 1)
    assert code == 0, said_ + err


@case
def k3_scaled_extra_bytes_and_a_clash_of_names(w):
    def edit(d):
        d.add_extra_dim(laspy.ExtraBytesParams("range", "u2", "m", offsets=np.array([1.0]), scales=np.array([0.01])))
        d.add_extra_dim(laspy.ExtraBytesParams("confidence", "f8", "of another"))
        d["range"] = 1 + 0.01 * (np.arange(len(d.x)) % 900)
        d["confidence"] = np.arange(len(d.x)) * 0.5
        d.intensity = np.arange(len(d.x)) % 65000
        d.user_data = np.arange(len(d.x)) % 251
        d.point_source_id = np.full(len(d.x), 3)

    las(w, "a.laz", point_format=6, crs=SITE, edit=edit)
    labelled(w, "a.laz", "o.laz")
    a, o = laspy.read(w.path("a.laz")), laspy.read(w.path("o.laz"))
    assert len(a.x) == len(o.x)
    for name in ("X", "Y", "Z", "intensity", "user_data", "point_source_id", "range"):
        assert np.array_equal(np.asarray(a[name]), np.asarray(o[name])), name
    names = list(o.point_format.extra_dimension_names)
    assert {"range", "instance", "model"} <= set(names), names
    kept = [n for n in names if "confidence" in n]
    assert kept and (len(kept) == 2 or o[kept[0]].max() <= 1), names


@case
def k3_near_infrared_waveless_and_a_record_of_the_user(w):
    def edit(d):
        d.red, d.green, d.blue, d.nir = (np.arange(len(d.x)) % m for m in (65000, 251, 7, 40000))
        d.gps_time = np.arange(len(d.x)) * 0.25
        d.scan_angle = np.arange(len(d.x)) % 30
        d.header.vlrs.append(laspy.VLR("company", 77, "project", b"kept as it is"))

    las(w, "a.laz", point_format=8, crs=SITE, edit=edit)
    labelled(w, "a.laz", "o.laz")
    a, o = laspy.read(w.path("a.laz")), laspy.read(w.path("o.laz"))
    assert o.point_format.id == 8
    for name in ("X", "Y", "Z", "red", "nir", "gps_time", "scan_angle", "return_number"):
        assert np.array_equal(a[name], o[name]), name
    assert any(v.user_id == "company" and v.record_id == 77 for v in o.header.vlrs)


@case
def k3_noise_stays_in_its_place_in_the_labelled_cloud(w):
    mark = np.zeros(len(w.points), np.uint8)
    mark[::5] = 7
    points = w.points.copy()
    points[::5, 2] += 9

    def edit(d):
        d.classification, d.intensity = mark, np.arange(len(mark)) % 65000

    las(w, "a.las", points, 1, edit=edit)
    labelled(w, "a.las", "o.las")
    o = laspy.read(w.path("o.las"))
    assert np.array_equal(o.intensity, np.arange(len(mark)) % 65000) and np.array_equal(o.classification, mark)
    assert not np.asarray(o["instance"])[::5].any(), "noise belongs to no block"


@case
def k3_ply_keeps_other_elements_and_comments(w):
    ply(w, "a.ply", comments=["made by a scanner"], extra={"quality": np.arange(len(w.points), dtype="u2")}, lists=True)
    labelled(w, "a.ply", "o.ply")
    import plyfile

    o = plyfile.PlyData.read(str(w.path("o.ply")))
    assert [e.name for e in o.elements][:2] == ["camera", "vertex"], o.elements
    assert np.array_equal(o["vertex"]["quality"], np.arange(len(w.points), dtype="u2"))
    assert {"instance", "model", "confidence"} <= {p.name for p in o["vertex"].properties}
    assert "made by a scanner" in o.comments


@case
def k3_pcd_with_an_old_label_and_rows(w):
    pcd(w, "a.pcd", extra=("label", np.arange(len(w.points), dtype="u4") % 5))
    labelled(w, "a.pcd", "o.pcd")
    head = w.path("o.pcd").read_bytes().split(b"DATA")[0].decode()
    assert f"POINTS {len(w.points)}" in head and "label" in head and "instance" in head, head


# --- K4 -------------------------------------------------------------------------------------------------------------------------


def text_is_reference(w, lines, name="a.csv", axes="east-north", **how):
    text(w, name, lines, **how)
    w.site(name, axes=axes)
    as_reference(w, w.check())


@case
def k4_thousands_by_apostrophe(w):
    text(w, "a.csv", ["East;North;Height"] + [f"{e:,.3f};{n:,.3f};{z:.3f}".replace(",", "'") for e, n, z in w.points])
    w.site("a.csv")
    refused_or_reference(w, w.check(), "a.csv")


@case
def k4_thousands_by_narrow_blanks(w):
    text(w, "a.csv", ["East;North;Height"] + [f"{e:,.3f};{n:,.3f};{z:.3f}".replace(",", "\u202f").replace(".", ",") for e, n, z in w.points])
    w.site("a.csv")
    refused_or_reference(w, w.check(), "a.csv")


@case
def k4_typographic_minus(w):
    text(w, "a.csv", ["x,y,z"] + [r.replace("-", "\u2212") for r in rows(w, "{:.3f},{:.3f},{:.3f}")])
    w.site("a.csv")
    refused_or_reference(w, w.check(), "a.csv")


@case
def k4_plus_signs(w):
    text_is_reference(w, rows(w, "{:+.3f} {:+.3f} {:+.3f}"), "a.xyz")


@case
def k4_comments_between_the_rows(w):
    lines = rows(w, "{:.3f},{:.3f},{:.3f}")
    text_is_reference(w, ["x,y,z"] + lines[:50] + ["# second swath", "", "// another"] + lines[50:])


@case
def k4_mixed_line_ends(w):
    w.path("a.csv").write_bytes(b"x,y,z\r\n" + b"".join(r.encode() + (b"\n", b"\r\n")[i % 2] for i, r in enumerate(rows(w, "{:.3f},{:.3f},{:.3f}"))))
    w.site("a.csv")
    as_reference(w, w.check())


@case
def k4_reduced_level_and_short_names(w):
    text_is_reference(w, ["E\tN\tRL"] + rows(w, "{:.3f}\t{:.3f}\t{:.3f}"), "a.txt")


@case
def k4_north_named_first_in_one_letter(w):
    text_is_reference(w, ["N,E,H"] + [f"{n:.3f},{e:.3f},{z:.3f}" for e, n, z in w.points])


@case
def k4_japanese_words_of_east_and_north(w):
    text_is_reference(w, ["番号,北距,東距,標高(m)"] + [f"{i},{n:.3f},{e:.3f},{z:.3f}" for i, (e, n, z) in enumerate(w.points)], encoding="cp932")


@case
def k4_japanese_utf_16_with_decimal_comma(w):
    text(w, "a.csv", ["X座標;Y座標;標高"] + [f"{n:.3f};{e:.3f};{z:.3f}".replace(".", ",") for e, n, z in w.points], encoding="utf-16")
    w.site("a.csv", axes="north-east")
    as_reference(w, w.check())


@case
def k4_iso_2022_jp_or_euc_jp_header(w):
    lines = ["点名,X座標,Y座標,標高"] + [f"T{i},{n:.3f},{e:.3f},{z:.3f}" for i, (e, n, z) in enumerate(w.points)]
    for encoding in ("euc_jp", "iso2022_jp"):
        text(w, "a.csv", lines, encoding=encoding)
        w.site("a.csv", axes="north-east")
        refused_or_reference(w, w.check(), "a.csv")


@case
def k4_sima_file_named_csv(w):
    lines = ["Z00,座標ﾃﾞｰﾀ,01,", "Z01,4,,", "A00,"] + [f"A01,{i + 1},T{i + 1},{n:.3f},{e:.3f},{z:.3f}," for i, (e, n, z) in enumerate(w.points)] + ["A99,"]
    text(w, "a.csv", lines, encoding="cp932")
    w.site("a.csv", axes="north-east")
    refused_or_reference(w, w.check(), "a.csv")


@case
def k4_height_named_twice(w):
    text(w, "a.csv", ["x,y,z,height"] + [f"{e:.3f},{n:.3f},{z:.3f},{z + 36.7:.3f}" for e, n, z in w.points])
    w.site("a.csv")
    refused(w.check(), "a.csv", "height")


@case
def k4_ellipsoidal_and_orthometric_heights(w):
    text(w, "a.csv", ["easting,northing,ellipsoidal height,orthometric height"] + [f"{e:.3f},{n:.3f},{z + 36.7:.3f},{z:.3f}" for e, n, z in w.points])
    w.site("a.csv")
    refused_or_reference(w, w.check(), "a.csv", "height")


@case
def k4_local_and_site_coordinates_side_by_side(w):
    text(w, "a.csv", ["x,y,z,easting,northing,elevation"] + [f"{e - 41250:.3f},{n + 98760:.3f},{z:.3f},{e:.3f},{n:.3f},{z:.3f}" for e, n, z in w.points])
    w.site("a.csv")
    refused_or_reference(w, w.check(), "a.csv", "east and north")


@case
def k4_northing_and_x_mixed(w):
    text(w, "a.csv", ["x,northing,z"] + rows(w, "{:.3f},{:.3f},{:.3f}"))
    for axes in ("east-north", "north-east"):
        w.site("a.csv", axes=axes)
        refused_or_reference(w, w.check(), "a.csv")


@case
def k4_html_error_page_named_csv(w):
    text(w, "a.csv", ["<!DOCTYPE html>", "<html><body>Login</body></html>"])
    w.site("a.csv")
    refused(w.check(), "a.csv")


@case
def k4_zip_named_txt(w):
    import zipfile

    with zipfile.ZipFile(w.path("a.txt"), "w") as z:
        z.writestr("a.xyz", "\n".join(rows(w)))
    w.site("a.txt")
    refused(w.check(), "a.txt")


# --- K5 -------------------------------------------------------------------------------------------------------------------------


@case
def k5_a_twentieth_at_zero(w):
    n = len(w.points) // 20
    las(w, "a.laz", np.vstack([w.points, np.zeros((n, 3))]), crs=SITE)
    w.site("a.laz")
    seen = w.check()
    as_reference(w, seen, len(w.points) + n) if seen.code == 0 else refused(seen, "a.laz")
    said(seen, "far")


@case
def k5_multipath_below_the_bed(w):
    las(w, "a.laz", np.vstack([w.points, [41250, -98760, -400.0], [41250.5, -98760, -380.0]]))
    w.site("a.laz")
    seen = w.check()
    as_reference(w, seen, len(w.points) + 2)
    said(seen, "far")


@case
def k5_a_beam_of_points_into_the_sky(w):
    beam = np.column_stack([np.full(40, 41250.0), np.full(40, -98760.0), np.linspace(60, 2000, 40)])
    las(w, "a.laz", np.vstack([w.points, beam]))
    w.site("a.laz")
    seen = w.check()
    as_reference(w, seen, len(w.points) + 40)


@case
def k5_two_piers_three_kilometres_apart(w):
    las(w, "a.laz", np.vstack([w.points, w.points + [3000, 0, 0]]))
    w.site("a.laz")
    seen = w.check()
    assert seen.code == 0 and seen.high[0] - seen.low[0] > 2900, "half of a survey is no stray"


@case
def k5_a_smaller_pile_500_m_away(w):
    n = len(w.points) // 8
    las(w, "a.laz", np.vstack([w.points, w.points[:n] + [500, 0, 0]]))
    w.site("a.laz")
    seen = w.check()
    assert seen.code == 0
    assert seen.high[0] - seen.low[0] > 400 or "far" in seen.text, "lost without a word"


@case
def k5_a_run_with_a_stray_is_not_dearer(w):
    import time

    seconds = []
    for name, more in (("a.laz", []), ("b.laz", [[41250 + 30_000, -98760, 2.0]])):
        las(w, name, np.vstack([w.points, *([more] if more else [])]))
        w.site(name, size=2.0)
        start = time.time()
        code, out, err = w.tsumu("run", w.folder, "--plans", 0, "--out", w.path(name + ".run"), "--threads", 1)
        assert code in (0, 1), err
        seconds.append(time.time() - start)
    assert seconds[1] < 2 * seconds[0] + 3, seconds


@case
def k5_one_wild_cell_of_a_design(w):
    values = np.full((16, 16), 3.4, "f4")
    values[3, 3] = 1e6
    tif(w, "d.tif", values)
    refused(design_case(w, "d.tif"), "d.tif", "heights")


@case
def k5_a_corner_of_a_tin_at_the_origin(w):
    wild = surface("FG", 3.4).replace("</Pnts>", '<P id="99">0 0 0</P></Pnts>').replace("</Faces>", "<F>1 2 99</F></Faces>")
    seen = landxml(w, [wild])
    assert seen.code == 2, "a triangle to the origin is a design"


# --- K6 -------------------------------------------------------------------------------------------------------------------------


@case
def k6_palette(w):
    import rasterio

    tif(w, "d.tif", np.full((16, 16), 3, "u1"))
    with rasterio.open(w.path("d.tif"), "r+") as out:
        out.write_colormap(1, {0: (0, 0, 0, 255), 3: (255, 0, 0, 255)})
    refused(design_case(w, "d.tif"), "d.tif")


@case
def k6_double_no_data_lowest(w):
    lowest = float(np.finfo("f8").min)
    tif(w, "d.tif", half("f8", 3.4, lowest), nodata=lowest)
    at_level(design_case(w, "d.tif"))


@case
def k6_offset_alone(w):
    tif(w, "d.tif", np.full((16, 16), 103.4, "f4"), offset=-100.0)
    at_level(design_case(w, "d.tif"), tolerance=0.01)


@case
def k6_south_up(w):
    from rasterio import Affine

    tif(w, "d.tif", np.full((16, 16), 3.4, "f4"), transform=Affine(0.5, 0, 41246, 0, 0.5, -98764))
    seen = design_case(w, "d.tif")
    at_level(seen) if seen.code == 0 else refused(seen, "d.tif")


@case
def k6_complex_numbers(w):
    tif(w, "d.tif", np.full((16, 16), 3.4, "c8"))
    refused(design_case(w, "d.tif"), "d.tif")


@case
def k6_no_data_0_of_floats(w):
    tif(w, "d.tif", half("f4", 3.4, 0.0), nodata=0.0)
    at_level(design_case(w, "d.tif"))


@case
def k6_no_data_everywhere(w):
    tif(w, "d.tif", np.full((16, 16), -9999, "f4"), nodata=-9999)
    refused(design_case(w, "d.tif"), "d.tif")


@case
def k6_inf_in_a_design(w):
    tif(w, "d.tif", half("f4", 3.4, np.inf))
    seen = design_case(w, "d.tif")
    at_level(seen) if seen.code == 0 else refused(seen, "d.tif")


@case
def k6_scale_in_feet_unit(w):
    tif(w, "d.tif", np.full((16, 16), 1115, "i2"), scale=0.01, unit="us-ft")
    seen = design_case(w, "d.tif")
    at_level(seen, 11.15 * 1200 / 3937) if seen.code == 0 else refused(seen, "f")


@case
def k6_png_named_tif(w):
    w.path("d.tif").write_bytes(b"\x89PNG\r\n\x1a\n" + bytes(64))
    refused(design_case(w, "d.tif"), "d.tif")


# --- K7 -------------------------------------------------------------------------------------------------------------------------


@case
def k7_layer_0_of_a_block_on_a_layer_that_is_off(w):
    def fill(d, m):
        d.layers.add("OLD").off()
        plate(d.blocks.new("rev"), 5.0, "0", at=(-4, -4))
        m.add_blockref("rev", (41250, -98760), dxfattribs={"layer": "OLD"})
        plate(m, 3.4)

    at_level(dxf(w, fill))


@case
def k7_array_of_inserts(w):
    def fill(d, m):
        d.blocks.new("b").add_3dface([(0, 0, 0), (4, 0, 0), (4, 4, 0), (0, 4, 0)])
        insert = m.add_blockref("b", (41246, -98764, 3.4))
        insert.dxf.row_count = insert.dxf.column_count = 2
        insert.dxf.row_spacing = insert.dxf.column_spacing = 4

    seen = dxf(w, fill)
    at_level(seen)
    assert seen.value["design_covered"] is not None


@case
def k7_block_that_holds_itself(w):
    def fill(d, m):
        block = d.blocks.new("b")
        block.add_3dface([(-4, -4, 0), (4, -4, 0), (4, 4, 0), (-4, 4, 0)])
        block.add_blockref("b", (0, 0, 0))
        m.add_blockref("b", (41250, -98760, 3.4))

    seen = dxf(w, fill)
    at_level(seen) if seen.code == 0 else refused(seen, "d.dxf")


@case
def k7_external_reference(w):
    def fill(d, m):
        d.add_xref_def("other.dwg", "other")
        m.add_blockref("other", (0, 0, 0))
        plate(m, 3.4)

    seen = dxf(w, fill)
    at_level(seen) if seen.code == 0 else refused(seen, "other")
    said(seen, "other")


@case
def k7_locked_and_unplotted_layers_count(w):
    def fill(d, m):
        layer = d.layers.add("FG")
        layer.lock()
        layer.dxf.plot = 0
        plate(m, 3.4)

    at_level(dxf(w, fill))


@case
def k7_decimetres_and_feet(w):
    at_level(dxf(w, lambda d, m: plate(m, scale=10), units=14))
    at_level(dxf(w, lambda d, m: plate(m, scale=1 / 0.3048), units=2))


@case
def k7_flat_drawing(w):
    refused_words = dxf(w, lambda d, m: m.add_lwpolyline([(41246, -98764), (41254, -98764), (41254, -98756)], close=True))
    refused(refused_words, "d.dxf")


@case
def k7_names_of_layers_in_japanese(w):
    def fill(d, m):
        d.layers.add("現況").off()
        plate(m, 5.0, "現況")
        plate(m, 3.4, "計画")

    seen = dxf(w, fill)
    at_level(seen)
    said(seen, "現況")


# --- K8 -------------------------------------------------------------------------------------------------------------------------


@case
def k8_the_same_name_twice(w):
    refused(landxml(w, [surface("FG", 1.2), surface("FG", 3.4)], more='surface = "FG"\n'), "d.xml", "FG")


@case
def k8_name_in_another_case(w):
    refused(landxml(w, [surface("EG", 1.2), surface("FG", 3.4)], more='surface = "fg"\n'), "FG", "EG")


@case
def k8_prefix_of_the_namespace(w):
    import re

    landxml(w, [surface("FG", 3.4)])
    whole = w.path("d.xml").read_text()
    whole = re.sub(r"<(/?)([A-Za-z])", r"<\1lx:\2", whole).replace("xmlns=", "xmlns:lx=")
    w.path("d.xml").write_text(whole)
    seen = w.check()
    at_level(seen) if seen.code == 0 else refused(seen, "d.xml")


@case
def k8_kilometres(w):
    seen = landxml(w, [surface("FG", 3.4, 1000.0)], '<Units><Metric linearUnit="kilometer"/></Units>')
    at_level(seen) if seen.code == 0 else refused(seen, "kilomet")


@case
def k8_unit_that_nobody_knows(w):
    refused(landxml(w, [surface("FG", 3.4)], '<Units><Metric linearUnit="shaku"/></Units>'), "shaku")


@case
def k8_compressed_and_named_xml(w):
    import gzip

    landxml(w, [surface("FG", 3.4)])
    w.path("d.xml").write_bytes(gzip.compress(w.path("d.xml").read_bytes()))
    refused(w.check(), "d.xml")


@case
def k8_a_face_of_points_that_are_not_there(w):
    refused(landxml(w, [surface("FG", 3.4).replace("</Faces>", "<F>1 2 777</F></Faces>")]), "d.xml")


@case
def k8_cut_short(w):
    landxml(w, [surface("FG", 3.4)])
    whole = w.path("d.xml").read_bytes()
    w.path("d.xml").write_bytes(whole[: len(whole) // 2])
    refused(w.check(), "d.xml")


@case
def k8_no_units_at_all(w):
    seen = landxml(w, [surface("FG", 3.4)], units="")
    at_level(seen) if seen.code == 0 else refused(seen, "nit")


# --- K9 -------------------------------------------------------------------------------------------------------------------------


@case
def k9_e57_turned_about_itself(w):
    local = w.points - [41250, -98760, 0]
    half_ = np.sqrt(0.5)
    back = np.column_stack([local[:, 1], -local[:, 0], local[:, 2]])
    import pye57

    file = pye57.E57(str(w.path("a.e57")), mode="w")
    data = {"cartesianX": back[:, 0].copy(), "cartesianY": back[:, 1].copy(), "cartesianZ": back[:, 2].copy()}
    file.write_scan_raw(data, rotation=np.array([half_, 0, 0, half_]), translation=np.array([41250.0, -98760.0, 0.0]))
    file.close()
    w.site("a.e57")
    as_reference(w, w.check())


@case
def k9_e57_shift_that_is_nearly_round(w):
    e57(w, "a.e57", scans=[((41250.1234, -98760.4321, 0.0), (1, 0, 0, 0))])
    w.site("a.e57")
    as_reference(w, w.check())


@case
def k9_sensor_of_the_site_far_from_everything(w):
    las(w, "a.laz", crs=SITE)
    w.site("a.laz", more="sensor_position = [0.0, 0.0, 0.0]")
    seen = w.check()
    assert seen.code == 2 or "sensor" in seen.text, "a sensor at 0, 0, 0 is believed"


@case
def k9_sensor_of_the_site_not_finite(w):
    las(w, "a.laz", crs=SITE)
    w.site("a.laz", more="sensor_position = [nan, 0.0, 10.0]")
    refused(w.check(), "site.toml", "sensor_position")


@case
def k9_pcd_viewpoint_of_nan(w):
    pcd(w, "a.pcd", viewpoint="nan nan nan 1 0 0 0")
    w.site("a.pcd")
    refused_or_reference(w, w.check(), "a.pcd")


@case
def k9_pcd_viewpoint_is_turned(w):
    pcd(w, "a.pcd", viewpoint="41250 -98760 12 0.7071 0 0 0.7071")
    w.site("a.pcd")
    as_reference(w, w.check())


# --- K10 ------------------------------------------------------------------------------------------------------------------------


@case
def k10_stl_with_nan(w):
    v, f = cube()
    raw = bytearray(binary_stl(v, f))
    raw[84 + 12 : 84 + 16] = struct.pack("<f", np.nan)
    refused(mesh_case(w, "m.stl", bytes(raw))[1], "m.stl")


@case
def k10_obj_line_continuation_and_degenerate_faces(w):
    v, f = cube()
    body = obj(v, f).replace("f 1", "f \\\n1") + "f 1 1 2\n"
    seen, checked = mesh_case(w, "m.obj", body)
    said(seen, "8.0000 m³") if seen.code == 0 else refused(checked, "m.obj")


@case
def k10_obj_with_lines_and_points(w):
    v, f = cube()
    said(mesh_case(w, "m.obj", obj(v, f) + "l 1 2\np 3\nvp 0.1\n")[0], "8.0000 m³")


@case
def k10_two_solids_apart(w):
    a, fa = cube()
    b, fb = cube(0.5, (10.0, 0, 0))
    seen, checked = mesh_case(w, "m.obj", obj(np.vstack([a, b]), np.vstack([fa, fb + len(a)])))
    refused(checked, "own") if seen.code == 2 else said(seen, "8.1250 m³")


@case
def k10_in_inches(w):
    v, f = cube(2 / 0.0254)
    said(mesh_case(w, "m.stl", binary_stl(v, f), "in")[0], "8.000")


@case
def k10_without_a_unit(w):
    v, f = cube()
    mesh_case(w, "m.stl", binary_stl(v, f))
    (w.folder / "catalog.toml").write_text('[[block]]\nname = "own"\nmesh = "m.stl"\n')
    refused(w.check(), "catalog.toml", "unit")


@case
def k10_ply_of_triangle_strips(w):
    head = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nelement tristrips 1\nproperty list int int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n4 0 1 2 3\n"
    refused(mesh_case(w, "m.ply", head)[1], "m.ply")


@case
def k10_cracks_of_a_tenth_of_a_millimetre(w):
    v, f = cube()
    rng = np.random.default_rng(3)
    triangles = v[f] + rng.uniform(-2e-5, 2e-5, (len(f), 3, 3))
    body = b"".join(struct.pack("<12fH", 0, 0, 0, *t.ravel(), 0) for t in triangles)
    seen, checked = mesh_case(w, "m.stl", b"x".ljust(80) + struct.pack("<I", len(f)) + body)
    said(seen, " m³") if seen.code == 0 else refused(checked, "own", "mesh")


@case
def k10_three_mf_named_stl(w):
    w.path("m.stl").write_bytes(b"PK\x03\x04" + bytes(200))
    refused(mesh_case(w, "m.stl", b"PK\x03\x04" + bytes(200))[1], "m.stl")


@case
def k10_flat_plate(w):
    v, f = cube()
    v = v * [1, 1, 0]
    refused(mesh_case(w, "m.obj", obj(v, f))[1], "own")


# --- K11 ------------------------------------------------------------------------------------------------------------------------


@case
def k11_fine_scale_of_coarse_numbers(w):
    las(w, "a.laz", np.round(w.points / 0.1) * 0.1, crs=SITE)
    w.site("a.laz", size=2.0)
    refused(w.check(), "steps of 0.1")


@case
def k11_a_height_model_on_a_grid_is_no_coarse_step(w):
    cell = 0.1
    i = np.floor(w.points[:, :2] / cell).astype(int)
    cells = {}
    for key, z in zip(map(tuple, i), w.points[:, 2]):
        cells.setdefault(key, []).append(z)
    grid = np.array([[a * cell, b * cell, np.mean(z)] for (a, b), z in cells.items()])
    text(w, "a.xyz", rows(w, "{:.1f} {:.1f} {:.3f}", grid))
    w.site("a.xyz", size=2.0)
    seen = w.check()
    assert seen.code == 0, "a grid of 10 cm is refused"
    said(seen, "grid of 100 mm")


@case
def k11_doubles_rounded_to_decimetres_in_e57(w):
    e57(w, "a.e57", np.round(w.points, 1))
    w.site("a.e57", size=2.0)
    refused(w.check(), "steps of 0.1")


@case
def k11_floats_that_have_blurred_heights_alone(w):
    points = w.points + [0, 0, 4_000_000]
    ply(w, "a.ply", points, kind="f4")
    w.site("a.ply", design="")
    refused(w.check(), "a.ply")


if __name__ == "__main__":
    check_siblings.main()
