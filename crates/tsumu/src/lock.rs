//! One writer a run folder: two at once would mix their files.

use crate::{Error, Result};
use anyhow::anyhow;
use io::IoError;
use io::manifest::LOCK;
use std::fs::{self, File, OpenOptions, TryLockError};
use std::path::{Path, PathBuf};

/// Held while a folder is written; the file goes with it, and a folder that nothing was left in.
#[derive(Debug)]
pub(crate) struct FolderLock {
    root: PathBuf,
    _file: File,
}

impl FolderLock {
    /// Makes the folder when it is missing and locks it. Errors: another program is writing there.
    pub fn take(root: &Path) -> Result<Self> {
        let os = |path: &Path, source| IoError::Os { path: path.into(), doing: "write", source };
        let path = root.join(LOCK);
        loop {
            fs::create_dir_all(root).map_err(|e| os(root, e))?;
            io::atomic::refuse_links(root)?;
            // Never emptied: were it a link after all, the file behind it keeps its content.
            let opened = OpenOptions::new().write(true).create(true).truncate(false).open(&path);
            let file = opened.map_err(|e| os(&path, e))?;
            match file.try_lock() {
                Err(TryLockError::WouldBlock) => {
                    return Err(Error::bad_input(anyhow!(
                        "{}: another run is writing there; wait for it, or choose another folder with --out",
                        root.display()
                    )));
                }
                // File systems without locks exist; they are not refused.
                Ok(()) | Err(TryLockError::Error(_)) => {}
            }
            if still_there(&path, &file) {
                return Ok(Self { root: root.to_path_buf(), _file: file });
            }
            // Whoever held it before has just taken the file away: this is a lock on nothing.
        }
    }

    /// Whether a writer has left a folder before its work was whole, or is still at it.
    pub fn is_left(root: &Path) -> bool {
        root.join(LOCK).symlink_metadata().is_ok()
    }
}

#[cfg(unix)]
fn still_there(path: &Path, file: &File) -> bool {
    use std::os::unix::fs::MetadataExt;
    let place = |m: fs::Metadata| (m.dev(), m.ino());
    match (path.symlink_metadata(), file.metadata()) {
        (Ok(named), Ok(open)) => place(named) == place(open),
        _ => false,
    }
}

#[cfg(not(unix))]
fn still_there(_path: &Path, _file: &File) -> bool {
    true // an open file cannot be taken away there
}

/// Failing to tidy is no failure.
impl Drop for FolderLock {
    fn drop(&mut self) {
        let _ = fs::remove_file(self.root.join(LOCK));
        let _ = fs::remove_dir(&self.root);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_writer_at_a_time_and_nothing_stays() {
        let folder = tempfile::tempdir().unwrap();
        let run = folder.path().join("run");
        let first = FolderLock::take(&run).unwrap();
        let message = FolderLock::take(&run).err().unwrap().line();
        assert!(message.contains("another run"), "{message}");
        assert!(FolderLock::is_left(&run));
        drop(first);
        assert!(!run.exists());
        drop(FolderLock::take(&run).unwrap());
    }

    /// The lock was once opened so that a file anywhere could be emptied through a link of its name.
    #[cfg(unix)]
    #[test]
    fn a_lock_that_is_a_link_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let (run, victim) = (folder.path().join("run"), folder.path().join("victim"));
        fs::create_dir(&run).unwrap();
        fs::write(&victim, "precious").unwrap();
        std::os::unix::fs::symlink(&victim, run.join(LOCK)).unwrap();
        assert!(FolderLock::take(&run).err().unwrap().line().contains("link"));
        assert_eq!(fs::read_to_string(&victim).unwrap(), "precious");
    }
}
