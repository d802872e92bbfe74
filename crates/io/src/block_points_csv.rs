//! Points of blocks as runs of survey points, one run a line: `block_id,first_point,last_point`, points counted from 0.

use crate::input::Input;
use crate::{IoError, atomic, csv_table};
use std::collections::BTreeMap;
use std::path::Path;

/// Columns of the file.
pub const COLUMNS: [&str; 3] = ["block_id", "first_point", "last_point"];

/// Text of the file: number and ascending points of each block.
pub fn text<'a>(blocks: impl Iterator<Item = (u32, &'a [u32])>) -> String {
    let rows = blocks.flat_map(|(block, points)| {
        let runs = points.chunk_by(|a, b| a + 1 == *b);
        runs.map(move |run| [block, run[0], run[run.len() - 1]].map(|v| v.to_string()).to_vec())
    });
    csv_table::text(&COLUMNS, rows)
}

/// Writes the file.
pub fn write<'a>(
    path: &Path,
    blocks: impl Iterator<Item = (u32, &'a [u32])>,
) -> Result<(), IoError> {
    atomic::write_bytes(path, text(blocks).as_bytes())
}

/// Reads the file; the survey has `survey_points` points.
pub fn read(path: &Path, survey_points: usize) -> Result<BTreeMap<u32, Vec<u32>>, IoError> {
    let mut of_block: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    csv_table::read(&mut Input::open(path)?, &COLUMNS, &[], |row, c| {
        let [block, first, last] = [0, 1, 2].map(|i| row.number::<u32>(COLUMNS[i], c[i]));
        let (block, first, last) = (block?, first?, last?);
        if first > last || last as usize >= survey_points {
            return Err(row.bad(format!(
                "points {first} to {last} are no run of a survey of {survey_points} points"
            )));
        }
        of_block.entry(block).or_default().extend(first..=last);
        Ok(())
    })?;
    for points in of_block.values_mut() {
        points.sort_unstable();
        points.dedup();
    }
    Ok(of_block)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_come_back_as_points() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("points.csv");
        let blocks: [(u32, &[u32]); 2] = [(3, &[0, 1, 2, 7]), (5, &[9])];
        write(&file, blocks.into_iter()).unwrap();
        let back = read(&file, 10).unwrap();
        assert_eq!(back, BTreeMap::from([(3, vec![0, 1, 2, 7]), (5, vec![9])]));
        let message = read(&file, 9).unwrap_err().to_string();
        assert!(message.contains("points 9 to 9") && message.contains("line 4"), "{message}");
    }
}
