//! GeoPackage of a structure through its epochs: `epochs`, `blocks` (one row a block, the same number in every epoch), `observations` (a
//! block in an epoch) and `changes` (arrows from epoch to epoch), for QGIS and its temporal controller.

use crate::changes_csv::ChangeRow;
use crate::geopackage::{STANDARD, spatial_reference};
use crate::{IoError, atomic, drawing};
use rusqlite::{Connection, params};
use std::io;
use std::path::Path;

const SCHEMA: &str = "
CREATE TABLE epochs (
  fid INTEGER PRIMARY KEY AUTOINCREMENT NOT NULL, epoch INTEGER UNIQUE NOT NULL, date TEXT, survey TEXT, crs TEXT,
  reg_basis TEXT, reg_dx_m DOUBLE, reg_dy_m DOUBLE, reg_dz_m DOUBLE, reg_yaw_deg DOUBLE, reg_sd_z_m DOUBLE);
CREATE TABLE blocks (
  fid INTEGER PRIMARY KEY AUTOINCREMENT NOT NULL, geom POINT, block_id INTEGER UNIQUE NOT NULL, model TEXT, first_epoch INTEGER,
  last_epoch INTEGER, state TEXT);
CREATE TABLE observations (
  fid INTEGER PRIMARY KEY AUTOINCREMENT NOT NULL, geom POINT, block_id INTEGER NOT NULL, epoch INTEGER NOT NULL, date TEXT,
  block_in_epoch INTEGER, class TEXT, x_m DOUBLE, y_m DOUBLE, z_m DOUBLE, qw DOUBLE, qx DOUBLE, qy DOUBLE, qz DOUBLE, dx_m DOUBLE,
  dy_m DOUBLE, dz_m DOUBLE, turn_deg DOUBLE, level_m DOUBLE, confidence DOUBLE, occlusion DOUBLE, note TEXT,
  UNIQUE (block_id, epoch));
CREATE TABLE changes (
  fid INTEGER PRIMARY KEY AUTOINCREMENT NOT NULL, geom LINESTRING, block_id INTEGER, from_epoch INTEGER, to_epoch INTEGER, date TEXT,
  model TEXT, class TEXT, dx_m DOUBLE, dy_m DOUBLE, dz_m DOUBLE, distance_m DOUBLE, turn_deg DOUBLE, level_m DOUBLE,
  level_deg DOUBLE, significance DOUBLE, confidence DOUBLE, note TEXT);
INSERT INTO gpkg_contents (table_name, data_type, identifier) VALUES ('epochs', 'attributes', 'epochs');
";

/// One epoch of the store.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct EpochRow {
    /// Number, from 0.
    pub epoch: u32,
    /// Date of the survey, as the user gives it (ISO 8601 for QGIS).
    pub date: String,
    /// Its name: a run folder or a file.
    pub survey: String,
    /// What the registration rests on; empty for the first epoch.
    pub basis: String,
    /// Shift applied to it.
    pub shift_m: [f64; 3],
    /// Turn applied to it.
    pub yaw_deg: f64,
    /// Standard deviation of the height of the registration.
    pub sd_z_m: f64,
}

/// One block of the structure.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TrackRow {
    /// Its number in all epochs.
    pub block_id: u32,
    /// Name in the catalogue.
    pub model: String,
    /// Epoch it was first seen in.
    pub first_epoch: u32,
}

/// One block in one epoch.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ObservationRow {
    /// Its number in all epochs.
    pub block_id: u32,
    /// The epoch.
    pub epoch: u32,
    /// Its number in that epoch.
    pub block_in_epoch: Option<u32>,
    /// What happened since the epoch before.
    pub class: String,
    /// Origin of its mesh, site coordinates.
    pub position_m: Option<[f64; 3]>,
    /// Rotation, w x y z.
    pub rotation_wxyz: [f64; 4],
    /// Shift since the epoch before.
    pub shift_m: [f64; 3],
    /// Turn since the epoch before.
    pub turn_deg: f64,
    /// Level of detection of the shift.
    pub level_m: f64,
    /// Probability that it is right.
    pub confidence: f64,
    /// Share of the surface that is hidden.
    pub occlusion: Option<f64>,
    /// What a reader should know.
    pub note: String,
}

/// Changes from one epoch to the next.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct EpochChanges {
    /// The earlier epoch.
    pub from: u32,
    /// The later epoch.
    pub to: u32,
    /// One row a block.
    pub rows: Vec<ChangeRow>,
}

/// Everything the store holds.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Store {
    /// CRS of all epochs, `EPSG:n` or empty.
    pub crs: String,
    /// Epochs in order.
    pub epochs: Vec<EpochRow>,
    /// Blocks by number.
    pub blocks: Vec<TrackRow>,
    /// Blocks in epochs.
    pub observations: Vec<ObservationRow>,
    /// Changes between epochs.
    pub changes: Vec<EpochChanges>,
}

/// Writes the store; rows of an epoch do not depend on later ones.
pub fn write(path: &Path, store: &Store) -> Result<(), IoError> {
    let bytes = bytes(store).map_err(|e| IoError::Os {
        path: path.into(),
        doing: "build",
        source: io::Error::other(e),
    })?;
    atomic::write_bytes(path, &bytes)
}

fn bytes(store: &Store) -> rusqlite::Result<Vec<u8>> {
    let mut database = Connection::open_in_memory()?;
    database.execute_batch(STANDARD)?;
    database.execute_batch(SCHEMA)?;
    let transaction = database.transaction()?;
    fill(&transaction, store)?;
    transaction.commit()?;
    Ok(database.serialize("main")?.to_vec())
}

fn fill(db: &Connection, store: &Store) -> rusqlite::Result<()> {
    let srs = spatial_reference(db, &store.crs, drawing::epsg(&store.crs))?;
    for e in &store.epochs {
        let [dx, dy, dz] = e.shift_m;
        db.execute(
            "INSERT INTO epochs VALUES (NULL, ?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10)",
            params![e.epoch, e.date, e.survey, store.crs, e.basis, dx, dy, dz, e.yaw_deg, e.sd_z_m],
        )?;
    }
    let date = |epoch: u32| {
        store.epochs.iter().find(|e| e.epoch == epoch).map(|e| e.date.as_str()).unwrap_or_default()
    };
    let mut extents = [Extent::default(); 3];
    for b in &store.blocks {
        let seen = store.observations.iter().filter(|o| o.block_id == b.block_id);
        let last = seen.clone().max_by_key(|o| o.epoch);
        let place = seen.filter(|o| o.position_m.is_some()).max_by_key(|o| o.epoch);
        let position = place.and_then(|o| o.position_m);
        position.iter().for_each(|p| extents[0].hold(p));
        db.execute(
            "INSERT INTO blocks VALUES (NULL, ?1, ?2, ?3, ?4, ?5, ?6)",
            params![
                position.map(|p| point(&p, srs)),
                b.block_id,
                b.model,
                b.first_epoch,
                last.map(|o| o.epoch),
                last.map(|o| o.class.as_str())
            ],
        )?;
    }
    for o in &store.observations {
        o.position_m.iter().for_each(|p| extents[1].hold(p));
        observation(db, o, date(o.epoch), srs)?;
    }
    for between in &store.changes {
        for row in &between.rows {
            change(db, between, row, date(between.to), srs, &mut extents[2])?;
        }
    }
    let tables = [("blocks", "POINT"), ("observations", "POINT"), ("changes", "LINESTRING")];
    for ((table, kind), extent) in tables.into_iter().zip(extents) {
        let [x0, y0, x1, y1] = extent.bounds();
        db.execute(
            "INSERT INTO gpkg_contents (table_name, data_type, identifier, min_x, min_y, max_x, max_y, srs_id) VALUES (?1, 'features', ?1, ?2, ?3, ?4, ?5, ?6)",
            params![table, x0, y0, x1, y1, srs],
        )?;
        db.execute(
            "INSERT INTO gpkg_geometry_columns VALUES (?1, 'geom', ?2, ?3, 1, 0)",
            params![table, kind, srs],
        )?;
    }
    Ok(())
}

fn observation(db: &Connection, o: &ObservationRow, date: &str, srs: i64) -> rusqlite::Result<()> {
    let p = o.position_m;
    let [qw, qx, qy, qz] = o.rotation_wxyz.map(|v| p.map(|_| v));
    let [dx, dy, dz] = o.shift_m;
    db.execute(
        "INSERT INTO observations VALUES (NULL, ?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10, ?11, ?12, ?13, ?14, ?15, ?16, ?17, ?18, ?19, ?20, ?21)",
        params![
            p.map(|p| point(&p, srs)),
            o.block_id,
            o.epoch,
            date,
            o.block_in_epoch,
            o.class,
            p.map(|p| p[0]),
            p.map(|p| p[1]),
            p.map(|p| p[2]),
            qw,
            qx,
            qy,
            qz,
            dx,
            dy,
            dz,
            o.turn_deg,
            o.level_m,
            o.confidence,
            o.occlusion,
            o.note
        ],
    )?;
    Ok(())
}

fn change(
    db: &Connection,
    between: &EpochChanges,
    row: &ChangeRow,
    date: &str,
    srs: i64,
    extent: &mut Extent,
) -> rusqlite::Result<()> {
    // A block seen once is an arrow of no length.
    let ends = match (row.centre_earlier, row.centre_later) {
        (Some(a), Some(b)) => Some([a, b]),
        (Some(p), None) | (None, Some(p)) => Some([p, p]),
        (None, None) => None,
    };
    ends.iter().flatten().for_each(|p| extent.hold(p));
    let shift = row.shift_m;
    db.execute(
        "INSERT INTO changes VALUES (NULL, ?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10, ?11, ?12, ?13, ?14, ?15, ?16, ?17)",
        params![
            ends.map(|e| line(&e, srs)),
            row.block_id,
            between.from,
            between.to,
            date,
            row.model,
            row.class,
            shift.map(|s| s[0]),
            shift.map(|s| s[1]),
            shift.map(|s| s[2]),
            row.distance_m,
            row.turn_deg,
            row.level_m,
            row.level_deg,
            row.significance,
            row.confidence,
            row.note
        ],
    )?;
    Ok(())
}

/// Smallest box around what was held.
#[derive(Clone, Copy, Debug)]
struct Extent([f64; 4]);

impl Default for Extent {
    fn default() -> Self {
        Self([f64::MAX, f64::MAX, f64::MIN, f64::MIN])
    }
}

impl Extent {
    fn hold(&mut self, p: &[f64; 3]) {
        let e = self.0;
        self.0 = [e[0].min(p[0]), e[1].min(p[1]), e[2].max(p[0]), e[3].max(p[1])];
    }

    fn bounds(&self) -> [Option<f64>; 4] {
        self.0.map(|v| (v.abs() < f64::MAX).then_some(v))
    }
}

/// GeoPackage binary of a point with height.
fn point(p: &[f64; 3], srs: i64) -> Vec<u8> {
    let mut out = head(srs, 1001);
    out.extend(p.iter().flat_map(|v| v.to_le_bytes()));
    out
}

/// GeoPackage binary of a line with heights.
fn line(ends: &[[f64; 3]; 2], srs: i64) -> Vec<u8> {
    let mut out = head(srs, 1002);
    out.extend(2_u32.to_le_bytes());
    out.extend(ends.iter().flatten().flat_map(|v| v.to_le_bytes()));
    out
}

/// Header without envelope, then the kind of the WKB.
fn head(srs: i64, kind: u32) -> Vec<u8> {
    let mut out = b"GP\0\x01".to_vec();
    out.extend((srs as i32).to_le_bytes());
    out.push(1); // little-endian
    out.extend(kind.to_le_bytes());
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn store(epochs: u32) -> Store {
        let epoch =
            |epoch| EpochRow { epoch, date: format!("202{epoch}-05-01"), ..EpochRow::default() };
        let seen = |epoch: u32| ObservationRow {
            block_id: 1,
            epoch,
            block_in_epoch: Some(4),
            class: "unchanged".into(),
            position_m: Some([1.0, 2.0 + f64::from(epoch), 3.0]),
            ..ObservationRow::default()
        };
        Store {
            crs: "EPSG:6679".into(),
            epochs: (0..epochs).map(epoch).collect(),
            blocks: vec![TrackRow { block_id: 1, model: "tetrapod".into(), first_epoch: 0 }],
            observations: (0..epochs).map(seen).collect(),
            changes: vec![EpochChanges {
                from: 0,
                to: 1,
                rows: vec![ChangeRow {
                    block_id: 1,
                    centre_earlier: Some([1.0, 2.0, 3.0]),
                    centre_later: Some([1.0, 3.0, 3.0]),
                    ..ChangeRow::default()
                }],
            }],
        }
    }

    /// All rows of a table as text.
    fn rows(path: &Path, table: &str) -> Vec<String> {
        let db = Connection::open(path).unwrap();
        let mut query = db.prepare(&format!("SELECT * FROM {table} ORDER BY fid")).unwrap();
        let columns = query.column_count();
        let row = |r: &rusqlite::Row| {
            let cells: Result<Vec<String>, _> = (0..columns)
                .map(|i| r.get::<_, rusqlite::types::Value>(i).map(|v| format!("{v:?}")))
                .collect();
            cells.map(|c| c.join("|"))
        };
        query.query_map([], row).unwrap().map(Result::unwrap).collect()
    }

    #[test]
    fn another_epoch_changes_no_earlier_row() {
        let folder = tempfile::tempdir().unwrap();
        let (two, three) = (folder.path().join("2.gpkg"), folder.path().join("3.gpkg"));
        write(&two, &store(2)).unwrap();
        write(&three, &store(3)).unwrap();
        for table in ["epochs", "observations", "changes"] {
            let (old, new) = (rows(&two, table), rows(&three, table));
            assert_eq!(new[..old.len()], old[..], "{table}");
        }
        assert_eq!(rows(&three, "observations").len(), 3);
        let geometry: Vec<u8> = Connection::open(&two)
            .unwrap()
            .query_row("SELECT geom FROM changes", [], |r| r.get(0))
            .unwrap();
        assert_eq!(geometry.len(), 8 + 1 + 4 + 4 + 48);
        assert_eq!(f64::from_le_bytes(geometry[17..25].try_into().unwrap()), 1.0);
    }
}
