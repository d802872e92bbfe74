//! A LAS or LAZ file again with three dimensions more: header, records before and behind the points, and each point's own
//! record are kept.

use super::chunks;
use super::extra;
use super::header::{self, Header, RECORD_BYTES, f64_at, u16_at, u32_at, u64_at};
use super::read::{check_plain_count, first_of_each, stream_records};
use super::write::{LazWriter, vlr_record};
use crate::crs;
use crate::input::Input;
use crate::relabel::{ByRecord, PointLabels, Records, SiteFromFile};
use crate::{IoError, atomic};
use laz::las::selective::DecompressionSelection;
use std::io;
use std::ops::Range;
use std::path::Path;

const DIMENSIONS: [(&str, u8, &str); 3] = [
    ("instance", 5, "block number, 0 = none"),
    ("model", 3, "type of block, 0 = none"),
    ("confidence", 9, "of the label, 0 to 1"),
];
/// Bytes of the three.
const ADDED: usize = 10;

/// Writes `out` from `source` with these labels.
pub fn relabel(
    out: &Path,
    source: &Path,
    labels: &PointLabels,
    to_site: &SiteFromFile,
    records: Records,
) -> Result<(), IoError> {
    let mut input = Input::open(source)?;
    let header = header::read(&mut input)?;
    // Memory follows the number of points: it must be one that the file can hold.
    match &header.laz {
        Some(vlr) => drop(chunks::table(&mut input, &header, vlr)?),
        None => check_plain_count(&input, &header)?,
    }
    let by_record = ByRecord::new(labels, header.summary.points, records);
    let frame = Frame::of(&mut input, &header, to_site)?;
    let compressed = crate::mesh::extension(out) == "laz";
    let extra_bytes =
        frame.record_bytes - usize::from(RECORD_BYTES[usize::from(header.summary.format)]);
    let vlr = LazWriter::vlr(header.summary.format, extra_bytes)
        .map_err(|e| IoError::unsupported(out, e))?;
    let mut problem = None;
    let result = atomic::write(out, |file| {
        let (mut head, mut vlrs) = (frame.head.clone(), frame.vlrs.clone());
        if compressed {
            let mut data = Vec::new();
            vlr.write_to(&mut data)?;
            vlr_record(&mut vlrs, laz::LazVlr::USER_ID, laz::LazVlr::RECORD_ID, &data);
        }
        let count = vlrs.len() as u32;
        let vlrs = vlrs.concat();
        let data_at = head.len() + vlrs.len();
        head[96..100].copy_from_slice(&(data_at as u32).to_le_bytes());
        head[100..104].copy_from_slice(&count.to_le_bytes());
        head[104] = header.summary.format | if compressed { 0x80 } else { 0 };
        head[105..107].copy_from_slice(&(frame.record_bytes as u16).to_le_bytes());
        file.write_all(&head)?;
        file.write_all(&vlrs)?;
        let mut tally = Tally::default();
        let mut writer =
            LazWriter::new(compressed.then_some(&vlr), data_at as u64, frame.record_bytes);
        writer.begin(file)?;
        let fed = feed(&mut input, &header, &mut |first, raw| {
            let piece = frame.records(raw, first, &by_record, header.summary.format, &mut tally);
            writer.add(file, &piece).map_err(|e| IoError::write(out, e))
        });
        if let Err(error) = fed {
            problem = Some(error);
            return Err(io::Error::other("the survey could not be read again"));
        }
        writer.end(file)?;
        frame.finish(file, &mut head, &tally, records)
    });
    match problem {
        Some(error) => Err(error),
        None => result,
    }
}

/// Takes raw records, with the number of the first.
type Sink<'s> = dyn FnMut(u64, &[u8]) -> Result<(), IoError> + 's;

/// Raw records of the whole file in their order, with the number of the first.
fn feed(input: &mut Input, header: &Header, sink: &mut Sink) -> Result<(), IoError> {
    let chunks = match &header.laz {
        Some(vlr) => Some(chunks::table(input, header, vlr)?),
        None => None,
    };
    let firsts = chunks.as_deref().map(first_of_each);
    let whole = |raw: &[u8], first: u64| Ok((first, raw.to_vec()));
    let listed = chunks.as_deref().zip(firsts.as_deref());
    let all = DecompressionSelection::all();
    stream_records(input, header, listed, all, &whole, &mut |(first, raw)| sink(first, &raw))
}

/// Returns and box of what was written.
struct Tally {
    points: u64,
    returns: [u64; 15],
    low: [i32; 3],
    high: [i32; 3],
}

impl Default for Tally {
    fn default() -> Self {
        Self { points: 0, returns: [0; 15], low: [i32::MAX; 3], high: [i32::MIN; 3] }
    }
}

/// Everything of the file but its points, ready to be written.
struct Frame {
    head: Vec<u8>,
    vlrs: Vec<Vec<u8>>,
    /// Bytes of the old record that are kept: what earlier labels took is not.
    kept: Vec<Range<usize>>,
    record_bytes: usize,
    swap: bool,
    /// Heights change their sign.
    flip: bool,
    /// Extended records and waveforms behind the points.
    tail: Vec<u8>,
    /// Number of extended records in the tail (LAS 1.4).
    extended: u32,
    /// Where in the tail the waveforms begin.
    waveforms: Option<u64>,
    minor: u8,
}

impl Frame {
    fn of(input: &mut Input, header: &Header, to_site: &SiteFromFile) -> Result<Self, IoError> {
        input.go_to(0, "the header")?;
        let mut head = input.take(header.header_bytes, "the header")?;
        let data =
            input.take(header.data_at - header.header_bytes, "the records before the points")?;
        let count = u32_at(&head, 100);
        let new_heights = to_site.height_factor != 1.0;
        let is_projection = |user: &str| new_heights && user == "LASF_Projection";
        let (mut vlrs, mut described, mut at) = (Vec::new(), Vec::new(), 0);
        for _ in 0..count {
            let end = at + 54 + usize::from(u16_at(&data, at + 20));
            let raw = &data[at..end];
            let user = String::from_utf8_lossy(&raw[2..18]).trim_end_matches('\0').to_string();
            match (user.as_str(), u16_at(raw, 18)) {
                ("LASF_Spec", 4) => described = raw[54..].to_vec(),
                (laz::LazVlr::USER_ID, laz::LazVlr::RECORD_ID) | ("copc", _) => {}
                (user, _) if is_projection(user) => {}
                _ => vlrs.push(raw.to_vec()),
            }
            at = end;
        }
        let base = usize::from(RECORD_BYTES[usize::from(header.summary.format)]);
        let record = usize::from(header.summary.record_bytes);
        let (kept, descriptors) = extra::without_labels(&described, base, record);
        let record_bytes = kept.iter().map(|r| r.len()).sum::<usize>() + ADDED;
        let descriptors = [descriptors, extra::descriptors(&DIMENSIONS)].concat();
        if record_bytes > usize::from(u16::MAX) || descriptors.len() > usize::from(u16::MAX) {
            let what = "the points have so many extra dimensions that three more do not fit";
            return Err(IoError::unsupported(input.path, what));
        }
        vlr_record(&mut vlrs, "LASF_Spec", 4, &descriptors);
        let own = &header.summary.reference;
        let code = if new_heights { own.horizontal } else { None };
        // A file that says nothing of its system gets the site's.
        let code = code.or(if own.is_unstated() { to_site.epsg } else { None });
        if let Some(code) = code {
            let text = crs::wkt_of_epsg(code);
            let encoding = u16_at(&head, 6) & !0x10 | if text.is_some() { 0x10 } else { 0 };
            head[6..8].copy_from_slice(&encoding.to_le_bytes());
            match (text, u16::try_from(code)) {
                (Some(t), _) => {
                    vlr_record(&mut vlrs, "LASF_Projection", 2112, &[t.as_bytes(), b"\0"].concat())
                }
                (None, Ok(code)) => {
                    vlr_record(&mut vlrs, "LASF_Projection", 34735, &crs::keys_of_epsg(code))
                }
                (None, Err(_)) => {}
            }
        }
        move_header(&mut head, to_site);
        let mut frame = Self {
            head,
            vlrs,
            kept,
            record_bytes,
            swap: to_site.swap,
            flip: to_site.height_factor < 0.0,
            tail: Vec::new(),
            extended: 0,
            waveforms: None,
            minor: header.minor,
        };
        frame.take_tail(input)?;
        Ok(frame)
    }

    /// Extended records (but an octree's, which no longer fits) and the waveforms of LAS 1.3.
    fn take_tail(&mut self, input: &mut Input) -> Result<(), IoError> {
        let waveforms = if self.minor >= 3 { u64_at(&self.head, 227) } else { 0 };
        if self.minor == 3 && waveforms > 0 {
            input.go_to(waveforms, "the waveforms")?;
            self.tail = input.take(input.len - waveforms, "the waveforms")?;
            self.waveforms = Some(0);
        }
        if self.minor < 4 {
            return Ok(());
        }
        let (mut at, count) = (u64_at(&self.head, 235), u32_at(&self.head, 243));
        for _ in 0..count {
            input.go_to(at, "an extended variable-length record")?;
            let mut head = [0; 60];
            input.fill(&mut head, "an extended variable-length record")?;
            let bytes = u64_at(&head, 20);
            if !head[2..].starts_with(b"copc\0") {
                if at == waveforms {
                    self.waveforms = Some(self.tail.len() as u64);
                }
                self.tail.extend(head);
                self.tail.extend(input.take(bytes, "an extended variable-length record")?);
                self.extended += 1;
            }
            at += 60 + bytes;
        }
        Ok(())
    }

    /// The records that come back of this piece, labels behind them.
    fn records(
        &self,
        raw: &[u8],
        first: u64,
        labels: &ByRecord,
        format: u8,
        tally: &mut Tally,
    ) -> Vec<u8> {
        let old = usize::from(u16_at(&self.head, 105));
        let mut out = Vec::with_capacity(raw.len() / old * self.record_bytes);
        for (i, record) in raw.chunks_exact(old).enumerate() {
            let Some((instance, model, confidence)) = labels.of(first + i as u64) else { continue };
            let start = out.len();
            self.kept.iter().for_each(|r| out.extend_from_slice(&record[r.clone()]));
            let place = &mut out[start..start + 12];
            if self.swap {
                let (x, y) = place.split_at_mut(4);
                x.swap_with_slice(&mut y[..4]);
            }
            if self.flip {
                let z = -(i64::from(u32_at(place, 8) as i32));
                place[8..12].copy_from_slice(&(z.min(i64::from(i32::MAX)) as i32).to_le_bytes());
            }
            tally.add(&out[start..], format);
            out.extend_from_slice(&instance.to_le_bytes());
            out.extend_from_slice(&model.to_le_bytes());
            out.extend_from_slice(&confidence.to_le_bytes());
        }
        out
    }

    /// Writes what lies behind the points and fills in the header what is known only now.
    fn finish(
        &self,
        file: &mut dyn atomic::WriteSeek,
        head: &mut [u8],
        tally: &Tally,
        records: Records,
    ) -> io::Result<()> {
        let tail_at = file.seek(io::SeekFrom::End(0))?;
        file.write_all(&self.tail)?;
        if let Some(at) = self.waveforms {
            head[227..235].copy_from_slice(&(tail_at + at).to_le_bytes());
        }
        if self.minor >= 4 {
            let start = if self.extended > 0 { tail_at } else { 0 };
            head[235..243].copy_from_slice(&start.to_le_bytes());
            head[243..247].copy_from_slice(&self.extended.to_le_bytes());
        }
        if records == Records::Labelled {
            tally.write(head, self.minor);
        }
        file.seek(io::SeekFrom::Start(0))?;
        file.write_all(head)
    }
}

impl Tally {
    fn add(&mut self, record: &[u8], format: u8) {
        self.points += 1;
        let number = usize::from(record[14] & if format < 6 { 7 } else { 15 });
        if let Some(count) = number.checked_sub(1).and_then(|n| self.returns.get_mut(n)) {
            *count += 1;
        }
        for k in 0..3 {
            let v = u32_at(record, 4 * k) as i32;
            (self.low[k], self.high[k]) = (self.low[k].min(v), self.high[k].max(v));
        }
    }

    /// Counts and box of a part of the file.
    fn write(&self, head: &mut [u8], minor: u8) {
        let legacy = |n: u64| u32::try_from(n).unwrap_or(0).to_le_bytes();
        head[107..111].copy_from_slice(&legacy(self.points));
        for k in 0..5 {
            head[111 + 4 * k..115 + 4 * k].copy_from_slice(&legacy(self.returns[k]));
        }
        if minor >= 4 {
            head[247..255].copy_from_slice(&self.points.to_le_bytes());
            for (k, n) in self.returns.iter().enumerate() {
                head[255 + 8 * k..263 + 8 * k].copy_from_slice(&n.to_le_bytes());
            }
        }
        if self.points == 0 {
            return;
        }
        for k in 0..3 {
            let (scale, offset) = (f64_at(head, 131 + 8 * k), f64_at(head, 155 + 8 * k));
            let ends = [self.low[k], self.high[k]].map(|v| f64::from(v) * scale + offset);
            head[179 + 16 * k..187 + 16 * k].copy_from_slice(&ends[1].to_le_bytes());
            head[187 + 16 * k..195 + 16 * k].copy_from_slice(&ends[0].to_le_bytes());
        }
    }
}

/// Scale, offset and box of the header in site coordinates: the stored integers stay as they are.
fn move_header(head: &mut [u8], to_site: &SiteFromFile) {
    if to_site.swap {
        for (a, b, bytes) in [(131, 139, 8), (155, 163, 8), (179, 195, 16)] {
            let (left, right) = head.split_at_mut(b);
            left[a..a + bytes].swap_with_slice(&mut right[..bytes]);
        }
    }
    let (factor, up) = (to_site.height_factor, to_site.vertical_offset_m);
    let set =
        |head: &mut [u8], at: usize, v: f64| head[at..at + 8].copy_from_slice(&v.to_le_bytes());
    let (scale, offset) = (f64_at(head, 147), f64_at(head, 171));
    let (high, low) = (f64_at(head, 211), f64_at(head, 219));
    let ends = [low, high].map(|v| v * factor + up);
    set(head, 147, scale * factor.abs());
    set(head, 171, offset * factor + up);
    set(head, 211, ends[0].max(ends[1]));
    set(head, 219, ends[0].min(ends[1]));
}
