//! Reads points in batches: raw records → coordinates and labels.

use super::chunks::{self, Chunk, Points};
use super::header::{self, Header, LasSummary};
use crate::input::Input;
use crate::ply::{label, not_a_label};
use crate::raw_cloud::RawCloud;
use crate::{IoError, Place};
use geom::DVec3;
use rayon::prelude::*;

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
    let header = header::read(input)?;
    match &header.laz {
        None => stream_plain(input, &header, sink)?,
        Some(vlr) => {
            let chunks = chunks::table(input, &header, vlr)?;
            stream_chunks(input, &header, &chunks, sink)?;
        }
    }
    let LasSummary { crs, crs_wkt, .. } = header.summary;
    Ok(RawCloud { crs, crs_wkt, ..RawCloud::default() })
}

fn stream_plain(
    input: &mut Input,
    header: &Header,
    sink: &mut dyn FnMut(RawCloud) -> Result<(), IoError>,
) -> Result<(), IoError> {
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
    input.go_to(header.data_at, "the points")?;
    let mut done = 0;
    while done < total {
        let count = batch_points(header).min(total - done);
        let bytes = input.take(count * record, "the points")?;
        sink(decode(input, header, &bytes, done)?)?;
        done += count;
    }
    Ok(())
}

/// Chunk by chunk, as many at a time as there are threads; a chunk too large for that in pieces.
pub(super) fn stream_chunks(
    input: &mut Input,
    header: &Header,
    chunks: &[Chunk],
    sink: &mut dyn FnMut(RawCloud) -> Result<(), IoError>,
) -> Result<(), IoError> {
    let vlr = header.laz.as_ref().expect("only compressed files have chunks");
    let record = u64::from(header.summary.record_bytes);
    let together = rayon::current_num_threads().max(1) * 2;
    let damaged =
        |input: &Input, done: u64, what: String| input.malformed(Place::Record(done + 1), what);
    let (mut done, mut next) = (0, 0);
    while next < chunks.len() {
        let group: Vec<&Chunk> = chunks[next..]
            .iter()
            .take(together)
            .take_while(|c| c.points * record <= BATCH_BYTES)
            .collect();
        if group.is_empty() {
            let bytes = chunks::load(input, &chunks[next])?;
            let mut points = Points::new(&bytes, chunks[next].points, vlr)
                .map_err(|e| damaged(input, done, e))?;
            loop {
                let records =
                    points.next(batch_points(header)).map_err(|e| damaged(input, done, e))?;
                if records.is_empty() {
                    break;
                }
                let batch = decode(input, header, &records, done)?;
                done += batch.len() as u64;
                sink(batch)?;
            }
            next += 1;
            continue;
        }
        next += group.len();
        let mut loaded = Vec::with_capacity(group.len());
        let mut first = done;
        for chunk in group {
            loaded.push((first, chunk.points, chunks::load(input, chunk)?));
            first += chunk.points;
        }
        let path = input.path;
        let batches: Vec<Result<RawCloud, IoError>> = loaded
            .into_par_iter()
            .map(|(first, points, bytes)| {
                let fail = |what: String| IoError::malformed(path, Place::Record(first + 1), what);
                let records = Points::new(&bytes, points, vlr)
                    .and_then(|mut p| p.next(points))
                    .map_err(fail)?;
                decode_records(path, header, &records, first)
            })
            .collect();
        for batch in batches {
            let batch = batch?;
            done += batch.len() as u64;
            sink(batch)?;
        }
    }
    Ok(())
}

fn batch_points(header: &Header) -> u64 {
    BATCH.min(BATCH_BYTES / u64::from(header.summary.record_bytes))
}

fn decode(input: &Input, header: &Header, records: &[u8], first: u64) -> Result<RawCloud, IoError> {
    decode_records(input.path, header, records, first)
}

fn decode_records(
    path: &std::path::Path,
    header: &Header,
    records: &[u8],
    first: u64,
) -> Result<RawCloud, IoError> {
    let LasSummary { scale, offset, record_bytes, .. } = header.summary;
    let size = usize::from(record_bytes);
    let count = records.len() / size;
    let coordinate = |r: &[u8], at: usize| f64::from(header::u32_at(r, at) as i32);
    let mut batch = RawCloud::default();
    batch.position.reserve_exact(count);
    let of = |r: &[u8]| {
        DVec3::new(coordinate(r, 0), coordinate(r, 4), coordinate(r, 8)) * scale + offset
    };
    batch.position.extend(records.chunks_exact(size).map(of));
    if let Some(i) = batch.position.iter().position(|p| !p.is_finite()) {
        let (p, at) = (batch.position[i], Place::Record(first + i as u64 + 1));
        return Err(IoError::NotFinite { path: path.into(), at, x: p.x, y: p.y, z: p.z });
    }
    // Every format has the point source id after the scan angle, which takes two bytes from format 6 on.
    let source_at = if header.summary.format < 6 { 18 } else { 20 };
    batch.line = Some(records.chunks_exact(size).map(|r| header::u16_at(r, source_at)).collect());
    let [instance, model, confidence] = header.extra.present();
    if !(instance || model || confidence) {
        return Ok(batch);
    }
    let (mut ids, mut models, mut sure) = (Vec::new(), Vec::new(), Vec::new());
    for (i, record) in records.chunks_exact(size).enumerate() {
        let [id, kind, trust] = header.extra.values(record);
        let fail = |name: &str, v: f64| {
            IoError::malformed(path, Place::Record(first + i as u64 + 1), not_a_label(name, v))
        };
        if instance {
            ids.push(label(id, u32::MAX).ok_or_else(|| fail("instance", id))?);
        }
        if model {
            models.push(label(kind, u16::MAX.into()).ok_or_else(|| fail("model", kind))? as u16);
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
