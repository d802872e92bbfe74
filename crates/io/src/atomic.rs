//! Files appear whole or not at all: written under a temporary name in the same folder, flushed to disk, then renamed.

use crate::IoError;
use std::fs::{self, File};
use std::io::{self, BufWriter, Read, Seek, Write};
use std::path::Path;

/// How the names of files begin that are work in hand; they are no results.
pub const TEMPORARY: &str = ".tsumu-";

const PART: &str = ".part";

/// So many bytes at the beginning of a file tell its kind: `<!doctype h`, `{"west_m":`.
const KIND_BYTES: usize = 10;

/// A stream that a writer may also seek in.
pub trait WriteSeek: Write + Seek {}
impl<T: Write + Seek> WriteSeek for T {}

/// Writes the file through `fill`; on any error the old file, or none, is still there and nothing else is left.
/// The folder is made when it is missing. What stands in its place and is no file, as a device is, stays there: an error.
pub fn write(
    path: &Path,
    fill: impl FnOnce(&mut dyn WriteSeek) -> io::Result<()>,
) -> Result<(), IoError> {
    refuse_no_file(path)?;
    let attempt = || {
        let folder = match path.parent() {
            Some(p) if !p.as_os_str().is_empty() => p,
            _ => Path::new("."),
        };
        fs::create_dir_all(folder)?;
        let temporary =
            tempfile::Builder::new().prefix(TEMPORARY).suffix(PART).tempfile_in(folder)?;
        let mut buffer = BufWriter::with_capacity(1 << 16, temporary.as_file());
        fill(&mut buffer)?;
        buffer.flush()?;
        drop(buffer);
        temporary.as_file().sync_all()?;
        readable_by_others(temporary.as_file())?;
        temporary.persist(path).map_err(|e| e.error)?;
        folder_to_disk(folder)
    };
    attempt().map_err(|e| IoError::write(path, e))
}

/// Writes these bytes.
pub fn write_bytes(path: &Path, bytes: &[u8]) -> Result<(), IoError> {
    write(path, |out| out.write_all(bytes))
}

/// Writes these bytes where somebody has named the file: what is there already is replaced only by its own kind, which both begin alike
/// for, so that a slip in a name costs no survey. An empty file may be replaced. Errors: something else is there.
pub fn write_over_own_kind(path: &Path, bytes: &[u8]) -> Result<(), IoError> {
    if let Ok(meta) = fs::metadata(path)
        && meta.is_file()
        && meta.len() > 0
        && !begins_alike(path, bytes).map_err(|e| IoError::read(path, e))?
    {
        let what =
            "there is another kind of file already, which is not overwritten; choose another name";
        return Err(IoError::unsupported(path, what));
    }
    write_bytes(path, bytes)
}

fn begins_alike(path: &Path, bytes: &[u8]) -> io::Result<bool> {
    let mut there = Vec::new();
    File::open(path)?.take(KIND_BYTES as u64).read_to_end(&mut there)?;
    Ok(there == bytes[..bytes.len().min(KIND_BYTES)])
}

/// A rename would put a file in the place of a pipe or a device, for whoever has the rights.
fn refuse_no_file(path: &Path) -> Result<(), IoError> {
    let Ok(meta) = fs::symlink_metadata(path) else { return Ok(()) };
    if meta.is_file() || meta.is_symlink() {
        return Ok(());
    }
    let what = if meta.is_dir() {
        "it is a folder; a file is going to be written, choose another name"
    } else {
        "it is a pipe or a device, which is not replaced; choose another name"
    };
    Err(IoError::unsupported(path, what))
}

/// Writes these bytes unless the file is there already: of several writers one is first and the others change nothing. Whether this was
/// the first. The file is whole from its first moment.
pub fn write_if_absent(path: &Path, bytes: &[u8]) -> Result<bool, IoError> {
    let attempt = || {
        let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
        fs::create_dir_all(folder)?;
        let mut aside =
            tempfile::Builder::new().prefix(TEMPORARY).suffix(PART).tempfile_in(folder)?;
        aside.write_all(bytes)?;
        aside.as_file().sync_all()?;
        readable_by_others(aside.as_file())?;
        match aside.persist_noclobber(path) {
            Ok(_) => folder_to_disk(folder).map(|()| true),
            Err(e) if e.error.kind() == io::ErrorKind::AlreadyExists => Ok(false),
            Err(e) => Err(e.error),
        }
    };
    attempt().map_err(|e| IoError::write(path, e))
}

/// Removes what writes that were killed have left in a folder and below it. Nobody else may be writing there.
pub fn clear_aside(folder: &Path) -> Result<(), IoError> {
    let mut open = vec![folder.to_path_buf()];
    while let Some(here) = open.pop() {
        let fail = |e| IoError::read(&here, e);
        for item in fs::read_dir(&here).map_err(fail)? {
            let item = item.map_err(fail)?;
            let name = item.file_name().to_string_lossy().into_owned();
            if item.file_type().map_err(fail)?.is_dir() {
                open.push(item.path());
            } else if name.starts_with(TEMPORARY) && name.ends_with(PART) {
                fs::remove_file(item.path()).map_err(|e| IoError::write(&item.path(), e))?;
            }
        }
    }
    Ok(())
}

/// A rename is on the disk when its folder is: after a power cut the file is the old or the new one, never none.
#[cfg(unix)]
fn folder_to_disk(folder: &Path) -> io::Result<()> {
    match File::open(folder)?.sync_all() {
        // Some network file systems have no such call; they order renames themselves.
        Err(e) if matches!(e.kind(), io::ErrorKind::InvalidInput | io::ErrorKind::Unsupported) => {
            Ok(())
        }
        other => other,
    }
}

#[cfg(not(unix))]
fn folder_to_disk(_folder: &Path) -> io::Result<()> {
    Ok(())
}

/// Refuses a folder that holds a link anywhere: what is written there would appear, or overwrite, elsewhere.
/// A folder that is not there holds none.
pub fn refuse_links(folder: &Path) -> Result<(), IoError> {
    let mut open = vec![folder.to_path_buf()];
    while let Some(here) = open.pop() {
        let fail = |e| IoError::read(&here, e);
        let items = match fs::read_dir(&here) {
            Err(e) if e.kind() == io::ErrorKind::NotFound => return Ok(()),
            other => other.map_err(fail)?,
        };
        for item in items {
            let item = item.map_err(fail)?;
            let kind = item.file_type().map_err(fail)?;
            if kind.is_symlink() {
                let what = "it is a link; results are written into folders of their own only: remove the link, or choose another folder";
                return Err(IoError::unsupported(&item.path(), what));
            } else if kind.is_dir() {
                open.push(item.path());
            }
        }
    }
    Ok(())
}

/// Temporary files are made private; a result should be as readable as any other file of the user.
#[cfg(unix)]
fn readable_by_others(file: &File) -> io::Result<()> {
    use std::os::unix::fs::PermissionsExt;
    file.set_permissions(fs::Permissions::from_mode(0o644))
}

#[cfg(not(unix))]
fn readable_by_others(_file: &File) -> io::Result<()> {
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failed_write_leaves_the_old_file_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        write_bytes(&path, b"old").unwrap();
        let full = || io::Error::from(io::ErrorKind::StorageFull);
        let error =
            write(&path, |out| out.write_all(b"half of the new").and(Err(full()))).unwrap_err();
        assert!(
            error.to_string().contains("a.txt") && error.to_string().contains("free some space"),
            "{error}"
        );
        assert_eq!(fs::read(&path).unwrap(), b"old");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    /// A page named `survey.laz` once took the survey's place.
    #[test]
    fn a_named_file_is_replaced_by_its_own_kind_alone() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("page.html");
        let page = b"<!doctype html><p>new";
        for old in ["", "<!doctype html><p>old page", "<!doctype html><p>new"] {
            fs::write(&path, old).unwrap();
            write_over_own_kind(&path, page).unwrap();
            assert_eq!(fs::read(&path).unwrap(), page);
        }
        for other in ["LASF\0\0\0\0", "name = \"Site\"", "<", "{\"format\":1}"] {
            fs::write(&path, other).unwrap();
            let message = write_over_own_kind(&path, page).unwrap_err().to_string();
            assert!(message.contains("page.html") && message.contains("another name"), "{message}");
            assert_eq!(fs::read_to_string(&path).unwrap(), other);
        }
        fs::remove_file(&path).unwrap();
        write_over_own_kind(&path, page).unwrap();
    }

    /// Whoever may replace `/dev/null` once did.
    #[cfg(unix)]
    #[test]
    fn what_is_no_file_stays() {
        let folder = tempfile::tempdir().unwrap();
        let (socket, inside) = (folder.path().join("socket"), folder.path().join("folder"));
        let _listening = std::os::unix::net::UnixListener::bind(&socket).unwrap();
        fs::create_dir(&inside).unwrap();
        for (path, word) in [(&socket, "device"), (&inside, "folder")] {
            let message = write_bytes(path, b"x").unwrap_err().to_string();
            assert!(message.contains(word), "{message}");
            assert!(write_over_own_kind(path, b"x").is_err());
            assert!(!path.symlink_metadata().unwrap().is_file());
        }
    }

    #[test]
    fn of_many_writers_one_is_first() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("tile/done.json");
        let first = std::thread::scope(|scope| {
            let write = |i: u8| {
                let path = &path;
                scope.spawn(move || write_if_absent(path, &[i; 1000]).unwrap())
            };
            let all: Vec<_> = (0..8).map(write).collect();
            all.into_iter().map(|t| usize::from(t.join().unwrap())).sum::<usize>()
        });
        assert_eq!(first, 1);
        let bytes = fs::read(&path).unwrap();
        assert!(bytes.len() == 1000 && bytes.iter().all(|b| *b == bytes[0]));
        assert_eq!(fs::read_dir(path.parent().unwrap()).unwrap().count(), 1);
    }

    /// `exports` once was a link, and eleven files appeared where it led to.
    #[cfg(unix)]
    #[test]
    fn links_in_a_result_folder_are_named() {
        let folder = tempfile::tempdir().unwrap();
        let run = folder.path().join("run");
        refuse_links(&run).unwrap();
        write_bytes(&run.join("plan/a.txt"), b"x").unwrap();
        refuse_links(&run).unwrap();
        std::os::unix::fs::symlink(folder.path(), run.join("plan/exports")).unwrap();
        let message = refuse_links(&run).unwrap_err().to_string();
        assert!(message.contains("exports") && message.contains("link"), "{message}");
    }

    #[test]
    fn a_file_in_the_way_of_a_folder_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("file");
        write_bytes(&path, b"x").unwrap();
        let error = write_bytes(&path.join("below"), b"y").unwrap_err();
        assert!(error.to_string().contains("below"), "{error}");
    }
}
