//! The thesis' sensor (§3.4.3): the visible surface with white noise, 1 cm for UAV and 3 cm for MBES.

use super::views::{Ring, cameras, check_rings, occlusion, seen_points, thinned};
use super::{Scan, within};
use crate::SynthError;
use crate::range_map::RangeMap;
use crate::recipe::{Resolved, Visibility};
use crate::targets::Targets;
use geom::{SeedTree, Vec3, hidden_points};
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
        let (points, visible) = match visibility {
            Visibility::Exact => {
                let maps: Vec<_> = cameras.into_par_iter().map(|c| RangeMap::render(c, targets)).collect();
                let seen = seen_points(targets, &maps, 1, resolved.target_points, seed.child("surface", 0));
                (seen.points, seen.view.iter().map(Option::is_some).collect::<Vec<_>>())
            }
            Visibility::Katz => {
                // A pile shows about a third of its surface to one viewpoint.
                let per_m2 = 3.5 * resolved.target_points as f32 / targets.area_m2();
                let points = targets.sample(per_m2, seed.child("surface", 0));
                let mut visible = vec![false; points.position.len()];
                for &from in &positions {
                    for i in hidden_points::visible(&points.position, from, hidden_points::RADIUS_FACTOR)? {
                        visible[i] = true;
                    }
                }
                (points, visible)
            }
        };
        let occlusion = occlusion(&points.owner, visible.iter().copied());
        let mut rng = seed.child("noise", 0).rng();
        let shown = (0..visible.len()).filter(|&i| visible[i]).collect();
        let points = thinned(shown, resolved.target_points, &mut rng)
            .into_iter()
            .map(|i| {
                let noise = Vec3::from_array(std::array::from_fn(|_| StandardNormal.sample(&mut rng)));
                (points.position[i] + noise * self.noise_sd_m, points.owner[i])
            })
            .collect();
        Ok(Scan { points, occlusion, positions })
    }
}
