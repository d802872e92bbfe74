//! `as_built.csv`: what became of each planned block, one a line, then blocks nobody planned.

use crate::{IoError, atomic, csv_table};
use std::path::Path;

/// Columns.
pub const COLUMNS: [&str; 14] = [
    "order",
    "later_id",
    "model",
    "state",
    "dx_m",
    "dy_m",
    "dz_m",
    "distance_m",
    "turn_deg",
    "level_m",
    "x_m",
    "y_m",
    "z_m",
    "note",
];

/// One planned or extra block. Figures of a difference are empty where nothing stands to differ, or nothing was planned.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct AsBuiltRow {
    /// Order in the plan; `None` for an extra.
    pub order: Option<u32>,
    /// Number in the later epoch.
    pub later_id: Option<u32>,
    /// Type that was planned, of an extra the type found.
    pub model: String,
    /// What became of it, in a word.
    pub state: String,
    /// East, north, up: built less planned, metres.
    pub off_m: [f64; 3],
    /// Length of it.
    pub distance_m: f64,
    /// The least turn over the symmetry, degrees.
    pub turn_deg: f64,
    /// Level of detection of the distance, metres.
    pub level_m: f64,
    /// Where it stands, or should: centre, site coordinates.
    pub centre_m: [f64; 3],
    /// What a reader should know.
    pub note: String,
}

impl AsBuiltRow {
    fn fields(&self) -> Vec<String> {
        let whole = |v: Option<u32>| v.map(|v| v.to_string()).unwrap_or_default();
        let rounded = |v: f64, digits: usize| {
            let text = format!("{v:.digits$}");
            if text.trim_matches(['-', '0', '.']).is_empty() { "0".into() } else { text }
        };
        let both = self.order.is_some() && self.later_id.is_some();
        let if_both = |v: f64| if both { rounded(v, 4) } else { String::new() };
        let mut out =
            vec![whole(self.order), whole(self.later_id), self.model.clone(), self.state.clone()];
        out.extend(self.off_m.map(if_both));
        out.extend([self.distance_m, self.turn_deg, self.level_m].map(if_both));
        out.extend(self.centre_m.map(|v| rounded(v, 4)));
        out.push(self.note.clone());
        out
    }
}

/// Writes the file.
pub fn write(path: &Path, rows: &[AsBuiltRow]) -> Result<(), IoError> {
    let text = csv_table::text(&COLUMNS, rows.iter().map(AsBuiltRow::fields));
    atomic::write_bytes(path, text.as_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_block_that_does_not_stand_differs_by_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("as_built.csv");
        let off = AsBuiltRow {
            order: Some(1),
            later_id: Some(7),
            state: "off by".into(),
            off_m: [0.25, -0.00001, 0.0],
            ..AsBuiltRow::default()
        };
        let gone = AsBuiltRow { later_id: None, state: "not placed".into(), ..off.clone() };
        write(&path, &[off, gone]).unwrap();
        let text = std::fs::read_to_string(&path).unwrap();
        let lines: Vec<&str> = text.lines().collect();
        assert!(lines[1].contains("off by,0.2500,0,0,"), "{}", lines[1]);
        assert!(lines[2].contains("not placed,,,,,,,"), "{}", lines[2]);
    }
}
