//! `not_judged.csv`: what may be blocks, in the columns of `blocks.csv`. Of a place that no type fits only the place is
//! known: `x_m y_m z_m` are where a block's centre may be, all other cells but the number are empty.

use crate::blocks_csv::{BlockRow, COLUMNS};
use crate::input::Input;
use crate::{IoError, atomic, csv_table};
use scene::{Catalog, Guess, Recognised, SiteFrame, Verdict};
use std::path::Path;

/// One line.
#[derive(Clone, Debug, PartialEq)]
pub enum NotJudgedRow {
    /// The likeliest pose and type.
    Fit(BlockRow),
    /// A place alone.
    Place {
        /// Number of the block.
        block_id: u32,
        /// Where its centre may be, site coordinates, metres.
        position_m: [f64; 3],
    },
}

impl NotJudgedRow {
    /// A block that is not judged; `None` for one that is.
    pub fn of(block: &Recognised, catalog: &Catalog, frame: &SiteFrame) -> Option<Self> {
        match &block.verdict {
            Verdict::Stated(_) => None,
            Verdict::NotJudged(Guess::Fit(fit)) => {
                Some(Self::Fit(BlockRow::of_fit(block.block, fit, catalog, frame)))
            }
            Verdict::NotJudged(Guess::Place(place)) => Some(Self::Place {
                block_id: block.block.0,
                position_m: frame.site_from_local(*place).to_array(),
            }),
        }
    }

    /// Number of the block.
    pub fn block_id(&self) -> u32 {
        match self {
            Self::Fit(row) => row.block_id,
            Self::Place { block_id, .. } => *block_id,
        }
    }

    fn fields(&self) -> Vec<String> {
        match self {
            Self::Fit(row) => row.fields(),
            Self::Place { block_id, position_m } => {
                let mut fields = vec![String::new(); COLUMNS.len()];
                fields[0] = block_id.to_string();
                position_m.iter().zip(&mut fields[2..5]).for_each(|(v, f)| *f = v.to_string());
                fields
            }
        }
    }
}

/// Text of the file.
pub fn text(rows: &[NotJudgedRow]) -> String {
    csv_table::text(&COLUMNS, rows.iter().map(NotJudgedRow::fields))
}

/// Writes the file.
pub fn write(path: &Path, rows: &[NotJudgedRow]) -> Result<(), IoError> {
    atomic::write_bytes(path, text(rows).as_bytes())
}

/// Reads the file; a line without a type is a place alone.
pub fn read(path: &Path) -> Result<Vec<NotJudgedRow>, IoError> {
    let mut input = Input::open(path)?;
    let rows = csv_table::read(&mut input, &COLUMNS[..5], &COLUMNS[5..], |row, c| {
        if !row.text(c[1]).is_empty() {
            return Ok(NotJudgedRow::Fit(BlockRow::read(row, c)?));
        }
        let axis = |i: usize| row.finite(COLUMNS[i], c[i]);
        let position_m = [axis(2)?, axis(3)?, axis(4)?];
        Ok(NotJudgedRow::Place { block_id: row.number("block_id", c[0])?, position_m })
    })?;
    crate::blocks_csv::check_numbers(&input, rows.iter().map(NotJudgedRow::block_id))?;
    Ok(rows)
}
