//! Every reader behind the name of its kind: what the damaged files of this test go through, and the fuzz targets too.

use io::{Input, IoError};
use std::path::Path;

/// Kinds of point clouds.
pub const CLOUDS: [&str; 7] = ["laz", "las", "ply", "pcd", "e57", "xyz", "copc.laz"];

/// Kinds of everything else.
pub const OTHERS: [&str; 17] = [
    "stl",
    "obj",
    "mesh.ply",
    "tif",
    "xml",
    "dxf",
    "blocks.csv",
    "placements.csv",
    "site.toml",
    "catalog.toml",
    "review.json",
    "manifest.json",
    "alignment.xml",
    "alignment.dxf",
    "labels.laz",
    "labels.ply",
    "labels.pcd",
];

/// Reads the bytes as a file of this kind.
pub fn read(kind: &str, bytes: &[u8]) -> Result<(), IoError> {
    let name = format!("hostile.{kind}");
    let name = Path::new(&name);
    let mut input = Input::of_bytes(name, bytes);
    match kind {
        "las" | "laz" | "ply" | "xyz" | "pcd" | "e57" => {
            io::points::read_as(&mut input, kind, &geom::Silent).map(drop)
        }
        "copc.laz" => {
            let (low, high) = (geom::DVec3::ZERO, geom::DVec3::new(5.0, 99.0, 99.0));
            io::las::stream_box(&mut input, low, high, &mut |_| Ok(())).map(drop)
        }
        "tif" => io::geotiff::read(&mut input).map(drop),
        "xml" => io::landxml::read(&mut input, None).map(|tin| drop(tin.on_grid(0.5))),
        "dxf" => io::dxf::read_faces(&mut input)
            .map(|faces| drop(io::tin::Tin::of_faces(&faces).on_grid(0.5))),
        "stl" | "obj" => io::mesh::read_as(&mut input, kind).map(drop),
        "mesh.ply" => io::mesh::read_as(&mut input, "ply").map(drop),
        "blocks.csv" => io::blocks_csv::read_from(&mut input).map(drop),
        "placements.csv" => io::placements_csv::read_from(&mut input).map(drop),
        "site.toml" => {
            io::site::parse_toml::<scene::SiteSpec>(name, &String::from_utf8_lossy(bytes))
                .map(|site| drop(site.check()))
        }
        "catalog.toml" => {
            io::site::parse_toml::<scene::CatalogSpec>(name, &String::from_utf8_lossy(bytes))
                .map(drop)
        }
        "review.json" => io::review::read_from(&mut input).map(drop),
        "manifest.json" => io::manifest::Manifest::of_bytes(name, bytes).map(drop),
        "alignment.xml" => io::landxml::read_alignment(&mut input, None).map(drop),
        "alignment.dxf" => io::dxf::read_polylines(&mut input, None).map(drop),
        "labels.laz" | "labels.ply" | "labels.pcd" => relabelled(kind, bytes),
        _ => panic!("there is no reader of `{kind}`"),
    }
}

/// The file again with labels, moved to other coordinates.
fn relabelled(kind: &str, bytes: &[u8]) -> Result<(), IoError> {
    use io::relabel::{PointLabels, Records, SiteFromFile};
    let folder = tempfile::tempdir().expect("a folder for a test can be made");
    let source = folder.path().join(format!("hostile.{kind}"));
    std::fs::write(&source, bytes).expect("a file of a test can be written");
    let labels = PointLabels {
        record: &[0, 5, 4_000_000_000],
        instance: &[1, 2, 3],
        model: &[1, 1, 1],
        confidence: &[0.5; 3],
    };
    let to_site =
        SiteFromFile { swap: true, height_factor: 0.3048, vertical_offset_m: 1.0, epsg: None };
    let out = folder.path().join(format!("out.hostile.{kind}"));
    io::relabel::write(&out, &source, &labels, &to_site, Records::All)
}
