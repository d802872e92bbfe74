//! Finished parts of a run, kept in its folder until the run is whole: a run that was killed goes on from the last.
//!
//! In: the name of a part and the work that makes it. Out: its value, from the folder when it was made there from the
//! same inputs with the same settings and seed by the same program, or else made now. A part is written whole or not
//! at all, with its hash; what cannot be read, or belongs to another key, is made again. The folder is locked while
//! it is written: two runs at once would mix their files.

use crate::lock::FolderLock;
use crate::{Error, Job, Result, written};
use geom::{Event, JobPart, Observer, PartState, Warning};
use io::IoError;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::fs;
use std::path::{Path, PathBuf};

/// Begins with the mark of work in hand.
const FOLDER: &str = ".tsumu-resume";
const HASH_BYTES: usize = 32;
/// No part is larger: an exabyte would not be a part.
const MOST_BYTES: u64 = 1 << 60;

/// Parts of a job, kept in a folder or not.
pub(crate) struct Parts<'a> {
    job: &'a Job<'a>,
    kept: Option<Kept>,
}

/// Where the parts of a run are kept until it is whole.
struct Kept {
    folder: PathBuf,
    key: String,
    _lock: FolderLock,
}

/// Whether the run of a folder was begun and is not whole.
pub(crate) fn is_unfinished(root: &Path) -> bool {
    FolderLock::is_left(root)
        || root.join(FOLDER).symlink_metadata().is_ok()
        || written::is_left(root)
}

#[derive(Serialize)]
struct Written<'v, T> {
    key: &'v str,
    warnings: &'v [Warning],
    value: &'v T,
}

#[derive(Deserialize)]
struct Read<T> {
    key: String,
    warnings: Vec<Warning>,
    value: T,
}

impl<'a> Parts<'a> {
    /// Nothing is kept.
    pub fn none(job: &'a Job<'a>) -> Self {
        Self { job, kept: None }
    }

    /// Locks a run folder and clears what killed writes have left there. `key` stands for everything the parts follow from.
    pub fn kept(root: &Path, key: String, job: &'a Job<'a>) -> Result<Self> {
        let lock = FolderLock::take(root)?;
        let folder = root.join(FOLDER);
        fs::create_dir_all(&folder).map_err(|source| os("write", &folder, source))?;
        io::atomic::clear_aside(root)?;
        let kept = Kept { folder, key, _lock: lock };
        Ok(Self { job, kept: Some(kept) })
    }

    /// Whose parts they are.
    pub fn job(&self) -> &'a Job<'a> {
        self.job
    }

    /// A folder of a part that keeps itself, another for every key; `None`: nothing is kept.
    pub fn folder(&self, part: JobPart) -> Option<PathBuf> {
        self.kept.as_ref().map(|kept| kept.folder.join(format!("{part}-{}", &kept.key[..16])))
    }

    /// The value of a part: kept, or made by `work` and kept from now on. Its warnings come either way.
    pub fn part<T: Serialize + DeserializeOwned, E: Into<Error>>(
        &self,
        part: JobPart,
        work: impl FnOnce() -> std::result::Result<T, E>,
    ) -> Result<T> {
        let Some(kept) = &self.kept else { return work().map_err(Into::into) };
        let path = kept.folder.join(part.word());
        if let Some(found) = kept.read(&path) {
            found.warnings.into_iter().for_each(|w| self.job.event(Event::Warned(w)));
            self.job.event(Event::Part { part, state: PartState::Kept });
            return Ok(found.value);
        }
        let before = self.job.warned().len();
        let value = work().map_err(Into::into)?;
        kept.write(&path, &self.job.warned()[before..], &value)?;
        self.job.event(Event::Part { part, state: PartState::Keeping });
        Ok(value)
    }

    /// The run is whole: the parts go.
    pub fn finish(self) -> Result<()> {
        let Some(kept) = &self.kept else { return Ok(()) };
        Ok(fs::remove_dir_all(&kept.folder).map_err(|source| os("write", &kept.folder, source))?)
    }
}

impl Kept {
    fn write<T: Serialize>(&self, path: &Path, warnings: &[Warning], value: &T) -> Result<()> {
        let (_, bytes) = write_hashed(&Written { key: &self.key, warnings, value })?;
        Ok(io::atomic::write_bytes(path, &bytes)?)
    }

    fn read<T: DeserializeOwned>(&self, path: &Path) -> Option<Read<T>> {
        // A pipe of this name would be waited for.
        let (_, kept) = read_hashed(&io::read_bytes(path, MOST_BYTES).ok()?)?;
        Some(kept).filter(|kept: &Read<T>| kept.key == self.key)
    }
}

/// A value as bytes with their hash before them, and the first digits of that.
pub(crate) fn write_hashed<T: Serialize>(value: &T) -> Result<(String, Vec<u8>)> {
    let mut bytes = vec![0; HASH_BYTES];
    ciborium::into_writer(value, &mut bytes)?;
    let hash = io::manifest::hash(&bytes[HASH_BYTES..]);
    bytes[..HASH_BYTES].copy_from_slice(&hash);
    Ok((digits(&hash), bytes))
}

/// The way back; `None` for bytes that are not as they were written.
pub(crate) fn read_hashed<T: DeserializeOwned>(bytes: &[u8]) -> Option<(String, T)> {
    let (hash, content) = bytes.split_at_checked(HASH_BYTES)?;
    if hash != io::manifest::hash(content) {
        return None;
    }
    Some((digits(hash), ciborium::from_reader(content).ok()?))
}

fn digits(hash: &[u8]) -> String {
    hash[..8].iter().map(|byte| format!("{byte:02x}")).collect()
}

/// A folder of no parts goes, before the lock does. Failing to tidy is no failure.
impl Drop for Kept {
    fn drop(&mut self) {
        let _ = fs::remove_dir(&self.folder);
    }
}

fn os(doing: &'static str, path: &Path, source: std::io::Error) -> IoError {
    IoError::Os { path: path.into(), doing, source }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn made(parts: &Parts, value: f32) -> (f32, bool) {
        let mut worked = false;
        let got = parts.part(JobPart::Plan, || {
            worked = true;
            Ok::<_, Error>(value)
        });
        (got.unwrap(), worked)
    }

    #[test]
    fn a_part_is_made_once_for_a_key() {
        let (folder, job) = (tempfile::tempdir().unwrap(), Job::silent());
        let run = folder.path().join("run");
        let open = |key: &str| Parts::kept(&run, key.into(), &job).unwrap();
        assert_eq!(made(&open("one"), 0.1), (0.1, true));
        assert_eq!(made(&open("one"), 0.2), (0.1, false));
        assert_eq!(made(&open("two"), 0.3), (0.3, true));
        // Damage is noticed.
        let path = run.join(FOLDER).join("plan");
        let mut bytes = fs::read(&path).unwrap();
        *bytes.last_mut().unwrap() ^= 1;
        fs::write(&path, bytes).unwrap();
        assert_eq!(made(&open("two"), 0.4), (0.4, true));
        open("two").finish().unwrap();
        assert!(!run.exists(), "an empty run folder goes");
    }
}
