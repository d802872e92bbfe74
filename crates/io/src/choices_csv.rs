//! `choices.csv`: plans of the same works to choose from, one a line.

use crate::{IoError, atomic, csv_table};
use std::path::Path;

/// Columns.
pub const COLUMNS: [&str; 10] = [
    "aim",
    "blocks",
    "void_filled_m3",
    "void_left_m3",
    "protruding",
    "mean_contacts",
    "porosity",
    "concrete_m3",
    "cost",
    "file",
];

/// One plan.
#[derive(Clone, Debug, PartialEq)]
pub struct ChoiceRow {
    /// What it is made for.
    pub aim: String,
    /// Blocks to place.
    pub blocks: u32,
    /// Void it fills below the design, m³.
    pub void_filled_m3: f64,
    /// Void it leaves, m³.
    pub void_left_m3: f64,
    /// Blocks that stand above the design by more than the overflow threshold.
    pub protruding: u32,
    /// Blocks and ground that a block touches, on average.
    pub mean_contacts: f64,
    /// Porosity of the new layer.
    pub porosity: f64,
    /// Concrete, m³.
    pub concrete_m3: f64,
    /// Cost of all blocks in place.
    pub cost: f64,
    /// Its placements, from the folder of the table.
    pub file: String,
}

impl ChoiceRow {
    fn fields(&self) -> Vec<String> {
        vec![
            self.aim.clone(),
            self.blocks.to_string(),
            format!("{:.2}", self.void_filled_m3),
            format!("{:.2}", self.void_left_m3),
            self.protruding.to_string(),
            format!("{:.2}", self.mean_contacts),
            format!("{:.3}", self.porosity),
            format!("{:.2}", self.concrete_m3),
            format!("{:.2}", self.cost),
            self.file.clone(),
        ]
    }
}

/// Writes the file.
pub fn write(path: &Path, rows: &[ChoiceRow]) -> Result<(), IoError> {
    let text = csv_table::text(&COLUMNS, rows.iter().map(ChoiceRow::fields));
    atomic::write_bytes(path, text.as_bytes())
}
