//! Every export of a run at once, under the names that formats.md states.

use crate::drawing::Drawing;
use crate::raster::Raster;
use crate::tin::Tin;
use crate::{IoError, dxf, geojson, geopackage, geotiff, glb, ifc, landxml};
use std::path::Path;

/// A LandXML surface of more nodes is thinned: surveying programs choke on it.
const TIN_NODES: usize = 60_000;

/// What goes out.
#[derive(Clone, Copy, Debug)]
pub struct ExportSet<'a> {
    /// Blocks and sections.
    pub drawing: Drawing<'a>,
    /// Root of the run's random choices, for the record.
    pub seed: u64,
    /// Maps by name: each becomes `NAME.tif`.
    pub maps: &'a [(&'a str, Raster)],
    /// Names of the maps that are surfaces (heights) and go into `surfaces.xml` as well.
    pub surfaces: &'a [&'a str],
}

/// Writes all of them into a folder; each file whole or not at all.
pub fn write(folder: &Path, set: &ExportSet) -> Result<(), IoError> {
    let at = |name: &str| folder.join(name);
    let drawing = &set.drawing;
    geopackage::write(&at("project.gpkg"), drawing, set.seed)?;
    geojson::write(&at("blocks.geojson"), drawing)?;
    dxf::write(&at("blocks.dxf"), drawing)?;
    glb::write(&at("blocks.glb"), drawing)?;
    ifc::write(&at("blocks.ifc"), drawing)?;
    let mut tins = Vec::new();
    for (name, map) in set.maps {
        geotiff::write(&at(&format!("{name}.tif")), map, &drawing.frame.crs)?;
        if set.surfaces.contains(name) {
            let step = (map.value.len() as f64 / TIN_NODES as f64).sqrt().ceil() as usize;
            tins.push((*name, Tin::of_raster(map, step)));
        }
    }
    let tins: Vec<(&str, &Tin)> = tins.iter().filter(|t| !t.1.triangles.is_empty()).map(|(n, t)| (*n, t)).collect();
    if tins.is_empty() {
        return Ok(());
    }
    landxml::write(&at("surfaces.xml"), drawing.name, &drawing.frame.crs, &tins)
}
