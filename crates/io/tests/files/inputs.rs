//! Kinds of clouds that we read but do not write.

use crate::foreign::{self, place};
use geom::{DVec3, Silent};
use io::{Input, RawCloud, points};
use std::path::Path;
use std::sync::Mutex;

fn read(kind: &str, bytes: &[u8]) -> Result<RawCloud, String> {
    let name = format!("a.{kind}");
    points::read_as(&mut Input::of_bytes(Path::new(&name), bytes), kind, &Silent)
        .map_err(|e| e.to_string())
}

#[test]
fn text_clouds_of_many_makes() {
    let expected = [DVec3::new(1.5, -2.0, 3.25), DVec3::new(4.0, 5.0, 6.0)];
    for text in [
        "1.5 -2 3.25\n4 5 6\n",
        "# exported\n1.5,-2,3.25,77\r\n4,5,6,78\r\n",
        "\u{feff}X;Y;Z\n1.5;-2;3.25\n4;5;6",
        "//X,Y,Z\n1.5,-2,3.25\n\n4,5,6\n",
        "2\n1.5 -2 3.25 -1712\n4 5 6 3\n",
        "name,north,east,height\na,-2,1.5,3.25\nb,5,4,6\n",
        "\"x\"\t\"y\"\t\"z\"\n1.5\t-2\t3.25\n4\t5\t6e0\n",
    ] {
        assert_eq!(read("xyz", text.as_bytes()).unwrap().position, expected, "{text}");
    }
    let labelled = read("csv", b"z,y,x,instance,model,confidence\n3.25,-2,1.5,7,2,0.5\n").unwrap();
    assert_eq!(
        (labelled.instance, labelled.model, labelled.confidence),
        (Some(vec![7]), Some(vec![2]), Some(vec![0.5]))
    );
}

#[test]
fn text_clouds_name_the_line() {
    let fails = |text: &str, parts: &[&str]| {
        let error = read("xyz", text.as_bytes()).unwrap_err();
        assert!(parts.iter().all(|p| error.contains(p)), "{error}");
    };
    fails("1 2 3\n1 2\n", &["a.xyz, line 2", "`z`"]);
    fails("1 2 3\n1 2 x\n", &["line 2", "`x`"]);
    fails("1 2 3\n1 NaN 3\n", &["line 2", "finite"]);
    fails("a,b,c\n1,2,3\n", &["`x`", "a, b, c"]);
    fails("", &["no points"]);
    fails("x y z\n", &["no points"]);
    fails("x,y,z,instance\n1,2,3,-1\n", &["line 2", "`instance` = -1"]);
}

#[test]
fn pcd_of_all_three_kinds() {
    for data in ["ascii", "binary", "binary_compressed"] {
        let cloud = read("pcd", &foreign::pcd(data)).unwrap();
        assert_eq!((cloud.len(), cloud.invalid), (99, 1), "{data}");
        assert_eq!(cloud.sensor_positions, [DVec3::new(1.0, 2.0, 30.0)]);
        assert_eq!(cloud.float32, data != "ascii");
        for (k, p) in cloud.position.iter().enumerate() {
            let i = if k < 3 { k } else { k + 1 };
            let [x, y, z] = place(i);
            let expected = DVec3::new(f64::from(x as f32), f64::from(y as f32), z);
            assert!((*p - expected).length() < 1e-6, "{data} {i}: {p} {expected}");
            assert_eq!(cloud.instance.as_ref().unwrap()[k], (i % 5) as u32);
        }
    }
}

#[test]
fn an_e57_keeps_where_its_scanners_stood() {
    let cloud = read("e57", &foreign::e57()).unwrap();
    assert_eq!((cloud.len(), cloud.invalid), (299, 1));
    assert_eq!(cloud.sensor_positions, [DVec3::new(0.0, 5.0, 1.5), DVec3::new(100.0, 5.0, 1.5)]);
    let [x, y, z] = place(9);
    assert!((cloud.position[9] - DVec3::new(x, y + 5.0, z + 1.5)).length() < 1e-12);
    assert!((cloud.position[150 + 8] - DVec3::new(x + 100.0, y + 5.0, z + 1.5)).length() < 1e-12);
}

#[test]
fn a_copc_is_read_whole_and_in_part() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.copc.laz");
    std::fs::write(&path, foreign::copc()).unwrap();
    let all = points::read(&path, &Silent).unwrap();
    assert_eq!(all.len(), 200);
    let inside = |low: DVec3, high: DVec3| {
        let within = |p: &&DVec3| p.cmpge(low).all() && p.cmple(high).all();
        let mut expected: Vec<_> =
            all.position.iter().filter(within).map(|p| p.to_array()).collect();
        let mut found: Vec<_> = points::read_box(&path, low, high, &Silent)
            .unwrap()
            .position
            .iter()
            .map(|p| p.to_array())
            .collect();
        let order = |a: &[f64; 3], b: &[f64; 3]| a.partial_cmp(b).unwrap();
        expected.sort_by(order);
        found.sort_by(order);
        assert_eq!(found, expected);
        found.len()
    };
    assert!(inside(DVec3::new(9.0, 0.0, 0.0), DVec3::new(20.0, 2.0, 9.0)) > 10);
    assert_eq!(inside(DVec3::splat(-1.0), DVec3::splat(99.0)), 200);
    // Only the chunk that is needed is read: damage in the other one goes unnoticed.
    let mut bytes = foreign::copc();
    let data_at = u32::from_le_bytes(bytes[96..100].try_into().unwrap()) as usize;
    bytes[data_at + 8 + 30..data_at + 8 + 90].fill(0xff);
    std::fs::write(&path, bytes).unwrap();
    assert!(points::read(&path, &Silent).is_err());
    assert_eq!(
        points::read_box(&path, DVec3::new(8.5, 0.0, 0.0), DVec3::splat(99.0), &Silent)
            .unwrap()
            .len(),
        {
            let within = |p: &&DVec3| p.x >= 8.5;
            all.position.iter().filter(within).count()
        }
    );
}

#[test]
fn float32_at_large_coordinates_is_warned_of_in_millimetres() {
    struct Listen(Mutex<Vec<String>>);
    impl geom::Observer for Listen {
        fn event(&self, event: geom::Event) {
            if let geom::Event::Warned(w) = event {
                self.0.lock().unwrap().push(w.message);
            }
        }
    }
    let ply = |x: f32| {
        let mut bytes = b"ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\nend_header\n".to_vec();
        [x, 1.0, 2.0].iter().for_each(|v| bytes.extend(v.to_le_bytes()));
        bytes
    };
    let warnings = |x: f32| {
        let (listen, bytes) = (Listen(Mutex::default()), ply(x));
        points::read_as(&mut Input::of_bytes(Path::new("a.ply"), &bytes), "ply", &listen).unwrap();
        listen.0.into_inner().unwrap()
    };
    assert!(warnings(100.0).is_empty());
    // Floats near −35,678 are 1/256 m apart: 2 mm either way.
    assert!(warnings(-35_678.0)[0].contains("2.0 mm"));
    assert!(warnings(4_000_000.0)[0].contains("125.0 mm"));
}

#[test]
fn a_design_comes_from_landxml_dxf_and_geotiff() {
    use scene::AxisOrder;
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    io::landxml::write(&at("a.xml"), "p", "EPSG:6679", &[crate::sample::surface("design")])
        .unwrap();
    let face = |p: [[f64; 3]; 4]| {
        let pairs: String = (0..4)
            .flat_map(|i| (0..3).map(move |k| format!("{}\n{}\n", 10 + 10 * k + i, p[i][k])))
            .collect();
        format!("0\nSECTION\n2\nENTITIES\n0\n3DFACE\n8\n0\n{pairs}0\nENDSEC\n0\nEOF\n")
    };
    let corners = [[0.0, 0.0, 1.0], [10.0, 0.0, 2.0], [10.0, 5.0, 3.5], [0.0, 5.0, 2.5]];
    std::fs::write(at("a.dxf"), face(corners.map(|[x, y, z]| [x - 35_600.125, y - 12_300.0, z])))
        .unwrap();
    std::fs::write(
        at("north.dxf"),
        face(corners.map(|[x, y, z]| [y - 12_300.0, x - 35_600.125, z])),
    )
    .unwrap();
    for (name, order) in [
        ("a.xml", AxisOrder::EastNorth),
        ("a.dxf", AxisOrder::EastNorth),
        ("north.dxf", AxisOrder::NorthEast),
    ] {
        let design = io::design_file::read(&at(name), 0.25, order, &Silent).unwrap();
        let level = design.level_at(-35_600.0 + 4.0, -12_300.0 + 2.0).unwrap();
        let expected = 1.0 + 0.1 * 4.125 + 0.3 * 2.0;
        assert!((level - expected).abs() < 1e-6, "{name}: {level} {expected}");
    }
    io::geotiff::write(&at("a.tif"), &crate::sample::raster(), "EPSG:6679").unwrap();
    let design = io::design_file::read(&at("a.tif"), 0.25, AxisOrder::EastNorth, &Silent).unwrap();
    assert_eq!(design.level_at(-35_600.25 + 1.0, -12_300.75 + 1.5), Some(32.0));
    let error = io::design_file::read(&at("a.pdf"), 0.25, AxisOrder::EastNorth, &Silent)
        .unwrap_err()
        .to_string();
    assert!(error.contains(".xml, .tif, .dxf"), "{error}");
}
