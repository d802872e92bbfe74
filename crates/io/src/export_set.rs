//! Every export of a run at once, under the names that formats.md states.

use crate::details::Details;
use crate::drawing::Drawing;
use crate::landxml::{self, Surface};
use crate::raster::Raster;
use crate::tin_thinning::TinThinning;
use crate::{
    IoError, atomic, dxf, geojson, geopackage, geotiff, glb, ifc, qgis_project, qgis_style, xlsx,
};
use std::path::{Path, PathBuf};

/// How far a LandXML surface may stray from its map, metres: the map's own cells are no truer.
const TIN_TOLERANCE_M: f32 = 0.01;
/// Surveying programs choke on more: the tolerance is doubled until the surface has no more points.
const TIN_NODES: usize = 20_000;

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

/// Writes all of them into a folder, each file whole or not at all; the files it wrote.
pub fn write(folder: &Path, set: &ExportSet) -> Result<Vec<PathBuf>, IoError> {
    write_with(folder, set, &Details::default())
}

/// Writes all of them with alignment, design, unfilled places, quantities and the day of the survey.
pub fn write_with(
    folder: &Path,
    set: &ExportSet,
    details: &Details,
) -> Result<Vec<PathBuf>, IoError> {
    let mut written = Vec::new();
    let mut at = |name: &str| {
        written.push(folder.join(name));
        folder.join(name)
    };
    let drawing = &set.drawing;
    geopackage::write_with(&at("project.gpkg"), drawing, details, set.seed)?;
    qgis_project::write(&at("project.qgz"), drawing, set.maps)?;
    geojson::write(&at("blocks.geojson"), drawing)?;
    dxf::write_with(&at("blocks.dxf"), drawing, details)?;
    glb::write(&at("blocks.glb"), drawing)?;
    ifc::write_with(&at("blocks.ifc"), drawing, details)?;
    xlsx::write(&at("quantities.xlsx"), drawing, details)?;
    let mut tins = Vec::new();
    for (name, map) in set.maps {
        let band = format!("{name}, metres");
        geotiff::write_named(&at(&format!("{name}.tif")), map, &drawing.frame.crs, &band)?;
        let differences = name.starts_with("deficit");
        let [low, high] = qgis_project::range(map, differences);
        let style = qgis_style::raster_document(differences, low, high);
        atomic::write_bytes(&at(&format!("{name}.qml")), style.as_bytes())?;
        if set.surfaces.contains(name) {
            tins.push(surface(name, map));
        }
    }
    tins.retain(|surface| !surface.tin.triangles.is_empty());
    let path = folder.join("surfaces.xml");
    if tins.is_empty() {
        // One of an earlier run would be taken for this run's.
        return match std::fs::remove_file(&path) {
            Err(e) if e.kind() != std::io::ErrorKind::NotFound => Err(IoError::write(&path, e)),
            _ => Ok(written),
        };
    }
    landxml::write_with(&path, drawing.name, &drawing.frame.crs, &tins, drawing.sections, details)?;
    written.push(path);
    Ok(written)
}

fn surface(name: &str, map: &Raster) -> Surface {
    let thinning = TinThinning::new(map);
    let mut tolerance_m = TIN_TOLERANCE_M;
    let mut tin = thinning.tin(tolerance_m);
    // A hole keeps its edge whatever the tolerance: the end of this is a metre.
    while tin.vertices.len() > TIN_NODES && tolerance_m < 1.0 {
        tolerance_m *= 2.0;
        tin = thinning.tin(tolerance_m);
    }
    let note = format!("within {tolerance_m} m of the cells of {} m in {name}.tif", map.cell_m);
    Surface { name: name.into(), note, tin }
}
