//! `changes.csv`: what happened to each block between two surveys, one block a line; and `changes_truth.csv`, what really did in
//! synthetic epochs.

use crate::csv_table;
use crate::input::Input;
use crate::{IoError, atomic};
use std::path::Path;

/// Columns.
pub const COLUMNS: [&str; 18] = [
    "block_id",
    "earlier_id",
    "later_id",
    "model",
    "class",
    "dx_m",
    "dy_m",
    "dz_m",
    "distance_m",
    "turn_deg",
    "axis",
    "level_m",
    "level_deg",
    "significance",
    "confidence",
    "occlusion_earlier",
    "occlusion_later",
    "note",
];

/// One block. Figures of a movement are empty where a block is seen in one epoch only.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ChangeRow {
    /// Number in the comparison.
    pub block_id: u32,
    /// Number in the earlier epoch.
    pub earlier_id: Option<u32>,
    /// Number in the later epoch.
    pub later_id: Option<u32>,
    /// Name in the catalogue.
    pub model: String,
    /// What happened, in a word.
    pub class: String,
    /// East, north, up: later less earlier, metres.
    pub shift_m: Option<[f64; 3]>,
    /// Length of it.
    pub distance_m: Option<f64>,
    /// The least turn over the block's symmetry, degrees.
    pub turn_deg: Option<f64>,
    /// Unit axis of the turn.
    pub axis: Option<[f64; 3]>,
    /// Level of detection along the shift, metres.
    pub level_m: Option<f64>,
    /// Level of detection of the turn, degrees.
    pub level_deg: Option<f64>,
    /// Probability of a difference like this without change.
    pub significance: Option<f64>,
    /// Probability that the class is right.
    pub confidence: Option<f64>,
    /// Share of the surface hidden in the earlier epoch.
    pub occlusion_earlier: Option<f64>,
    /// The same in the later epoch.
    pub occlusion_later: Option<f64>,
    /// What a reader should know.
    pub note: String,
    /// Centre in the earlier epoch, site coordinates; for the drawings, not a column.
    pub centre_earlier: Option<[f64; 3]>,
    /// Centre in the later epoch, registered.
    pub centre_later: Option<[f64; 3]>,
}

impl ChangeRow {
    fn fields(&self) -> Vec<String> {
        let whole = |v: Option<u32>| v.map(|v| v.to_string()).unwrap_or_default();
        // Micrometres and millionths of a degree are nobody's business.
        let short = |v: Option<f64>| v.map(|v| tidy(v, 1e6)).unwrap_or_default();
        let [dx, dy, dz] = [0, 1, 2].map(|i| short(self.shift_m.map(|s| s[i])));
        let axis = self.axis.filter(|a| a.iter().any(|v| *v != 0.0));
        vec![
            self.block_id.to_string(),
            whole(self.earlier_id),
            whole(self.later_id),
            self.model.clone(),
            self.class.clone(),
            dx,
            dy,
            dz,
            short(self.distance_m),
            short(self.turn_deg),
            axis.map(|a| a.map(|v| tidy(v, 1e4)).join(" ")).unwrap_or_default(),
            short(self.level_m),
            short(self.level_deg),
            self.significance.map(|p| format!("{p:.3e}")).unwrap_or_default(),
            short(self.confidence),
            short(self.occlusion_earlier),
            short(self.occlusion_later),
            self.note.clone(),
        ]
    }
}

/// The number rounded to one part of `parts`, without a negative zero.
fn tidy(v: f64, parts: f64) -> String {
    let rounded = (v * parts).round() / parts;
    if rounded == 0.0 { "0".into() } else { rounded.to_string() }
}

/// Text of the file.
pub fn text(rows: &[ChangeRow]) -> String {
    csv_table::text(&COLUMNS, rows.iter().map(ChangeRow::fields))
}

/// Writes the file.
pub fn write(path: &Path, rows: &[ChangeRow]) -> Result<(), IoError> {
    atomic::write_bytes(path, text(rows).as_bytes())
}

/// Reads the file; centres are not in it.
pub fn read(path: &Path) -> Result<Vec<ChangeRow>, IoError> {
    csv_table::read(&mut Input::open(path)?, &COLUMNS, &[], |row, c| {
        let id = |i: usize| -> Result<Option<u32>, IoError> {
            if row.text(c[i]).is_empty() {
                Ok(None)
            } else {
                row.number(COLUMNS[i], c[i]).map(Some)
            }
        };
        let some = |i: usize| row.finite_or_empty(COLUMNS[i], c[i]);
        let shift_m = match (some(5)?, some(6)?, some(7)?) {
            (Some(x), Some(y), Some(z)) => Some([x, y, z]),
            _ => None,
        };
        let numbers: Vec<f64> =
            row.text(c[10]).split_whitespace().filter_map(|v| v.parse().ok()).collect();
        let axis = match (row.text(c[10]), numbers.as_slice()) {
            ("", _) => None,
            (_, &[x, y, z]) => Some([x, y, z]),
            (text, _) => {
                return Err(row.bad(format!("`axis` = `{text}` is not three numbers")));
            }
        };
        Ok(ChangeRow {
            block_id: row.number(COLUMNS[0], c[0])?,
            earlier_id: id(1)?,
            later_id: id(2)?,
            model: row.text(c[3]).to_string(),
            class: row.text(c[4]).to_string(),
            shift_m,
            distance_m: some(8)?,
            turn_deg: some(9)?,
            axis,
            level_m: some(11)?,
            level_deg: some(12)?,
            significance: some(13)?,
            confidence: some(14)?,
            occlusion_earlier: some(15)?,
            occlusion_later: some(16)?,
            note: row.text(c[17]).to_string(),
            centre_earlier: None,
            centre_later: None,
        })
    })
}

/// Columns of `changes_truth.csv`.
pub const TRUTH_COLUMNS: [&str; 11] = [
    "earlier_id",
    "later_id",
    "plan_order",
    "model",
    "what",
    "dx_m",
    "dy_m",
    "dz_m",
    "turn_deg",
    "lost_leg",
    "cut_plane",
];

/// What really happened to a block of a synthetic scene.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TruthRow {
    /// Number before.
    pub earlier_id: Option<u32>,
    /// Number after.
    pub later_id: Option<u32>,
    /// Order in the plan.
    pub plan_order: Option<u32>,
    /// Name in the catalogue.
    pub model: String,
    /// What was done, in a word.
    pub what: String,
    /// Shift of the centre after settling; of a planned block: against its planned rest.
    pub shift_m: [f64; 3],
    /// The least turn over the symmetry, degrees.
    pub turn_deg: f64,
    /// Share of the leg that broke off.
    pub lost_leg: f64,
    /// Normal and offset, block coordinates: what lies beyond is gone.
    pub cut_plane: Option<[f64; 4]>,
}

/// Text of `changes_truth.csv`.
pub fn truth_text(rows: &[TruthRow]) -> String {
    let whole = |v: Option<u32>| v.map(|v| v.to_string()).unwrap_or_default();
    let fields = |r: &TruthRow| {
        let [dx, dy, dz] = r.shift_m.map(|v| tidy(v, 1e6));
        let cut = r.cut_plane.map(|c| c.map(|v| tidy(v, 1e6)).join(" ")).unwrap_or_default();
        vec![
            whole(r.earlier_id),
            whole(r.later_id),
            whole(r.plan_order),
            r.model.clone(),
            r.what.clone(),
            dx,
            dy,
            dz,
            tidy(r.turn_deg, 1e6),
            tidy(r.lost_leg, 1e6),
            cut,
        ]
    };
    csv_table::text(&TRUTH_COLUMNS, rows.iter().map(fields))
}

/// Writes `changes_truth.csv`.
pub fn write_truth(path: &Path, rows: &[TruthRow]) -> Result<(), IoError> {
    atomic::write_bytes(path, truth_text(rows).as_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_of_changes_comes_back() {
        let moved = ChangeRow {
            block_id: 7,
            earlier_id: Some(7),
            later_id: Some(9),
            model: "tetrapod, 2 m".into(),
            class: "moved".into(),
            shift_m: Some([0.25, -0.5, 0.0]),
            distance_m: Some(0.559_017),
            turn_deg: Some(12.5),
            axis: Some([0.0, 0.6, -0.8]),
            level_m: Some(0.02),
            level_deg: Some(0.4),
            significance: Some(1e-9),
            confidence: Some(0.97),
            occlusion_earlier: Some(0.5),
            occlusion_later: Some(0.4),
            note: "turn is ambiguous; \"why\"".into(),
            ..ChangeRow::default()
        };
        let new = ChangeRow {
            block_id: 8,
            later_id: Some(3),
            class: "new".into(),
            model: "cube".into(),
            ..ChangeRow::default()
        };
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("changes.csv");
        write(&path, &[moved.clone(), new.clone()]).unwrap();
        assert_eq!(read(&path).unwrap(), vec![moved, new]);
        let broken = text(&[]).replace("axis", "axle");
        std::fs::write(&path, broken).unwrap();
        assert!(read(&path).unwrap_err().to_string().contains("`axis`"));
    }
}
