//! What can go wrong with a file. Every message names the file, the place in it and what to do.

use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

/// Why a file could not be read or written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum IoError {
    /// The operating system refused.
    #[error("cannot {doing} {}: {source}{}", path.display(), advice(source))]
    Os {
        /// The file or folder.
        path: PathBuf,
        /// What was tried, e.g. `read`.
        doing: &'static str,
        /// The system's answer.
        source: io::Error,
    },
    /// The content breaks the rules of its format.
    #[error("{}{at}: {what}", path.display())]
    Malformed {
        /// The file.
        path: PathBuf,
        /// Where in it.
        at: Place,
        /// What is wrong and what to do.
        what: String,
    },
    /// A cloud without points.
    #[error("{}: the file holds no points; export it again with the points selected", path.display())]
    NoPoints {
        /// The file.
        path: PathBuf,
    },
    /// A cloud of which every point is marked as none.
    #[error(
        "{}: every point is left out ({left_out}); name the classes that are surface in `keep`, e.g. `keep = [9]`",
        path.display()
    )]
    AllLeftOut {
        /// The file.
        path: PathBuf,
        /// How many for which reason.
        left_out: String,
    },
    /// A coordinate that is not a number.
    #[error("{}{at}: the coordinates ({x}, {y}, {z}) are not all finite numbers; remove such points before", path.display())]
    NotFinite {
        /// The file.
        path: PathBuf,
        /// Which point.
        at: Place,
        /// First coordinate.
        x: f64,
        /// Second coordinate.
        y: f64,
        /// Third coordinate.
        z: f64,
    },
    /// The header promises more than the file can hold.
    #[error(
        "{}: the header promises {promised} {what}, but a file of {file_bytes} bytes holds at most {at_most}; the file is cut short or damaged",
        path.display()
    )]
    TooMany {
        /// The file.
        path: PathBuf,
        /// Points, triangles, chunks …
        what: &'static str,
        /// Number in the header.
        promised: u64,
        /// Most the file's size allows.
        at_most: u64,
        /// Size of the file.
        file_bytes: u64,
    },
    /// A valid file of a kind that is not supported.
    #[error("{}: {what}", path.display())]
    Unsupported {
        /// The file.
        path: PathBuf,
        /// What is not supported and what to use instead.
        what: String,
    },
    /// The extension says nothing.
    #[error("{}: the extension is none of {known}; rename the file to what it is", path.display())]
    UnknownExtension {
        /// The file.
        path: PathBuf,
        /// Extensions that are known here.
        known: &'static str,
    },
    /// A column is missing.
    #[error("{}: there is no column `{column}`; the file has {found}", path.display())]
    MissingColumn {
        /// The file.
        path: PathBuf,
        /// The column.
        column: &'static str,
        /// Columns found.
        found: String,
    },
    /// Several things that are wrong, one a line.
    #[error("{}", lines(all))]
    Several {
        /// Each of them.
        all: Vec<IoError>,
    },
    /// A path in a site file that leaves its folder.
    #[error(
        "{}: `{key}` = \"{}\" leaves the site folder; copy the file into the folder and give its name there",
        path.display(), target.display()
    )]
    Outside {
        /// The TOML file.
        path: PathBuf,
        /// The key.
        key: String,
        /// What it names.
        target: PathBuf,
    },
}

/// Where in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// Nowhere in particular.
    File,
    /// A line, from 1.
    Line(u64),
    /// A point, triangle or other record, from 1.
    Record(u64),
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::File => Ok(()),
            Self::Line(n) => write!(f, ", line {n}"),
            Self::Record(n) => write!(f, ", record {n}"),
        }
    }
}

fn lines(all: &[IoError]) -> String {
    all.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n")
}

fn advice(source: &io::Error) -> &'static str {
    match source.kind() {
        io::ErrorKind::NotFound => "; check the spelling of the path",
        io::ErrorKind::PermissionDenied | io::ErrorKind::ReadOnlyFilesystem => {
            "; choose a folder you may use, or change its permissions"
        }
        io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => {
            "; nothing was left behind: free some space and run again"
        }
        _ => "",
    }
}

impl IoError {
    /// One error as it is, several as one.
    pub fn of_several(mut all: Vec<Self>) -> Self {
        match all.len() {
            1 => all.remove(0),
            _ => Self::Several { all },
        }
    }

    /// Each thing that is wrong.
    pub fn each(&self) -> Vec<&Self> {
        match self {
            Self::Several { all } => all.iter().flat_map(Self::each).collect(),
            one => vec![one],
        }
    }

    /// The system refused to read.
    pub(crate) fn read(path: &Path, source: io::Error) -> Self {
        Self::Os { path: path.into(), doing: "read", source }
    }

    /// The system refused to write.
    pub(crate) fn write(path: &Path, source: io::Error) -> Self {
        Self::Os { path: path.into(), doing: "write", source }
    }

    /// Broken content at a place. What the file says is quoted on one line and not at any length.
    pub(crate) fn malformed(path: &Path, at: Place, what: impl Into<String>) -> Self {
        let what: String = what.into();
        let mut quoted: String =
            what.chars().map(|c| if c.is_control() { ' ' } else { c }).take(400).collect();
        if quoted.len() < what.len() {
            quoted.push('…');
        }
        Self::Malformed { path: path.into(), at, what: quoted }
    }

    /// A valid file that is not supported.
    pub(crate) fn unsupported(path: &Path, what: impl Into<String>) -> Self {
        Self::Unsupported { path: path.into(), what: what.into() }
    }
}
