//! `unfilled.csv`: one place that stays below the design a line, the largest void first, with the reason why no block went there.

use crate::csv_table;
use crate::input::Input;
use crate::{IoError, atomic};
use std::path::Path;

/// Columns.
pub const COLUMNS: [&str; 8] =
    ["place", "x_m", "y_m", "edge_m", "void_m3", "trials", "reason", "words"];

/// One line.
#[derive(Clone, Debug, PartialEq)]
pub struct UnfilledRow {
    /// Number of the place, from 1.
    pub place: u32,
    /// East and north of its middle, site coordinates.
    pub centre_m: [f64; 2],
    /// Its edge.
    pub edge_m: f64,
    /// Volume that is missing in it, m³.
    pub void_m3: f64,
    /// Drops that were tried in it and removed.
    pub trials: u32,
    /// Why, as one word.
    pub reason: String,
    /// Why, in words.
    pub words: String,
}

impl UnfilledRow {
    fn fields(&self) -> Vec<String> {
        vec![
            self.place.to_string(),
            format!("{:.3}", self.centre_m[0]),
            format!("{:.3}", self.centre_m[1]),
            format!("{:.3}", self.edge_m),
            format!("{:.3}", self.void_m3),
            self.trials.to_string(),
            self.reason.clone(),
            self.words.clone(),
        ]
    }
}

/// Writes the file.
pub fn write(path: &Path, rows: &[UnfilledRow]) -> Result<(), IoError> {
    let text = csv_table::text(&COLUMNS, rows.iter().map(UnfilledRow::fields));
    atomic::write_bytes(path, text.as_bytes())
}

/// Reads the file.
pub fn read(path: &Path) -> Result<Vec<UnfilledRow>, IoError> {
    csv_table::read(&mut Input::open(path)?, &COLUMNS, &[], |row, c| {
        Ok(UnfilledRow {
            place: row.number(COLUMNS[0], c[0])?,
            centre_m: [row.finite(COLUMNS[1], c[1])?, row.finite(COLUMNS[2], c[2])?],
            edge_m: row.finite(COLUMNS[3], c[3])?,
            void_m3: row.finite(COLUMNS[4], c[4])?,
            trials: row.number(COLUMNS[5], c[5])?,
            reason: row.text(c[6]).to_string(),
            words: row.text(c[7]).to_string(),
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_comes_back() {
        let row = UnfilledRow {
            place: 1,
            centre_m: [-52.25, 98_760.5],
            edge_m: 2.0,
            void_m3: 1.25,
            trials: 8,
            reason: "overflow".into(),
            words: "a block here, however laid, stands above the design".into(),
        };
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("unfilled.csv");
        write(&file, std::slice::from_ref(&row)).unwrap();
        assert_eq!(read(&file).unwrap(), [row]);
    }
}
