//! A laser scanner that stands beside the pile, or on a boat that passes it: one side is seen, near parts densely.
//!
//! Equal steps of angle give a density that falls with the square of the distance and with the angle of incidence.

use super::views::{occlusion, seen_points};
use super::{Scan, within};
use crate::SynthError;
use crate::camera::Camera;
use crate::range_map::RangeMap;
use crate::recipe::Resolved;
use crate::targets::Targets;
use geom::{SeedTree, Vec3};
use rand::RngExt;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Where it stands and how well it measures.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Scanner {
    /// Stands: distance south of the site's southern edge, along its middle (east), and height above the bed at the origin.
    pub stands: Vec<Stand>,
    /// Noise along the ray.
    pub range_noise_sd_m: f32,
    /// Noise across it, an axis, at 10 m.
    pub lateral_noise_sd_m: f32,
    /// Flatter surfaces give no return.
    pub least_incidence_deg: f32,
    /// Whether the survey says where the scanner stood.
    pub told: bool,
}

/// One place of the scanner.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Stand {
    /// Distance from the southern edge of the site; negative stands on the pile's own plan.
    pub off_m: f32,
    /// East of the middle.
    pub along_m: f32,
    /// Above the bed at the origin.
    pub height_m: f32,
}

impl Default for Scanner {
    fn default() -> Self {
        Self {
            stands: vec![Stand { off_m: 4.0, along_m: 0.0, height_m: 6.0 }],
            range_noise_sd_m: 0.005,
            lateral_noise_sd_m: 0.002,
            least_incidence_deg: 8.0,
            told: true,
        }
    }
}

impl Scanner {
    pub(super) fn check(&self) -> Result<(), SynthError> {
        within("sensor.stands", self.stands.len() as f32, [1.0, 200.0], "1 to 200 stands")?;
        for stand in &self.stands {
            within("sensor.stands.off_m", stand.off_m, [0.5, 1000.0], "0.5 to 1000 m")?;
            within("sensor.stands.along_m", stand.along_m, [-1e4, 1e4], "-10000 to 10000 m")?;
            within("sensor.stands.height_m", stand.height_m, [-50.0, 1000.0], "-50 to 1000 m")?;
        }
        within("sensor.range_noise_sd_m", self.range_noise_sd_m, [0.0, 1.0], "0 to 1 m")?;
        within("sensor.lateral_noise_sd_m", self.lateral_noise_sd_m, [0.0, 1.0], "0 to 1 m")?;
        within("sensor.least_incidence_deg", self.least_incidence_deg, [0.0, 60.0], "0 to 60°")
    }

    pub(super) fn scan(
        &self,
        targets: &Targets,
        resolved: &Resolved,
        seed: SeedTree,
    ) -> Result<Scan, SynthError> {
        let south = -resolved.size_m[1] / 2.0;
        let positions: Vec<Vec3> =
            self.stands.iter().map(|s| Vec3::new(s.along_m, south - s.off_m, s.height_m)).collect();
        let maps: Vec<_> = positions
            .par_iter()
            .map(|&p| {
                let camera = Camera::looking_at(&targets.bounds, p, resolved.pixel_m());
                RangeMap::render(camera, targets).without_triangles()
            })
            .collect();
        // Far and flat surfaces are thinned: three times as many are asked for.
        let wanted = 3 * resolved.target_points;
        let seen = seen_points(targets, &maps, 1, wanted, seed.child("surface", 0));
        let occlusion = occlusion(&seen.points.owner, seen.view.iter().map(Option::is_some));
        let ray = |i: usize| {
            let from = positions[usize::from(seen.view[i]?)];
            let way = seen.points.position[i] - from;
            let range = way.length();
            let incidence = -seen.points.normal[i].dot(way / range);
            (incidence > self.least_incidence_deg.to_radians().sin()).then_some((
                way / range,
                range,
                incidence / (range * range),
            ))
        };
        let rays: Vec<_> = (0..seen.view.len()).map(ray).collect();
        let total: f32 = rays.iter().flatten().map(|r| r.2).sum();
        let share = resolved.target_points as f32 / total.max(f32::MIN_POSITIVE);
        let mut rng = seed.child("noise", 0).rng();
        let mut points = Vec::with_capacity(resolved.target_points);
        for (i, ray) in rays.into_iter().enumerate() {
            let Some((way, range, weight)) = ray else { continue };
            if rng.random::<f32>() >= share * weight {
                continue;
            }
            let white: [f32; 3] = std::array::from_fn(|_| StandardNormal.sample(&mut rng));
            let white = Vec3::from_array(white);
            let along = way * white.dot(way);
            let noise = along * self.range_noise_sd_m
                + (white - along) * (self.lateral_noise_sd_m * range / 10.0);
            points.push((seen.points.position[i] + noise, seen.points.owner[i]));
        }
        let positions = if self.told { positions } else { Vec::new() };
        Ok(Scan { points, line: Vec::new(), occlusion, positions })
    }
}
