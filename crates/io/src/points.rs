//! Point clouds by extension: whole, or thinned while reading; labelled clouds out.

use crate::crs::{self, FileCrs, Unit};
use crate::input::Input;
use crate::mesh::extension;
use crate::read_options::{ReadOptions, Reason, describe};
use crate::thinning::Thinning;
use crate::{IoError, RawCloud, e57_scan, las, pcd, ply, text_cloud};
use geom::{DVec3, Event, Observer, Stage};
use std::path::Path;

/// Extensions that can be read.
pub const READABLE: &str = ".las, .laz, .copc.laz, .ply, .e57, .pcd, .xyz, .txt, .csv, .pts, .asc";

/// The whole cloud, as its file has it. Warns of what 32-bit storage has lost.
pub fn read(path: &Path, observer: &dyn Observer) -> Result<RawCloud, IoError> {
    read_with(path, &ReadOptions::default(), observer)
}

/// The same with options.
pub fn read_with(
    path: &Path,
    options: &ReadOptions,
    observer: &dyn Observer,
) -> Result<RawCloud, IoError> {
    let kind = known(path)?;
    read_as_with(&mut Input::open(path)?, &kind, options, observer)
}

/// The same from an opened file of a known kind (a lower-case extension).
pub fn read_as(
    input: &mut Input,
    kind: &str,
    observer: &dyn Observer,
) -> Result<RawCloud, IoError> {
    read_as_with(input, kind, &ReadOptions::default(), observer)
}

/// The same with options.
pub fn read_as_with(
    input: &mut Input,
    kind: &str,
    options: &ReadOptions,
    observer: &dyn Observer,
) -> Result<RawCloud, IoError> {
    let mut cloud = RawCloud::default();
    let meta = stream_with(input, kind, options, &mut |batch| {
        cloud.append(batch);
        Ok(())
    })?;
    finish(input.path, cloud, meta, options, observer)
}

/// The cloud thinned to one point in each cube of this edge (in the file's unit) while it is read:
/// the memory needed follows the size of the site, not of the file.
pub fn read_thinned(
    path: &Path,
    cell_m: f64,
    observer: &dyn Observer,
) -> Result<RawCloud, IoError> {
    read_thinned_with(path, cell_m, &ReadOptions::default(), observer)
}

/// The same with options.
pub fn read_thinned_with(
    path: &Path,
    cell_m: f64,
    options: &ReadOptions,
    observer: &dyn Observer,
) -> Result<RawCloud, IoError> {
    let kind = known(path)?;
    let mut input = Input::open(path)?;
    let mut thinning = Thinning::new(cell_m);
    let meta = stream_with(&mut input, &kind, options, &mut |batch| {
        thinning.add(&batch);
        Ok(())
    })?;
    let seen = thinning.seen();
    let cloud = thinning.finish();
    let message =
        format!("{}: {seen} points, {} after thinning to {cell_m} m", path.display(), cloud.len());
    observer.event(Event::Noted { stage: Stage::Read, message });
    finish(path, cloud, meta, options, observer)
}

/// The points inside a box (the file's coordinates): a part of a large survey. A COPC file is read only where it
/// touches the box.
pub fn read_box(
    path: &Path,
    low: DVec3,
    high: DVec3,
    observer: &dyn Observer,
) -> Result<RawCloud, IoError> {
    read_box_with(path, low, high, &ReadOptions::default(), observer)
}

/// The same with options.
pub fn read_box_with(
    path: &Path,
    low: DVec3,
    high: DVec3,
    options: &ReadOptions,
    observer: &dyn Observer,
) -> Result<RawCloud, IoError> {
    let kind = known(path)?;
    let mut input = Input::open(path)?;
    let mut cloud = RawCloud::default();
    let meta = if kind == "laz" && las::is_copc(&mut input)? {
        las::stream_box_with(&mut input, low, high, options, &mut |batch| {
            cloud.append(batch);
            Ok(())
        })?
    } else {
        input.go_to(0, "the header")?;
        stream_with(&mut input, &kind, options, &mut |batch| {
            let inside = |p: &DVec3| p.cmpge(low).all() && p.cmple(high).all();
            let index: Vec<usize> =
                (0..batch.len()).filter(|&i| inside(&batch.position[i])).collect();
            cloud.append(batch.select(&index));
            Ok(())
        })?
    };
    finish(path, cloud, meta, options, observer)
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

/// Batches of a file into `sink`, as they come: nothing is converted, nothing told. What comes back has everything but the points.
pub fn stream_file(
    path: &Path,
    options: &ReadOptions,
    sink: &mut dyn FnMut(RawCloud) -> Result<(), IoError>,
) -> Result<RawCloud, IoError> {
    let kind = known(path)?;
    let meta = stream_with(&mut Input::open(path)?, &kind, options, sink)?;
    Ok(RawCloud { reference: crs::or_beside(path, meta.reference.clone()), ..meta })
}

/// What the header of a cloud's file says of its coordinates, or the `.prj` beside it.
pub fn reference(path: &Path) -> Result<FileCrs, IoError> {
    let kind = known(path)?;
    let mut input = Input::open(path)?;
    let own = match kind.as_str() {
        "las" | "laz" => las::summary(&mut input)?.reference,
        "ply" => ply::reference(&mut input)?,
        "e57" => e57_scan::reference(&mut input)?,
        "pcd" => pcd::reference(&mut input)?,
        _ => text_cloud::reference(&mut input)?,
    };
    Ok(crs::or_beside(path, own))
}

/// Batches of any known kind into `sink`; what comes back has everything but the points.
pub fn stream(
    input: &mut Input,
    kind: &str,
    sink: &mut dyn FnMut(RawCloud) -> Result<(), IoError>,
) -> Result<RawCloud, IoError> {
    stream_with(input, kind, &ReadOptions::default(), sink)
}

/// The same with options.
pub fn stream_with(
    input: &mut Input,
    kind: &str,
    options: &ReadOptions,
    sink: &mut dyn FnMut(RawCloud) -> Result<(), IoError>,
) -> Result<RawCloud, IoError> {
    match kind {
        "las" | "laz" => las::stream_with(input, options, sink),
        "ply" => ply::stream_with(input, options, sink),
        "e57" => e57_scan::stream(input, sink),
        "pcd" => pcd::stream_with(input, options, sink),
        "xyz" | "txt" | "csv" | "pts" | "asc" => text_cloud::stream_with(input, options, sink),
        _ => Err(IoError::UnknownExtension { path: input.path.into(), known: READABLE }),
    }
}

fn finish(
    path: &Path,
    mut cloud: RawCloud,
    meta: RawCloud,
    options: &ReadOptions,
    observer: &dyn Observer,
) -> Result<RawCloud, IoError> {
    cloud.left_out = meta.left_out;
    cloud.classes = meta.classes;
    if meta.invalid > 0 {
        *cloud.left_out.entry(Reason::Invalid).or_default() += meta.invalid;
    }
    if cloud.is_empty() {
        let path = path.into();
        return Err(if cloud.left_out.is_empty() {
            IoError::NoPoints { path }
        } else {
            IoError::AllLeftOut { path, left_out: describe(&cloud.left_out) }
        });
    }
    cloud.sensor_positions = meta.sensor_positions;
    cloud.reference = crs::or_beside(path, meta.reference);
    cloud.named_axes = meta.named_axes;
    cloud.crs = meta.crs.or_else(|| cloud.reference.epsg());
    cloud.crs_wkt = meta.crs_wkt;
    cloud.float32 = meta.float32;
    cloud.invalid = meta.invalid;
    cloud.notes = meta.notes;
    // One number for all points says nothing of lines.
    cloud.line = cloud.line.filter(|line| line.windows(2).any(|w| w[0] != w[1]));
    cloud.warn_of_rounding(path, observer);
    cloud.warn_of_step(path, observer);
    if options.without_strays {
        leave_out_strays(path, &mut cloud, observer);
    }
    heights_in_metres(path, &mut cloud)?;
    if !cloud.left_out.is_empty() {
        let points = describe(&cloud.left_out);
        cloud.notes.push(format!("{points} points were left out"));
    }
    for note in &cloud.notes {
        let message = format!("{}: {note}", path.display());
        observer.event(Event::Noted { stage: Stage::Read, message });
    }
    Ok(cloud)
}

/// Takes out the points that lie far from all others, and says how many and where.
fn leave_out_strays(path: &Path, cloud: &mut RawCloud, observer: &dyn Observer) {
    let strays = geom::strays(&cloud.position);
    if strays.index.is_empty() {
        return;
    }
    let mut next = strays.index.iter().copied().peekable();
    let kept: Vec<usize> = (0..cloud.len()).filter(|i| next.next_if_eq(i).is_none()).collect();
    *cloud = cloud.select(&kept);
    let message = format!("{}: left out {}", path.display(), strays.describe());
    observer.event(Event::Warned(geom::Warning { stage: Stage::Read, message }));
}

/// Heights in another unit than metres, or counted downwards, become heights in metres where the file says so.
fn heights_in_metres(path: &Path, cloud: &mut RawCloud) -> Result<(), IoError> {
    let unit = cloud.reference.vertical_unit.clone().unwrap_or_else(Unit::metre);
    let down = cloud.reference.depth;
    if unit.is_metre() && !down {
        return Ok(());
    }
    if !unit.metres.is_finite() {
        return Err(IoError::unsupported(
            path,
            format!(
                "the heights are in the {unit}, which is not known here; convert them to metres"
            ),
        ));
    }
    let factor = if down { -unit.metres } else { unit.metres };
    cloud.position.iter_mut().for_each(|p| p.z *= factor);
    cloud.sensor_positions.iter_mut().for_each(|p| p.z *= factor);
    cloud.height_factor = Some(factor);
    cloud.notes.push(if down {
        format!("depths in the {unit} were turned into heights in metres")
    } else {
        format!("heights in the {unit} were turned into metres (× {factor:.9})")
    });
    Ok(())
}
