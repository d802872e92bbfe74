//! Surface change where there is no block: M3C2 (Lague, Brodu and Leroux 2013).
//!
//! In: two clouds in one frame. Out, at core places of the earlier one: the distance between both surfaces along the normal at a
//! scale, with its level of detection. Points of each cloud within a cylinder about the normal give a mean and a roughness; level
//! = 1.96·(√(σ₁²/n₁ + σ₂²/n₂) + registration).

use crate::dense::along;
use crate::motion::covariance_at;
use crate::registration::Registration;
use geom::{PointGrid, Vec3, normals, thin_from_lowest};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Scales of the comparison, in block lengths.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SurfaceConfig {
    /// Distance of core places.
    pub core_blocks: f32,
    /// Radius of the normals.
    pub normal_blocks: f32,
    /// Radius of the cylinder.
    pub cylinder_blocks: f32,
    /// Half its length: larger changes are not seen.
    pub reach_blocks: f32,
    /// Fewest points of each cloud in a cylinder.
    pub least_points: usize,
}

impl Default for SurfaceConfig {
    fn default() -> Self {
        Self {
            core_blocks: 0.15,
            normal_blocks: 0.25,
            cylinder_blocks: 0.125,
            reach_blocks: 0.75,
            least_points: 5,
        }
    }
}

/// What the surface did at one place.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct SurfaceChange {
    /// The place, earlier epoch's local frame.
    pub place: Vec3,
    /// Unit normal at the scale, upwards.
    pub normal: Vec3,
    /// Later less earlier along the normal, metres.
    pub distance_m: f64,
    /// Below this nothing is known, metres.
    pub level_m: f64,
    /// Points of the earlier and the later cloud in the cylinder.
    pub points: [usize; 2],
}

impl SurfaceChange {
    /// Whether it is beyond its level.
    pub fn is_change(&self) -> bool {
        self.distance_m.abs() > self.level_m
    }
}

/// Where both clouds show a surface: the change at core places `size_m` (a block's length) times the scales apart.
/// `later` is registered by `registration`, whose error widens the level.
pub fn surface_changes(
    earlier: &[Vec3],
    later: &[Vec3],
    size_m: f32,
    registration: &Registration,
    config: &SurfaceConfig,
) -> Vec<SurfaceChange> {
    let kept = thin_from_lowest(earlier, config.core_blocks * size_m).kept;
    let cores: Vec<Vec3> = kept.iter().map(|&i| earlier[i as usize]).collect();
    let normal = core_normals(earlier, &cores, config.normal_blocks * size_m);
    at_cores([earlier, later], &cores, &normal, size_m, registration, config)
}

/// Normals of some places from all points around them.
fn core_normals(points: &[Vec3], cores: &[Vec3], radius_m: f32) -> Vec<Vec3> {
    // One point a fifth of the radius is plenty for a plane.
    let kept = thin_from_lowest(points, 0.2 * radius_m).kept;
    let mut cloud: Vec<Vec3> = cores.to_vec();
    cloud.extend(kept.iter().map(|&i| points[i as usize]));
    let mut all = normals(&cloud, radius_m, &|_| Vec3::Z);
    all.truncate(cores.len());
    all
}

/// The same at given places with given normals; places without a normal or with too few points are left out.
pub fn at_cores(
    clouds: [&[Vec3]; 2],
    cores: &[Vec3],
    normal: &[Vec3],
    size_m: f32,
    registration: &Registration,
    config: &SurfaceConfig,
) -> Vec<SurfaceChange> {
    let radius_m = config.cylinder_blocks * size_m;
    let grids = clouds.map(|c| PointGrid::new(c, radius_m));
    let one = |i: usize| {
        let (place, normal) = (cores[i], normal[i]);
        if normal == Vec3::ZERO {
            return None;
        }
        let reach_m = config.reach_blocks * size_m;
        let [a, b] = [0, 1].map(|k| cylinder(&grids[k], place, normal, radius_m, reach_m));
        if a.count.min(b.count) < config.least_points {
            return None;
        }
        let of_motion =
            covariance_at(registration.motion.pivot(), place.as_dvec3(), &registration.covariance);
        let direction = normal.as_dvec3().to_array();
        let of_registration = along(&crate::dense::part(&of_motion, 0), direction).max(0.0).sqrt();
        let of_mean = (a.variance / a.count as f64 + b.variance / b.count as f64).sqrt();
        Some(SurfaceChange {
            place,
            normal,
            distance_m: b.mean - a.mean,
            level_m: 1.96 * (of_mean + of_registration),
            points: [a.count, b.count],
        })
    };
    (0..cores.len()).into_par_iter().filter_map(one).collect()
}

/// Points in a cylinder: how many, mean and variance along its axis.
struct Cylinder {
    count: usize,
    mean: f64,
    variance: f64,
}

fn cylinder(grid: &PointGrid, place: Vec3, axis: Vec3, radius_m: f32, reach_m: f32) -> Cylinder {
    let step = 1.5 * radius_m;
    let slices = (2.0 * reach_m / step).ceil() as usize;
    // A ball that holds a slice of the cylinder.
    let ball = (radius_m * radius_m + 0.25 * step * step).sqrt();
    let (mut count, mut sum, mut squares) = (0, 0.0, 0.0);
    for k in 0..slices {
        let low = -reach_m + k as f32 * step;
        let high = (low + step).min(reach_m);
        let middle = place + axis * (0.5 * (low + low + step));
        grid.for_each_within(middle, ball, |_, p, _| {
            let d = p - place;
            let t = d.dot(axis);
            let across2 = d.length_squared() - t * t;
            if t >= low && t < high && across2 <= radius_m * radius_m {
                count += 1;
                sum += f64::from(t);
                squares += f64::from(t) * f64::from(t);
            }
        });
    }
    let n = f64::from(count.max(1));
    let mean = sum / n;
    let variance = (squares / n - mean * mean).max(0.0);
    Cylinder { count: count as usize, mean, variance }
}

/// For every point of a cloud the change at the nearest core place within two core distances, metres; NaN without one.
pub fn of_points(points: &[Vec3], changes: &[SurfaceChange], size_m: f32) -> Vec<f32> {
    let places: Vec<Vec3> = changes.iter().map(|c| c.place).collect();
    let reach_m = 2.0 * SurfaceConfig::default().core_blocks * size_m;
    let grid = PointGrid::new(&places, reach_m);
    let one = |p: &Vec3| {
        grid.nearest_within(*p, reach_m)
            .map_or(f32::NAN, |(i, _)| changes[i as usize].distance_m as f32)
    };
    points.par_iter().map(one).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use geom::DVec3;

    fn plane(z: f32) -> Vec<Vec3> {
        (0..10_000)
            .map(|i| {
                let (x, y) = ((i % 100) as f32 * 0.05, (i / 100) as f32 * 0.05);
                // A known roughness: ±1 cm in turn.
                Vec3::new(x, y, z + if i % 2 == 0 { 0.01 } else { -0.01 })
            })
            .collect()
    }

    #[test]
    fn a_raised_plane_is_raised_and_its_level_follows_its_roughness() {
        let exact = Registration::fixed(DVec3::ZERO);
        let found =
            surface_changes(&plane(0.0), &plane(0.05), 2.0, &exact, &SurfaceConfig::default());
        assert!(found.len() > 100);
        for c in &found {
            assert!((c.distance_m - 0.05).abs() < 0.004, "{}", c.distance_m);
            let n = c.points.map(|n| n as f64);
            let level = 1.96 * (1e-4 / n[0] + 1e-4 / n[1]).sqrt();
            assert!((c.level_m / level - 1.0).abs() < 0.1, "{} {level}", c.level_m);
        }
        assert!(found.iter().all(SurfaceChange::is_change));
        let same =
            surface_changes(&plane(0.0), &plane(0.0), 2.0, &exact, &SurfaceConfig::default());
        assert!(same.iter().all(|c| c.distance_m == 0.0));
    }
}
