//! Results of an experiment's rows on disk, so that one that was stopped goes on where it was.
//!
//! A row's file begins with the settings it was made under; under others it is made anew.

use crate::ReproduceError;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// What a row found on its scenes.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RowResult {
    /// Instances that meet a part, that meet none, and parts that nothing meets; at IoU .5.
    pub right: usize,
    /// See above.
    pub wrong: usize,
    /// See above.
    pub missed: usize,
    /// AP in ScanNet's manner and at IoU .5.
    pub ap: Option<f64>,
    /// See above.
    pub ap50: Option<f64>,
    /// Mean wall time a scene, seconds.
    pub seconds: f64,
    /// Mean points of a scene.
    pub points: f64,
    /// Largest memory a scene took beyond what was held before, MB, where the system tells.
    pub peak_mb: Option<f64>,
    /// Optimiser steps of its network; 0 without training.
    pub steps: u64,
}

impl RowResult {
    /// Share of its instances that are right.
    pub fn precision(&self) -> Option<f64> {
        (self.right + self.wrong > 0).then(|| self.right as f64 / (self.right + self.wrong) as f64)
    }

    /// Wall time for 100,000 points, seconds.
    pub fn seconds_for_100_000(&self) -> Option<f64> {
        (self.points > 0.0).then(|| self.seconds * 1e5 / self.points)
    }

    /// Share of the scored parts that were found.
    pub fn recall(&self) -> Option<f64> {
        (self.right + self.missed > 0)
            .then(|| self.right as f64 / (self.right + self.missed) as f64)
    }
}

#[derive(Serialize, Deserialize)]
struct Kept {
    settings: String,
    result: RowResult,
}

/// A folder of rows made under the same settings.
pub struct RowsOnDisk {
    folder: PathBuf,
    settings: String,
    trainings: String,
}

impl RowsOnDisk {
    /// Makes the folder. `trainings`: of the settings those that a training depends on.
    pub fn at(folder: &Path, settings: String, trainings: String) -> Result<Self, ReproduceError> {
        std::fs::create_dir_all(folder).map_err(|e| failed(folder, e))?;
        Ok(Self { folder: folder.to_owned(), settings, trainings })
    }

    /// Where a row's training is kept: one begun with another seed or length has another place.
    pub fn training(&self, row: &str) -> PathBuf {
        self.folder.join(training_folder(row, &self.trainings))
    }

    /// The row's result from before, or made now and kept.
    pub fn row(
        &self,
        row: &str,
        make: impl FnOnce() -> Result<RowResult, ReproduceError>,
    ) -> Result<RowResult, ReproduceError> {
        let path = self.folder.join(format!("{}.json", file_name(row)));
        // A file that cannot be read is one that was cut short: the row is made again.
        let before = std::fs::read_to_string(&path).ok();
        let before = before.and_then(|text| serde_json::from_str::<Kept>(&text).ok());
        if let Some(kept) = before.filter(|k| k.settings == self.settings) {
            return Ok(kept.result);
        }
        let result = make()?;
        let kept = Kept { settings: self.settings.clone(), result };
        let text = serde_json::to_string_pretty(&kept).expect("plain numbers and texts");
        let aside = path.with_extension("part");
        std::fs::write(&aside, text).map_err(|e| failed(&aside, e))?;
        std::fs::rename(&aside, &path).map_err(|e| failed(&path, e))?;
        Ok(kept.result)
    }
}

fn failed(path: &Path, source: std::io::Error) -> ReproduceError {
    ReproduceError::File { file: path.display().to_string(), source }
}

/// Name of a training's folder: what it is of, and eight digits that stand for the settings it depends on.
pub fn training_folder(of: &str, settings: &str) -> String {
    format!("{}-{}", file_name(of), digits(settings.as_bytes()))
}

/// Eight digits that stand for something.
pub fn digits(of: &[u8]) -> String {
    blake3::hash(of).to_hex()[..8].to_string()
}

/// Words of a row's name, as a file may be called.
fn file_name(row: &str) -> String {
    let words = row.split(|c: char| !c.is_ascii_alphanumeric()).filter(|w| !w.is_empty());
    words.collect::<Vec<_>>().join("-").to_lowercase()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_is_made_once_under_the_same_settings() {
        let folder = tempfile::tempdir().unwrap();
        let result = RowResult { right: 3, wrong: 1, missed: 2, ..Default::default() };
        let at = |settings: &str| {
            RowsOnDisk::at(folder.path(), settings.into(), settings.into()).unwrap()
        };
        assert_eq!(at("a").training("FPCC (text)"), at("a").training("FPCC, text"));
        assert_ne!(at("a").training("FPCC (text)"), at("b").training("FPCC (text)"));
        assert_eq!(at("a").row("FPCC (text)", || Ok(result.clone())).unwrap(), result);
        let not_again = || -> Result<RowResult, ReproduceError> { panic!("made twice") };
        assert_eq!(at("a").row("FPCC (text)", not_again).unwrap(), result);
        let other = RowResult::default();
        assert_eq!(at("b").row("FPCC (text)", || Ok(other.clone())).unwrap(), other);
        std::fs::write(folder.path().join("fpcc-text.json"), "{\"sett").unwrap();
        assert_eq!(at("b").row("FPCC (text)", || Ok(result.clone())).unwrap(), result);
        assert_eq!(result.precision(), Some(0.75));
        let timed = RowResult { seconds: 0.5, points: 5e4, ..Default::default() };
        assert_eq!((timed.seconds_for_100_000(), other.seconds_for_100_000()), (Some(1.0), None));
        assert_eq!((result.recall(), other.recall()), (Some(0.6), None));
    }
}
