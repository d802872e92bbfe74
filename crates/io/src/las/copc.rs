//! COPC (cloud-optimised LAZ): an octree of chunks, of which only those that touch a box are decompressed.

use super::chunks::{self, Chunk};
use super::header::{self, f64_at, u64_at};
use super::read::{decode_records, meta, stream_records, wanted};
use crate::input::Input;
use crate::raw_cloud::RawCloud;
use crate::read_options::{LeftOut, ReadOptions};
use crate::{IoError, Place};
use geom::DVec3;
use std::collections::{BTreeMap, BTreeSet};

const ENTRY: u64 = 32;

/// Whether the file has an octree.
pub fn is_copc(input: &mut Input) -> Result<bool, IoError> {
    input.go_to(0, "the header")?;
    Ok(header::read(input)?.copc_info.is_some_and(|info| info.len() >= 160))
}

/// Points inside the box (`low` to `high`, the file's coordinates), from the chunks that touch it.
pub fn stream_box(
    input: &mut Input,
    low: DVec3,
    high: DVec3,
    sink: &mut dyn FnMut(RawCloud) -> Result<(), IoError>,
) -> Result<RawCloud, IoError> {
    stream_box_with(input, low, high, &ReadOptions::default(), sink)
}

/// The same with options.
pub fn stream_box_with(
    input: &mut Input,
    low: DVec3,
    high: DVec3,
    options: &ReadOptions,
    sink: &mut dyn FnMut(RawCloud) -> Result<(), IoError>,
) -> Result<RawCloud, IoError> {
    input.go_to(0, "the header")?;
    let header = header::read(input)?;
    let (Some(info), Some(_)) = (header.copc_info.as_ref().filter(|i| i.len() >= 160), &header.laz)
    else {
        return Err(IoError::unsupported(input.path, "the file has no COPC octree"));
    };
    let octree = Octree {
        corner: DVec3::new(f64_at(info, 0), f64_at(info, 8), f64_at(info, 16)) - f64_at(info, 24),
        edge: 2.0 * f64_at(info, 24),
    };
    let chunks = octree.chunks(input, &header, [u64_at(info, 40), u64_at(info, 48)], low, high)?;
    let firsts = first_records(input, &header, &chunks)?;
    let mut left_out = LeftOut::new();
    let path = input.path;
    let decode = |raw: &[u8], first: u64| decode_records(path, &header, raw, first, options);
    let listed = Some((chunks.as_slice(), firsts.as_slice()));
    let wanted = wanted(&header, options);
    stream_records(input, &header, listed, wanted, &decode, &mut |batch: RawCloud| {
        for (reason, n) in &batch.left_out {
            *left_out.entry(*reason).or_default() += n;
        }
        let inside = |p: &DVec3| p.cmpge(low).all() && p.cmple(high).all();
        let index: Vec<usize> = (0..batch.len()).filter(|&i| inside(&batch.position[i])).collect();
        if index.is_empty() { Ok(()) } else { sink(batch.select(&index)) }
    })?;
    Ok(RawCloud { left_out, ..meta(header.summary) })
}

/// Number of the first point of each of these chunks among all points of the file: chunks lie in the file in the order
/// of its points.
fn first_records(
    input: &mut Input,
    header: &header::Header,
    chunks: &[Chunk],
) -> Result<Vec<u64>, IoError> {
    let vlr = header.laz.as_ref().expect("only compressed files have an octree");
    let (mut first, mut by_place) = (0, BTreeMap::new());
    for chunk in chunks::table(input, header, vlr)? {
        by_place.insert(chunk.at, first);
        first += chunk.points;
    }
    let of = |c: &Chunk| by_place.get(&c.at).copied();
    let all: Option<Vec<u64>> = chunks.iter().map(of).collect();
    all.ok_or_else(|| input.malformed(Place::File, "the octree and the table of chunks disagree"))
}

struct Octree {
    corner: DVec3,
    edge: f64,
}

impl Octree {
    fn touches(&self, key: [i32; 4], low: DVec3, high: DVec3) -> bool {
        let edge = self.edge / 2_f64.powi(key[0]);
        let corner = self.corner + DVec3::new(key[1].into(), key[2].into(), key[3].into()) * edge;
        // Integer coordinates may stick out of their cube by a step.
        let margin = edge * 1e-6;
        corner.cmple(high + margin).all() && (corner + edge).cmpge(low - margin).all()
    }

    /// Walks the pages of the hierarchy; chunks in file order.
    fn chunks(
        &self,
        input: &mut Input,
        header: &header::Header,
        root: [u64; 2],
        low: DVec3,
        high: DVec3,
    ) -> Result<Vec<Chunk>, IoError> {
        let record = u64::from(header.summary.record_bytes);
        let (mut open, mut seen, mut chunks) = (vec![root], BTreeSet::new(), Vec::new());
        let mut left =
            header.summary.points.min(input.len.saturating_mul(2).saturating_add(250_000));
        while let Some([at, bytes]) = open.pop() {
            if !seen.insert(at) {
                return Err(input.malformed(Place::File, "the octree's pages go in a circle"));
            }
            input.go_to(at, "a page of the octree")?;
            let page = input.take(bytes, "a page of the octree")?;
            for e in page.chunks_exact(ENTRY as usize) {
                let int =
                    |at: usize| i32::from_le_bytes(e[at..at + 4].try_into().expect("four bytes"));
                let (key, offset) = ([int(0), int(4), int(8), int(12)], u64_at(e, 16));
                let (Ok(bytes), points) = (u64::try_from(int(24)), int(28)) else {
                    return Err(input.malformed(Place::File, "the octree is damaged"));
                };
                if !(0..=31).contains(&key[0]) || !self.touches(key, low, high) {
                    continue;
                }
                if points == -1 {
                    open.push([offset, bytes]);
                } else if points > 0 {
                    let points = points as u64;
                    if points > left || bytes < record || offset.saturating_add(bytes) > input.len {
                        return Err(
                            input.malformed(Place::File, "the octree does not fit the file")
                        );
                    }
                    left -= points;
                    chunks.push(Chunk { at: offset, bytes, points });
                }
            }
        }
        chunks.sort_by_key(|c| c.at);
        Ok(chunks)
    }
}
