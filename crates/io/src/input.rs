//! An opened file (or bytes in memory) with its name and size: what every reader reads from.

use crate::{IoError, Place};
use encoding_rs::{Encoding, UTF_8};
use std::fs::File;
use std::io::{self, BufRead, BufReader, Cursor, Read, Seek, SeekFrom};
use std::path::Path;

/// Opens a file that must be one: opening a pipe would wait for whoever writes into it, a device may never end.
/// Returns it with its size, bytes.
pub fn open_regular(path: &Path) -> Result<(File, u64), IoError> {
    let open = || {
        // Before opening, for a pipe blocks in `open`; after it, for the name may have been exchanged in between.
        regular(&std::fs::metadata(path)?)?;
        let file = File::open(path)?;
        let meta = file.metadata()?;
        regular(&meta)?;
        Ok((file, meta.len()))
    };
    open().map_err(|e| IoError::read(path, e))
}

/// Content of a file that must be one and hold at most `limit` bytes.
pub fn read_bytes(path: &Path, limit: u64) -> Result<Vec<u8>, IoError> {
    let (file, len) = open_regular(path)?;
    let too_long = |len| {
        let what = format!("{len} bytes are too many for such a file (limit {limit})");
        IoError::malformed(path, Place::File, what)
    };
    if len > limit {
        return Err(too_long(len));
    }
    let mut bytes = Vec::with_capacity(len as usize);
    file.take(limit + 1).read_to_end(&mut bytes).map_err(|e| IoError::read(path, e))?;
    if bytes.len() as u64 > limit { Err(too_long(bytes.len() as u64)) } else { Ok(bytes) }
}

/// Text of a file that must be one, be UTF-8, and hold at most `limit` bytes.
pub fn read_text(path: &Path, limit: u64) -> Result<String, IoError> {
    String::from_utf8(read_bytes(path, limit)?).map_err(|_| {
        let what = "the file is not UTF-8 text; save it as UTF-8";
        IoError::malformed(path, Place::File, what)
    })
}

fn regular(meta: &std::fs::Metadata) -> io::Result<()> {
    if meta.is_dir() {
        return Err(io::Error::new(
            io::ErrorKind::IsADirectory,
            "it is a folder, a file is needed",
        ));
    }
    if !meta.is_file() {
        return Err(io::Error::new(
            io::ErrorKind::InvalidInput,
            "it is a pipe or a device; write it to an ordinary file first",
        ));
    }
    Ok(())
}

trait ReadSeek: Read + Seek + Send {}
impl<T: Read + Seek + Send> ReadSeek for T {}

/// Bytes with a name for messages and a known length, against which every promise of a header is checked.
pub struct Input<'a> {
    /// The file's path, or a name for messages.
    pub path: &'a Path,
    /// Size, bytes.
    pub len: u64,
    reader: BufReader<Box<dyn ReadSeek + 'a>>,
}

impl<'a> Input<'a> {
    /// Opens a file.
    pub fn open(path: &'a Path) -> Result<Self, IoError> {
        let (file, len) = open_regular(path)?;
        Ok(Self { path, len, reader: BufReader::with_capacity(1 << 16, Box::new(file)) })
    }

    /// Reads from memory; `name` appears in messages.
    pub fn of_bytes(name: &'a Path, bytes: &'a [u8]) -> Self {
        let reader: Box<dyn ReadSeek + 'a> = Box::new(Cursor::new(bytes));
        Self { path: name, len: bytes.len() as u64, reader: BufReader::new(reader) }
    }

    /// Broken content at a place of this file.
    pub(crate) fn malformed(&self, at: Place, what: impl Into<String>) -> IoError {
        IoError::malformed(self.path, at, what)
    }

    /// Fills the buffer, or says which part of the file is missing.
    pub(crate) fn fill(&mut self, buffer: &mut [u8], part: &str) -> Result<(), IoError> {
        self.reader.read_exact(buffer).map_err(|e| match e.kind() {
            io::ErrorKind::UnexpectedEof => {
                let what = format!("the file ends inside {part}; it is cut short");
                IoError::malformed(self.path, Place::File, what)
            }
            _ => IoError::read(self.path, e),
        })
    }

    /// The next `count` bytes; never allocates more than the file has left.
    pub(crate) fn take(&mut self, count: u64, part: &str) -> Result<Vec<u8>, IoError> {
        let left = self.len.saturating_sub(self.position()?);
        if count > left {
            let what = format!(
                "{part} needs {count} bytes, but only {left} are left; the file is cut short or damaged"
            );
            return Err(self.malformed(Place::File, what));
        }
        let mut bytes = vec![0; count as usize];
        self.fill(&mut bytes, part)?;
        Ok(bytes)
    }

    /// Goes to a byte of the file, or says that it lies outside.
    pub(crate) fn go_to(&mut self, byte: u64, part: &str) -> Result<(), IoError> {
        if byte > self.len {
            let what =
                format!("{part} should be at byte {byte}, but the file ends at {}", self.len);
            return Err(self.malformed(Place::File, what));
        }
        self.reader.seek(SeekFrom::Start(byte)).map_err(|e| IoError::read(self.path, e))?;
        Ok(())
    }

    /// The byte that comes next.
    pub(crate) fn position(&mut self) -> Result<u64, IoError> {
        self.reader.stream_position().map_err(|e| IoError::read(self.path, e))
    }

    /// One line without its end, at most `limit` bytes; `None` at the end of the file.
    pub(crate) fn line(
        &mut self,
        buffer: &mut Vec<u8>,
        line: u64,
        limit: u64,
    ) -> Result<bool, IoError> {
        buffer.clear();
        let read = self
            .reader
            .by_ref()
            .take(limit)
            .read_until(b'\n', buffer)
            .map_err(|e| IoError::read(self.path, e))?;
        if buffer.last() != Some(&b'\n') && read as u64 == limit {
            let what = format!(
                "the line is longer than {limit} bytes; this is not a text file of the expected kind"
            );
            return Err(self.malformed(Place::Line(line), what));
        }
        while matches!(buffer.last(), Some(b'\n' | b'\r')) {
            buffer.pop();
        }
        Ok(read > 0)
    }

    /// Everything from here to the end as text; refuses more than `limit` bytes.
    pub(crate) fn text(&mut self, limit: u64) -> Result<String, IoError> {
        if self.len > limit {
            let what = format!("{} bytes are too many for such a file (limit {limit})", self.len);
            return Err(self.malformed(Place::File, what));
        }
        let mut bytes = Vec::new();
        self.reader.read_to_end(&mut bytes).map_err(|e| IoError::read(self.path, e))?;
        let refused = |encoding: &'static Encoding| {
            let what = format!("the file is not {} text; save it as UTF-8", encoding.name());
            self.malformed(Place::File, what)
        };
        let encoding = encoding_of(&bytes);
        if encoding == UTF_8 && !bytes.starts_with(b"\xef\xbb\xbf") {
            return String::from_utf8(bytes).map_err(|_| refused(UTF_8));
        }
        let (text, _, faults) = encoding.decode(&bytes);
        if faults { Err(refused(encoding)) } else { Ok(text.into_owned()) }
    }
}

impl Read for Input<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.reader.read(buffer)
    }
}

impl Seek for Input<'_> {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.reader.seek(to)
    }
}

/// The encoding of a text by its mark, or by what an XML declaration in its first line names; else UTF-8.
fn encoding_of(bytes: &[u8]) -> &'static Encoding {
    if let Some((encoding, _)) = Encoding::for_bom(bytes) {
        return encoding;
    }
    let head = &bytes[..bytes.len().min(200)];
    let declared = head.starts_with(b"<?xml").then(|| {
        let text = String::from_utf8_lossy(head);
        let rest = text.split_once("encoding=")?.1;
        let mark = rest.chars().next().filter(|c| matches!(c, '"' | '\''))?;
        let word = rest[1..].split(mark).next()?;
        Encoding::for_label(word.trim().as_bytes())
    });
    declared.flatten().unwrap_or(UTF_8)
}
