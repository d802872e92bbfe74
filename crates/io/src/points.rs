//! Point clouds by extension: whole, or thinned while reading; labelled clouds out.

use crate::input::Input;
use crate::mesh::extension;
use crate::thinning::Thinning;
use crate::{IoError, RawCloud, e57_scan, las, pcd, ply, xyz};
use geom::{DVec3, Event, Observer};
use std::path::Path;

/// Extensions that can be read.
pub const READABLE: &str = ".las, .laz, .copc.laz, .ply, .e57, .pcd, .xyz, .txt, .csv, .pts, .asc";

/// The whole cloud, as its file has it. Warns of what 32-bit storage has lost.
pub fn read(path: &Path, observer: &dyn Observer) -> Result<RawCloud, IoError> {
    let kind = known(path)?;
    read_as(&mut Input::open(path)?, &kind, observer)
}

/// The same from an opened file of a known kind (a lower-case extension).
pub fn read_as(
    input: &mut Input,
    kind: &str,
    observer: &dyn Observer,
) -> Result<RawCloud, IoError> {
    let mut cloud = RawCloud::default();
    let meta = stream(input, kind, &mut |batch| {
        cloud.append(batch);
        Ok(())
    })?;
    finish(input.path, cloud, meta, observer)
}

/// The cloud thinned to one point in each cube of this edge (in the file's unit) while it is read:
/// the memory needed follows the size of the site, not of the file.
pub fn read_thinned(
    path: &Path,
    cell_m: f64,
    observer: &dyn Observer,
) -> Result<RawCloud, IoError> {
    let kind = known(path)?;
    let mut input = Input::open(path)?;
    let mut thinning = Thinning::new(cell_m);
    let meta = stream(&mut input, &kind, &mut |batch| {
        thinning.add(&batch);
        Ok(())
    })?;
    let seen = thinning.seen();
    let cloud = thinning.finish();
    let message =
        format!("{}: {seen} points, {} after thinning to {cell_m} m", path.display(), cloud.len());
    observer.event(Event::Noted { stage: "read", message });
    finish(path, cloud, meta, observer)
}

/// The points inside a box (the file's coordinates): a part of a large survey. A COPC file is read only where it
/// touches the box.
pub fn read_box(
    path: &Path,
    low: DVec3,
    high: DVec3,
    observer: &dyn Observer,
) -> Result<RawCloud, IoError> {
    let kind = known(path)?;
    let mut input = Input::open(path)?;
    let mut cloud = RawCloud::default();
    let meta = if kind == "laz" && las::is_copc(&mut input)? {
        las::stream_box(&mut input, low, high, &mut |batch| {
            cloud.append(batch);
            Ok(())
        })?
    } else {
        input.go_to(0, "the header")?;
        stream(&mut input, &kind, &mut |batch| {
            let inside = |p: &DVec3| p.cmpge(low).all() && p.cmple(high).all();
            let index: Vec<usize> =
                (0..batch.len()).filter(|&i| inside(&batch.position[i])).collect();
            cloud.append(batch.select(&index));
            Ok(())
        })?
    };
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
        "las" | "laz" | "ply" | "e57" | "pcd" | "xyz" | "txt" | "csv" | "pts" | "asc" => Ok(kind),
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
        "e57" => e57_scan::stream(input, sink),
        "pcd" => pcd::stream(input, sink),
        "xyz" | "txt" | "csv" | "pts" | "asc" => xyz::stream(input, sink),
        _ => Err(IoError::UnknownExtension { path: input.path.into(), known: READABLE }),
    }
}

fn finish(
    path: &Path,
    mut cloud: RawCloud,
    meta: RawCloud,
    observer: &dyn Observer,
) -> Result<RawCloud, IoError> {
    if cloud.is_empty() {
        return Err(IoError::NoPoints { path: path.into() });
    }
    cloud.sensor_positions = meta.sensor_positions;
    cloud.crs = meta.crs;
    cloud.crs_wkt = meta.crs_wkt;
    cloud.float32 = meta.float32;
    cloud.invalid = meta.invalid;
    // One number for all points says nothing of lines.
    cloud.line = cloud.line.filter(|line| line.windows(2).any(|w| w[0] != w[1]));
    cloud.warn_of_rounding(path, observer);
    if cloud.invalid > 0 {
        let message = format!(
            "{}: {} points that the file marks as invalid were left out",
            path.display(),
            cloud.invalid
        );
        observer.event(Event::Noted { stage: "read", message });
    }
    Ok(cloud)
}
