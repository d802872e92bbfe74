//! How much memory work needs, and how much it may take: asked before anything is paid for.

use crate::error::OrBadInput;
use crate::{Error, Result};
use anyhow::anyhow;
use std::fmt;
use std::path::Path;
use std::str::FromStr;

/// Memory of the program with its weights before the first point, GB.
const PROGRAM_GB: f64 = 0.35;
/// Bytes a point costs while a tile is worked on.
const BYTES_A_POINT: f64 = 160.0;

/// An amount of memory: `4GB`, `500MB`, `2.5 GiB`.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub struct Memory {
    gb: f64,
}

impl Default for Memory {
    fn default() -> Self {
        Self { gb: 4.0 }
    }
}

impl Memory {
    /// In 10⁹ bytes.
    pub fn gb(&self) -> f64 {
        self.gb
    }
}

impl FromStr for Memory {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let wrong = || {
            Error::bad_input(anyhow!(
                "`{text}` is no amount of memory: write e.g. 4GB, 500MB or 2.5GiB"
            ))
        };
        let text = text.trim();
        let digits = text.find(|c: char| c.is_ascii_alphabetic()).ok_or_else(wrong)?;
        let (number, unit) = text.split_at(digits);
        let number: f64 = number.trim().parse().map_err(|_| wrong())?;
        let unit_gb = match unit.to_ascii_lowercase().as_str() {
            "tb" => 1e3,
            "gb" | "g" => 1.0,
            "mb" | "m" => 1e-3,
            "gib" => 1.073_741_824,
            "mib" => 1.048_576e-3,
            _ => return Err(wrong()),
        };
        let gb = number * unit_gb;
        if gb.is_finite() && gb > 0.0 { Ok(Self { gb }) } else { Err(wrong()) }
    }
}

impl fmt::Display for Memory {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.gb < 1.0 { write!(f, "{:.0}MB", self.gb * 1e3) } else { write!(f, "{}GB", self.gb) }
    }
}

/// Bytes a point costs while a survey is read, kept, labelled and written.
const BYTES_A_POINT_OF_SITE: f64 = 70.0;

/// Asks, from the headers of a site's surveys, whether a run of it or a merge of its tiles keeps within `memory`. What a plan's maps need is
/// bounded by `plan.memory_gb`. Errors: it does not; the site cannot be read.
pub fn check_memory(site: &Path, memory: Memory) -> Result<()> {
    let files = io::site::load(site).or_bad_input()?;
    let mut points = 0;
    for file in &files.survey_files {
        points += io::points::stated_points(file).or_bad_input()?;
    }
    let gb = of_site_gb(points);
    if files.spec.area.is_some() || gb <= memory.gb() {
        return Ok(());
    }
    Err(Error::bad_input(anyhow!(
        "{}: the surveys have {points} points, which need some {gb:.1} GB, more than --memory {memory}; give more, thin the surveys, or read a part with [area]",
        files.folder.display()
    )))
}

/// What a site of so many points needs, GB.
fn of_site_gb(points: u64) -> f64 {
    PROGRAM_GB + points as f64 * BYTES_A_POINT_OF_SITE * 1e-9
}

/// What working on a tile that reads so many points needs, GB.
pub(crate) fn of_tile_gb(points: u64) -> f64 {
    let gb = PROGRAM_GB + points as f64 * BYTES_A_POINT * 1e-9;
    (gb * 1e3).ceil() / 1e3
}

/// Most points a tile may read within this memory.
pub(crate) fn points_within(memory: Memory) -> u64 {
    ((memory.gb - PROGRAM_GB).max(0.0) * 1e9 / BYTES_A_POINT) as u64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn amounts_are_read_as_people_write_them() {
        let gb = |text: &str| text.parse::<Memory>().map(|m| m.gb());
        assert_eq!(gb("4GB").unwrap(), 4.0);
        assert_eq!(gb(" 500 MB").unwrap(), 0.5);
        assert!((gb("2GiB").unwrap() - 2.147_483_648).abs() < 1e-12);
        for wrong in ["", "4", "GB", "-1GB", "0GB", "1e999GB", "4 PB", "nanGB"] {
            assert!(gb(wrong).unwrap_err().line().contains("4GB"), "{wrong}");
        }
    }

    #[test]
    fn what_is_within_fits() {
        let memory: Memory = "2GB".parse().unwrap();
        assert!(of_tile_gb(points_within(memory)) <= 2.001);
        assert_eq!(points_within("100MB".parse().unwrap()), 0);
    }
}
