//! GeoPackage: one file with blocks, placements and the run that made them, for QGIS and everything built on GDAL.

use crate::drawing::{Drawing, Source, Unit};
use crate::{IoError, atomic, las};
use rusqlite::{Connection, params};
use std::io;
use std::path::Path;

/// The tables the standard asks for, then ours. Dates are fixed: the same result gives the same bytes.
const SCHEMA: &str = "
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
CREATE TABLE blocks (
  fid INTEGER PRIMARY KEY AUTOINCREMENT NOT NULL, geom POLYGON, block_id INTEGER, model TEXT, x_m DOUBLE, y_m DOUBLE,
  z_m DOUBLE, occlusion DOUBLE, confidence DOUBLE, fitness_m DOUBLE, runner_up TEXT, runner_up_fitness_m DOUBLE, type_judged BOOLEAN);
CREATE TABLE placements (
  fid INTEGER PRIMARY KEY AUTOINCREMENT NOT NULL, geom POLYGON, placing_order INTEGER, round INTEGER, model TEXT,
  x_m DOUBLE, y_m DOUBLE, z_m DOUBLE, filled_m3 DOUBLE, contacts INTEGER);
CREATE TABLE runs (
  fid INTEGER PRIMARY KEY AUTOINCREMENT NOT NULL, name TEXT, version TEXT, seed INTEGER, crs TEXT, vertical_datum TEXT,
  recognised INTEGER, planned INTEGER);
INSERT INTO gpkg_contents (table_name, data_type, identifier) VALUES ('runs', 'attributes', 'runs');
";

/// Writes the drawing; `seed` is the run's.
pub fn write(path: &Path, drawing: &Drawing, seed: u64) -> Result<(), IoError> {
    let bytes = bytes(drawing, seed).map_err(|e| IoError::write(path, io::Error::other(e)))?;
    atomic::write_bytes(path, &bytes)
}

fn bytes(drawing: &Drawing, seed: u64) -> rusqlite::Result<Vec<u8>> {
    let mut database = Connection::open_in_memory()?;
    database.execute_batch(SCHEMA)?;
    let transaction = database.transaction()?;
    fill(&transaction, drawing, seed)?;
    transaction.commit()?;
    Ok(database.serialize("main")?.to_vec())
}

fn fill(db: &Connection, drawing: &Drawing, seed: u64) -> rusqlite::Result<()> {
    let srs = match drawing.epsg() {
        Some(code) => {
            if code != 4326 {
                let wkt = las::wkt_of_epsg(code).unwrap_or_else(|| "undefined".into());
                let sql = "INSERT INTO gpkg_spatial_ref_sys VALUES (?1, ?2, 'EPSG', ?2, ?3, NULL)";
                db.execute(sql, params![drawing.frame.crs, code, wkt])?;
            }
            i64::from(code)
        }
        None => -1,
    };
    let (mut extent, mut counts) = ([[f64::MAX, f64::MAX, f64::MIN, f64::MIN]; 2], [0_i64; 2]);
    for unit in drawing.units() {
        let (centre, model) = (drawing.centre(&unit), &drawing.catalog.get(unit.model).name);
        let outline = drawing.footprint(&unit);
        let geometry = polygon(&outline, srs as i32);
        let table = usize::from(matches!(unit.source, Source::Planned(_)));
        counts[table] += 1;
        for p in outline {
            let e = &mut extent[table];
            *e = [e[0].min(p[0]), e[1].min(p[1]), e[2].max(p[0]), e[3].max(p[1])];
        }
        match unit {
            Unit { source: Source::Recognised(r, fit), .. } => {
                let runner_up = fit.runner_up.map(|(m, _)| drawing.catalog.get(m).name.clone());
                db.execute(
                    "INSERT INTO blocks VALUES (NULL, ?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10, ?11, ?12)",
                    params![
                        geometry,
                        r.block.0,
                        model,
                        centre.x,
                        centre.y,
                        centre.z,
                        fit.occlusion,
                        fit.confidence,
                        fit.fitness_m,
                        runner_up,
                        fit.runner_up.map(|(_, f)| f),
                        fit.type_judged
                    ],
                )?;
            }
            Unit { source: Source::Planned(p), .. } => {
                db.execute(
                    "INSERT INTO placements VALUES (NULL, ?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9)",
                    params![
                        geometry,
                        p.order,
                        p.round,
                        model,
                        centre.x,
                        centre.y,
                        centre.z,
                        p.filled_m3,
                        p.contacts
                    ],
                )?;
            }
        }
    }
    for (table, [x0, y0, x1, y1]) in ["blocks", "placements"].into_iter().zip(extent) {
        let bound = |v: f64| (v.abs() < f64::MAX).then_some(v);
        db.execute(
            "INSERT INTO gpkg_contents (table_name, data_type, identifier, min_x, min_y, max_x, max_y, srs_id) VALUES (?1, 'features', ?1, ?2, ?3, ?4, ?5, ?6)",
            params![table, bound(x0), bound(y0), bound(x1), bound(y1), srs],
        )?;
        db.execute(
            "INSERT INTO gpkg_geometry_columns VALUES (?1, 'geom', 'POLYGON', ?2, 0, 0)",
            params![table, srs],
        )?;
    }
    db.execute(
        "INSERT INTO runs VALUES (NULL, ?1, ?2, ?3, ?4, ?5, ?6, ?7)",
        params![
            drawing.name,
            env!("CARGO_PKG_VERSION"),
            seed.cast_signed(),
            drawing.frame.crs,
            drawing.frame.vertical_datum,
            counts[0],
            counts[1]
        ],
    )?;
    Ok(())
}

/// GeoPackage binary: header without envelope, then a WKB polygon of one closed ring.
fn polygon(outline: &[[f64; 2]], srs: i32) -> Vec<u8> {
    let mut out = b"GP\0\x01".to_vec();
    out.extend(srs.to_le_bytes());
    out.push(1); // little-endian
    out.extend(3_u32.to_le_bytes()); // polygon
    out.extend(1_u32.to_le_bytes());
    out.extend((outline.len() as u32 + 1).to_le_bytes());
    for p in outline.iter().chain(outline.first()) {
        out.extend(p.iter().flat_map(|v| v.to_le_bytes()));
    }
    out
}
