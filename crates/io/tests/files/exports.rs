//! Exports: what they must hold, without another program; `tools/check_exports.py` opens them with independent readers.

use crate::sample::{raster, sample, surface, tin};
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
    assert_eq!(
        (count("BLOCK"), count("INSERT"), count("POLYLINE"), count("VERTEX")),
        (2, 8, 2, 10)
    );
    assert!(text.is_ascii());
    // The faces of the block definitions are read where they are inserted.
    let faces = of_bytes("a.dxf", text.as_bytes(), |i| dxf::read_faces(i).unwrap());
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
    // Block 1 stands unturned at the local origin.
    let first: Vec<f64> = features[0]["geometry"]["coordinates"][0][0]
        .as_array()
        .unwrap()
        .iter()
        .map(|v| v.as_f64().unwrap())
        .collect();
    assert_eq!(first, [-35_600.5, -12_300.25]);
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
        "deficit.tif",
        "height.tif",
        "project.gpkg",
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
