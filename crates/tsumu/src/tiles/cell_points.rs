//! The points of a survey in one file a cell, so that a tile reads its own and no others.
//!
//! A record is 18 bytes: place as whole steps from the cell's corner (three i32), survey line (u16), number in the survey (u32). Written
//! once while the survey streams by: nothing but a buffer is held.

use super::grid::{Cell, Grid};
use crate::{Error, Result};
use anyhow::{Context, anyhow};
use geom::DVec3;
use std::fs::{self, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};

const RECORD: usize = 18;
/// A step of the plane coordinates, metres: exact to a quarter of a micrometre over cells of 512 m.
const PLANE_STEP_M: f64 = 1.0 / 4_194_304.0;
/// A step of the heights, metres: exact to a micrometre within 2 km of the survey's first point.
const HEIGHT_STEP_M: f64 = 1.0 / 1_048_576.0;
/// Bytes held before they are written.
const HELD: usize = 64 << 20;

/// A point of a cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct CellPoint {
    /// Site coordinates, metres.
    pub position: DVec3,
    /// Survey line, numbered through all files; 0 = unknown.
    pub line: u16,
    /// Number among the survey's points, from 0.
    pub number: u32,
}

/// Where the points of cells lie.
#[derive(Clone, Debug)]
pub(crate) struct CellFiles {
    folder: PathBuf,
    grid: Grid,
    /// Height that heights count from, metres.
    level_m: f64,
}

impl CellFiles {
    pub fn new(folder: PathBuf, grid: Grid, level_m: f64) -> Self {
        Self { folder, grid, level_m }
    }

    fn file(&self, cell: Cell) -> PathBuf {
        self.folder.join(format!("e{}n{}.pts", cell.east, cell.north))
    }

    fn steps(&self, cell: Cell, p: DVec3) -> [i32; 3] {
        let corner = self.grid.corner(cell);
        // A stray far above or below stays far.
        [
            ((p.x - corner.x) / PLANE_STEP_M).round() as i32,
            ((p.y - corner.y) / PLANE_STEP_M).round() as i32,
            ((p.z - self.level_m) / HEIGHT_STEP_M).round() as i32,
        ]
    }

    fn place(&self, cell: Cell, steps: [i32; 3]) -> DVec3 {
        let corner = self.grid.corner(cell);
        DVec3::new(
            corner.x + f64::from(steps[0]) * PLANE_STEP_M,
            corner.y + f64::from(steps[1]) * PLANE_STEP_M,
            self.level_m + f64::from(steps[2]) * HEIGHT_STEP_M,
        )
    }

    /// The points of a cell that has `points`. Errors: the file is not there, or not as long as it was.
    pub fn read(&self, cell: Cell, points: u64) -> Result<Vec<CellPoint>> {
        let file = self.file(cell);
        let bytes = fs::read(&file).with_context(|| format!("cannot read {}", file.display()))?;
        if bytes.len() as u64 != points * RECORD as u64 {
            return Err(Error::bad_input(anyhow!(
                "{}: has {} bytes, the plan says {points} points of {RECORD}; make the plan again with `tsumu tiles plan`",
                file.display(),
                bytes.len()
            )));
        }
        Ok(bytes.chunks_exact(RECORD).map(|r| self.point(cell, r)).collect())
    }

    fn point(&self, cell: Cell, record: &[u8]) -> CellPoint {
        let four = |at: usize| [record[at], record[at + 1], record[at + 2], record[at + 3]];
        let steps = [0, 4, 8].map(|at| i32::from_le_bytes(four(at)));
        CellPoint {
            position: self.place(cell, steps),
            line: u16::from_le_bytes([record[12], record[13]]),
            number: u32::from_le_bytes(four(14)),
        }
    }
}

/// Writes points into their cells' files.
pub(crate) struct CellWriter {
    files: CellFiles,
    /// What is held for each cell; a cell's place here is its slot.
    held: Vec<(Cell, Vec<u8>)>,
    bytes: usize,
}

impl CellWriter {
    /// Empties the folder. Error: it cannot be written.
    pub fn new(files: CellFiles) -> Result<Self> {
        let folder = &files.folder;
        if folder.exists() {
            fs::remove_dir_all(folder).with_context(|| cannot_write(folder))?;
        }
        fs::create_dir_all(folder).with_context(|| cannot_write(folder))?;
        Ok(Self { files, held: Vec::new(), bytes: 0 })
    }

    /// A place as it will be read again.
    pub fn rounded(&self, cell: Cell, p: DVec3) -> DVec3 {
        self.files.place(cell, self.files.steps(cell, p))
    }

    /// Slot of a cell that has none yet: slots count up from 0.
    pub fn new_slot(&mut self, cell: Cell) -> usize {
        self.held.push((cell, Vec::new()));
        self.held.len() - 1
    }

    /// A point of the cell in this slot.
    pub fn add(&mut self, slot: usize, point: &CellPoint) -> Result<()> {
        let (cell, held) = &mut self.held[slot];
        for steps in self.files.steps(*cell, point.position) {
            held.extend_from_slice(&steps.to_le_bytes());
        }
        held.extend_from_slice(&point.line.to_le_bytes());
        held.extend_from_slice(&point.number.to_le_bytes());
        self.bytes += RECORD;
        if self.bytes >= HELD { self.flush() } else { Ok(()) }
    }

    fn flush(&mut self) -> Result<()> {
        for (cell, bytes) in self.held.iter_mut().filter(|(_, bytes)| !bytes.is_empty()) {
            let file = self.files.file(*cell);
            let opened = OpenOptions::new().create(true).append(true).open(&file);
            let mut out = opened.with_context(|| cannot_write(&file))?;
            out.write_all(bytes).with_context(|| cannot_write(&file))?;
            bytes.clear();
        }
        self.bytes = 0;
        Ok(())
    }

    /// Everything is in its file.
    pub fn finish(mut self) -> Result<CellFiles> {
        self.flush()?;
        Ok(self.files)
    }
}

fn cannot_write(path: &Path) -> String {
    format!("cannot write {}", path.display())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_come_back_to_a_micrometre() {
        let folder = tempfile::tempdir().unwrap();
        let grid = Grid { edge_m: 17.0 };
        let files = CellFiles::new(folder.path().join("points"), grid, 1.5);
        let mut writer = CellWriter::new(files).unwrap();
        let slot = writer.new_slot(grid.cell(DVec3::new(41_250.5, -98_760.5, 0.0)));
        let places = [
            DVec3::new(41_250.123_456_7, -98_760.987_654_3, 3.25),
            DVec3::new(41_251.0, -98_761.0, -4.0),
        ];
        for (number, position) in places.into_iter().enumerate() {
            let point = CellPoint { position, line: 7, number: number as u32 };
            writer.add(slot, &point).unwrap();
        }
        let files = writer.finish().unwrap();
        let cell = grid.cell(places[0]);
        let back = files.read(cell, 2).unwrap();
        for (point, place) in back.iter().zip(places) {
            assert!((point.position - place).abs().max_element() < 1e-6);
            assert_eq!(point.line, 7);
        }
        let message = files.read(cell, 3).unwrap_err().line();
        assert!(message.contains("plan again"), "{message}");
    }
}
