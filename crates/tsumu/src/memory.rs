//! Whether a run fits into the memory it may take: asked from headers and sizes before anything is paid for.

use crate::tiles::MOST_POINTS;
use crate::{Error, Result};
use anyhow::anyhow;
use io::IoError;
use scene::MemoryBound;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// The program with weights, catalogue and threads, before the first point.
const PROGRAM_BYTES: u64 = 220_000_000;
/// Peak of a whole run a point of its surveys with their blocks: positions as the file has them, in the local frame, labels, and the clouds that
/// are written (docs/bench/files.md has the measurements).
const POINT_BYTES: u64 = 180;
/// The same where the site is cut into tiles: positions and labels alone are held of all points.
const POINT_BYTES_IN_TILES: u64 = 70;

/// What bounds the memory of a job, once its site or its command has said so. Whoever watches the program asks it; clones are
/// of the same job.
#[derive(Clone, Debug, Default)]
pub struct MemoryLimit(Arc<AtomicU64>);

impl MemoryLimit {
    /// The bound, bytes; `None`: there is none.
    pub fn bytes(&self) -> Option<u64> {
        Some(self.0.load(Ordering::Relaxed)).filter(|bytes| *bytes > 0)
    }

    pub(crate) fn set(&self, bound: MemoryBound) {
        self.0.store(bound.bytes(), Ordering::Relaxed);
    }
}

/// What a run would hold at once.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Need {
    /// Points of all surveys.
    pub points: u64,
    /// The maps of the plan, bytes.
    pub raster_bytes: u64,
}

impl Need {
    /// Peak memory, bytes.
    pub fn bytes(self) -> u64 {
        PROGRAM_BYTES.saturating_add(self.point_bytes()).saturating_add(self.raster_bytes)
    }

    fn point_bytes(self) -> u64 {
        let whole = self.points.min(MOST_POINTS as u64) * POINT_BYTES;
        whole.max(self.points.saturating_mul(POINT_BYTES_IN_TILES))
    }

    /// Refuses what does not fit.
    pub fn check(self, bound: Option<MemoryBound>) -> Result<()> {
        let Some(bound) = bound.filter(|bound| self.bytes() > bound.bytes()) else { return Ok(()) };
        Err(Error::bad_input(anyhow!(
            "the run would need about {:.1} GB of memory ({:.1} million points, maps of the plan {:.1} GB), and may take {bound} (--memory, or `memory` in site.toml): allow more, give [area] for a part of the site, or enlarge plan.cell_m",
            self.bytes() as f64 / 1e9,
            self.points as f64 / 1e6,
            self.raster_bytes as f64 / 1e9,
        )))
    }
}

/// Points that the headers of these files state; a kind that states none counts nothing, it is counted when it is read.
pub(crate) fn stated_points<'a>(files: impl Iterator<Item = &'a Path>) -> u64 {
    files.map(|file| points_of(file).unwrap_or(0)).fold(0, u64::saturating_add)
}

/// A damaged header is its reader's to name.
fn points_of(file: &Path) -> std::result::Result<u64, IoError> {
    let kind = file.extension().map(|e| e.to_string_lossy().to_lowercase());
    match kind.as_deref() {
        Some("las" | "laz") => Ok(io::las::summary(&mut io::Input::open(file)?)?.points),
        _ => Ok(0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_does_not_fit_is_refused_with_its_size() {
        let bound = |text: &str| Some(text.parse::<MemoryBound>().unwrap());
        let need = Need { points: 50_000_000, raster_bytes: 1_000_000_000 };
        need.check(None).unwrap();
        need.check(bound("64GB")).unwrap();
        let line = need.check(bound("4GB")).unwrap_err().line();
        for word in ["50.0 million points", "4GB", "maps of the plan 1.0 GB", "--memory"] {
            assert!(line.contains(word), "{line}");
        }
        let beyond = Need { points: u64::MAX, raster_bytes: u64::MAX };
        assert!(beyond.check(bound("1000GB")).is_err());
    }

    #[test]
    fn a_limit_is_of_the_job() {
        let limit = MemoryLimit::default();
        let same = limit.clone();
        assert_eq!(same.bytes(), None);
        limit.set("1GB".parse().unwrap());
        assert_eq!(same.bytes(), Some(1_000_000_000));
    }
}
