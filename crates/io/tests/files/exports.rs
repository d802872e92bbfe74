//! Exports: what they must hold, without another program; `tools/check_exports.py` opens them with independent readers.

use crate::sample::{details, raster, sample, surface, tin};
use geom::{DVec3, Silent};
use io::{Input, dxf, geojson, geopackage, geotiff, glb, ifc, landxml};
use std::fs;
use std::path::Path;

fn of_bytes<T>(name: &str, bytes: &[u8], read: impl Fn(&mut Input) -> T) -> T {
    read(&mut Input::of_bytes(Path::new(name), bytes))
}

#[test]
fn a_geotiff_comes_back_with_its_place() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("height.tif");
    geotiff::write(&path, &raster(), "EPSG:6679").unwrap();
    let (back, crs) = geotiff::read(&mut Input::open(&path).unwrap()).unwrap();
    assert_eq!(crs.as_deref(), Some("EPSG:6679"));
    assert_eq!((back.origin, back.cell_m, back.columns), (raster().origin, 0.5, 7));
    let same = |a: &f32, b: &f32| a == b || (a.is_nan() && b.is_nan());
    assert!(back.value.iter().zip(&raster().value).all(|(a, b)| same(a, b)));
    assert_eq!(back.design().level_at(-35_600.25 + 1.0, -12_300.75 + 1.5), Some(32.0));
}

#[test]
fn a_landxml_surface_comes_back() {
    let text = landxml::text("a & b", "EPSG:6679", &[surface("design <1>"), surface("as-is")]);
    let back =
        of_bytes("s.xml", text.as_bytes(), |i| landxml::read(i, Some("design <1>")).unwrap());
    assert_eq!(back, tin());
    // North comes first in the file.
    assert!(text.contains("<P id=\"2\">-12300 -35590.125 2</P>"), "{text}");
    assert!(
        text.contains("name=\"design &lt;1&gt;\" desc=\"a &quot;sample&quot; &lt; 1\""),
        "{text}"
    );
    let missing = of_bytes("s.xml", text.as_bytes(), |i| {
        landxml::read(i, Some("planned")).unwrap_err().to_string()
    });
    assert!(missing.contains("planned"));
    let broken = text.replace("<F>1 3 4</F>", "<F>1 3 9</F>");
    let error = of_bytes("s.xml", broken.as_bytes(), |i| {
        landxml::read(i, Some("as-is")).unwrap_err().to_string()
    });
    assert!(error.contains("s.xml, line") && error.contains("<F>"), "{error}");
}

#[test]
fn a_dxf_has_a_block_per_type_and_an_insert_per_unit() {
    let sample = sample();
    let text = dxf::text(&sample.drawing());
    let lines: Vec<&str> = text.lines().collect();
    let count = |entity: &str| lines.chunks(2).filter(|p| p[0] == "0" && p[1] == entity).count();
    // A block a type and one for the numbers; a unit is a solid and a number; numbers are attributes.
    assert_eq!((count("BLOCK"), count("INSERT"), count("ATTRIB")), (3, 16, 40));
    // Eight outlines, two section lines in space and laid out, and the frame.
    assert_eq!(count("POLYLINE"), 8 + 2 + 2 + 1);
    assert!(text.contains("\nNo.0+5\n") && text.contains("\n-35600"), "station and place");
    assert!(text.is_ascii());
    // The faces of the block definitions are read where they are inserted.
    // (The solids' layers are frozen at first: thawed, as a person would before taking them for a surface.)
    let thawed = text.replace("\n70\n1\n62\n", "\n70\n0\n62\n");
    let faces = of_bytes("a.dxf", thawed.as_bytes(), |i| dxf::read_faces(i).unwrap());
    assert_eq!(faces.len(), 64);
    let drawing = sample.drawing();
    let unit = drawing.units().next().unwrap();
    let mesh = &drawing.catalog.get(unit.model).mesh;
    for (corner, vertex) in faces[0].iter().zip(mesh.corners(0)) {
        let expected = drawing.frame.site_from_local(unit.pose.transform_point(vertex));
        assert!((*corner - expected).length() < 1e-4, "{corner} {expected}");
    }
}

#[test]
fn geojson_has_a_closed_polygon_per_block() {
    let sample = sample();
    let value = geojson::value(&sample.drawing());
    let features = value["features"].as_array().unwrap();
    assert_eq!(features.len(), 8);
    assert_eq!(value["crs"]["properties"]["name"], "urn:ogc:def:crs:EPSG::6679");
    for feature in features {
        let ring = feature["geometry"]["coordinates"][0].as_array().unwrap();
        assert_eq!(ring.first(), ring.last());
        assert!(ring.len() >= 4);
    }
    // Block 1 stands unturned at the local origin: its outline is a rectangle of 2 m by 1 m from there.
    let ring = features[0]["geometry"]["coordinates"][0].as_array().unwrap();
    let range = |k: usize| {
        let values = ring.iter().map(|p| p[k].as_f64().unwrap());
        [values.clone().fold(f64::MAX, f64::min), values.fold(f64::MIN, f64::max)]
    };
    let close = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).abs() < 1e-3 && (a[1] - b[1]).abs() < 1e-3;
    assert_eq!(ring.len(), 5);
    assert!(close(range(0), [-35_600.5, -35_598.5]) && close(range(1), [-12_300.25, -12_299.25]));
    assert_eq!(features[5]["properties"]["order"], 1);
}

#[test]
fn a_glb_is_framed_as_the_standard_has_it() {
    let sample = sample();
    let bytes = glb::bytes(&sample.drawing());
    let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
    assert_eq!((&bytes[..4], word(4), word(8)), (&b"glTF"[..], 2, bytes.len()));
    let json_len = word(12);
    let document: serde_json::Value = serde_json::from_slice(&bytes[20..20 + json_len]).unwrap();
    assert_eq!(word(20 + json_len) + 28 + json_len, bytes.len());
    assert_eq!(document["nodes"].as_array().unwrap().len(), 9);
    assert_eq!(document["meshes"].as_array().unwrap().len(), 4);
    let views = document["bufferViews"].as_array().unwrap();
    let end = |v: &serde_json::Value| {
        v["byteOffset"].as_u64().unwrap() + v["byteLength"].as_u64().unwrap()
    };
    assert_eq!(views.iter().map(end).max(), document["buffers"][0]["byteLength"].as_u64());
}

#[test]
fn an_ifc_maps_every_unit_to_its_type() {
    let sample = sample();
    let text = ifc::text(&sample.drawing());
    let count = |entity: &str| text.matches(&format!("={entity}(")).count();
    assert_eq!((count("IFCBUILDINGELEMENTPART"), count("IFCBUILDINGELEMENTPARTTYPE")), (8, 2));
    assert_eq!(
        (count("IFCMAPPEDITEM"), count("IFCREPRESENTATIONMAP"), count("IFCTRIANGULATEDFACESET")),
        (8, 2, 2)
    );
    assert!(text.contains("IFCPROJECTEDCRS('EPSG:6679'") && text.is_ascii());
}

#[test]
fn a_geopackage_is_a_whole_database() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.gpkg");
    let sample = sample();
    geopackage::write(&path, &sample.drawing(), u64::MAX).unwrap();
    let db = rusqlite::Connection::open(&path).unwrap();
    let number = |sql: &str| db.query_row(sql, [], |row| row.get::<_, i64>(0)).unwrap();
    assert_eq!(number("SELECT count(*) FROM blocks"), 5);
    assert_eq!(number("SELECT count(*) FROM placements"), 3);
    assert_eq!(number("SELECT recognised FROM runs"), 5);
    assert_eq!(number("PRAGMA application_id"), 0x4750_4B47);
    assert_eq!(
        number("SELECT srs_id FROM gpkg_geometry_columns WHERE table_name = 'blocks'"),
        6679
    );
    // Every layer has its geometry and a style that QGIS takes as default; the styles' table is registered.
    let names =
        ["blocks", "not_judged", "placements", "unfilled", "design", "alignment", "sections"];
    for name in names {
        let of = |sql: &str| db.query_row(sql, [name], |row| row.get::<_, i64>(0)).unwrap();
        assert_eq!(
            of("SELECT count(*) FROM gpkg_geometry_columns WHERE table_name = ?1"),
            1,
            "{name}"
        );
        assert_eq!(
            of("SELECT useAsDefault FROM layer_styles WHERE f_table_name = ?1"),
            1,
            "{name}"
        );
    }
    assert_eq!(number("SELECT count(*) FROM gpkg_contents WHERE table_name = 'layer_styles'"), 1);
    assert_eq!(number("SELECT count(*) FROM not_judged"), 1);
    let mass: f64 =
        db.query_row("SELECT mass_kg FROM blocks WHERE block_id = 1", [], |r| r.get(0)).unwrap();
    assert!((mass - 1.0 * 2300.0 / 2.0).abs() < 1.0, "a wedge of half a cubic metre: {mass}");
    let check: String = db.query_row("PRAGMA integrity_check", [], |row| row.get(0)).unwrap();
    assert_eq!(check, "ok");
}

#[test]
fn the_same_result_gives_the_same_bytes_and_an_empty_one_is_written_too() {
    let sample = sample();
    let empty = io::drawing::Drawing {
        recognised: &[],
        placements: &[],
        sections: &[],
        ..sample.drawing()
    };
    for drawing in [sample.drawing(), empty] {
        let folder = tempfile::tempdir().unwrap();
        let [a, b] = ["a", "b"].map(|sub| {
            let at = |name: &str| folder.path().join(sub).join(name);
            geojson::write(&at("x.geojson"), &drawing).unwrap();
            dxf::write(&at("x.dxf"), &drawing).unwrap();
            glb::write(&at("x.glb"), &drawing).unwrap();
            ifc::write(&at("x.ifc"), &drawing).unwrap();
            geopackage::write(&at("x.gpkg"), &drawing, 7).unwrap();
            geotiff::write(&at("x.tif"), &raster(), "none").unwrap();
            ["x.geojson", "x.dxf", "x.glb", "x.ifc", "x.gpkg", "x.tif"]
                .map(|name| fs::read(at(name)).unwrap())
        });
        assert!(a == b);
    }
}

#[test]
fn a_labelled_cloud_of_the_contract() {
    // Names and kinds of the extra dimensions, as other programs find them.
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.laz");
    io::points::write(&path, &crate::clouds::sample(5)).unwrap();
    let bytes = fs::read(&path).unwrap();
    let find = |name: &[u8]| bytes.windows(name.len()).position(|w| w == name).unwrap();
    let codes = [&b"instance\0"[..], b"model\0", b"confidence\0"].map(|n| bytes[find(n) - 2]);
    assert_eq!(codes, [5, 3, 9], "u32, u16, f32");
    assert_eq!(io::points::read(&path, &Silent).unwrap().len(), 5);
}

#[test]
fn the_whole_set_has_the_names_of_the_guide() {
    let (sample, folder) = (sample(), tempfile::tempdir().unwrap());
    let map = geom::HeightMap {
        origin: [0.25, 0.25],
        cell_m: 0.1,
        nx: 400,
        ny: 300,
        z_m: vec![1.5; 120_000],
    };
    let maps = [
        ("height", io::raster::Raster::of_heights(&map, &sample.frame)),
        ("deficit", io::raster::Raster::of_differences(&map, &sample.frame)),
    ];
    let set = io::export_set::ExportSet {
        drawing: sample.drawing(),
        seed: 7,
        maps: &maps,
        surfaces: &["height"],
    };
    io::export_set::write(folder.path(), &set).unwrap();
    let mut names: Vec<_> = fs::read_dir(folder.path())
        .unwrap()
        .map(|e| e.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    let expected = [
        "blocks.dxf",
        "blocks.geojson",
        "blocks.glb",
        "blocks.ifc",
        "deficit.qml",
        "deficit.tif",
        "height.qml",
        "height.tif",
        "project.gpkg",
        "project.qgz",
        "quantities.xlsx",
        "surfaces.xml",
    ];
    assert_eq!(names, expected);
    let read =
        |name: &str| geotiff::read(&mut Input::open(&folder.path().join(name)).unwrap()).unwrap().0;
    assert_eq!((read("height.tif").value[0], read("deficit.tif").value[0]), (3.5, 1.5));
    assert_eq!(read("height.tif").origin, [-35_600.25, -12_300.0]);
    assert_eq!(read("height.tif").cell_m, 0.1);
    let tin = landxml::read(
        &mut Input::open(&folder.path().join("surfaces.xml")).unwrap(),
        Some("height"),
    )
    .unwrap();
    // A level surface needs few points, but keeps its border.
    assert!(
        tin.vertices.len() < 3_000 && tin.vertices.iter().all(|v| v.z == 3.5),
        "{}",
        tin.vertices.len()
    );
    let span = |axis: fn(&DVec3) -> f64| {
        tin.vertices
            .iter()
            .map(axis)
            .fold((f64::MAX, f64::MIN), |(low, high), v| (low.min(v), high.max(v)))
    };
    assert_eq!(span(|v| v.x), (-35_600.25, -35_560.35));
    // Without a surface, one of an earlier run is gone.
    let none = io::export_set::ExportSet { surfaces: &[], ..set };
    io::export_set::write(folder.path(), &none).unwrap();
    assert!(!folder.path().join("surfaces.xml").exists());
}

const EVIL: &str = "=cmd|' /C calc'!A0\u{7}\n<b>\"&é積";

#[test]
fn hostile_names_stay_text_in_every_export() {
    let (mut sample, folder) = (sample(), tempfile::tempdir().unwrap());
    let models: Vec<_> = sample
        .catalog
        .iter()
        .map(|(_, m)| scene::BlockModel { name: EVIL.into(), ..m.clone() })
        .collect();
    sample.catalog = scene::Catalog::new(models);
    let drawing = io::drawing::Drawing { name: EVIL, ..sample.drawing() };
    let mut hostile = details();
    hostile.unfilled[0].reason = EVIL.into();
    hostile.survey_date = EVIL.into();
    let map = geom::HeightMap { origin: [0.0; 2], cell_m: 1.0, nx: 4, ny: 4, z_m: vec![1.0; 16] };
    let maps = [("height", io::raster::Raster::of_heights(&map, &sample.frame))];
    let set = io::export_set::ExportSet { drawing, seed: 1, maps: &maps, surfaces: &["height"] };
    io::export_set::write_with(folder.path(), &set, &hostile).unwrap();
    let text = |name: &str| fs::read_to_string(folder.path().join(name)).unwrap();
    // XML that a strict reader takes, with the name as text.
    for name in ["surfaces.xml", "height.qml"] {
        let text = text(name);
        let options = roxmltree::ParsingOptions { allow_dtd: true, ..Default::default() };
        roxmltree::Document::parse_with_options(&text, options)
            .unwrap_or_else(|e| panic!("{name}: {e}"));
        assert!(!text.contains("<b>"), "{name}");
    }
    // Pairs of lines only: a name with a line break in it would shift all that follows.
    let dxf = text("blocks.dxf");
    assert!(
        dxf.is_ascii() && dxf.lines().step_by(2).all(|code| code.trim().parse::<i32>().is_ok())
    );
    assert!(text("blocks.ifc").lines().all(|l| !l.chars().any(char::is_control)));
    // A workbook's text cells are shared strings, never formulas: those are ours, and of cells alone.
    let mut book =
        zip::ZipArchive::new(fs::File::open(folder.path().join("quantities.xlsx")).unwrap())
            .unwrap();
    let mut read = |name: &str| {
        let mut text = String::new();
        std::io::Read::read_to_string(&mut book.by_name(name).unwrap(), &mut text).unwrap();
        text
    };
    for sheet in 1..=3 {
        let sheet = read(&format!("xl/worksheets/sheet{sheet}.xml"));
        for formula in sheet.split("<f>").skip(1) {
            let formula = formula.split("</f>").next().unwrap();
            assert!(
                formula.chars().all(|c| c.is_ascii_alphanumeric() || "()+*/:".contains(c)),
                "{formula}"
            );
        }
    }
    assert!(read("xl/sharedStrings.xml").contains("=cmd|"));
}

#[test]
fn works_reach_every_format() {
    let (sample, folder) = (sample(), tempfile::tempdir().unwrap());
    let map = geom::HeightMap { origin: [0.0; 2], cell_m: 1.0, nx: 4, ny: 4, z_m: vec![1.0; 16] };
    let maps = [("height", io::raster::Raster::of_heights(&map, &sample.frame))];
    let set = io::export_set::ExportSet {
        drawing: sample.drawing(),
        seed: 1,
        maps: &maps,
        surfaces: &["height"],
    };
    io::export_set::write_with(folder.path(), &set, &details()).unwrap();
    let text = |name: &str| fs::read_to_string(folder.path().join(name)).unwrap();
    let land = text("surfaces.xml");
    assert!(land.contains("date=\"2026-11-30\"") && land.contains("length=\"20\""));
    // The section runs east from the alignment: its offsets are 0 to 4 to the right of it.
    assert!(land.contains("<CrossSect sta=\"5\" name=\"No.0+5\"><CrossSectSurf name=\"design\"><PntList2D>0 4 1 5 2 4 3 5 4 4</PntList2D>"), "{land}");
    let dxf = text("blocks.dxf");
    let on = |layer: &str| dxf.matches(&format!("\n8\n{layer}\n")).count();
    assert!(on("DESIGN") > 3 && on("ALIGNMENT") > 5 && on("UNFILLED") > 4 && on("TITLE") > 4);
    let ifc = text("blocks.ifc");
    assert!(ifc.contains("IFCMATERIAL('Concrete'") && ifc.contains("'2026-11-30T00:00:00'"));
    let db = rusqlite::Connection::open(folder.path().join("project.gpkg")).unwrap();
    for (layer, count) in [("alignment", 1), ("design", 1), ("sections", 2), ("unfilled", 1)] {
        let found: i64 =
            db.query_row(&format!("SELECT count(*) FROM {layer}"), [], |r| r.get(0)).unwrap();
        assert_eq!(found, count, "{layer}");
    }
}
