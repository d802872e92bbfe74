//! `manifest.json`: what made a run folder, and the BLAKE3 hash of every input and output, so that anybody can check.

use crate::{IoError, Place, atomic, own_hash, review};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Component, Path, PathBuf};

/// Name in the run folder.
pub const FILE: &str = "manifest.json";

/// Layout of the file that this version writes and reads.
pub const FORMAT: u32 = 2;

/// The layout before: the same without the file's own hash.
const WITHOUT_OWN_HASH: u32 = 1;

/// The lock of whoever writes into a run folder: there while somebody writes, or where a writer was killed.
pub const LOCK: &str = ".tsumu-lock";

/// A manifest is text about some hundred files.
const LARGEST: u64 = 64 << 20;

/// Wall times of a run: different every time, and so not in the manifest; the file holds a hash of itself.
pub const APART: &str = "timing.json";

/// The manifest. Holds no times and no absolute paths: the same inputs, seed and version give the same bytes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Manifest {
    /// BLAKE3 of the file as it is with zeros in this place; `None` in memory until it is sealed, and in files of layout 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub own_blake3: Option<String>,
    /// Version of this file's layout.
    pub format: u32,
    /// Version of the program.
    pub version: String,
    /// Root of all random choices.
    pub seed: u64,
    /// Every setting as used.
    pub config: serde_json::Value,
    /// Further facts: weights used, reviews applied.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub notes: BTreeMap<String, serde_json::Value>,
    /// Inputs by their path relative to the site folder.
    pub inputs: BTreeMap<String, Entry>,
    /// Outputs by their path relative to the run folder.
    pub outputs: BTreeMap<String, Entry>,
}

/// Size and hash of a file.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Entry {
    /// Size.
    pub bytes: u64,
    /// BLAKE3, 64 hexadecimal digits.
    pub blake3: String,
}

/// How a file differs from its manifest.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Difference {
    /// Other content.
    Changed(PathBuf),
    /// Not there.
    Missing(PathBuf),
    /// There, but not in the manifest.
    Unlisted(PathBuf),
    /// A review that lies in the site folder and was not there when the site was run.
    NotApplied(PathBuf),
}

impl std::fmt::Display for Difference {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Changed(p) => write!(f, "{}: changed since the run", p.display()),
            Self::Missing(p) => write!(f, "{}: missing", p.display()),
            Self::Unlisted(p) => write!(f, "{}: not made by the run", p.display()),
            Self::NotApplied(p) => {
                write!(f, "{}: came after the run, which knows nothing of it", p.display())
            }
        }
    }
}

impl Manifest {
    /// A manifest without files.
    pub fn new(version: &str, seed: u64, config: serde_json::Value) -> Self {
        Self {
            own_blake3: None,
            format: FORMAT,
            version: version.into(),
            seed,
            config,
            notes: BTreeMap::new(),
            inputs: BTreeMap::new(),
            outputs: BTreeMap::new(),
        }
    }

    /// Adds an input: its name relative to the site folder, and where it is now.
    pub fn add_input(&mut self, name: &Path, file: &Path) -> Result<(), IoError> {
        self.inputs.insert(portable(name), entry(file)?);
        Ok(())
    }

    /// One word for everything a result follows from: inputs, settings, seed, version, and what `program` says of the
    /// build. Two runs with the same key are the same run.
    pub fn key(&self, program: &str) -> String {
        let facts = serde_json::to_string(&(
            &self.version,
            self.seed,
            &self.config,
            &self.notes,
            &self.inputs,
            program,
        ));
        blake3::hash(facts.expect("a manifest is plain data").as_bytes()).to_hex().to_string()
    }

    /// Hashes every input again: a file that was exchanged while the run was at work must not be vouched for.
    pub fn check_inputs(&self, site: &Path) -> Result<(), IoError> {
        for (name, stated) in &self.inputs {
            let path = site.join(name);
            if entry(&path)? != *stated {
                return Err(IoError::unsupported(
                    &path,
                    "the file was changed while the run was at work; run again",
                ));
            }
        }
        Ok(())
    }

    /// Hashes what was written, given relative to its folder, and writes the manifest there. Only that is vouched for: a
    /// file somebody else put into the folder is none of the outputs.
    pub fn seal<'n>(
        &mut self,
        run: &Path,
        written: impl IntoIterator<Item = &'n Path>,
    ) -> Result<(), IoError> {
        let hashed = |name: &Path| Ok((portable(name), entry(&run.join(name))?));
        let outputs: Result<_, IoError> = written.into_iter().map(hashed).collect();
        self.seal_with(run, outputs?)
    }

    /// The same with hashes that were taken when the outputs were written: a file that was changed since is not vouched for.
    pub fn seal_with(
        &mut self,
        run: &Path,
        outputs: BTreeMap<String, Entry>,
    ) -> Result<(), IoError> {
        self.outputs = outputs;
        atomic::write_bytes(&run.join(FILE), self.sealed_text().as_bytes())
    }

    /// The file's text with its own hash.
    pub fn sealed_text(&mut self) -> String {
        (self.format, self.own_blake3) = (FORMAT, Some(own_hash::zeros()));
        let text = own_hash::seal(pretty(self));
        self.own_blake3 = serde_json::from_str::<Self>(&text).ok().and_then(|m| m.own_blake3);
        text
    }

    /// Takes the manifest of an earlier run away before the first of its files is overwritten: from then on until the new
    /// one is sealed the folder is an unfinished run, to every command that opens it.
    pub fn invalidate(run: &Path) -> Result<(), IoError> {
        let path = run.join(FILE);
        match fs::remove_file(&path) {
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => Ok(()),
            other => other.map_err(|e| IoError::write(&path, e)),
        }
    }

    /// Reads the manifest of a run folder.
    pub fn load(run: &Path) -> Result<Self, IoError> {
        let path = run.join(FILE);
        if run.is_dir() && !path.try_exists().map_err(|e| IoError::read(&path, e))? {
            let what =
                "the folder has no manifest: the run was not finished; `tsumu run` goes on with it";
            return Err(IoError::unsupported(&path, what));
        }
        Self::of_bytes(&path, &crate::input::read_bytes(&path, LARGEST)?)
    }

    /// The same from the file's content.
    pub fn of_bytes(path: &Path, bytes: &[u8]) -> Result<Self, IoError> {
        let manifest: Self = serde_json::from_slice(bytes).map_err(|e| {
            IoError::malformed(path, Place::Line(e.line() as u64), format!("not a manifest: {e}"))
        })?;
        if ![WITHOUT_OWN_HASH, FORMAT].contains(&manifest.format) {
            let what = format!(
                "format = {} is not known (this version reads {WITHOUT_OWN_HASH} and {FORMAT}); use the version of the program that made the run",
                manifest.format
            );
            return Err(IoError::unsupported(path, what));
        }
        let whole = match manifest.format {
            FORMAT => manifest.own_blake3.is_some() && own_hash::is_whole(bytes) == Some(true),
            _ => manifest.own_blake3.is_none(),
        };
        if !whole {
            let what = "the manifest itself was changed since the run, so that nothing it says can be believed; run again, or take it from a copy";
            return Err(IoError::unsupported(path, what));
        }
        let outside =
            |n: &&String| !Path::new(n).components().all(|c| matches!(c, Component::Normal(_)));
        // Surveys and designs may lie anywhere; what the run wrote may not.
        match manifest.outputs.keys().find(outside) {
            Some(name) => {
                Err(IoError::Outside { path: path.into(), key: "file".into(), target: name.into() })
            }
            None => Ok(manifest),
        }
    }
}

/// Recomputes every hash of a run folder, and of the inputs when the site folder is given. Empty: all is as it was.
pub fn verify(run: &Path, site: Option<&Path>) -> Result<Vec<Difference>, IoError> {
    let manifest = Manifest::load(run)?;
    let mut differences = Vec::new();
    let folders =
        std::iter::once((run, &manifest.outputs)).chain(site.map(|s| (s, &manifest.inputs)));
    for (folder, entries) in folders {
        for (name, expected) in entries {
            let path = folder.join(name);
            let is_output = std::ptr::eq(entries, &manifest.outputs);
            match entry(&path) {
                // A link leads to a file that may change without this one.
                Ok(_) if is_output && path.is_symlink() => {
                    differences.push(Difference::Changed(path));
                }
                Ok(found) if found == *expected => {}
                Ok(_) => differences.push(Difference::Changed(path)),
                Err(IoError::Os { source, .. })
                    if source.kind() == std::io::ErrorKind::NotFound =>
                {
                    differences.push(Difference::Missing(path));
                }
                // A folder, a pipe or a device where a file was.
                Err(IoError::Os { source, .. })
                    if matches!(
                        source.kind(),
                        std::io::ErrorKind::IsADirectory
                            | std::io::ErrorKind::InvalidInput
                            | std::io::ErrorKind::NotADirectory
                    ) =>
                {
                    differences.push(Difference::Changed(path));
                }
                Err(e) => return Err(e),
            }
        }
    }
    if let Some(review) = site.map(|s| s.join(review::FILE))
        && !manifest.inputs.contains_key(review::FILE)
        && review.exists()
    {
        differences.push(Difference::NotApplied(review));
    }
    if !times_are_own(&run.join(APART)) {
        differences.push(Difference::Changed(run.join(APART)));
    }
    let lock = Some(PathBuf::from(LOCK)).filter(|lock| run.join(lock).symlink_metadata().is_ok());
    let unlisted = files_below(run)?
        .into_iter()
        .chain(lock)
        .filter(|name| !manifest.outputs.contains_key(&portable(name)));
    differences.extend(unlisted.map(|name| Difference::Unlisted(run.join(name))));
    Ok(differences)
}

/// Writes the wall times of a run, an object, with the hash of what is written.
pub fn write_times(run: &Path, seconds: &serde_json::Value) -> Result<(), IoError> {
    let mut times = seconds.clone();
    if let Some(times) = times.as_object_mut() {
        times.insert("own_blake3".into(), own_hash::zeros().into());
    }
    atomic::write_bytes(&run.join(APART), own_hash::seal(pretty(&times)).as_bytes())
}

/// Whether the wall times are as they were written; a run without them, or with those of an earlier version, says nothing.
fn times_are_own(path: &Path) -> bool {
    if path.symlink_metadata().is_err() {
        return true;
    }
    let Ok(bytes) = crate::input::read_bytes(path, LARGEST) else { return false };
    let stated = serde_json::from_slice::<BTreeMap<String, serde_json::Value>>(&bytes);
    match own_hash::is_whole(&bytes) {
        Some(whole) => whole,
        None => stated.is_ok_and(|times| times.values().all(serde_json::Value::is_number)),
    }
}

fn pretty(value: &impl Serialize) -> String {
    serde_json::to_string_pretty(value).expect("plain data") + "\n"
}

/// BLAKE3 of some bytes.
pub fn hash(bytes: &[u8]) -> [u8; 32] {
    blake3::hash(bytes).into()
}

/// Size and hash of a file.
pub fn entry(path: &Path) -> Result<Entry, IoError> {
    let mut hasher = blake3::Hasher::new();
    let (mut file, _) = crate::input::open_regular(path)?;
    let bytes = std::io::copy(&mut file, &mut hasher).map_err(|e| IoError::read(path, e))?;
    Ok(Entry { bytes, blake3: hasher.finalize().to_hex().to_string() })
}

/// Relative paths of everything but the manifest, the wall times and the lock, sorted: files, links, pipes, and folders that
/// hold nothing. A finished run leaves no work in hand, so that such names are told like any other.
pub fn files_below(folder: &Path) -> Result<Vec<PathBuf>, IoError> {
    let (mut found, mut open) = (Vec::new(), vec![PathBuf::new()]);
    while let Some(below) = open.pop() {
        let here = folder.join(&below);
        let fail = |e| IoError::read(&here, e);
        let mut empty = true;
        for item in fs::read_dir(&here).map_err(fail)? {
            let item = item.map_err(fail)?;
            let name = below.join(item.file_name());
            empty = false;
            if item.file_type().map_err(fail)?.is_dir() {
                open.push(name);
            } else if ![FILE, APART, LOCK, crate::signature::FILE]
                .map(Path::new)
                .contains(&name.as_path())
            {
                found.push(name);
            }
        }
        if empty && below != Path::new("") {
            found.push(below);
        }
    }
    found.sort();
    Ok(found)
}

/// A path as a manifest has it: the same text on every system. Files of a site that lie elsewhere keep their whole path.
pub fn portable(path: &Path) -> String {
    let parts: Vec<_> = path
        .components()
        .filter(|c| !matches!(c, Component::RootDir))
        .map(|c| c.as_os_str().to_string_lossy())
        .collect();
    let root =
        if path.is_absolute() && !matches!(path.components().next(), Some(Component::Prefix(_))) {
            "/"
        } else {
            ""
        };
    format!("{root}{}", parts.join("/"))
}
