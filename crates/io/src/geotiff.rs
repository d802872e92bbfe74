//! GeoTIFF: height, deficit and distance maps out (f32, deflated, NaN = nothing), design surfaces in.

use crate::crs::{FileCrs, GeoKeys, Unit};
use crate::geotiff_band::{self, Band};
use crate::input::Input;
use crate::raster::Raster;
use crate::{IoError, Place};
use std::io::{Cursor, Read, Seek};
use std::path::Path;
use tiff::decoder::{Decoder, Limits};
use tiff::tags::Tag;

pub use crate::geotiff_writer::{write, write_named};

const GEO_KEYS: Tag = Tag::GeoKeyDirectoryTag;
/// Cells that any file may have, and how many more for each of its bytes.
const FREE_CELLS: u64 = 4_000_000;
const CELLS_PER_BYTE: u64 = 16;

/// What a GeoTIFF holds.
#[derive(Clone, Debug, PartialEq)]
pub struct HeightImage {
    /// Heights in metres.
    pub raster: Raster,
    /// What the file says of its coordinates.
    pub reference: FileCrs,
    /// Unit of the heights in the file, when it was not the metre.
    pub converted_from: Option<Unit>,
}

/// Reads the first band of a north-up GeoTIFF and the `EPSG:n` it names.
pub fn read(input: &mut Input) -> Result<(Raster, Option<String>), IoError> {
    let image = read_heights(input)?;
    let crs = image.reference.epsg();
    Ok((image.raster, crs))
}

/// Reads a north-up GeoTIFF of one band as heights: no-data, scale, offset, mask and unit are obeyed, anything else is refused.
pub fn read_heights(input: &mut Input) -> Result<HeightImage, IoError> {
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
    let place = place(&mut decoder, path)?;
    let keys = GeoKeys {
        directory: decoder.get_tag_u16_vec(GEO_KEYS).unwrap_or_default(),
        doubles: decoder.get_tag_f64_vec(Tag::GeoDoubleParamsTag).unwrap_or_default(),
        texts: decoder.get_tag_ascii_string(Tag::GeoAsciiParamsTag).unwrap_or_default(),
    };
    let reference = keys.crs();
    let band = Band::of(&mut decoder, path)?;
    let inverted = photometric(&mut decoder, path)?;
    let numbers = decoder.read_image().map_err(damaged)?;
    let mut value = band
        .heights(numbers, inverted)
        .ok_or_else(|| IoError::unsupported(path, "the image's numbers are of an unknown kind"))?;
    if value.len() as u64 != cells {
        return Err(IoError::malformed(path, Place::File, "the image is not whole"));
    }
    geotiff_band::apply_mask(&mut decoder, (columns, rows), &mut value, path)?;
    let stated = band.unit.clone().or_else(|| reference.vertical_unit.clone());
    let converted_from = stated.filter(|u| !u.is_metre());
    if let Some(unit) = &converted_from {
        if !unit.metres.is_finite() {
            let what = format!(
                "the heights are in `{unit}`, which is not known here; convert them to metres"
            );
            return Err(IoError::unsupported(path, what));
        }
        value.iter_mut().for_each(|v| *v = (f64::from(*v) * unit.metres) as f32);
    }
    if reference.depth {
        value.iter_mut().for_each(|v| *v = -*v);
    }
    let value: Vec<f32> = value.chunks(columns as usize).rev().flatten().copied().collect();
    // A tie point is a corner of its cell, or its middle when "pixel is point".
    let to_middle = if keys.pixel_is_point() { 0.0 } else { 0.5 };
    let cell_m = place.cell_m;
    let west = place.tie[3] + (to_middle - place.tie[0]) * cell_m;
    let top = place.tie[4] - (to_middle - place.tie[1]) * cell_m;
    let origin = [west, top - f64::from(rows - 1) * cell_m];
    let raster = Raster { origin, cell_m, columns: columns as usize, value };
    Ok(HeightImage { raster, reference, converted_from })
}

/// Where the cells lie: a tie point (column, row, 0, east, north, 0) and the edge of a cell.
struct Placed {
    cell_m: f64,
    tie: [f64; 6],
}

fn place<R: Read + Seek>(decoder: &mut Decoder<R>, path: &Path) -> Result<Placed, IoError> {
    let mut numbers = |tag: Tag| decoder.get_tag_f64_vec(tag).ok();
    let (scale, tie) = (numbers(Tag::ModelPixelScaleTag), numbers(Tag::ModelTiepointTag));
    let by_tie = scale
        .as_deref()
        .zip(tie.as_deref())
        .and_then(|(s, t)| Some(([*s.first()?, *s.get(1)?], t.get(..6)?.try_into().ok()?)));
    // A matrix says the same when it neither turns nor shears.
    let matrix = numbers(Tag::ModelTransformationTag).filter(|m| m.len() == 16);
    let by_matrix = matrix.filter(|m| m[1] == 0.0 && m[4] == 0.0).map(|m| {
        let tie: [f64; 6] = [0.0, 0.0, 0.0, m[3], m[7], 0.0];
        ([m[0], -m[5]], tie)
    });
    by_tie
        .or(by_matrix)
        .filter(|([w, h], t)| {
            *w > 0.0 && (w - h).abs() < 1e-9 * w && t.iter().all(|v: &f64| v.is_finite())
        })
        .map(|([cell_m, _], tie)| Placed { cell_m, tie })
        .ok_or_else(|| {
            let what = "the image has no position and cell size, or its cells are not square and north-up; warp it with gdalwarp";
            IoError::malformed(path, Place::File, what)
        })
}

/// Whether the decoder turns the numbers round ("white is zero", which says nothing of heights); refuses colours.
fn photometric<R: Read + Seek>(decoder: &mut Decoder<R>, path: &Path) -> Result<bool, IoError> {
    let kind = decoder.get_tag_u32(Tag::PhotometricInterpretation).unwrap_or(1);
    let samples = decoder.get_tag_u32(Tag::SamplesPerPixel).unwrap_or(1);
    if samples != 1 {
        return Err(IoError::unsupported(
            path,
            format!("the image has {samples} bands; give one band of heights"),
        ));
    }
    match kind {
        0 => Ok(true),
        1 => Ok(false),
        3 => Err(IoError::unsupported(
            path,
            "the numbers are places in a table of colours, not heights; give one band of heights",
        )),
        other => Err(IoError::unsupported(
            path,
            format!(
                "the image holds colours (photometric interpretation {other}); give one band of heights"
            ),
        )),
    }
}
