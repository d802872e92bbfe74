//! Writes every export of a small made-up result into a folder, for `tools/check_exports.py`:
//! `cargo run --release -p io --example exports -- FOLDER`.

#[path = "../tests/files/clouds.rs"]
#[allow(dead_code, unused_imports)]
mod clouds;
#[path = "../tests/files/sample.rs"]
mod sample;

use io::export_set::{self, ExportSet};
use io::{dxf, geojson, geopackage, geotiff, glb, ifc, landxml, points};
use std::path::PathBuf;

fn main() {
    let Some(folder) = std::env::args_os().nth(1).map(PathBuf::from) else {
        eprintln!("usage: exports FOLDER");
        std::process::exit(2);
    };
    if let Err(error) = write(&folder) {
        eprintln!("{error}");
        std::process::exit(1);
    }
}

fn write(folder: &std::path::Path) -> Result<(), io::IoError> {
    let sample = sample::sample();
    let drawing = sample.drawing();
    let at = |name: &str| folder.join(name);
    geojson::write(&at("blocks.geojson"), &drawing)?;
    dxf::write(&at("blocks.dxf"), &drawing)?;
    glb::write(&at("blocks.glb"), &drawing)?;
    ifc::write(&at("blocks.ifc"), &drawing)?;
    geopackage::write(&at("blocks.gpkg"), &drawing, 7)?;
    geotiff::write(&at("height.tif"), &sample::raster(), &sample.frame.crs)?;
    landxml::write(
        &at("surface.xml"),
        drawing.name,
        &sample.frame.crs,
        &[sample::surface("design")],
    )?;
    let maps = [("as-surveyed", sample::raster()), ("deficit-before", sample::raster())];
    let set = ExportSet { drawing, seed: 7, maps: &maps, surfaces: &["as-surveyed"] };
    export_set::write_with(&at("set"), &set, &sample::details())?;
    points::write(&at("cloud.laz"), &clouds::sample(120_001))?;
    points::write(&at("cloud.las"), &clouds::sample(1_000))?;
    points::write(&at("cloud.ply"), &clouds::sample(1_000))
}
