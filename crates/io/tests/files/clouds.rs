//! Clouds come back as they were written.

use geom::{DVec3, Silent, Vec3};
use io::{RawCloud, points};
use proptest::prelude::*;

/// A labelled cloud near a large northing.
pub fn sample(n: usize) -> RawCloud {
    let at = |i: usize| {
        let t = i as f64;
        DVec3::new(
            -35678.1234 + (t * 0.37).sin() * 40.0,
            -12345.6789 + t * 0.001,
            2.5 + (t * 0.11).cos(),
        )
    };
    RawCloud {
        position: (0..n).map(at).collect(),
        instance: Some((0..n).map(|i| (i % 7) as u32 * 1000).collect()),
        model: Some((0..n).map(|i| (i % 3) as u16).collect()),
        confidence: Some((0..n).map(|i| i as f32 / n as f32).collect()),
        line: Some((0..n).map(|i| (i % 5) as u16).collect()),
        crs: Some("EPSG:6679".into()),
        ..RawCloud::default()
    }
}

fn there_and_back(cloud: &RawCloud, name: &str) -> RawCloud {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    points::write(&path, cloud).unwrap();
    points::read(&path, &Silent).unwrap()
}

#[test]
fn a_large_cloud_survives_every_format() {
    let cloud = sample(120_001); // three chunks of LAZ, the last one not full
    for name in ["a.ply", "a.las", "a.laz"] {
        let back = there_and_back(&cloud, name);
        assert_eq!(back.len(), cloud.len(), "{name}");
        assert_eq!(
            (&back.instance, &back.model, &back.confidence, &back.line),
            (&cloud.instance, &cloud.model, &cloud.confidence, &cloud.line),
            "{name}"
        );
        assert_eq!(back.crs.as_deref(), Some("EPSG:6679"), "{name}");
        let worst = back
            .position
            .iter()
            .zip(&cloud.position)
            .map(|(a, b)| (*a - *b).abs().max_element())
            .fold(0.0, f64::max);
        assert!(worst <= if name == "a.ply" { 0.0 } else { 0.000_050_1 }, "{name}: {worst}");
    }
}

#[test]
fn the_bytes_do_not_depend_on_the_number_of_threads() {
    let cloud = sample(120_001);
    let folder = tempfile::tempdir().unwrap();
    let write = |threads: usize, name: &str| {
        let path = folder.path().join(name);
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| points::write(&path, &cloud)).unwrap();
        std::fs::read(path).unwrap()
    };
    assert_eq!(write(1, "one.laz"), write(3, "three.laz"));
}

#[test]
fn an_unlisted_crs_is_named_by_geotiff_keys() {
    let cloud = RawCloud { crs: Some("EPSG:2992".into()), ..sample(10) };
    assert_eq!(there_and_back(&cloud, "a.laz").crs.as_deref(), Some("EPSG:2992"));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]
    #[test]
    fn any_cloud_comes_back(
        rows in prop::collection::vec((-1e6..1e6_f64, -1e6..1e6_f64, -1e3..1e3_f64, any::<u32>(), any::<u16>(), 0.0..1.0_f32), 1..200),
        columns in 0..8_u8,
    ) {
        let cloud = RawCloud {
            position: rows.iter().map(|r| DVec3::new(r.0, r.1, r.2)).collect(),
            instance: (columns & 1 != 0).then(|| rows.iter().map(|r| r.3).collect()),
            model: (columns & 2 != 0).then(|| rows.iter().map(|r| r.4).collect()),
            confidence: (columns & 4 != 0).then(|| rows.iter().map(|r| r.5).collect()),
            ..RawCloud::default()
        };
        let record = Some((0..cloud.len() as u32).collect());
        let expected = RawCloud { record, ..cloud.clone() };
        prop_assert_eq!(&there_and_back(&cloud, "a.ply"), &expected);
        for name in ["a.las", "a.laz"] {
            let back = there_and_back(&cloud, name);
            prop_assert_eq!(&back.instance, &cloud.instance);
            prop_assert_eq!(&back.model, &cloud.model);
            prop_assert_eq!(&back.confidence, &cloud.confidence);
            for (a, b) in back.position.iter().zip(&cloud.position) {
                prop_assert!((*a - *b).abs().max_element() < 0.000_501, "{} {}", a, b);
            }
            // What was read is on the grid: writing it again changes nothing.
            prop_assert_eq!(&there_and_back(&back, name).position, &back.position);
        }
    }

    #[test]
    fn any_mesh_comes_back(v in prop::collection::vec((-1e3..1e3_f32, -1e3..1e3_f32, -1e3..1e3_f32), 3..50)) {
        let vertices: Vec<Vec3> = v.iter().map(|&(x, y, z)| Vec3::new(x, y, z)).collect();
        let n = vertices.len() as u32;
        let triangles = (2..n).map(|i| [i - 2, i - 1, i]).collect();
        let mesh = geom::TriMesh { vertices, triangles };
        let folder = tempfile::tempdir().unwrap();
        for name in ["a.ply", "a.obj", "a.stl"] {
            let path = folder.path().join(name);
            io::mesh::write(&path, &mesh).unwrap();
            let back = io::mesh::read(&path).unwrap();
            prop_assert_eq!(back.triangles.len(), mesh.triangles.len());
            for t in 0..mesh.triangles.len() {
                prop_assert_eq!(back.corners(t), mesh.corners(t));
            }
        }
    }
}

#[test]
fn thinning_keeps_one_point_a_cube_and_its_labels() {
    let cloud = sample(30_000);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.laz");
    points::write(&path, &cloud).unwrap();
    let all = points::read(&path, &Silent).unwrap();
    let thin = points::read_thinned(&path, 0.5, &Silent).unwrap();
    let cubes = |c: &RawCloud| {
        let mut keys: Vec<_> =
            c.position.iter().map(|p| (*p / 0.5).floor().to_array().map(|v| v as i64)).collect();
        keys.sort_unstable();
        keys.dedup();
        keys
    };
    assert_eq!(cubes(&thin).len(), thin.len());
    assert_eq!(cubes(&thin), cubes(&all));
    let labels = thin.instance.as_ref().unwrap();
    for (p, label) in thin.position.iter().zip(labels).take(300) {
        let i = all.position.iter().position(|q| q == p).unwrap();
        assert_eq!(all.instance.as_ref().unwrap()[i], *label);
    }
}
