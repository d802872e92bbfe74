//! One survey looked at in a single pass and bounded memory: extent, levels, density, step, what the file says of itself.

use geom::{DVec3, strays};
use io::crs::FileCrs;
use io::read_options::{LeftOut, Reason};
use io::{IoError, RawCloud, ReadOptions};
use scene::{Area, AxisOrder};
use serde::Serialize;
use std::collections::HashSet;
use std::path::Path;

/// Points that are kept of a survey of any size.
const SAMPLE: usize = 1_000_000;

/// What a survey holds.
#[derive(Clone, Debug, Default, Serialize)]
pub struct SurveyLook {
    /// The file.
    pub file: String,
    /// Points that are read.
    pub points: u64,
    /// Points that are left out, by reason.
    pub left_out: Vec<(String, u64)>,
    /// Share of all points that are water, as far as the file classes them.
    pub water_share: f64,
    /// Share of all points that are ground, and vegetation, as far as the file classes them; `None`: it does not.
    pub ground_share: Option<f64>,
    /// See `ground_share`.
    pub vegetation_share: Option<f64>,
    /// Lower corner of the bulk: east, north, height, metres.
    pub low: [f64; 3],
    /// Upper corner.
    pub high: [f64; 3],
    /// Heights below which 2, 50 and 98 % of the points lie, metres.
    pub levels_m: [f64; 3],
    /// Points on a square metre of the ground they cover.
    pub density_per_m2: f64,
    /// Step of the stored numbers, metres; 0 = none to speak of.
    pub step_m: f64,
    /// What 32-bit storage has cost at these coordinates, metres; 0 for doubles.
    pub rounding_m: f64,
    /// What the file says of its coordinates, in words; empty when nothing.
    pub crs: String,
    /// Points far from all others, in words; empty when there are none.
    pub strays: String,
    /// What the reader took for what.
    pub notes: Vec<String>,
    /// Evenly chosen points in site coordinates, strays left out.
    #[serde(skip)]
    pub sample: Vec<DVec3>,
    /// What the file says of its coordinates.
    #[serde(skip)]
    pub reference: FileCrs,
    /// Whether `sample` holds every point.
    #[serde(skip)]
    pub whole: bool,
}

/// Every `stride`-th point, so that the whole is never held.
#[derive(Default)]
struct Sample {
    points: Vec<DVec3>,
    stride: u64,
    seen: u64,
}

impl Sample {
    fn add(&mut self, batch: &RawCloud, inside: impl Fn(&DVec3) -> bool) {
        self.stride = self.stride.max(1);
        for p in batch.position.iter().filter(|p| inside(p)) {
            if self.seen.is_multiple_of(self.stride) {
                self.points.push(*p);
            }
            self.seen += 1;
            if self.points.len() == 2 * SAMPLE {
                let mut keep = false;
                self.points.retain(|_| {
                    keep = !keep;
                    keep
                });
                self.stride *= 2;
            }
        }
    }
}

/// What a site says of a survey's coordinates.
#[derive(Clone, Copy, Default)]
pub(crate) struct Placed<'a> {
    /// How the file's columns run.
    pub axis_order: AxisOrder,
    /// Added to its heights, metres.
    pub offset_m: f64,
    /// The part that is looked at.
    pub area: Option<&'a Area>,
}

/// Looks at a file, or what of it lies in the area.
pub(crate) fn look(
    file: &Path,
    options: &ReadOptions,
    placed: &Placed,
) -> Result<SurveyLook, IoError> {
    let Placed { axis_order, offset_m, area } = *placed;
    let mut sample = Sample::default();
    let meta = io::points::stream_file(file, options, &mut |batch| {
        let axes = if batch.named_axes { AxisOrder::EastNorth } else { axis_order };
        let corners = area.map(|area| area.corners(axes));
        let inside = |p: &DVec3| corners.is_none_or(|[l, h]| p.cmpge(l).all() && p.cmple(h).all());
        sample.add(&batch, inside);
        Ok(())
    })?;
    let Sample { points, seen, stride } = sample;
    let mut left_out = meta.left_out.clone();
    if meta.invalid > 0 {
        *left_out.entry(Reason::Invalid).or_default() += meta.invalid;
    }
    if points.is_empty() {
        if let Some(Area { west, east, south, north }) = area {
            let what = format!(
                "none of its points lies in the area (east {west} to {east}, north {south} to {north}); is the axis order right?"
            );
            return Err(IoError::Unsupported { path: file.into(), what });
        }
        let path = file.into();
        return Err(if left_out.is_empty() {
            IoError::NoPoints { path }
        } else {
            let left_out = io::read_options::describe(&left_out);
            IoError::AllLeftOut { path, left_out }
        });
    }
    let mut look = stated(file, &meta, &left_out, seen, stride);
    let reference = meta.reference.clone();
    let float32 = meta.float32;
    let raw = RawCloud { position: points, reference, float32, ..RawCloud::default() };
    let unit = meta.reference.vertical_unit.as_ref().map_or(1.0, |u| u.metres);
    (look.step_m, look.rounding_m) = (raw.step(), raw.rounding_m());
    let factor = if meta.reference.depth { -unit } else { unit };
    if let Some(named) = meta.reference.vertical_unit.as_ref().filter(|u| !u.is_metre()) {
        look.notes.push(format!("heights in the {named} count as metres (× {unit:.9})"));
    }
    if meta.reference.depth {
        look.notes.push("depths count as heights".into());
    }
    let turned = |p: DVec3| {
        let p = DVec3::new(p.x, p.y, p.z * factor + offset_m);
        if meta.named_axes { p } else { axis_order.east_north_up(p) }
    };
    measure(&mut look, raw.position.into_iter().map(turned).collect());
    Ok(look)
}

/// The same of a survey that was read, so that no file is read twice: its heights are metres, its strays gone, `offset_m` not added
/// yet. The cloud holds a point at least.
pub fn look_of_cloud(
    file: &Path,
    cloud: &RawCloud,
    axis_order: AxisOrder,
    offset_m: f64,
) -> SurveyLook {
    let mut sample = Sample::default();
    sample.add(cloud, |_| true);
    let mut look = SurveyLook {
        step_m: cloud.step(),
        rounding_m: cloud.rounding_m(),
        ..stated(file, cloud, &cloud.left_out, sample.seen, sample.stride)
    };
    let turned = |p: DVec3| {
        let p = DVec3::new(p.x, p.y, p.z + offset_m);
        if cloud.named_axes { p } else { axis_order.east_north_up(p) }
    };
    measure(&mut look, sample.points.into_iter().map(turned).collect());
    look
}

/// What the file says of itself, beside its points.
fn stated(file: &Path, meta: &RawCloud, left_out: &LeftOut, read: u64, stride: u64) -> SurveyLook {
    let mut look = SurveyLook {
        file: file.display().to_string(),
        points: read,
        water_share: share(left_out, Reason::Class(9), read),
        ground_share: of_classes(meta, &[2]),
        vegetation_share: of_classes(meta, &[3, 4, 5]),
        whole: stride <= 1,
        left_out: left_out.iter().map(|(r, n)| (r.to_string(), *n)).collect(),
        notes: meta.notes.clone(),
        reference: meta.reference.clone(),
        ..SurveyLook::default()
    };
    if !look.reference.is_unstated() {
        look.crs = look.reference.label();
    }
    look
}

/// Share of the points that have these classes; `None` where the file classes nothing.
fn of_classes(meta: &RawCloud, wanted: &[u8]) -> Option<f64> {
    // 0 and 1 are "not classified".
    meta.classes.keys().any(|class| *class > 1).then_some(())?;
    let all: u64 = meta.classes.values().sum();
    let own: u64 = wanted.iter().filter_map(|class| meta.classes.get(class)).sum();
    Some(own as f64 / all.max(1) as f64)
}

fn share(left_out: &LeftOut, reason: Reason, read: u64) -> f64 {
    let all = read + left_out.values().sum::<u64>();
    left_out.get(&reason).copied().unwrap_or(0) as f64 / all.max(1) as f64
}

fn measure(look: &mut SurveyLook, mut points: Vec<DVec3>) {
    let found = strays(&points);
    if !found.index.is_empty() {
        look.strays = found.describe();
        let mut next = found.index.iter().copied().peekable();
        let mut i = 0;
        points.retain(|_| {
            let keep = next.next_if_eq(&i).is_none();
            i += 1;
            keep
        });
    }
    let first = points[0];
    let (low, high) = points.iter().fold((first, first), |(l, h), p| (l.min(*p), h.max(*p)));
    (look.low, look.high) = (low.to_array(), high.to_array());
    let mut heights: Vec<f64> = points.iter().map(|p| p.z).collect();
    heights.sort_by(f64::total_cmp);
    let at = |share: f64| heights[((heights.len() - 1) as f64 * share).round() as usize];
    look.levels_m = [at(0.02), at(0.5), at(0.98)];
    look.density_per_m2 = density(&points, low, high, look.points);
    look.sample = points;
}

/// Points over the area of the cells that hold any; cells so large that a covered one is rarely empty.
fn density(points: &[DVec3], low: DVec3, high: DVec3, all: u64) -> f64 {
    let size = (high - low).truncate().max_element();
    let cell = (size / (points.len() as f64).sqrt() * 4.0).max(1e-9);
    let key = |p: &DVec3| ((*p - low) / cell).floor().to_array().map(|v| v as i64);
    let cells: HashSet<[i64; 2]> = points.iter().map(|p| [key(p)[0], key(p)[1]]).collect();
    all as f64 / (cells.len() as f64 * cell * cell)
}
