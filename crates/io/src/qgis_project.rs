//! `project.qgz`: opens the GeoPackage and the maps of the same folder in QGIS, styled.
//!
//! The project names its coordinate system in full (a code alone leaves it empty) and repeats the renderers (a project does
//! not look into `layer_styles`). Names of layers have more than ten letters: QGIS makes new ones for shorter.

use crate::drawing::Drawing;
use crate::landxml::escaped;
use crate::raster::Raster;
use crate::vector_layers::{Kind, NAMES};
use crate::{IoError, atomic, qgis_style};
use std::fmt::Write as _;
use std::io::{self, Cursor, Write as _};
use std::path::Path;
use zip::write::SimpleFileOptions;

/// Writes the project; `maps` are the rasters beside it, `NAME.tif`.
pub fn write(path: &Path, drawing: &Drawing, maps: &[(&str, Raster)]) -> Result<(), IoError> {
    let packed = || -> io::Result<Vec<u8>> {
        let mut zip = zip::ZipWriter::new(Cursor::new(Vec::new()));
        let options = SimpleFileOptions::default().last_modified_time(zip::DateTime::default());
        zip.start_file("project.qgs", options).map_err(io::Error::other)?;
        zip.write_all(text(drawing, maps).as_bytes())?;
        Ok(zip.finish().map_err(io::Error::other)?.into_inner())
    };
    atomic::write_bytes(path, &packed().map_err(|e| IoError::write(path, e))?)
}

/// The project's XML.
pub fn text(drawing: &Drawing, maps: &[(&str, Raster)]) -> String {
    let srs = reference_system(drawing);
    let (mut tree, mut layers) = (String::new(), String::new());
    // The tree lists from the top down.
    for (name, title, kind) in NAMES.iter().rev() {
        let source = format!("./project.gpkg|layername={name}");
        let _ = write!(
            tree,
            "<layer-tree-layer id=\"tsumu_layer_{name}\" name=\"{title}\" checked=\"Qt::Checked\" expanded=\"0\" providerKey=\"ogr\" source=\"{source}\"/>"
        );
        let shape = match kind {
            Kind::Point => "Point",
            Kind::Line => "Line",
            Kind::Polygon => "Polygon",
        };
        let _ = write!(
            layers,
            "<maplayer type=\"vector\" geometry=\"{shape}\" labelsEnabled=\"{}\"><id>tsumu_layer_{name}</id><datasource>{source}</datasource><layername>{title}</layername><srs>{srs}</srs><provider encoding=\"UTF-8\">ogr</provider>{}</maplayer>",
            u8::from(qgis_style::labelled(name)),
            qgis_style::body(name)
        );
    }
    for (name, map) in maps.iter().rev() {
        let name = escaped(name);
        let source = format!("./{name}.tif");
        let shown = if name == "deficit-before" { "Qt::Checked" } else { "Qt::Unchecked" };
        let _ = write!(
            tree,
            "<layer-tree-layer id=\"tsumu_map_{name}\" name=\"{name}\" checked=\"{shown}\" expanded=\"0\" providerKey=\"gdal\" source=\"{source}\"/>"
        );
        let differences = name.starts_with("deficit");
        let [low, high] = range(map, differences);
        let _ = write!(
            layers,
            "<maplayer type=\"raster\"><id>tsumu_map_{name}</id><datasource>{source}</datasource><layername>{name}</layername><srs>{srs}</srs><provider>gdal</provider>{}</maplayer>",
            qgis_style::raster(differences, low, high)
        );
    }
    format!(
        "<!DOCTYPE qgis PUBLIC 'http://mrcc.com/qgis.dtd' 'SYSTEM'>\n<qgis projectname=\"{0}\" version=\"3.22.16\"><title>{0}</title><projectCrs>{srs}</projectCrs><layer-tree-group>{tree}</layer-tree-group><projectlayers>{layers}</projectlayers><properties><SpatialRefSys><ProjectionsEnabled type=\"int\">1</ProjectionsEnabled></SpatialRefSys><Paths><Absolute type=\"bool\">false</Absolute></Paths></properties></qgis>\n",
        escaped(drawing.name)
    )
}

fn reference_system(drawing: &Drawing) -> String {
    let Some(code) = drawing.epsg() else { return "<spatialrefsys/>".into() };
    let wkt = crate::crs::wkt_of_epsg(code).unwrap_or_default();
    format!(
        "<spatialrefsys><wkt>{}</wkt><srid>{code}</srid><authid>EPSG:{code}</authid><geographicflag>false</geographicflag></spatialrefsys>",
        escaped(&wkt)
    )
}

/// Values between which the colours run: 2 % at either end are left out; differences reach as far below as above.
pub(crate) fn range(map: &Raster, differences: bool) -> [f64; 2] {
    let mut known: Vec<f32> = map.value.iter().copied().filter(|v| v.is_finite()).collect();
    known.sort_by(f32::total_cmp);
    let at = |share: usize| {
        known.get(known.len().saturating_sub(1) * share / 100).copied().map_or(0.0, f64::from)
    };
    let (low, high) = (at(2), at(98));
    let [low, high] = if differences {
        let reach = low.abs().max(high.abs());
        [-reach, reach]
    } else {
        [low, high]
    };
    if high > low { [low, high] } else { [low - 1.0, low + 1.0] }
}
