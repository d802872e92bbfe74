//! The chunks of a LAZ file: where each starts, how many points it has, and their decompression.
//!
//! A chunk is independent of the others, so that they are decompressed in parallel and in bounded memory;
//! what the decoder would trust (sizes of chunks and layers) is checked here first.

use super::header::{self, Header, u32_at};
use crate::input::Input;
use crate::{IoError, Place};
use laz::LazVlr;
use laz::las::selective::DecompressionSelection;
use laz::laszip::{ChunkTable, CompressorType};
use laz::record::{
    LayeredPointRecordDecompressor, RecordDecompressor, SequentialPointRecordDecompressor,
};
use std::io::{self, Cursor, Read, Seek, SeekFrom};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

/// One chunk: place in the file and points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Chunk {
    pub at: u64,
    pub bytes: u64,
    pub points: u64,
}

/// Points that a byte of compressed data may hold. Surveys need 2 to 8 bytes a point; a file beyond this limit
/// is made to fill memory.
const POINTS_PER_BYTE: u64 = 2;
/// Small files may hold this many points whatever their size.
const FREE_POINTS: u64 = 250_000;

/// Every chunk of the file in order; their points add up to the header's.
pub(super) fn table(
    input: &mut Input,
    header: &Header,
    vlr: &LazVlr,
) -> Result<Vec<Chunk>, IoError> {
    let total = header.summary.points;
    let at_most =
        (input.len - header.data_at).saturating_mul(POINTS_PER_BYTE).saturating_add(FREE_POINTS);
    if total > at_most {
        let (path, file_bytes) = (input.path.into(), input.len);
        return Err(IoError::TooMany {
            path,
            what: "points",
            promised: total,
            at_most,
            file_bytes,
        });
    }
    if is_one_chunk(vlr) {
        return Ok(vec![Chunk {
            at: header.data_at,
            bytes: input.len - header.data_at,
            points: total,
        }]);
    }
    let damaged = |input: &Input, what: String| {
        input.malformed(
            Place::File,
            format!("{what}; the file is cut short or damaged: write it again with the program it came from"),
        )
    };
    input.go_to(header.data_at, "the chunk table's address")?;
    let first = header.data_at + 8;
    let mut table_at = address(input)?;
    if table_at < first {
        // A writer that could not seek leaves the address at the very end.
        input.go_to(input.len.saturating_sub(8), "the chunk table's address")?;
        table_at = address(input)?;
    }
    if table_at < first || table_at > input.len.saturating_sub(8) {
        return Err(damaged(input, "the table of chunks is missing".into()));
    }
    input.go_to(table_at + 4, "the chunk table")?;
    let mut count = [0; 4];
    input.fill(&mut count, "the chunk table")?;
    let count = u64::from(u32::from_le_bytes(count));
    // Every chunk holds at least one whole record.
    let at_most = (table_at - first) / u64::from(header.summary.record_bytes);
    if count > at_most {
        let (path, file_bytes) = (input.path.into(), input.len);
        return Err(IoError::TooMany {
            path,
            what: "chunks",
            promised: count,
            at_most,
            file_bytes,
        });
    }
    input.go_to(table_at, "the chunk table")?;
    let variable = vlr.uses_variable_size_chunks();
    let entries = ChunkTable::read(input, variable)
        .map_err(|e| damaged(input, format!("the table of chunks cannot be read ({e})")))?;
    let (mut chunks, mut at, mut left) = (Vec::with_capacity(count as usize), first, total);
    for entry in &entries {
        let points = if variable { entry.point_count } else { left.min(vlr.chunk_size().into()) };
        if points > left || entry.byte_count > table_at - at {
            return Err(damaged(input, "the table of chunks does not fit the points".into()));
        }
        chunks.push(Chunk { at, bytes: entry.byte_count, points });
        at += entry.byte_count;
        left -= points;
    }
    if left > 0 {
        return Err(damaged(input, format!("the chunks hold {} of {total} points", total - left)));
    }
    Ok(chunks)
}

/// The first compression, without chunks.
fn is_one_chunk(vlr: &LazVlr) -> bool {
    // The compressor's type has no getter; it is the first number of the record.
    let mut raw = Vec::new();
    vlr.write_to(&mut raw).expect("memory takes every byte");
    raw.first() == Some(&(CompressorType::PointWise as u8))
}

fn address(input: &mut Input) -> Result<u64, IoError> {
    let mut raw = [0; 8];
    input.fill(&mut raw, "the chunk table's address")?;
    Ok(u64::try_from(i64::from_le_bytes(raw)).unwrap_or(0))
}

/// Stack that decompression may fill. A point needs a few kilobytes; damaged GPS times (formats before 6) have the decoder call itself
/// without end.
const MOST_STACK_BYTES: usize = 128 * 1024;

/// Compressed bytes that are not handed out to a decoder that has called itself too often: an overflow of the stack could not be caught.
/// Each byte lets it call itself about three times as often as before, so that asking at every byte is in time; only a file made to train
/// the decoder first could go farther between two bytes.
struct Watched<'a> {
    bytes: Cursor<&'a [u8]>,
    /// Address on the stack from which decompression was begun.
    begun: Arc<AtomicUsize>,
}

impl Watched<'_> {
    fn stack_holds(&self) -> io::Result<()> {
        if stack_address().abs_diff(self.begun.load(Ordering::Relaxed)) > MOST_STACK_BYTES {
            return Err(io::Error::other("GPS times without end"));
        }
        Ok(())
    }
}

impl Read for Watched<'_> {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        self.stack_holds()?;
        self.bytes.read(out)
    }

    fn read_exact(&mut self, out: &mut [u8]) -> io::Result<()> {
        self.stack_holds()?;
        self.bytes.read_exact(out)
    }
}

impl Seek for Watched<'_> {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.bytes.seek(to)
    }
}

/// Where the stack has come to.
fn stack_address() -> usize {
    let here = 0_u8;
    std::ptr::from_ref(&here).addr()
}

type Decoder<'a> = Box<dyn RecordDecompressor<Watched<'a>> + Send + Sync + 'a>;

/// Decompresses the points of one chunk, some at a time.
pub(super) struct Points<'a> {
    decoder: Decoder<'a>,
    begun: Arc<AtomicUsize>,
    record_bytes: usize,
    left: u64,
}

impl<'a> Points<'a> {
    /// Starts a chunk of which the `wanted` fields are decompressed (all of them in formats before 6); `Err` says what is wrong with it.
    pub fn new(
        bytes: &'a [u8],
        points: u64,
        vlr: &LazVlr,
        wanted: DecompressionSelection,
    ) -> Result<Self, String> {
        let record_bytes = vlr.items_size() as usize;
        let layers = header::layers(vlr);
        if layers > 0 && points > 0 {
            check_layers(bytes, record_bytes, layers)?;
        }
        let begun = Arc::new(AtomicUsize::new(stack_address()));
        let source = Watched { bytes: Cursor::new(bytes), begun: Arc::clone(&begun) };
        let mut decoder: Decoder = if layers > 0 {
            Box::new(LayeredPointRecordDecompressor::new(source))
        } else {
            Box::new(SequentialPointRecordDecompressor::new(source))
        };
        decoder.set_fields_from(vlr.items()).map_err(|e| e.to_string())?;
        decoder.set_selection(wanted);
        Ok(Self { decoder, begun, record_bytes, left: points })
    }

    /// Up to `most` raw records; empty at the end.
    pub fn next(&mut self, most: u64) -> Result<Vec<u8>, String> {
        let count = self.left.min(most);
        self.left -= count;
        let mut records = vec![0; count as usize * self.record_bytes];
        self.begun.store(stack_address(), Ordering::Relaxed);
        // The decoder indexes tables by decoded symbols; damaged data must end here, not end the program.
        let decoded = catch_unwind(AssertUnwindSafe(|| {
            records
                .chunks_exact_mut(self.record_bytes)
                .try_for_each(|r| self.decoder.decompress_next(r))
        }));
        match decoded {
            Ok(Ok(())) => Ok(records),
            Ok(Err(e)) => Err(format!("the compressed points are damaged ({e})")),
            Err(_) => Err("the compressed points are damaged".into()),
        }
    }
}

/// A layered chunk is the first record, a count and the sizes of its layers, then the layers: they must fill it.
fn check_layers(bytes: &[u8], record_bytes: usize, layers: usize) -> Result<(), String> {
    let head = record_bytes + 4 + 4 * layers;
    if bytes.len() < head {
        return Err("the compressed points are cut short".into());
    }
    let sizes = (0..layers).map(|i| u64::from(u32_at(bytes, record_bytes + 4 + 4 * i)));
    if sizes.sum::<u64>() > (bytes.len() - head) as u64 {
        return Err("the layers of the compressed points are larger than their chunk".into());
    }
    Ok(())
}

/// The compressed bytes of a chunk.
pub(super) fn load(input: &mut Input, chunk: &Chunk) -> Result<Vec<u8>, IoError> {
    input.go_to(chunk.at, "a chunk of points")?;
    input.take(chunk.bytes, "a chunk of points")
}
