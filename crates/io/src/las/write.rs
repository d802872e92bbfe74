//! Writes LAS 1.4, point format 6, plain or compressed, with CRS and extra dimensions.
//!
//! Chunks are compressed in parallel and written in order: the bytes do not depend on the number of threads.

use super::{extra, header};
use crate::crs;
use crate::raw_cloud::RawCloud;
use crate::{IoError, Place, atomic};
use geom::DVec3;
use laz::laszip::{ChunkTable, ChunkTableEntry};
use laz::record::{
    LayeredPointRecordCompressor, RecordCompressor, SequentialPointRecordCompressor,
};
use laz::{LazItemRecordBuilder, LazVlr};
use rayon::prelude::*;
use std::io::{self, Cursor};
use std::path::Path;

const FORMAT: u8 = 6;
const BASE: usize = 30;
/// Where the point source id lies after the coordinates.
const SOURCE_ID: usize = 8;
const CHUNK: usize = 50_000;
const HEADER: usize = 375;

/// A further number of each point: name of the dimension, what it means, a value a point (NaN: none).
#[derive(Clone, Copy, Debug)]
pub struct ExtraColumn<'a> {
    /// Name, at most 32 bytes.
    pub name: &'a str,
    /// Meaning, at most 32 bytes.
    pub description: &'a str,
    /// As long as the cloud.
    pub values: &'a [f32],
}

/// Writes the cloud; `.laz` is compressed, anything else plain.
pub fn write_cloud(path: &Path, cloud: &RawCloud) -> Result<(), IoError> {
    write_cloud_with(path, cloud, &[])
}

/// The same with further dimensions.
pub fn write_cloud_with(
    path: &Path,
    cloud: &RawCloud,
    columns: &[ExtraColumn],
) -> Result<(), IoError> {
    cloud.check_columns(path)?;
    for column in columns {
        let fits = column.values.len() == cloud.len()
            && column.name.len() <= 32
            && column.description.len() <= 32;
        if !fits {
            let what = format!(
                "dimension `{}` has {} values for {} points, or texts of more than 32 bytes",
                column.name,
                column.values.len(),
                cloud.len()
            );
            return Err(IoError::malformed(path, Place::File, what));
        }
    }
    let grid =
        Grid::of(cloud, columns).map_err(|what| IoError::malformed(path, Place::File, what))?;
    let compressed = crate::mesh::extension(path) == "laz";
    let dimensions: Vec<(&str, u8, &str)> = [
        (cloud.instance.is_some(), ("instance", 5, "block number, 0 = none")),
        (cloud.model.is_some(), ("model", 3, "type of block, 0 = none")),
        (cloud.confidence.is_some(), ("confidence", 9, "of the label, 0 to 1")),
    ]
    .into_iter()
    .filter_map(|(present, d)| present.then_some(d))
    .chain(columns.iter().map(|c| (c.name, 9, c.description)))
    .collect();
    let extra_bytes: usize = dimensions.iter().map(|d| if d.1 == 3 { 2 } else { 4 }).sum();
    let items = LazItemRecordBuilder::default_for_point_format_id(FORMAT, extra_bytes as u16)
        .expect("format 6 is known to the compressor");
    let vlr = LazVlr::from_laz_items(items);

    let mut records = Vec::new();
    let epsg: Option<u32> =
        cloud.crs.as_ref().and_then(|c| c.strip_prefix("EPSG:")).and_then(|c| c.parse().ok());
    let wkt = cloud.crs_wkt.clone().or_else(|| epsg.and_then(crs::wkt_of_epsg));
    match (&wkt, epsg.and_then(|c| u16::try_from(c).ok())) {
        (Some(wkt), _) => {
            let text = [wkt.as_bytes(), b"\0"].concat();
            vlr_record(&mut records, "LASF_Projection", 2112, &text);
        }
        (None, Some(code)) => {
            vlr_record(&mut records, "LASF_Projection", 34735, &crs::keys_of_epsg(code))
        }
        (None, None) => {}
    }
    if !dimensions.is_empty() {
        vlr_record(&mut records, "LASF_Spec", 4, &extra::descriptors(&dimensions));
    }
    if compressed {
        let mut data = Vec::new();
        vlr.write_to(&mut data).expect("memory takes every byte");
        vlr_record(&mut records, LazVlr::USER_ID, LazVlr::RECORD_ID, &data);
    }
    let vlr_count = records.len() as u32;
    let records = records.concat();
    let data_at = HEADER + records.len();

    let mut head = grid.header(cloud, BASE + extra_bytes, compressed, wkt.is_some());
    head[96..100].copy_from_slice(&(data_at as u32).to_le_bytes());
    head[100..104].copy_from_slice(&vlr_count.to_le_bytes());
    atomic::write(path, |out| {
        out.write_all(&head)?;
        out.write_all(&records)?;
        let size = BASE + extra_bytes;
        let mut writer = LazWriter::new(compressed.then_some(&vlr), data_at as u64, size);
        writer.begin(out)?;
        (0..cloud.len())
            .step_by(CHUNK)
            .try_for_each(|i| writer.add(out, &grid.records(cloud, i, size)))?;
        writer.end(out)
    })
}

/// Writes point records that come piece by piece, plain or in chunks compressed in parallel. The bytes do not depend on
/// the pieces or the number of threads.
pub(super) struct LazWriter<'a> {
    /// `None`: plain.
    vlr: Option<&'a LazVlr>,
    data_at: u64,
    record_bytes: usize,
    /// Records that do not fill a group of chunks yet.
    waiting: Vec<u8>,
    table: ChunkTable,
    at: u64,
}

impl<'a> LazWriter<'a> {
    /// The LASzip record for this point format with so many extra bytes; `Err` says why there is none.
    pub fn vlr(format: u8, extra_bytes: usize) -> Result<LazVlr, String> {
        let items = LazItemRecordBuilder::default_for_point_format_id(format, extra_bytes as u16)
            .map_err(|e| format!("point format {format} cannot be compressed: {e}"))?;
        let mut raw = Vec::new();
        LazVlr::from_laz_items(items).write_to(&mut raw).map_err(|e| e.to_string())?;
        // Wave packets are of version 1 in LASzip; the library at hand says 2 and means the same.
        for item in raw[34..].chunks_exact_mut(6) {
            if item[0] == 9 {
                item[4] = 1;
            }
        }
        LazVlr::from_buffer(&raw).map_err(|e| e.to_string())
    }

    pub fn new(vlr: Option<&'a LazVlr>, data_at: u64, record_bytes: usize) -> Self {
        let table = ChunkTable::default();
        Self { vlr, data_at, record_bytes, waiting: Vec::new(), table, at: data_at + 8 }
    }

    /// Leaves room for the table's address.
    pub fn begin(&mut self, out: &mut dyn atomic::WriteSeek) -> io::Result<()> {
        if self.vlr.is_some() { out.write_all(&(-1_i64).to_le_bytes()) } else { Ok(()) }
    }

    /// Adds whole records.
    pub fn add(&mut self, out: &mut dyn atomic::WriteSeek, records: &[u8]) -> io::Result<()> {
        if self.vlr.is_none() {
            return out.write_all(records);
        }
        self.waiting.extend_from_slice(records);
        let group = CHUNK * self.record_bytes * rayon::current_num_threads().max(1) * 2;
        if self.waiting.len() < group {
            return Ok(());
        }
        let whole = self.waiting.len() / (CHUNK * self.record_bytes) * (CHUNK * self.record_bytes);
        let rest = self.waiting.split_off(whole);
        let ready = std::mem::replace(&mut self.waiting, rest);
        self.compress(out, &ready)
    }

    fn compress(&mut self, out: &mut dyn atomic::WriteSeek, records: &[u8]) -> io::Result<()> {
        let Some(vlr) = self.vlr else { return Ok(()) };
        let chunks: Vec<&[u8]> = records.chunks(CHUNK * self.record_bytes).collect();
        let together = rayon::current_num_threads().max(1) * 2;
        for group in chunks.chunks(together) {
            let compressed: Vec<io::Result<Vec<u8>>> =
                group.par_iter().map(|records| compress(records, vlr)).collect();
            for bytes in compressed {
                let bytes = bytes?;
                out.write_all(&bytes)?;
                self.at += bytes.len() as u64;
                self.table.push(ChunkTableEntry {
                    point_count: CHUNK as u64,
                    byte_count: bytes.len() as u64,
                });
            }
        }
        Ok(())
    }

    /// The rest, the table and its address.
    pub fn end(&mut self, out: &mut dyn atomic::WriteSeek) -> io::Result<()> {
        let Some(vlr) = self.vlr else { return Ok(()) };
        let rest = std::mem::take(&mut self.waiting);
        self.compress(out, &rest)?;
        let mut table = Vec::new();
        self.table.write_to(&mut table, vlr)?;
        out.write_all(&table)?;
        out.seek(io::SeekFrom::Start(self.data_at))?;
        out.write_all(&(self.at as i64).to_le_bytes())?;
        out.seek(io::SeekFrom::End(0)).map(|_| ())
    }
}

fn compress(records: &[u8], vlr: &LazVlr) -> io::Result<Vec<u8>> {
    let layered = header::layers(vlr) > 0;
    let target = Cursor::new(Vec::new());
    let size = vlr.items_size() as usize;
    if layered {
        let mut compressor = LayeredPointRecordCompressor::new(target);
        compressor.set_fields_from(vlr.items()).map_err(io::Error::other)?;
        records.chunks_exact(size).try_for_each(|r| compressor.compress_next(r))?;
        compressor.done()?;
        Ok(compressor.into_inner().into_inner())
    } else {
        let mut compressor = SequentialPointRecordCompressor::new(target);
        compressor.set_fields_from(vlr.items()).map_err(io::Error::other)?;
        records.chunks_exact(size).try_for_each(|r| compressor.compress_next(r))?;
        compressor.done()?;
        Ok(compressor.into_inner().into_inner())
    }
}

/// The integer grid that the coordinates are stored on.
struct Grid<'a> {
    columns: &'a [ExtraColumn<'a>],
    scale: f64,
    offset: DVec3,
    min: DVec3,
    max: DVec3,
}

impl<'a> Grid<'a> {
    /// 0.1 mm steps (0.001 mm for clouds under 10 m) from whole metres; coarser only where 32 bits force it.
    fn of(cloud: &RawCloud, columns: &'a [ExtraColumn<'a>]) -> Result<Self, String> {
        let [min, max] = cloud.extent().unwrap_or_default();
        let size = (max - min).max_element();
        let mut scale = if size < 10.0 { 1e-6 } else { 1e-4 };
        while size / scale > 2e9 {
            scale *= 10.0;
        }
        if !(scale <= 1.0) {
            return Err(format!(
                "a cloud of {size} m cannot be stored in LAS; remove stray points before"
            ));
        }
        let offset = ((min + max) / 2.0).round();
        let grid = Self { columns, scale, offset, min, max };
        let back = |p: DVec3| grid.place(p).map(|v| f64::from(v) * scale);
        let (min, max) =
            (DVec3::from_array(back(min)) + offset, DVec3::from_array(back(max)) + offset);
        Ok(Self { columns, scale, offset, min, max })
    }

    fn place(&self, p: DVec3) -> [i32; 3] {
        ((p - self.offset) / self.scale).round().to_array().map(|v| v as i32)
    }

    /// Raw records of the chunk that begins at `start`.
    fn records(&self, cloud: &RawCloud, start: usize, size: usize) -> Vec<u8> {
        let end = cloud.len().min(start + CHUNK);
        let mut out = Vec::with_capacity((end - start) * size);
        for i in start..end {
            for v in self.place(cloud.position[i]) {
                out.extend_from_slice(&v.to_le_bytes());
            }
            let mut rest = [0; BASE - 12];
            rest[2] = 0x11; // first return of one
            if let Some(line) = &cloud.line {
                rest[SOURCE_ID..SOURCE_ID + 2].copy_from_slice(&line[i].to_le_bytes());
            }
            out.extend_from_slice(&rest);
            if let Some(column) = &cloud.instance {
                out.extend_from_slice(&column[i].to_le_bytes());
            }
            if let Some(column) = &cloud.model {
                out.extend_from_slice(&column[i].to_le_bytes());
            }
            if let Some(column) = &cloud.confidence {
                out.extend_from_slice(&column[i].to_le_bytes());
            }
            for column in self.columns {
                out.extend_from_slice(&column.values[i].to_le_bytes());
            }
        }
        out
    }

    /// The public header; offsets and record counts are filled in by the caller.
    fn header(
        &self,
        cloud: &RawCloud,
        record_bytes: usize,
        compressed: bool,
        wkt: bool,
    ) -> [u8; HEADER] {
        let mut h = [0; HEADER];
        let mut put = |at: usize, bytes: &[u8]| h[at..at + bytes.len()].copy_from_slice(bytes);
        put(0, b"LASF");
        put(6, &(if wkt { 0x10_u16 } else { 0 }).to_le_bytes());
        put(24, &[1, 4]);
        put(26, b"tsumu");
        put(58, concat!("tsumu ", env!("CARGO_PKG_VERSION")).as_bytes());
        put(94, &(HEADER as u16).to_le_bytes());
        put(104, &[FORMAT | if compressed { 0x80 } else { 0 }]);
        put(105, &(record_bytes as u16).to_le_bytes());
        for axis in 0..3 {
            put(131 + 8 * axis, &self.scale.to_le_bytes());
            put(155 + 8 * axis, &self.offset[axis].to_le_bytes());
            put(179 + 16 * axis, &self.max[axis].to_le_bytes());
            put(187 + 16 * axis, &self.min[axis].to_le_bytes());
        }
        let count = cloud.len() as u64;
        put(247, &count.to_le_bytes());
        put(255, &count.to_le_bytes());
        h
    }
}

pub(super) fn vlr_record(records: &mut Vec<Vec<u8>>, user: &str, id: u16, data: &[u8]) {
    let mut record = vec![0; 54];
    record[2..2 + user.len()].copy_from_slice(user.as_bytes());
    record[18..20].copy_from_slice(&id.to_le_bytes());
    record[20..22].copy_from_slice(&(data.len() as u16).to_le_bytes());
    record.extend_from_slice(data);
    debug_assert_eq!(header::u16_at(&record, 18), id);
    records.push(record);
}
