//! `covariance.csv`: how well each recognised block's pose is held, one block a line.
//!
//! The upper triangle of the 6×6 covariance of (tx, ty, tz, rx, ry, rz): a shift of the block's centre of mass along the
//! site's axes, metres, and a small turn about them, radians. Squares of standard deviations stand on the diagonal. A block
//! whose pose no points hold, say one that a reviewer placed, has no line.

use crate::{IoError, atomic, csv_table};
use scene::{Covariance, InstanceId, Recognised};
use std::path::Path;

const AXES: [&str; 6] = ["tx", "ty", "tz", "rx", "ry", "rz"];

/// Column names: the block, then `tx_tx`, `tx_ty` … `rz_rz`.
pub fn columns() -> Vec<String> {
    let pairs = (0..6).flat_map(|i| (i..6).map(move |k| format!("{}_{}", AXES[i], AXES[k])));
    std::iter::once("block_id".to_string()).chain(pairs).collect()
}

/// Text of the file: a line for every stated block that has a covariance.
pub fn text(blocks: &[Recognised]) -> String {
    let names = columns();
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let held = scene::stated(blocks).filter_map(|(b, fit)| Some(cells(b.block, &fit.covariance?)));
    csv_table::text(&names, held)
}

fn cells(block: InstanceId, covariance: &Covariance) -> Vec<String> {
    let upper = (0..6).flat_map(|i| (i..6).map(move |k| (i, k)));
    let cells = upper.map(|(i, k)| format!("{:.4e}", covariance.at(i, k)));
    std::iter::once(block.0.to_string()).chain(cells).collect()
}

/// Writes the file.
pub fn write(path: &Path, blocks: &[Recognised]) -> Result<(), IoError> {
    atomic::write_bytes(path, text(blocks).as_bytes())
}
