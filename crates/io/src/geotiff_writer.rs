//! GeoTIFF out: f32, deflated, NaN = nothing; the band says what it is and in which unit.

use crate::landxml::escaped;
use crate::raster::Raster;
use crate::{IoError, atomic, drawing};
use std::io::{self, Cursor};
use std::path::Path;
use tiff::encoder::{Compression, TiffEncoder, colortype::Gray32Float};
use tiff::tags::Tag;

/// GDAL's own tag for what TIFF has no words for.
const GDAL_METADATA: Tag = Tag::Unknown(42112);
const GEO_KEYS: Tag = Tag::GeoKeyDirectoryTag;

/// Writes the raster; `crs` is the site's (`EPSG:n`, anything else leaves the file without).
pub fn write(path: &Path, raster: &Raster, crs: &str) -> Result<(), IoError> {
    write_named(path, raster, crs, "")
}

/// The same with a name for the band, which says what its metres are.
pub fn write_named(path: &Path, raster: &Raster, crs: &str, band: &str) -> Result<(), IoError> {
    let bytes = bytes(raster, crs, band).map_err(|e| IoError::write(path, io::Error::other(e)))?;
    atomic::write_bytes(path, &bytes)
}

fn bytes(raster: &Raster, crs: &str, band: &str) -> tiff::TiffResult<Vec<u8>> {
    let mut out = Cursor::new(Vec::new());
    let mut encoder =
        TiffEncoder::new(&mut out)?.with_compression(Compression::Deflate(Default::default()));
    let (columns, rows) = (raster.columns, raster.rows());
    let mut image = encoder.new_image::<Gray32Float>(columns as u32, rows as u32)?;
    let [east, north] = raster.origin;
    let half = raster.cell_m / 2.0;
    let top = north + (rows as f64 - 1.0) * raster.cell_m + half;
    let tags = image.encoder();
    tags.write_tag(Tag::ModelPixelScaleTag, &[raster.cell_m, raster.cell_m, 0.0][..])?;
    tags.write_tag(Tag::ModelTiepointTag, &[0.0, 0.0, 0.0, east - half, top, 0.0][..])?;
    let code = drawing::epsg(crs).and_then(|c| u16::try_from(c).ok());
    // Version 1.1.0; model: projected (or user-defined); raster: pixel is area.
    let mut keys: Vec<u16> =
        vec![1, 1, 0, 2, 1024, 0, 1, if code.is_some() { 1 } else { 32767 }, 1025, 0, 1, 1];
    if let Some(code) = code {
        keys[3] = 4;
        keys.extend([3072, 0, 1, code, 3076, 0, 1, 9001]); // the CRS; metres
    }
    tags.write_tag(GEO_KEYS, &keys[..])?;
    tags.write_tag(Tag::GdalNodata, "nan")?;
    tags.write_tag(GDAL_METADATA, metadata(raster, band).as_str())?;
    // Images run from north to south.
    let data: Vec<f32> = raster.value.chunks(columns.max(1)).rev().flatten().copied().collect();
    image.write_data(&data)?;
    Ok(out.into_inner())
}

/// What GDAL and QGIS show of the band: its name, its unit, its statistics.
fn metadata(raster: &Raster, band: &str) -> String {
    let known = || raster.value.iter().copied().filter(|v| v.is_finite()).map(f64::from);
    let mut items =
        String::from("<Item name=\"UNITTYPE\" sample=\"0\" role=\"unittype\">metre</Item>");
    if !band.is_empty() {
        let name = escaped(band);
        items +=
            &format!("<Item name=\"DESCRIPTION\" sample=\"0\" role=\"description\">{name}</Item>");
    }
    let count = known().count();
    if count > 0 {
        let mean = known().sum::<f64>() / count as f64;
        let spread = (known().map(|v| (v - mean).powi(2)).sum::<f64>() / count as f64).sqrt();
        let [low, high] = [known().fold(f64::MAX, f64::min), known().fold(f64::MIN, f64::max)];
        for (name, value) in
            [("MINIMUM", low), ("MAXIMUM", high), ("MEAN", mean), ("STDDEV", spread)]
        {
            items += &format!("<Item name=\"STATISTICS_{name}\" sample=\"0\">{value}</Item>");
        }
    }
    format!("<GDALMetadata>{items}</GDALMetadata>")
}
