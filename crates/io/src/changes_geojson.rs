//! GeoJSON of a comparison: an arrow for every block that moved, a point for every other, with the columns of `changes.csv`.

use crate::changes_csv::ChangeRow;
use crate::{IoError, atomic, drawing};
use serde_json::{Value, json};
use std::path::Path;

/// Writes every block as an arrow (earlier to later centre) or a point.
pub fn write(path: &Path, name: &str, crs: &str, rows: &[ChangeRow]) -> Result<(), IoError> {
    let mut text = serde_json::to_string(&value(name, crs, rows)).expect("plain data");
    text.push('\n');
    atomic::write_bytes(path, text.as_bytes())
}

/// The document.
pub fn value(name: &str, crs: &str, rows: &[ChangeRow]) -> Value {
    let features: Vec<Value> = rows.iter().filter_map(feature).collect();
    let mut document = json!({ "type": "FeatureCollection", "name": name, "features": features });
    if let Some(code) = drawing::epsg(crs) {
        let name = format!("urn:ogc:def:crs:EPSG::{code}");
        document["crs"] = json!({ "type": "name", "properties": { "name": name } });
    }
    document
}

fn feature(row: &ChangeRow) -> Option<Value> {
    let geometry = match (row.centre_earlier, row.centre_later) {
        (Some(a), Some(b)) if row.class != "unchanged" => {
            json!({ "type": "LineString", "coordinates": [a, b] })
        }
        (Some(p), _) | (None, Some(p)) => json!({ "type": "Point", "coordinates": p }),
        (None, None) => return None,
    };
    let properties = json!({
        "block_id": row.block_id,
        "earlier_id": row.earlier_id,
        "later_id": row.later_id,
        "model": row.model,
        "class": row.class,
        "dx_m": row.shift_m.map(|s| s[0]),
        "dy_m": row.shift_m.map(|s| s[1]),
        "dz_m": row.shift_m.map(|s| s[2]),
        "distance_m": row.distance_m,
        "turn_deg": row.turn_deg,
        "level_m": row.level_m,
        "level_deg": row.level_deg,
        "significance": row.significance,
        "confidence": row.confidence,
        "note": row.note,
    });
    Some(json!({ "type": "Feature", "properties": properties, "geometry": geometry }))
}
