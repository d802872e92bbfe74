//! What a GeoTIFF's band holds: its numbers as heights, with no-data, scale, offset and mask obeyed.

use crate::crs::Unit;
use crate::{IoError, Place};
use roxmltree::Document;
use std::io::{Read, Seek};
use std::path::Path;
use tiff::decoder::{Decoder, DecodingResult};
use tiff::tags::Tag;

/// GDAL's own tag with scale, offset and unit of each band.
const METADATA: u16 = 42_112;

/// How stored numbers become heights.
#[derive(Clone, Debug, PartialEq)]
pub struct Band {
    /// As the file writes it.
    nodata: Option<String>,
    scale: f64,
    offset: f64,
    /// Unit of the heights, when the file names one.
    pub unit: Option<Unit>,
}

impl Band {
    /// Reads the tags of the present image.
    pub fn of<R: Read + Seek>(decoder: &mut Decoder<R>, path: &Path) -> Result<Self, IoError> {
        let text = |decoder: &mut Decoder<R>, tag: Tag| {
            let text = decoder.get_tag_ascii_string(tag).ok()?;
            Some(text.trim_matches(['\0', ' ', '\n']).to_string())
        };
        let nodata = text(decoder, Tag::GdalNodata);
        let mut band = Self { nodata, scale: 1.0, offset: 0.0, unit: None };
        let Some(xml) = text(decoder, Tag::Unknown(METADATA)) else { return Ok(band) };
        let broken = |what: String| IoError::malformed(path, Place::File, what);
        let document = Document::parse(&xml)
            .map_err(|e| broken(format!("the band's metadata cannot be read: {e}")))?;
        for item in document.descendants().filter(|n| n.tag_name().name() == "Item") {
            if item.attribute("sample").is_some_and(|s| s.trim() != "0") {
                continue;
            }
            let value = item.text().unwrap_or_default().trim();
            let number = || {
                let number = value.parse().ok().filter(|v: &f64| v.is_finite());
                number
                    .ok_or_else(|| broken(format!("the band's metadata `{value}` is not a number")))
            };
            match item.attribute("role") {
                Some("scale") => band.scale = number()?,
                Some("offset") => band.offset = number()?,
                Some("unittype") if !value.is_empty() => band.unit = Some(Unit::of_word(value)),
                _ => {}
            }
        }
        if band.scale == 0.0 {
            return Err(broken("the band's scale is 0".into()));
        }
        Ok(band)
    }

    /// The numbers as heights in the band's unit, NaN where there are none. No-data is compared in the band's own type.
    pub fn heights(&self, numbers: DecodingResult, inverted: bool) -> Option<Vec<f32>> {
        macro_rules! heights {
            ($values:expr, $t:ty, $undo:expr) => {{
                let hole = self.nodata.as_deref().and_then(|t| Self::of_type::<$t>(t, |v| v as $t));
                $values
                    .into_iter()
                    .map(|v| {
                        let v: $t = if inverted { $undo(v) } else { v };
                        if Some(v) == hole { f32::NAN } else { self.height(v as f64) }
                    })
                    .collect()
            }};
        }
        Some(match numbers {
            DecodingResult::F32(v) => heights!(v, f32, |v: f32| 1.0 - v),
            DecodingResult::F64(v) => heights!(v, f64, |v: f64| 1.0 - v),
            DecodingResult::U8(v) => heights!(v, u8, |v: u8| !v),
            DecodingResult::U16(v) => heights!(v, u16, |v: u16| !v),
            DecodingResult::U32(v) => heights!(v, u32, |v: u32| !v),
            DecodingResult::I8(v) => heights!(v, i8, |v: i8| v),
            DecodingResult::I16(v) => heights!(v, i16, |v: i16| v),
            DecodingResult::I32(v) => heights!(v, i32, |v: i32| v),
            _ => return None,
        })
    }

    /// The no-data text in the band's type: whole numbers from the digits, so that none is lost on the way.
    fn of_type<T: std::str::FromStr>(text: &str, narrow: impl Fn(f64) -> T) -> Option<T> {
        text.parse().ok().or_else(|| text.parse().ok().map(narrow))
    }

    fn height(&self, stored: f64) -> f32 {
        let height = stored * self.scale + self.offset;
        if height.is_finite() { height as f32 } else { f32::NAN }
    }
}

/// The mask that GDAL keeps in a second image, as holes in the first; `Err` when there is one that cannot be read.
pub fn apply_mask<R: Read + Seek>(
    decoder: &mut Decoder<R>,
    size: (u32, u32),
    value: &mut [f32],
    path: &Path,
) -> Result<(), IoError> {
    while decoder.more_images() {
        if decoder.next_image().is_err() {
            return Ok(()); // an image of a kind that is none of ours
        }
        let kind = decoder.get_tag_u32(Tag::NewSubfileType).unwrap_or(0);
        if kind & 4 == 0 || decoder.dimensions().ok() != Some(size) {
            continue; // a smaller picture of the same, or another page
        }
        return match decoder.read_image() {
            Ok(DecodingResult::U8(mask)) if mask.len() == value.len() => {
                let holes = value.iter_mut().zip(mask).filter(|(_, m)| *m == 0);
                holes.for_each(|(v, _)| *v = f32::NAN);
                Ok(())
            }
            Ok(DecodingResult::U8(bits))
                if bits.len() == (size.0 as usize).div_ceil(8) * size.1 as usize =>
            {
                let (columns, row_bytes) = (size.0 as usize, (size.0 as usize).div_ceil(8));
                for (i, v) in value.iter_mut().enumerate() {
                    let (row, column) = (i / columns, i % columns);
                    if bits[row * row_bytes + column / 8] >> (7 - column % 8) & 1 == 0 {
                        *v = f32::NAN;
                    }
                }
                Ok(())
            }
            _ => Err(masked(path)),
        };
    }
    Ok(())
}

/// A mask that says where nothing is designed must not be passed over.
pub fn masked(path: &Path) -> IoError {
    IoError::unsupported(
        path,
        "the image has a mask that is not read here; write the masked cells as no-data, e.g. with `gdalwarp -dstnodata -9999`",
    )
}
