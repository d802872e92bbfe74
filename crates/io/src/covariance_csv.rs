//! `covariance.csv`: how well each recognised block's pose is held, one block a line.
//!
//! The upper triangle of the 6×6 covariance of (tx, ty, tz, rx, ry, rz): a shift of the block's centre of mass along the
//! site's axes, metres, and a small turn about them, radians. Squares of standard deviations stand on the diagonal. A block
//! whose pose no points hold, say one that a reviewer placed, has no line. Numbers have the fewest digits that read back exactly.

use crate::input::Input;
use crate::{IoError, atomic, csv_table};
use scene::{Covariance, InstanceId, Recognised};
use std::path::Path;

/// The block, then the upper triangle.
pub const COLUMNS: [&str; 22] = [
    "block_id", "tx_tx", "tx_ty", "tx_tz", "tx_rx", "tx_ry", "tx_rz", "ty_ty", "ty_tz", "ty_rx",
    "ty_ry", "ty_rz", "tz_tz", "tz_rx", "tz_ry", "tz_rz", "rx_rx", "rx_ry", "rx_rz", "ry_ry",
    "ry_rz", "rz_rz",
];

/// Text of the file: a line for every block that has a covariance, also those that are not judged.
pub fn text(blocks: &[Recognised]) -> String {
    let held = blocks.iter().filter_map(|b| Some(cells(b.block, &b.fit()?.covariance?)));
    csv_table::text(&COLUMNS, held)
}

fn cells(block: InstanceId, covariance: &Covariance) -> Vec<String> {
    let upper = (0..6).flat_map(|i| (i..6).map(move |k| (i, k)));
    let cells = upper.map(|(i, k)| format!("{:e}", covariance.at(i, k)));
    std::iter::once(block.0.to_string()).chain(cells).collect()
}

/// Writes the file.
pub fn write(path: &Path, blocks: &[Recognised]) -> Result<(), IoError> {
    atomic::write_bytes(path, text(blocks).as_bytes())
}

/// Reads the file: number and covariance of every block in it.
pub fn read(path: &Path) -> Result<Vec<(u32, Covariance)>, IoError> {
    csv_table::read(&mut Input::open(path)?, &COLUMNS, &[], |row, c| {
        let mut matrix = [0.0; 36];
        let upper = (0..6).flat_map(|i| (i..6).map(move |k| 6 * i + k));
        for (at, n) in upper.zip(1..) {
            matrix[at] = row.finite(COLUMNS[n], c[n])? as f32;
        }
        Ok((row.number("block_id", c[0])?, Covariance::new(matrix)))
    })
}
