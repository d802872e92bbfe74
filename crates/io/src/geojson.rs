//! GeoJSON: the blocks' outlines from above with their figures. Coordinates are the site's projected ones, named by
//! the `crs` member that GDAL and QGIS read (RFC 7946 knows degrees only).

use crate::drawing::{Drawing, Source, Unit};
use crate::{IoError, atomic};
use serde_json::{Value, json};
use std::path::Path;

/// Writes every block as a polygon.
pub fn write(path: &Path, drawing: &Drawing) -> Result<(), IoError> {
    let mut text = serde_json::to_string(&value(drawing)).expect("plain data");
    text.push('\n');
    atomic::write_bytes(path, text.as_bytes())
}

/// The document.
pub fn value(drawing: &Drawing) -> Value {
    let features: Vec<Value> = drawing.units().map(|unit| feature(drawing, &unit)).collect();
    let mut document =
        json!({ "type": "FeatureCollection", "name": drawing.name, "features": features });
    if let Some(code) = drawing.epsg() {
        let name = format!("urn:ogc:def:crs:EPSG::{code}");
        document["crs"] = json!({ "type": "name", "properties": { "name": name } });
    }
    document
}

fn feature(drawing: &Drawing, unit: &Unit) -> Value {
    let mut rings = drawing.footprint(unit);
    rings.iter_mut().for_each(|ring| ring.extend(ring.first().copied()));
    let centre = drawing.centre(unit);
    let mut properties = json!({
        "id": unit.label(),
        "layer": unit.layer(),
        "model": drawing.catalog.get(unit.model).name,
        "x_m": centre.x, "y_m": centre.y, "z_m": centre.z,
        "mass_kg": drawing.catalog.get(unit.model).mass_kg(),
        "volume_m3": drawing.catalog.get(unit.model).volume_m3,
    });
    match unit.source {
        Source::Recognised(_, fit) => {
            properties["confidence"] = json!(fit.confidence);
            properties["fitness_m"] = json!(fit.fitness_m);
            properties["occlusion"] = json!(fit.occlusion);
        }
        Source::Planned(p) => {
            properties["order"] = json!(p.order);
            properties["round"] = json!(p.round);
            properties["filled_m3"] = json!(p.filled_m3);
            properties["contacts"] = json!(p.contacts);
        }
    }
    json!({ "type": "Feature", "properties": properties, "geometry": { "type": "Polygon", "coordinates": rings } })
}
