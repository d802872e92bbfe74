//! E57 (laser scanners): every scan in the file's common frame; where each scanner stood is kept.

use crate::crs;
use crate::input::Input;
use crate::raw_cloud::RawCloud;
use crate::sensor_place::Station;
use crate::{IoError, Place};
use e57::{CartesianCoordinate, E57Reader};
use geom::DVec3;
use std::panic::{AssertUnwindSafe, catch_unwind};

const BATCH: usize = 65_536;
const PAGE: u64 = 1024;
/// As for LAZ: points that a byte may hold, and points that any file may hold.
const POINTS_PER_BYTE: u64 = 2;
const FREE_POINTS: u64 = 250_000;

/// Hands the points on in batches; what comes back has everything but the points.
pub fn stream(
    input: &mut Input,
    sink: &mut dyn FnMut(RawCloud) -> Result<(), IoError>,
) -> Result<RawCloud, IoError> {
    check_header(input)?;
    let (path, file_bytes) = (input.path, input.len);
    // The library indexes by numbers of the file in places; damage must end here, not end the program.
    catch_unwind(AssertUnwindSafe(|| stream_scans(input, sink))).unwrap_or_else(|_| {
        Err(IoError::malformed(path, Place::File, format!("the {file_bytes} bytes are damaged")))
    })
}

/// A code, or well-known text.
fn of_metadata(text: &str) -> crs::FileCrs {
    crs::code(text).map_or_else(|| crs::of_text(text), crs::FileCrs::of_code)
}

/// What the file says of its coordinates.
pub(crate) fn reference(input: &mut Input) -> Result<crs::FileCrs, IoError> {
    check_header(input)?;
    let path = input.path;
    let damaged = |what: String| IoError::malformed(path, Place::File, format!("E57: {what}"));
    let read = catch_unwind(AssertUnwindSafe(|| {
        let reader = E57Reader::new(&mut *input).map_err(|e| e.to_string())?;
        Ok(reader.coordinate_metadata().map(of_metadata).unwrap_or_default())
    }));
    read.unwrap_or_else(|_| Err("the file is damaged".into())).map_err(damaged)
}

/// The library allocates by these numbers before it looks at the file's size.
fn check_header(input: &mut Input) -> Result<(), IoError> {
    let mut head = [0; 48];
    input.fill(&mut head, "the header")?;
    let number = |at: usize| u64::from_le_bytes(head[at..at + 8].try_into().expect("eight bytes"));
    if &head[..8] != b"ASTM-E57" {
        return Err(input
            .malformed(Place::File, "this is not an E57 file: it does not start with `ASTM-E57`"));
    }
    let (xml_at, xml_bytes, page) = (number(24), number(32), number(40));
    if page != PAGE || xml_at.checked_add(xml_bytes).is_none_or(|end| end > input.len) {
        let what = format!(
            "pages of {page} bytes and {xml_bytes} bytes of XML at {xml_at} do not fit the file"
        );
        return Err(input.malformed(Place::File, what));
    }
    input.go_to(0, "the header")
}

fn stream_scans(
    input: &mut Input,
    sink: &mut dyn FnMut(RawCloud) -> Result<(), IoError>,
) -> Result<RawCloud, IoError> {
    let (path, file_bytes) = (input.path, input.len);
    let damaged = |e: e57::Error| IoError::malformed(path, Place::File, format!("E57: {e}"));
    let mut reader = E57Reader::new(&mut *input).map_err(damaged)?;
    let mut meta = RawCloud::default();
    if let Some(wkt) = reader.coordinate_metadata().filter(|w| !w.trim().is_empty()) {
        meta.reference = of_metadata(wkt);
        meta.crs = meta.reference.epsg();
        meta.crs_wkt = Some(wkt.to_string());
    }
    let scans = reader.pointclouds();
    let promised = scans.iter().fold(0_u64, |sum, s| sum.saturating_add(s.records));
    let at_most = file_bytes.saturating_mul(POINTS_PER_BYTE).saturating_add(FREE_POINTS);
    if promised > at_most {
        return Err(IoError::TooMany {
            path: path.into(),
            what: "points",
            promised,
            at_most,
            file_bytes,
        });
    }
    let mut done = 0;
    for scan in &scans {
        let pose = scan.transform.as_ref();
        let place = pose.map(|p| DVec3::new(p.translation.x, p.translation.y, p.translation.z));
        let turned = pose.is_some_and(|p| (p.rotation.w.abs() - 1.0).abs() > 1e-9);
        let mut station = Station::new(place.filter(|p| p.is_finite()), turned);
        let fresh = || RawCloud { record: Some(Vec::new()), ..RawCloud::default() };
        let mut batch = fresh();
        for point in reader.pointcloud_simple(scan).map_err(damaged)? {
            done += 1;
            match point.map_err(damaged)?.cartesian {
                CartesianCoordinate::Valid { x, y, z } => {
                    if !(x.is_finite() && y.is_finite() && z.is_finite()) {
                        return Err(IoError::NotFinite {
                            path: path.into(),
                            at: Place::Record(done),
                            x,
                            y,
                            z,
                        });
                    }
                    batch.position.push(DVec3::new(x, y, z));
                    station.see(DVec3::new(x, y, z));
                    if let Some(column) = &mut batch.record {
                        column.push(u32::try_from(done - 1).unwrap_or(u32::MAX));
                    }
                }
                _ => meta.invalid += 1,
            }
            if batch.len() == BATCH {
                sink(std::mem::replace(&mut batch, fresh()))?;
            }
        }
        if !batch.is_empty() {
            sink(batch)?;
        }
        station.finish(&mut meta);
    }
    Ok(meta)
}
