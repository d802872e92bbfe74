//! Reads points in batches: raw records → coordinates and labels.

use super::chunks::{self, Chunk, Points};
use super::header::{self, Header, LasSummary};
use crate::input::Input;
use crate::ply::{instance_number, label, not_a_label};
use crate::raw_cloud::RawCloud;
use crate::read_options::{LeftOut, OVERLAP, ReadOptions};
use crate::{IoError, Place};
use geom::DVec3;
use laz::las::selective::DecompressionSelection;
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Points handed on at once, when they are not long.
const BATCH: u64 = 65_536;
/// Raw records held at once by a thread: a record may be 64 kB long.
const BATCH_BYTES: u64 = 4 << 20;

/// The header alone.
pub fn summary(input: &mut Input) -> Result<LasSummary, IoError> {
    header::read(input).map(|h| h.summary)
}

/// Hands the points on in batches; what comes back has everything but the points.
pub fn stream(
    input: &mut Input,
    sink: &mut dyn FnMut(RawCloud) -> Result<(), IoError>,
) -> Result<RawCloud, IoError> {
    stream_with(input, &ReadOptions::default(), sink)
}

/// The same with options.
pub fn stream_with(
    input: &mut Input,
    options: &ReadOptions,
    sink: &mut dyn FnMut(RawCloud) -> Result<(), IoError>,
) -> Result<RawCloud, IoError> {
    let header = header::read(input)?;
    let (mut left_out, mut classes) = (LeftOut::new(), BTreeMap::new());
    let mut counting = |batch: RawCloud| {
        for (reason, n) in &batch.left_out {
            *left_out.entry(*reason).or_default() += n;
        }
        for (class, n) in &batch.classes {
            *classes.entry(*class).or_default() += n;
        }
        if batch.is_empty() { Ok(()) } else { sink(batch) }
    };
    let path = input.path;
    let decode = |raw: &[u8], first: u64| decode_records(path, &header, raw, first, options);
    let wanted = wanted(&header, options);
    match &header.laz {
        None => stream_records(input, &header, None, wanted, &decode, &mut counting)?,
        Some(vlr) => {
            let chunks = chunks::table(input, &header, vlr)?;
            let firsts = first_of_each(&chunks);
            let chunks = Some((&chunks[..], &firsts[..]));
            stream_records(input, &header, chunks, wanted, &decode, &mut counting)?;
        }
    }
    Ok(RawCloud { left_out, classes, ..meta(header.summary) })
}

/// What is read of a record: the place, its marks and line, and labels where they are asked for.
pub(super) fn wanted(header: &Header, options: &ReadOptions) -> DecompressionSelection {
    let own = DecompressionSelection::base()
        .decompress_z()
        .decompress_classification()
        .decompress_flags()
        .decompress_point_source_id();
    let labels = options.labels && header.extra.present().contains(&true);
    if labels { own.decompress_extra_bytes() } else { own }
}

/// Number of the first point of each chunk.
pub(super) fn first_of_each(chunks: &[Chunk]) -> Vec<u64> {
    let of = |first: &mut u64, c: &Chunk| {
        *first += c.points;
        Some(*first - c.points)
    };
    chunks.iter().scan(0, of).collect()
}

/// A cloud without points that says what the header says.
pub(super) fn meta(summary: LasSummary) -> RawCloud {
    let LasSummary { reference, crs, crs_wkt, .. } = summary;
    RawCloud { reference, crs, crs_wkt, ..RawCloud::default() }
}

/// Takes raw records and the number of the first to something else, on any thread.
pub(super) type Decode<'a, T> = dyn Fn(&[u8], u64) -> Result<T, IoError> + Sync + 'a;

/// Raw records, of which the `wanted` fields hold, through `decode` into `sink`, in order: those of the chunks (with the number of
/// the first point of each), or of a file without.
pub(super) fn stream_records<T: Send>(
    input: &mut Input,
    header: &Header,
    chunks: Option<(&[Chunk], &[u64])>,
    wanted: DecompressionSelection,
    decode: &Decode<T>,
    sink: &mut dyn FnMut(T) -> Result<(), IoError>,
) -> Result<(), IoError> {
    match chunks {
        None => stream_plain(input, header, decode, sink),
        Some((chunks, firsts)) => {
            stream_chunks(input, header, (chunks, firsts), wanted, decode, sink)
        }
    }
}

/// The header's number of points must fit a file that is not compressed.
pub(super) fn check_plain_count(input: &Input, header: &Header) -> Result<(), IoError> {
    let (total, record) = (header.summary.points, u64::from(header.summary.record_bytes));
    let at_most = (input.len - header.data_at) / record;
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
    Ok(())
}

fn stream_plain<T>(
    input: &mut Input,
    header: &Header,
    decode: &Decode<T>,
    sink: &mut dyn FnMut(T) -> Result<(), IoError>,
) -> Result<(), IoError> {
    check_plain_count(input, header)?;
    let (total, record) = (header.summary.points, u64::from(header.summary.record_bytes));
    input.go_to(header.data_at, "the points")?;
    let mut done = 0;
    while done < total {
        let count = batch_points(header).min(total - done);
        let bytes = input.take(count * record, "the points")?;
        sink(decode(&bytes, done)?)?;
        done += count;
    }
    Ok(())
}

/// Chunk by chunk, as many at a time as there are threads; a chunk too large for that in pieces.
fn stream_chunks<T: Send>(
    input: &mut Input,
    header: &Header,
    (chunks, firsts): (&[Chunk], &[u64]),
    wanted: DecompressionSelection,
    decode: &Decode<T>,
    sink: &mut dyn FnMut(T) -> Result<(), IoError>,
) -> Result<(), IoError> {
    let vlr = header.laz.as_ref().expect("only compressed files have chunks");
    let record = u64::from(header.summary.record_bytes);
    let together = rayon::current_num_threads().max(1) * 2;
    let path = input.path;
    let damaged =
        |first: u64, what: String| IoError::malformed(path, Place::Record(first + 1), what);
    let mut next = 0;
    while next < chunks.len() {
        let group: Vec<&Chunk> = chunks[next..]
            .iter()
            .take(together)
            .take_while(|c| c.points * record <= BATCH_BYTES)
            .collect();
        if group.is_empty() {
            let bytes = chunks::load(input, &chunks[next])?;
            let mut done = firsts[next];
            let mut points = Points::new(&bytes, chunks[next].points, vlr, wanted)
                .map_err(|what| damaged(done, what))?;
            loop {
                let records =
                    points.next(batch_points(header)).map_err(|what| damaged(done, what))?;
                if records.is_empty() {
                    break;
                }
                sink(decode(&records, done)?)?;
                done += records.len() as u64 / record;
            }
            next += 1;
            continue;
        }
        let mut loaded = Vec::with_capacity(group.len());
        for (chunk, first) in group.iter().zip(&firsts[next..]) {
            loaded.push((*first, chunk.points, chunks::load(input, chunk)?));
        }
        next += group.len();
        let batches: Vec<Result<T, IoError>> = loaded
            .into_par_iter()
            .map(|(first, points, bytes)| {
                let records = Points::new(&bytes, points, vlr, wanted)
                    .and_then(|mut p| p.next(points))
                    .map_err(|what| damaged(first, what))?;
                decode(&records, first)
            })
            .collect();
        for batch in batches {
            sink(batch?)?;
        }
    }
    Ok(())
}

fn batch_points(header: &Header) -> u64 {
    BATCH.min(BATCH_BYTES / u64::from(header.summary.record_bytes))
}

/// Class, and flags as LAS 1.4 has them, of a record.
#[inline]
fn marks(record: &[u8], format: u8) -> (u8, u8) {
    if format < 6 {
        // Flags above the class: synthetic, key point, withheld. Class 12 was "overlap".
        let (class, flags) = (record[15] & 0x1f, record[15] >> 5);
        (class, if class == 12 { flags | OVERLAP } else { flags })
    } else {
        (record[16], record[15] & 0x0f)
    }
}

pub(super) fn decode_records(
    path: &std::path::Path,
    header: &Header,
    records: &[u8],
    first: u64,
    options: &ReadOptions,
) -> Result<RawCloud, IoError> {
    let LasSummary { scale, offset, record_bytes, format, .. } = header.summary;
    let size = usize::from(record_bytes);
    let coordinate = |r: &[u8], at: usize| f64::from(header::u32_at(r, at) as i32);
    let mut batch = RawCloud::default();
    let mut kept = Vec::with_capacity(records.len() / size);
    let mut classes = [0_u64; 256];
    for (i, record) in records.chunks_exact(size).enumerate() {
        let (class, flags) = marks(record, format);
        classes[usize::from(class)] += 1;
        match options.leave_out.reason(class, flags) {
            Some(reason) => *batch.left_out.entry(reason).or_default() += 1,
            None => kept.push((i, record)),
        }
    }
    let met = (0..=255).zip(classes).filter(|(_, n)| *n > 0);
    batch.classes = met.collect();
    let of = |&(_, r): &(usize, &[u8])| {
        DVec3::new(coordinate(r, 0), coordinate(r, 4), coordinate(r, 8)) * scale + offset
    };
    batch.position = kept.iter().map(of).collect();
    let place = |i: usize| Place::Record(first + i as u64 + 1);
    if let Some(k) = batch.position.iter().position(|p| !p.is_finite()) {
        let (p, at) = (batch.position[k], place(kept[k].0));
        return Err(IoError::NotFinite { path: path.into(), at, x: p.x, y: p.y, z: p.z });
    }
    if first + (records.len() / size) as u64 <= u64::from(u32::MAX) {
        batch.record = Some(kept.iter().map(|(i, _)| first as u32 + *i as u32).collect());
    }
    // Every format has the point source id after the scan angle, which takes two bytes from format 6 on.
    let source_at = if format < 6 { 18 } else { 20 };
    batch.line = Some(kept.iter().map(|(_, r)| header::u16_at(r, source_at)).collect());
    let [instance, model, confidence] = header.extra.present();
    if !options.labels || !(instance || model || confidence) {
        return Ok(batch);
    }
    let (mut ids, mut models, mut sure) = (Vec::new(), Vec::new(), Vec::new());
    for (i, record) in kept {
        let [id, kind, trust] = header.extra.values(record);
        let fail = |name: &str, v: f64, largest: u32| {
            IoError::malformed(path, place(i), not_a_label(name, v, largest))
        };
        if instance {
            let number = instance_number(id, options.minus_one);
            ids.push(number.ok_or_else(|| fail("instance", id, u32::MAX))?);
        }
        if model {
            let largest = u16::MAX.into();
            let number = label(kind, largest).ok_or_else(|| fail("model", kind, largest))?;
            models.push(number as u16);
        }
        if confidence {
            sure.push(trust as f32);
        }
    }
    batch.instance = instance.then_some(ids);
    batch.model = model.then_some(models);
    batch.confidence = confidence.then_some(sure);
    Ok(batch)
}
