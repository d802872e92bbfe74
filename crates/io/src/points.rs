//! Point clouds by extension: whole, or thinned while reading; labelled clouds out.

use crate::input::Input;
use crate::mesh::extension;
use crate::thinning::Thinning;
use crate::{IoError, RawCloud, las, ply};
use geom::{Event, Observer};
use std::path::Path;

/// Extensions that can be read.
pub const READABLE: &str = ".las, .laz, .ply";

/// The whole cloud, as its file has it. Warns of what 32-bit storage has lost.
pub fn read(path: &Path, observer: &dyn Observer) -> Result<RawCloud, IoError> {
    let kind = known(path)?;
    read_as(&mut Input::open(path)?, &kind, observer)
}

/// The same from an opened file of a known kind (a lower-case extension).
pub fn read_as(input: &mut Input, kind: &str, observer: &dyn Observer) -> Result<RawCloud, IoError> {
    let mut cloud = RawCloud::default();
    let meta = stream(input, kind, &mut |batch| {
        cloud.append(batch);
        Ok(())
    })?;
    finish(input.path, cloud, meta, observer)
}

/// The cloud thinned to one point in each cube of this edge (in the file's unit) while it is read:
/// the memory needed follows the size of the site, not of the file.
pub fn read_thinned(path: &Path, cell_m: f64, observer: &dyn Observer) -> Result<RawCloud, IoError> {
    let kind = known(path)?;
    let mut input = Input::open(path)?;
    let mut thinning = Thinning::new(cell_m);
    let meta = stream(&mut input, &kind, &mut |batch| {
        thinning.add(&batch);
        Ok(())
    })?;
    let seen = thinning.seen();
    let cloud = thinning.finish();
    let message = format!("{}: {seen} points, {} after thinning to {cell_m} m", path.display(), cloud.len());
    observer.event(Event::Noted { stage: "read", message });
    finish(path, cloud, meta, observer)
}

/// Writes `.laz`, `.las` or `.ply`, whole or not at all.
pub fn write(path: &Path, cloud: &RawCloud) -> Result<(), IoError> {
    match extension(path).as_str() {
        "las" | "laz" => las::write_cloud(path, cloud),
        "ply" => ply::write_cloud(path, cloud),
        _ => Err(IoError::UnknownExtension { path: path.into(), known: ".laz, .las, .ply" }),
    }
}

fn known(path: &Path) -> Result<String, IoError> {
    let kind = extension(path);
    match kind.as_str() {
        "las" | "laz" | "ply" => Ok(kind),
        _ => Err(IoError::UnknownExtension { path: path.into(), known: READABLE }),
    }
}

/// Batches of any known kind into `sink`; what comes back has everything but the points.
pub fn stream(
    input: &mut Input,
    kind: &str,
    sink: &mut dyn FnMut(RawCloud) -> Result<(), IoError>,
) -> Result<RawCloud, IoError> {
    match kind {
        "las" | "laz" => las::stream(input, sink),
        "ply" => ply::stream(input, sink),
        _ => Err(IoError::UnknownExtension { path: input.path.into(), known: READABLE }),
    }
}

fn finish(path: &Path, mut cloud: RawCloud, meta: RawCloud, observer: &dyn Observer) -> Result<RawCloud, IoError> {
    if cloud.is_empty() {
        return Err(IoError::NoPoints { path: path.into() });
    }
    cloud.sensor_positions = meta.sensor_positions;
    cloud.crs = meta.crs;
    cloud.crs_wkt = meta.crs_wkt;
    cloud.float32 = meta.float32;
    cloud.invalid = meta.invalid;
    cloud.warn_of_rounding(path, observer);
    Ok(cloud)
}
