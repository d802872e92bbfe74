//! The folder of a comparison: filled aside, then put in its place whole.

use super::EpochRun;
use crate::lock::FolderLock;
use crate::run_folder::outside_of_runs;
use crate::{Error, Result};
use anyhow::anyhow;
use io::IoError;
use io::manifest::{Manifest, files_below, portable};
use std::fs;
use std::path::{Path, PathBuf};

/// Key of the note that tells a comparison from a run.
pub(super) const NOTE: &str = "comparison";

/// Where a comparison will lie. Nobody else writes there while this lives; dropped without being filled, it leaves nothing.
#[derive(Debug)]
pub struct ComparisonFolder {
    pub(super) place: PathBuf,
    pub(super) aside: PathBuf,
    _lock: FolderLock,
}

impl ComparisonFolder {
    /// Takes hold of the folder. Errors: it holds something else than an earlier comparison, or another one is at work.
    pub fn begin(place: &Path) -> Result<Self> {
        may_be_replaced(place)?;
        let name = place.file_name().ok_or_else(|| {
            Error::bad_input(anyhow!("{}: names no folder; choose another --out", place.display()))
        })?;
        let aside = place.with_file_name(format!(".tsumu-{}.part", name.to_string_lossy()));
        if aside.is_symlink() {
            return Err(Error::bad_input(anyhow!(
                "{}: is a link; take it away, results are written into folders of their own only",
                aside.display()
            )));
        }
        let lock = FolderLock::take(&aside)?;
        let out = Self { place: place.to_path_buf(), aside, _lock: lock };
        for left in files_below(&out.aside)? {
            let path = out.aside.join(left);
            let gone = if path.is_dir() { fs::remove_dir(&path) } else { fs::remove_file(&path) };
            gone.map_err(|e| os("write", &path, e))?;
        }
        Ok(out)
    }

    /// Refuses to write over, or into the run of, what is compared.
    pub fn is_none_of(&self, epochs: &[&EpochRun]) -> Result<()> {
        let whole = |p: &Path| p.canonicalize().unwrap_or_else(|_| p.to_path_buf());
        let parent = self.aside.parent().filter(|p| !p.as_os_str().is_empty());
        let place = whole(parent.unwrap_or(Path::new(".")))
            .join(self.place.file_name().unwrap_or_default());
        for epoch in epochs {
            let into_run = epoch.folders.get(1).is_some_and(|run| place.starts_with(whole(run)));
            if into_run || epoch.folders.iter().any(|f| whole(f) == place) {
                return Err(Error::bad_input(anyhow!(
                    "--out {}: is, or lies in, what is compared ({}); choose another folder",
                    self.place.display(),
                    epoch.name
                )));
            }
        }
        Ok(())
    }

    /// Seals what was written aside and puts it in its place.
    pub(super) fn put(self, mut manifest: Manifest) -> Result<PathBuf> {
        let lock = self.aside.join(io::manifest::LOCK);
        fs::remove_file(&lock).map_err(|e| os("write", &lock, e))?;
        let written = files_below(&self.aside)?;
        manifest.seal(&self.aside, written.iter().map(PathBuf::as_path))?;
        may_be_replaced(&self.place)?;
        if self.place.is_dir() {
            fs::remove_dir_all(&self.place).map_err(|e| os("write", &self.place, e))?;
        }
        fs::rename(&self.aside, &self.place).map_err(|e| os("write", &self.place, e))?;
        Ok(self.place.clone())
    }
}

/// What is not put in its place goes. Failing to tidy is no failure.
impl Drop for ComparisonFolder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.aside);
    }
}

/// A folder in no run that is not there, is empty, or holds an earlier comparison and nothing else.
fn may_be_replaced(place: &Path) -> Result<()> {
    outside_of_runs(place)?;
    if place.is_file() || place.is_symlink() {
        return Err(Error::bad_input(anyhow!(
            "{}: is a file or a link, not a folder; choose another --out",
            place.display()
        )));
    }
    if !place.is_dir() {
        return Ok(());
    }
    let there = files_below(place)?;
    let earlier = Manifest::load(place).ok().filter(|m| m.notes.contains_key(NOTE));
    let ours = |file: &PathBuf| {
        let listed = earlier.as_ref().is_some_and(|m| m.outputs.contains_key(&portable(file)));
        listed || (earlier.is_some() && file == Path::new(io::manifest::FILE))
    };
    match there.iter().find(|f| !ours(f)) {
        None => Ok(()),
        Some(file) => Err(Error::bad_input(anyhow!(
            "{}: holds `{}`, which is not of a comparison; choose an empty folder with --out",
            place.display(),
            file.display()
        ))),
    }
}

fn os(doing: &'static str, path: &Path, source: std::io::Error) -> Error {
    Error::failed(IoError::Os { path: path.into(), doing, source })
}
