//! GeoTIFF: height, deficit and distance maps out (f32, deflated, NaN = nothing), design surfaces in.

use crate::input::Input;
use crate::raster::Raster;
use crate::{IoError, Place};
use std::io::Cursor;
use tiff::decoder::{Decoder, DecodingResult, Limits};
use tiff::tags::Tag;

pub use crate::geotiff_writer::{write, write_named};

const GEO_KEYS: Tag = Tag::GeoKeyDirectoryTag;
/// Cells that any file may have, and how many more for each of its bytes.
const FREE_CELLS: u64 = 4_000_000;
const CELLS_PER_BYTE: u64 = 16;

/// Reads the first band of a north-up GeoTIFF and the `EPSG:n` it names.
pub fn read(input: &mut Input) -> Result<(Raster, Option<String>), IoError> {
    let (path, len) = (input.path, input.len);
    let damaged = |e: tiff::TiffError| {
        IoError::malformed(path, Place::File, format!("not a GeoTIFF that can be read: {e}"))
    };
    let most_cells = FREE_CELLS + CELLS_PER_BYTE * len;
    let mut limits = Limits::default();
    limits.decoding_buffer_size = most_cells as usize * 8;
    limits.intermediate_buffer_size = most_cells as usize * 8;
    limits.ifd_value_size = len.min(64 << 20) as usize;
    let bytes = input.take(len, "the image")?;
    let mut decoder = Decoder::new(Cursor::new(&bytes)).map_err(damaged)?.with_limits(limits);
    let (columns, rows) = decoder.dimensions().map_err(damaged)?;
    let cells = u64::from(columns) * u64::from(rows);
    if cells == 0 || cells > most_cells {
        let path = path.into();
        return Err(IoError::TooMany {
            path,
            what: "cells",
            promised: cells,
            at_most: most_cells,
            file_bytes: len,
        });
    }
    let number = |decoder: &mut Decoder<_>, tag: Tag| decoder.get_tag_f64_vec(tag).ok();
    let scale = number(&mut decoder, Tag::ModelPixelScaleTag);
    let tie = number(&mut decoder, Tag::ModelTiepointTag);
    let place = scale
        .as_deref()
        .zip(tie.as_deref())
        .and_then(|(s, t)| Some((*s.first()?, *s.get(1)?, t.get(..6)?)));
    let Some((cell_m, _, tie)) = place.filter(|(w, h, t)| {
        *w > 0.0 && (w - h).abs() < 1e-9 * w && t.iter().all(|v| v.is_finite())
    }) else {
        let what = "the image has no position and cell size, or its cells are not square and north-up; warp it with gdalwarp";
        return Err(IoError::malformed(path, Place::File, what));
    };

    let keys = decoder.get_tag_u16_vec(GEO_KEYS).unwrap_or_default();
    let key =
        |id: u16| keys.chunks_exact(4).skip(1).find(|k| k[0] == id && k[1] == 0).map(|k| k[3]);
    let crs = key(3072).filter(|&c| c != 0 && c != 32767).map(|c| format!("EPSG:{c}"));
    // A tie point is a corner of its cell, or its middle when "pixel is point".
    let to_middle = if key(1025) == Some(2) { 0.0 } else { 0.5 };
    let nodata = decoder
        .get_tag_ascii_string(Tag::GdalNodata)
        .ok()
        .and_then(|t| t.trim_matches(['\0', ' ']).parse::<f64>().ok());
    let samples = decoder.colortype().map_err(damaged)?.num_samples() as usize;
    if samples != 1 {
        return Err(IoError::unsupported(
            path,
            format!("the image has {samples} bands; give one band of heights"),
        ));
    }
    let value = decoder.read_image().map_err(damaged)?;
    let mut value = floats(value)
        .ok_or_else(|| IoError::unsupported(path, "the image's numbers are of an unknown kind"))?;
    if value.len() as u64 != cells {
        return Err(IoError::malformed(path, Place::File, "the image is not whole"));
    }
    for v in &mut value {
        if !v.is_finite() || nodata.is_some_and(|n| f64::from(*v) == n) {
            *v = f32::NAN;
        }
    }
    let value: Vec<f32> = value.chunks(columns as usize).rev().flatten().copied().collect();
    let west = tie[3] + (to_middle - tie[0]) * cell_m;
    let top = tie[4] - (to_middle - tie[1]) * cell_m;
    let origin = [west, top - f64::from(rows - 1) * cell_m];
    Ok((Raster { origin, cell_m, columns: columns as usize, value }, crs))
}

fn floats(value: DecodingResult) -> Option<Vec<f32>> {
    Some(match value {
        DecodingResult::F32(v) => v,
        DecodingResult::F64(v) => v.into_iter().map(|v| v as f32).collect(),
        DecodingResult::I16(v) => v.into_iter().map(f32::from).collect(),
        DecodingResult::U16(v) => v.into_iter().map(f32::from).collect(),
        DecodingResult::I32(v) => v.into_iter().map(|v| v as f32).collect(),
        DecodingResult::U32(v) => v.into_iter().map(|v| v as f32).collect(),
        DecodingResult::U8(v) => v.into_iter().map(f32::from).collect(),
        _ => return None,
    })
}
