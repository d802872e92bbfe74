//! Ground that does not move, from a GeoJSON file.

use crate::error::OrBadInput;
use crate::{Error, Result};
use anyhow::{Context, anyhow};
use monitor::StableGround;
use serde_json::Value;
use std::path::Path;

/// Polygons of a site.
const MOST_BYTES: u64 = 256 << 20;

/// Reads the outer rings of all polygons of a GeoJSON file; coordinates are the site's (east, north).
pub fn read(file: &Path) -> Result<StableGround> {
    let named = || file.display().to_string();
    let text = io::read_text(file, MOST_BYTES).or_bad_input()?;
    let value: Value = serde_json::from_str(&text).with_context(named).or_bad_input()?;
    let mut polygons = Vec::new();
    collect(&value, &mut polygons).with_context(named).or_bad_input()?;
    if polygons.is_empty() {
        return Err(Error::bad_input(anyhow!(
            "{}: holds no Polygon or MultiPolygon; draw the ground that does not move as one",
            file.display()
        )));
    }
    Ok(StableGround { polygons })
}

fn collect(value: &Value, out: &mut Vec<Vec<[f64; 2]>>) -> anyhow::Result<()> {
    let list = |key: &str| value[key].as_array().map(Vec::as_slice).unwrap_or_default();
    match value["type"].as_str() {
        Some("FeatureCollection") => {
            list("features").iter().try_for_each(|f| collect(&f["geometry"], out))
        }
        Some("GeometryCollection") => list("geometries").iter().try_for_each(|g| collect(g, out)),
        Some("Feature") => collect(&value["geometry"], out),
        Some("Polygon") => {
            out.push(ring(&value["coordinates"][0])?);
            Ok(())
        }
        Some("MultiPolygon") => list("coordinates").iter().try_for_each(|p| {
            out.push(ring(&p[0])?);
            Ok(())
        }),
        _ => Ok(()),
    }
}

fn ring(value: &Value) -> anyhow::Result<Vec<[f64; 2]>> {
    let corner = |p: &Value| {
        let finite = |i: usize| p[i].as_f64().filter(|v| v.is_finite());
        finite(0).zip(finite(1)).map(|(x, y)| [x, y])
    };
    let corners: Option<Vec<[f64; 2]>> =
        value.as_array().and_then(|ring| ring.iter().map(corner).collect());
    match corners {
        Some(corners) if corners.len() >= 3 => Ok(corners),
        _ => Err(anyhow!("a polygon needs at least three corners of two finite numbers each")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn polygons_are_found_wherever_they_are() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("wall.geojson");
        let polygon = r#"{"type":"Polygon","coordinates":[[[0,0,5],[4,0,5],[4,2,5],[0,0,5]]]}"#;
        let text = format!(
            r#"{{"type":"FeatureCollection","features":[{{"type":"Feature","geometry":{polygon}}}]}}"#
        );
        for text in [text.as_str(), polygon] {
            std::fs::write(&file, text).unwrap();
            assert_eq!(read(&file).unwrap().polygons[0][1], [4.0, 0.0]);
        }
        for (text, word) in [
            ("{", "wall.geojson"),
            ("{}", "no Polygon"),
            (&polygon.replace("4,2,5", "4"), "finite"),
        ] {
            std::fs::write(&file, text).unwrap();
            assert!(read(&file).unwrap_err().line().contains(word));
        }
    }
}
