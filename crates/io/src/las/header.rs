//! The public header and variable-length records, with every count checked.

use super::extra;
use crate::crs::{self, FileCrs, GeoKeys};
use crate::input::Input;
use crate::{IoError, Place};
use geom::DVec3;
use laz::{LazItemType, LazVlr};

/// Bytes of a record without extra bytes, by point format.
pub(super) const RECORD_BYTES: [u16; 11] = [20, 28, 26, 34, 57, 63, 30, 36, 38, 59, 67];

/// What the header says of the file.
#[derive(Clone, Debug, PartialEq)]
pub struct LasSummary {
    /// Points.
    pub points: u64,
    /// Point data record format, 0–10.
    pub format: u8,
    /// Bytes of a record.
    pub record_bytes: u16,
    /// Size of one step of the stored integers, per axis.
    pub scale: DVec3,
    /// Added to the scaled integers.
    pub offset: DVec3,
    /// Lower corner as stated.
    pub min: DVec3,
    /// Upper corner as stated.
    pub max: DVec3,
    /// What the file says of its coordinates.
    pub reference: FileCrs,
    /// `EPSG:n` when the file names its CRS.
    pub crs: Option<String>,
    /// Its well-known text.
    pub crs_wkt: Option<String>,
    /// Compressed.
    pub compressed: bool,
}

/// The summary plus what the reader needs.
pub(super) struct Header {
    pub summary: LasSummary,
    pub data_at: u64,
    pub extra: extra::Dimensions,
    pub laz: Option<LazVlr>,
    /// Where the first variable-length record's content is, for COPC.
    pub copc_info: Option<Vec<u8>>,
    /// Bytes of the public header.
    pub header_bytes: u64,
    /// Minor version: 1.`minor`.
    pub minor: u8,
}

pub(super) fn u16_at(b: &[u8], at: usize) -> u16 {
    u16::from_le_bytes(b[at..at + 2].try_into().expect("two bytes"))
}
pub(super) fn u32_at(b: &[u8], at: usize) -> u32 {
    u32::from_le_bytes(b[at..at + 4].try_into().expect("four bytes"))
}
pub(super) fn u64_at(b: &[u8], at: usize) -> u64 {
    u64::from_le_bytes(b[at..at + 8].try_into().expect("eight bytes"))
}
pub(super) fn f64_at(b: &[u8], at: usize) -> f64 {
    f64::from_bits(u64_at(b, at))
}

pub(super) fn read(input: &mut Input) -> Result<Header, IoError> {
    let mut fixed = [0; 227];
    input.fill(&mut fixed, "the header")?;
    if &fixed[..4] != b"LASF" {
        return Err(input.malformed(
            Place::File,
            "this is not a LAS or LAZ file: it does not start with `LASF`",
        ));
    }
    let (major, minor) = (fixed[24], fixed[25]);
    if major != 1 || minor > 4 {
        return Err(IoError::unsupported(
            input.path,
            format!("LAS version {major}.{minor} is not known (1.0 to 1.4 are)"),
        ));
    }
    let header_bytes = u64::from(u16_at(&fixed, 94));
    let data_at = u64::from(u32_at(&fixed, 96));
    let vlrs = u32_at(&fixed, 100);
    // The two upper bits of the format mark compression (the highest one is historical).
    let (format, compressed) = (fixed[104] & 0x3f, fixed[104] & 0xc0 != 0);
    let record_bytes = u16_at(&fixed, 105);
    let needed = if minor >= 4 {
        375
    } else if minor == 3 {
        235
    } else {
        227
    };
    if header_bytes < needed || data_at < header_bytes || data_at > input.len {
        let what = format!(
            "header of {header_bytes} bytes and points from byte {data_at} on do not fit a file of {} bytes",
            input.len
        );
        return Err(input.malformed(Place::File, what));
    }
    let least = *RECORD_BYTES.get(usize::from(format)).ok_or_else(|| {
        IoError::unsupported(
            input.path,
            format!("point format {format} is not known (0 to 10 are)"),
        )
    })?;
    if record_bytes < least {
        let what = format!(
            "records of {record_bytes} bytes are too short for point format {format} ({least} bytes)"
        );
        return Err(input.malformed(Place::File, what));
    }
    let mut points = u64::from(u32_at(&fixed, 107));
    if minor >= 4 {
        input.go_to(247, "the number of points")?;
        let mut count = [0; 8];
        input.fill(&mut count, "the number of points")?;
        match u64::from_le_bytes(count) {
            0 => {}
            n => points = n,
        }
    }
    let vector = |at: usize, step: usize| {
        DVec3::from_array([0, 1, 2].map(|i| f64_at(&fixed, at + i * step)))
    };
    let (scale, offset) = (vector(131, 8), vector(155, 8));
    let (max, min) = (vector(179, 16), vector(187, 16));
    if !(scale.is_finite() && offset.is_finite() && scale.cmpne(DVec3::ZERO).all()) {
        let what = format!("scale {scale} and offset {offset} must be finite, the scale not 0");
        return Err(input.malformed(Place::File, what));
    }
    input.go_to(header_bytes, "the first variable-length record")?;
    let records = records(input, vlrs, data_at)?;
    let find = |user: &str, id: u16| {
        records.iter().find(|r| r.user == user && r.id == id).map(|r| r.data.as_slice())
    };
    let extended = extended_records(input, minor)?;
    let (crs_wkt, reference) = reference(&records, &extended, u16_at(&fixed, 6));
    let crs = reference.epsg();
    let extra =
        extra::Dimensions::of(find("LASF_Spec", 4), usize::from(least), usize::from(record_bytes));
    let laz = match (compressed, find(LazVlr::USER_ID, LazVlr::RECORD_ID)) {
        (false, _) => None,
        (true, None) => {
            return Err(input.malformed(
                Place::File,
                "the file is compressed, but its LASzip record is missing",
            ));
        }
        (true, Some(data)) => Some(laz_record(input, data, format, record_bytes)?),
    };
    let summary = LasSummary {
        points,
        format,
        record_bytes,
        scale,
        offset,
        min,
        max,
        reference,
        crs,
        crs_wkt,
        compressed,
    };
    let copc_info = find("copc", 1).map(<[u8]>::to_vec);
    Ok(Header { summary, data_at, extra, laz, copc_info, header_bytes, minor })
}

struct Record {
    user: String,
    id: u16,
    data: Vec<u8>,
}

fn records(input: &mut Input, count: u32, data_at: u64) -> Result<Vec<Record>, IoError> {
    const HEAD: u64 = 54;
    let at_most = (data_at - input.position()?) / HEAD;
    if u64::from(count) > at_most {
        let (path, file_bytes) = (input.path.into(), input.len);
        return Err(IoError::TooMany {
            path,
            what: "variable-length records",
            promised: count.into(),
            at_most,
            file_bytes,
        });
    }
    let mut records = Vec::new();
    for _ in 0..count {
        let mut head = [0; HEAD as usize];
        input.fill(&mut head, "a variable-length record")?;
        let user = String::from_utf8_lossy(&head[2..18]).trim_end_matches('\0').to_string();
        let data = input.take(u16_at(&head, 20).into(), "a variable-length record")?;
        if input.position()? > data_at {
            return Err(
                input.malformed(Place::File, "the variable-length records run into the points")
            );
        }
        records.push(Record { user, id: u16_at(&head, 18), data });
    }
    Ok(records)
}

/// Records behind the points (LAS 1.4): of them only what describes the coordinates is loaded.
fn extended_records(input: &mut Input, minor: u8) -> Result<Vec<Record>, IoError> {
    const HEAD: u64 = 60;
    const MOST: u64 = 1 << 20;
    if minor < 4 {
        return Ok(Vec::new());
    }
    let mut place = [0; 12];
    input.go_to(235, "the extended records' address")?;
    input.fill(&mut place, "the extended records' address")?;
    let (start, count) = (u64_at(&place, 0), u32_at(&place, 8));
    let at_most = input.len.saturating_sub(start) / HEAD;
    if u64::from(count) > at_most {
        let (path, file_bytes) = (input.path.into(), input.len);
        return Err(IoError::TooMany {
            path,
            what: "extended variable-length records",
            promised: count.into(),
            at_most,
            file_bytes,
        });
    }
    let (mut records, mut at) = (Vec::new(), start);
    for _ in 0..count {
        let mut head = [0; HEAD as usize];
        input.go_to(at, "an extended variable-length record")?;
        input.fill(&mut head, "an extended variable-length record")?;
        let bytes = u64_at(&head, 20);
        let user = String::from_utf8_lossy(&head[2..18]).trim_end_matches('\0').to_string();
        if user == "LASF_Projection" && bytes <= MOST {
            let data = input.take(bytes, "an extended variable-length record")?;
            records.push(Record { user, id: u16_at(&head, 18), data });
        }
        at = at.saturating_add(HEAD).saturating_add(bytes);
        if at > input.len {
            return Err(input.malformed(
                Place::File,
                "an extended variable-length record ends behind the file; the file is cut short",
            ));
        }
    }
    Ok(records)
}

/// Well-known text and what the file says of its coordinates. The global encoding's bit 4 says which of text and keys counts.
fn reference(records: &[Record], extended: &[Record], encoding: u16) -> (Option<String>, FileCrs) {
    let find = |id: u16| {
        let of = |list: &'_ [Record]| -> Option<Vec<u8>> {
            let found = list.iter().find(|r| r.user == "LASF_Projection" && r.id == id)?;
            Some(found.data.clone())
        };
        of(records).or_else(|| of(extended))
    };
    let text = |bytes: Vec<u8>| String::from_utf8_lossy(&bytes).trim_end_matches('\0').to_string();
    let wkt = find(2112).map(text).filter(|w| !w.trim().is_empty());
    let keys = find(34735).map(|data| GeoKeys {
        directory: data.chunks_exact(2).map(|b| u16_at(b, 0)).collect(),
        doubles: find(34736).unwrap_or_default().chunks_exact(8).map(|b| f64_at(b, 0)).collect(),
        texts: find(34737).map(text).unwrap_or_default(),
    });
    let of_keys = keys.map(|k| k.crs()).filter(|crs| !crs.is_unstated());
    let of_text = wkt.as_deref().map(crs::of_wkt);
    let text_counts = encoding & 0x10 != 0;
    let reference = match (of_text, of_keys) {
        (Some(text), Some(keys)) => {
            if text_counts || keys.horizontal.is_none() {
                text
            } else {
                keys
            }
        }
        (text, keys) => text.or(keys).unwrap_or_default(),
    };
    (wkt, reference)
}

/// The LASzip record must describe exactly the records of this file: the decoder trusts it.
fn laz_record(
    input: &Input,
    data: &[u8],
    format: u8,
    record_bytes: u16,
) -> Result<LazVlr, IoError> {
    let fail = |what: String| input.malformed(Place::File, what);
    let vlr = LazVlr::from_buffer(data)
        .map_err(|e| fail(format!("the LASzip record cannot be read: {e}")))?;
    let extra = record_bytes - RECORD_BYTES[usize::from(format)];
    let expected = laz::LazItemRecordBuilder::default_for_point_format_id(format, extra)
        .map_err(|e| fail(format!("point format {format} cannot be decompressed: {e}")))?;
    let known = |version: u16, t: LazItemType| match t {
        LazItemType::Point14
        | LazItemType::RGB14
        | LazItemType::RGBNIR14
        | LazItemType::WavePacket14
        | LazItemType::Byte14(_) => {
            matches!(version, 3 | 4)
        }
        _ => matches!(version, 1 | 2),
    };
    let same = vlr.items().len() == expected.len()
        && vlr.items().iter().zip(&expected).all(|(a, b)| {
            a.item_type() == b.item_type()
                && a.size() == b.size()
                && known(a.version(), a.item_type())
        });
    if same {
        Ok(vlr)
    } else {
        Err(fail("the LASzip record describes other points than the header".into()))
    }
}

/// Layers that a chunk of layered points stores one after another; 0 for the older compression.
pub(super) fn layers(vlr: &LazVlr) -> usize {
    vlr.items()
        .iter()
        .map(|item| match item.item_type() {
            LazItemType::Point14 => 9,
            LazItemType::RGB14 | LazItemType::WavePacket14 => 1,
            LazItemType::RGBNIR14 => 2,
            LazItemType::Byte14(n) => usize::from(n),
            _ => 0,
        })
        .sum()
}
