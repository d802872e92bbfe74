//! What a run has written, recorded as it is written: with its hash for the manifest, and in the folder for whoever comes after
//! a run that was killed. What is not recorded is somebody else's: it is neither vouched for nor removed.

use crate::Result;
use io::IoError;
use io::manifest::{Entry, Manifest, entry, portable};
use std::collections::{BTreeMap, BTreeSet};
use std::fs::{self, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

/// One line a file, `hash size name`; there from the first file until the manifest is sealed.
const FILE: &str = ".tsumu-outputs";
/// Some hundred lines for each of some hundred interrupted runs.
const LARGEST: u64 = 64 << 20;

/// The record of a run folder. Clones are of the same record.
#[derive(Clone, Debug)]
pub(crate) struct Written {
    root: PathBuf,
    /// Files that earlier runs left, each with every content it may have.
    earlier: BTreeSet<(String, Entry)>,
    now: Arc<Mutex<BTreeMap<String, Entry>>>,
}

/// Whether files of a run lie in the folder that no manifest vouches for.
pub(crate) fn is_left(root: &Path) -> bool {
    root.join(FILE).symlink_metadata().is_ok()
}

impl Written {
    /// The record of a folder in which a run begins: nothing yet, and what earlier runs have left.
    pub fn begin(root: &Path) -> Self {
        let mut earlier = recorded(&root.join(FILE));
        earlier.extend(Manifest::load(root).map(|m| m.outputs).unwrap_or_default());
        Self { root: root.to_path_buf(), earlier, now: Arc::default() }
    }

    /// From now on until the run is sealed the folder is an unfinished run: the manifest that is there goes, and what it
    /// said of the folder's files is recorded first.
    pub fn invalidate(&self) -> Result<()> {
        if self.root.join(io::manifest::FILE).symlink_metadata().is_err() && is_left(&self.root) {
            return Ok(());
        }
        let lines: String = self.earlier.iter().map(|(name, entry)| line(name, entry)).collect();
        io::atomic::write_bytes(&self.root.join(FILE), lines.as_bytes())?;
        Ok(Manifest::invalidate(&self.root)?)
    }

    /// Writes a file, whole, and records it.
    pub fn put<E: Into<crate::Error>>(
        &self,
        file: &Path,
        write: impl FnOnce(&Path) -> std::result::Result<(), E>,
    ) -> Result<()> {
        write(file).map_err(Into::into)?;
        self.record(file)
    }

    /// Records a file that has just been written.
    pub fn record(&self, file: &Path) -> Result<()> {
        let name = portable(file.strip_prefix(&self.root).unwrap_or(file));
        let found = entry(file)?;
        let path = self.root.join(FILE);
        let append = || {
            let mut record = OpenOptions::new().append(true).create(true).open(&path)?;
            record.write_all(line(&name, &found).as_bytes())
        };
        append().map_err(|source| os(&path, source))?;
        self.now.lock().expect("no thread panics with this lock").insert(name, found);
        Ok(())
    }

    /// Takes away what earlier runs wrote and this one did not, unless somebody has changed it since, and seals the manifest.
    pub fn seal(&self, manifest: &mut Manifest) -> Result<()> {
        let now = self.now.lock().expect("no thread panics with this lock").clone();
        for (name, left) in self.earlier.iter().filter(|(name, _)| !now.contains_key(name)) {
            let path = self.root.join(name);
            if entry(&path).is_ok_and(|found| found == *left) {
                fs::remove_file(&path).map_err(|source| os(&path, source))?;
                // A folder that held nothing else goes too.
                path.parent().filter(|p| *p != self.root).map(fs::remove_dir);
            }
        }
        manifest.seal_with(&self.root, now)?;
        let path = self.root.join(FILE);
        match fs::remove_file(&path) {
            Err(e) if e.kind() != std::io::ErrorKind::NotFound => Err(os(&path, e).into()),
            _ => Ok(()),
        }
    }
}

fn line(name: &str, entry: &Entry) -> String {
    format!("{} {} {name}\n", entry.blake3, entry.bytes)
}

/// What a record says; a line that was cut short, and one that names a file elsewhere, says nothing.
fn recorded(file: &Path) -> BTreeSet<(String, Entry)> {
    let bytes = io::read_bytes(file, LARGEST).unwrap_or_default();
    let text = String::from_utf8_lossy(&bytes);
    let whole = text.split_inclusive('\n').filter_map(|line| line.strip_suffix('\n'));
    let one = |line: &str| {
        let mut words = line.splitn(3, ' ');
        let (blake3, bytes) = (words.next()?.to_string(), words.next()?.parse().ok()?);
        let name = words.next()?.to_string();
        let inside = |c| matches!(c, std::path::Component::Normal(_));
        Path::new(&name).components().all(inside).then_some((name, Entry { bytes, blake3 }))
    };
    whole.filter_map(one).collect()
}

fn os(path: &Path, source: std::io::Error) -> IoError {
    IoError::Os { path: path.into(), doing: "write", source }
}

#[cfg(test)]
mod tests {
    use super::*;
    use io::manifest::verify;

    fn put(written: &Written, name: &str, text: &str) {
        let file = written.root.join(name);
        written.put(&file, |p| io::atomic::write_bytes(p, text.as_bytes())).unwrap();
    }

    fn manifest() -> Manifest {
        Manifest::new("0", 1, serde_json::Value::Null)
    }

    /// Whatever lay in a folder whose run had been killed once became an output of the next, with a hash.
    #[test]
    fn what_a_killed_run_wrote_is_told_from_what_others_put_there() {
        let folder = tempfile::tempdir().unwrap();
        let root = folder.path();
        let killed = Written::begin(root);
        killed.invalidate().unwrap();
        put(&killed, "plan/placements.csv", "of the killed run");
        put(&killed, "plan/summary.json", "of the killed run, then corrected");
        put(&killed, "report.html", "of the killed run");
        drop(killed);
        fs::write(root.join("plan/summary.json"), "by hand").unwrap();
        fs::create_dir(root.join("exports")).unwrap();
        fs::write(root.join("exports/theirs.tif"), "theirs").unwrap();
        assert!(is_left(root));

        let next = Written::begin(root);
        next.invalidate().unwrap();
        put(&next, "report.html", "of the next run");
        let mut sealed = manifest();
        next.seal(&mut sealed).unwrap();
        assert_eq!(sealed.outputs.keys().collect::<Vec<_>>(), ["report.html"]);
        assert!(!root.join("plan/placements.csv").exists(), "left by the killed run");
        let said: Vec<String> =
            verify(root, None).unwrap().iter().map(ToString::to_string).collect();
        assert_eq!(said.len(), 2, "{said:?}");
        assert!(said[0].contains("theirs.tif") && said[1].contains("summary.json"), "{said:?}");
    }

    #[test]
    fn an_earlier_run_is_known_after_its_manifest_is_gone() {
        let folder = tempfile::tempdir().unwrap();
        let first = Written::begin(folder.path());
        put(&first, "a.csv", "a");
        put(&first, "b.csv", "b");
        first.seal(&mut manifest()).unwrap();
        assert!(!is_left(folder.path()));
        // Killed between its manifest's end and its first file.
        Written::begin(folder.path()).invalidate().unwrap();
        assert!(is_left(folder.path()) && !folder.path().join("manifest.json").exists());
        let next = Written::begin(folder.path());
        put(&next, "a.csv", "a");
        next.seal(&mut manifest()).unwrap();
        assert!(!folder.path().join("b.csv").exists());
        assert_eq!(verify(folder.path(), None).unwrap(), []);
    }

    /// The file's content is what it was when it was written, not what it is when the manifest is made.
    #[test]
    fn a_file_changed_before_the_seal_is_not_vouched_for() {
        let folder = tempfile::tempdir().unwrap();
        let run = Written::begin(folder.path());
        put(&run, "a.csv", "a");
        fs::write(folder.path().join("a.csv"), "b").unwrap();
        run.seal(&mut manifest()).unwrap();
        assert_eq!(verify(folder.path(), None).unwrap().len(), 1);
    }
}
