//! GeoPackage: one file with blocks, placements and the run that made them, for QGIS and everything built on GDAL.

use crate::details::Details;
use crate::drawing::Drawing;
use crate::vector_layers::{Kind, Layer, layers};
use crate::{IoError, atomic, qgis_style};
use rusqlite::types::Value;
use rusqlite::{Connection, params, params_from_iter};
use std::io;
use std::path::Path;

/// The tables the standard asks for. Dates are fixed: the same result gives the same bytes.
pub(crate) const STANDARD: &str = "
PRAGMA application_id = 1196444487; -- 'GPKG'
PRAGMA user_version = 10300;
CREATE TABLE gpkg_spatial_ref_sys (
  srs_name TEXT NOT NULL, srs_id INTEGER NOT NULL PRIMARY KEY, organization TEXT NOT NULL,
  organization_coordsys_id INTEGER NOT NULL, definition TEXT NOT NULL, description TEXT);
CREATE TABLE gpkg_contents (
  table_name TEXT NOT NULL PRIMARY KEY, data_type TEXT NOT NULL, identifier TEXT UNIQUE, description TEXT DEFAULT '',
  last_change DATETIME NOT NULL DEFAULT '2000-01-01T00:00:00.000Z',
  min_x DOUBLE, min_y DOUBLE, max_x DOUBLE, max_y DOUBLE, srs_id INTEGER REFERENCES gpkg_spatial_ref_sys(srs_id));
CREATE TABLE gpkg_geometry_columns (
  table_name TEXT NOT NULL PRIMARY KEY REFERENCES gpkg_contents(table_name), column_name TEXT NOT NULL,
  geometry_type_name TEXT NOT NULL, srs_id INTEGER NOT NULL REFERENCES gpkg_spatial_ref_sys(srs_id),
  z TINYINT NOT NULL, m TINYINT NOT NULL, UNIQUE (table_name, column_name));
INSERT INTO gpkg_spatial_ref_sys VALUES
  ('Undefined Cartesian SRS', -1, 'NONE', -1, 'undefined', NULL),
  ('Undefined geographic SRS', 0, 'NONE', 0, 'undefined', NULL),
  ('WGS 84 geodetic', 4326, 'EPSG', 4326,
   'GEOGCS[\"WGS 84\",DATUM[\"WGS_1984\",SPHEROID[\"WGS 84\",6378137,298.257223563]],PRIMEM[\"Greenwich\",0],UNIT[\"degree\",0.0174532925199433],AUTHORITY[\"EPSG\",\"4326\"]]',
   NULL);
";

/// Ours.
const SCHEMA: &str = "
CREATE TABLE layer_styles (
  id INTEGER PRIMARY KEY AUTOINCREMENT, f_table_catalog TEXT, f_table_schema TEXT, f_table_name TEXT,
  f_geometry_column TEXT, styleName TEXT, styleQML TEXT, styleSLD TEXT, useAsDefault BOOLEAN, description TEXT,
  owner TEXT, ui TEXT, update_time DATETIME DEFAULT '2000-01-01T00:00:00.000Z');
INSERT INTO gpkg_contents (table_name, data_type, identifier) VALUES ('layer_styles', 'attributes', 'layer_styles');
CREATE TABLE runs (
  fid INTEGER PRIMARY KEY AUTOINCREMENT NOT NULL, name TEXT, version TEXT, seed INTEGER, crs TEXT, vertical_datum TEXT,
  recognised INTEGER, planned INTEGER);
INSERT INTO gpkg_contents (table_name, data_type, identifier) VALUES ('runs', 'attributes', 'runs');
";

/// Writes the drawing; `seed` is the run's.
pub fn write(path: &Path, drawing: &Drawing, seed: u64) -> Result<(), IoError> {
    write_with(path, drawing, &Details::default(), seed)
}

/// Writes the drawing and what belongs to it, with the styles QGIS takes as default.
pub fn write_with(
    path: &Path,
    drawing: &Drawing,
    details: &Details,
    seed: u64,
) -> Result<(), IoError> {
    let bytes =
        bytes(drawing, details, seed).map_err(|e| IoError::write(path, io::Error::other(e)))?;
    atomic::write_bytes(path, &bytes)
}

fn bytes(drawing: &Drawing, details: &Details, seed: u64) -> rusqlite::Result<Vec<u8>> {
    let mut database = Connection::open_in_memory()?;
    database.execute_batch(STANDARD)?;
    database.execute_batch(SCHEMA)?;
    let transaction = database.transaction()?;
    let srs = spatial_reference(&transaction, &drawing.frame.crs, drawing.epsg())?;
    let layers = layers(drawing, details);
    for layer in &layers {
        write_layer(&transaction, layer, srs)?;
    }
    let count =
        |name: &str| layers.iter().find(|l| l.name == name).map_or(0, |l| l.rows.len() as i64);
    transaction.execute(
        "INSERT INTO runs VALUES (NULL, ?1, ?2, ?3, ?4, ?5, ?6, ?7)",
        params![
            drawing.name,
            env!("CARGO_PKG_VERSION"),
            seed.cast_signed(),
            drawing.frame.crs,
            drawing.frame.vertical_datum,
            count("blocks"),
            count("placements")
        ],
    )?;
    transaction.commit()?;
    Ok(database.serialize("main")?.to_vec())
}

/// Enters the reference system and gives its number in the file.
pub(crate) fn spatial_reference(
    db: &Connection,
    crs: &str,
    epsg: Option<u32>,
) -> rusqlite::Result<i64> {
    let Some(code) = epsg else { return Ok(-1) };
    if code != 4326 {
        let wkt = crate::crs::wkt_of_epsg(code).unwrap_or_else(|| "undefined".into());
        let sql = "INSERT INTO gpkg_spatial_ref_sys VALUES (?1, ?2, 'EPSG', ?2, ?3, NULL)";
        db.execute(sql, params![crs, code, wkt])?;
    }
    Ok(i64::from(code))
}

fn write_layer(db: &Connection, layer: &Layer, srs: i64) -> rusqlite::Result<()> {
    let columns: String = layer.columns.iter().map(|c| format!(", {c}")).collect();
    db.execute_batch(&format!(
        "CREATE TABLE {} (fid INTEGER PRIMARY KEY AUTOINCREMENT NOT NULL, geom {}{columns});",
        layer.name,
        layer.kind.word()
    ))?;
    let marks: String = (0..layer.columns.len()).map(|i| format!(", ?{}", i + 2)).collect();
    let mut insert = db.prepare(&format!("INSERT INTO {} VALUES (NULL, ?1{marks})", layer.name))?;
    let mut extent = [f64::MAX, f64::MAX, f64::MIN, f64::MIN];
    for row in &layer.rows {
        for p in row.rings.iter().flatten() {
            let e = extent;
            extent = [e[0].min(p[0]), e[1].min(p[1]), e[2].max(p[0]), e[3].max(p[1])];
        }
        let geometry = Value::Blob(geometry(layer.kind, &row.rings, srs as i32));
        insert.execute(params_from_iter(std::iter::once(&geometry).chain(&row.values)))?;
    }
    let bound = |v: f64| (v.abs() < f64::MAX).then_some(v);
    let [x0, y0, x1, y1] = extent.map(bound);
    db.execute(
        "INSERT INTO gpkg_contents (table_name, data_type, identifier, description, min_x, min_y, max_x, max_y, srs_id) VALUES (?1, 'features', ?1, ?2, ?3, ?4, ?5, ?6, ?7)",
        params![layer.name, layer.title, x0, y0, x1, y1, srs],
    )?;
    db.execute(
        "INSERT INTO gpkg_geometry_columns VALUES (?1, 'geom', ?2, ?3, ?4, 0)",
        params![layer.name, layer.kind.word(), srs, u8::from(layer.kind == Kind::Line)],
    )?;
    db.execute(
        "INSERT INTO layer_styles (f_table_catalog, f_table_schema, f_table_name, f_geometry_column, styleName, styleQML, styleSLD, useAsDefault, description, owner) VALUES ('', '', ?1, 'geom', ?1, ?2, '', 1, ?3, '')",
        params![layer.name, qgis_style::document(layer.name), layer.title],
    )?;
    Ok(())
}

/// GeoPackage binary: header without envelope, then a WKB polygon of closed rings, or a line with heights.
fn geometry(kind: Kind, rings: &[Vec<[f64; 3]>], srs: i32) -> Vec<u8> {
    let mut out = b"GP\0\x01".to_vec();
    out.extend(srs.to_le_bytes());
    out.push(1); // little-endian
    let numbers = |out: &mut Vec<u8>, values: &[f64]| {
        out.extend(values.iter().flat_map(|v| v.to_le_bytes()));
    };
    match kind {
        Kind::Polygon => {
            out.extend(3_u32.to_le_bytes());
            out.extend((rings.len() as u32).to_le_bytes());
            for ring in rings {
                out.extend((ring.len() as u32 + 1).to_le_bytes());
                for p in ring.iter().chain(ring.first()) {
                    numbers(&mut out, &p[..2]);
                }
            }
        }
        Kind::Line => {
            let line = rings.first().map_or(&[][..], |l| l);
            out.extend(1002_u32.to_le_bytes()); // a line with z
            out.extend((line.len() as u32).to_le_bytes());
            line.iter().for_each(|p| numbers(&mut out, p));
        }
        Kind::Point => {
            let p = rings.first().and_then(|r| r.first()).copied().unwrap_or([f64::NAN; 3]);
            out.extend(1_u32.to_le_bytes());
            numbers(&mut out, &p[..2]);
        }
    }
    out
}
