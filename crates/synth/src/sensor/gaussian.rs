//! The thesis' sensor (§3.4.3): the visible surface with white noise, 1 cm for UAV and 3 cm for MBES.

use super::views::{
    Ring, cameras, check_rings, occlusion, seen_points, seen_points_by_removal, thinned,
};
use super::{Scan, within};
use crate::SynthError;
use crate::range_map::RangeMap;
use crate::recipe::{Resolved, Visibility};
use crate::targets::Targets;
use geom::{SeedTree, Vec3};
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;
use scene::SensorKind;
use serde::{Deserialize, Serialize};

/// White noise on what the viewpoints see.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Gaussian {
    /// Standard deviation along each axis.
    pub noise_sd_m: f32,
    /// Height of the viewpoints above the top of the pile.
    pub altitude_m: f32,
    /// Viewpoints; one straight above by default.
    pub rings: Vec<Ring>,
    /// What later stages take the points for.
    pub measured_as: SensorKind,
}

impl Default for Gaussian {
    fn default() -> Self {
        Self {
            noise_sd_m: 0.01,
            altitude_m: 40.0,
            rings: vec![Ring { elevation_deg: 90.0, cameras: 1 }],
            measured_as: SensorKind::Uav,
        }
    }
}

impl Gaussian {
    pub(super) fn check(&self) -> Result<(), SynthError> {
        within("sensor.noise_sd_m", self.noise_sd_m, [0.0, 10.0], "0 to 10 m")?;
        within("sensor.altitude_m", self.altitude_m, [0.01, 1000.0], "0.01 to 1000 m")?;
        check_rings(&self.rings)
    }

    pub(super) fn scan(
        &self,
        targets: &Targets,
        resolved: &Resolved,
        visibility: Visibility,
        seed: SeedTree,
    ) -> Result<Scan, SynthError> {
        let pixel_m = resolved.pixel_m();
        let cameras = cameras(&self.rings, self.altitude_m, &targets.bounds, pixel_m, 0.0);
        let positions: Vec<Vec3> = cameras.iter().map(|c| c.position).collect();
        let surface = seed.child("surface", 0);
        let seen = match visibility {
            Visibility::Exact => {
                let maps: Vec<_> = cameras
                    .into_par_iter()
                    .map(|c| RangeMap::render(c, targets).without_triangles())
                    .collect();
                seen_points(targets, &maps, 1, resolved.target_points, surface)
            }
            Visibility::Katz => {
                seen_points_by_removal(targets, &positions, 1, resolved.target_points, surface)?
            }
        };
        let points = seen.points;
        let visible: Vec<bool> = seen.view.iter().map(Option::is_some).collect();
        let occlusion = occlusion(&points.owner, visible.iter().copied());
        let mut rng = seed.child("noise", 0).rng();
        let shown = (0..visible.len()).filter(|&i| visible[i]).collect();
        let points = thinned(shown, resolved.target_points, &mut rng)
            .into_iter()
            .map(|i| {
                let noise =
                    Vec3::from_array(std::array::from_fn(|_| StandardNormal.sample(&mut rng)));
                (points.position[i] + noise * self.noise_sd_m, points.owner[i])
            })
            .collect();
        Ok(Scan { points, line: Vec::new(), occlusion, positions })
    }
}
