//! Viewpoints around a scene, what they see of the surfaces, and the sea's edge.

use super::within;
use crate::SynthError;
use crate::camera::Camera;
use crate::range_map::RangeMap;
use crate::targets::{SurfacePoints, Targets};
use geom::{Bounds, SeedTree, Vec3, hidden_points};
use rand::{Rng, RngExt};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Cameras at one elevation, evenly around the middle of what they look at.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Ring {
    /// Angle above the horizon, degrees; 90 looks straight down.
    pub elevation_deg: f32,
    /// Number of cameras.
    pub cameras: u32,
}

/// The sea's edge: nothing is measured below, splash spoils the band above.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Waterline {
    /// Height of the water above the bed at the middle of the site, metres.
    pub level_m: f32,
    /// Height of the spoilt band, metres.
    pub band_m: f32,
    /// Share of the band's points that are missing.
    pub missing: f32,
    /// Share of the band's points thrown up by splash, 0.1 to 1 m.
    pub splash: f32,
}

/// Samples on each block that occlusion is counted on, at least.
pub(super) const SAMPLES_PER_BLOCK: f32 = 1500.0;
/// Samples for each point wanted: a pile shows about a third of its surface to one viewpoint.
const SURFACE_TO_SEEN: f32 = 3.5;
/// A few per cent more are drawn than the share seen asks for, against chance.
const SPARE: f32 = 1.03;
/// Least and most that a round adds, in densities so far.
const MORE: [f32; 2] = [0.05, 8.0];
/// Widest region one set of cameras looks at; longer sites get several sets.
const TILE_M: f32 = 40.0;

pub(super) fn check_rings(rings: &[Ring]) -> Result<(), SynthError> {
    if rings.is_empty() {
        return Err(SynthError::BadValue {
            key: "sensor.rings",
            value: 0.0,
            why: "give at least one ring of cameras",
        });
    }
    rings.iter().try_for_each(|ring| {
        within("sensor.rings.elevation_deg", ring.elevation_deg, [10.0, 90.0], "10 to 90 degrees")?;
        within("sensor.rings.cameras", ring.cameras as f32, [1.0, 64.0], "1 to 64 cameras")
    })
}

/// Cameras of all rings, `altitude_m` above the top of the scene.
pub(super) fn cameras(
    rings: &[Ring],
    altitude_m: f32,
    bounds: &Bounds,
    pixel_m: f32,
    turn_rad: f32,
) -> Vec<Camera> {
    let tiles = |axis: usize| {
        let size = bounds.size()[axis];
        let count = (size / TILE_M).ceil().max(1.0) as usize;
        (0..count).map(move |i| {
            let at = |k: usize| bounds.min[axis] + size * k as f32 / count as f32;
            [at(i), at(i + 1)]
        })
    };
    let mut cameras = Vec::new();
    for y in tiles(1) {
        for x in tiles(0) {
            let region = Bounds {
                min: Vec3::new(x[0], y[0], bounds.min.z),
                max: Vec3::new(x[1], y[1], bounds.max.z),
            };
            for ring in rings {
                let (sin, cos) = ring.elevation_deg.to_radians().sin_cos();
                let distance = (altitude_m + region.size().z / 2.0) / sin;
                for k in 0..ring.cameras {
                    let azimuth = turn_rad + std::f32::consts::TAU * k as f32 / ring.cameras as f32;
                    let out = Vec3::new(cos * azimuth.cos(), cos * azimuth.sin(), sin);
                    cameras.push(Camera::looking_at(
                        &region,
                        region.centre() + out * distance,
                        pixel_m,
                    ));
                }
            }
        }
    }
    cameras
}

/// Surface points with one of the views that see each.
pub(super) struct VisiblePoints {
    pub points: SurfacePoints,
    /// A view that sees the point, drawn evenly; `None` when too few see it.
    pub view: Vec<Option<u16>>,
}

/// Samples the surfaces densely enough that about `wanted` points are seen by `least_views` cameras.
pub(super) fn seen_points(
    targets: &Targets,
    maps: &[RangeMap<Camera>],
    least_views: u16,
    wanted: usize,
    seed: SeedTree,
) -> VisiblePoints {
    let blocks = targets.block_count() as f32;
    let mut per_m2 = (SAMPLES_PER_BLOCK * blocks).max(wanted as f32) / targets.area_m2();
    let mut seen = look(
        targets.sample(per_m2, seed.child("sample", 0)),
        maps,
        least_views,
        seed.child("view", 0),
    );
    // The share seen so far says how many more samples are needed; a few per cent extra make up for chance.
    for round in 1..6 {
        let visible = seen.view.iter().flatten().count();
        if visible >= wanted || visible == 0 {
            break;
        }
        let more =
            per_m2 * ((wanted as f32 * SPARE / visible as f32) - 1.0).clamp(MORE[0], MORE[1]);
        let next = look(
            targets.sample(more, seed.child("sample", round)),
            maps,
            least_views,
            seed.child("view", round),
        );
        per_m2 += more;
        seen.points.append(next.points);
        seen.view.extend(next.view);
    }
    seen
}

/// The same by hidden-point removal on the points themselves (Katz et al. 2007), from every position.
pub(super) fn seen_points_by_removal(
    targets: &Targets,
    positions: &[Vec3],
    least_views: u16,
    wanted: usize,
    seed: SeedTree,
) -> Result<VisiblePoints, SynthError> {
    let per_m2 = SURFACE_TO_SEEN * wanted as f32 / targets.area_m2();
    let points = targets.sample(per_m2, seed.child("surface", 0));
    let mut views = vec![0_u16; points.position.len()];
    let mut view = vec![None; points.position.len()];
    let mut rng = seed.child("view", 0).rng();
    for (k, &from) in positions.iter().enumerate() {
        for i in hidden_points::visible(&points.position, from, hidden_points::RADIUS_FACTOR)? {
            views[i] += 1;
            // Each of the views so far is kept with the same chance.
            if views[i] == 1 || rng.random_range(0..views[i]) == 0 {
                view[i] = Some(k as u16);
            }
        }
    }
    for (view, count) in view.iter_mut().zip(views) {
        *view = view.filter(|_| count >= least_views);
    }
    Ok(VisiblePoints { points, view })
}

fn look(
    points: SurfacePoints,
    maps: &[RangeMap<Camera>],
    least_views: u16,
    seed: SeedTree,
) -> VisiblePoints {
    let start = seed.value() as usize;
    let look = |i: usize| {
        // Views in rotated order: the first that sees the point is an even draw, and the search may stop early.
        let shift = (start ^ i.wrapping_mul(0x9e37_79b9_7f4a_7c15)) >> 7;
        let order = (0..maps.len()).map(|k| (k + shift) % maps.len());
        let mut seeing = order.filter(|&k| maps[k].sees(points.position[i], points.normal[i]));
        let first = seeing.next()?;
        (seeing.take(usize::from(least_views) - 1).count() + 1 >= usize::from(least_views))
            .then_some(first as u16)
    };
    let view = (0..points.position.len()).into_par_iter().map(look).collect();
    VisiblePoints { points, view }
}

/// Occlusion of every block: 1 − visible samples / all samples (Eq. 3.14).
pub(super) fn occlusion(owner: &[u32], visible: impl Iterator<Item = bool>) -> Vec<f32> {
    let blocks = owner.iter().copied().max().unwrap_or(0) as usize;
    let (mut all, mut seen) = (vec![0_u32; blocks + 1], vec![0_u32; blocks + 1]);
    for (&k, visible) in owner.iter().zip(visible) {
        all[k as usize] += 1;
        seen[k as usize] += u32::from(visible);
    }
    (1..=blocks).map(|k| 1.0 - seen[k] as f32 / (all[k].max(1)) as f32).collect()
}

/// `count` of `from` in random order; all of them when there are fewer.
pub(super) fn thinned(mut from: Vec<usize>, count: usize, rng: &mut impl Rng) -> Vec<usize> {
    let count = count.min(from.len());
    for i in 0..count {
        let j = rng.random_range(i..from.len());
        from.swap(i, j);
    }
    from.truncate(count);
    from
}
