//! `what_if.csv`: what a plan would be under other assumptions, one a line; a table that was interrupted is gone on with.

use crate::input::Input;
use crate::{IoError, atomic, csv_table};
use std::path::Path;

/// Columns: what was assumed, then the plan's figures.
pub const COLUMNS: [&str; 12] = [
    "raise_m",
    "slope_m",
    "model",
    "overflow_m",
    "blocks",
    "mass_t",
    "concrete_m3",
    "void_filled_m3",
    "void_left_m3",
    "mean_distance_m",
    "porosity",
    "protruding",
];

/// One plan.
#[derive(Clone, Debug, PartialEq)]
pub struct WhatIfRow {
    /// The four assumptions as text; empty: as the site has it.
    pub assumed: [String; 4],
    /// The eight figures.
    pub figures: [f64; 8],
}

/// Writes the file.
pub fn write(path: &Path, rows: &[WhatIfRow]) -> Result<(), IoError> {
    let fields = |row: &WhatIfRow| {
        let figures = row.figures.iter().map(|v| format!("{v:.4}").parse::<f64>().unwrap_or(*v));
        row.assumed.iter().cloned().chain(figures.map(|v| v.to_string())).collect()
    };
    let text = csv_table::text(&COLUMNS, rows.iter().map(fields));
    atomic::write_bytes(path, text.as_bytes())
}

/// Reads the file.
pub fn read(path: &Path) -> Result<Vec<WhatIfRow>, IoError> {
    csv_table::read(&mut Input::open(path)?, &COLUMNS, &[], |row, c| {
        let assumed = [0, 1, 2, 3].map(|i| row.text(c[i]).to_string());
        let mut figures = [0.0; 8];
        for (k, figure) in figures.iter_mut().enumerate() {
            *figure = row.number(COLUMNS[4 + k], c[4 + k])?;
        }
        Ok(WhatIfRow { assumed, figures })
    })
}
