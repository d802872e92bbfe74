//! Photogrammetry from a drone: seen by several cameras, smooth where the world is sharp, spoilt at the water.
//!
//! Parameters and sources: density 350–900 /m² and 2.6 cm cloud spread on real breakwaters (Baiona; JSCE B2 2021
//! I_691, which also asks for oblique views in four directions and shows the slow vertical drift away from control
//! points); structure from motion rounds edges, fills narrow gaps and fails on moving or white water.

use super::views::{
    Ring, Waterline, cameras, check_rings, occlusion, seen_points, seen_points_by_removal, thinned,
};
use super::{Scan, within};
use crate::SynthError;
use crate::range_map::RangeMap;
use crate::recipe::{Resolved, Visibility};
use crate::targets::Targets;
use geom::{PointGrid, SeedTree, Vec3};
use rand::{Rng, RngExt};
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// A drone flight and what the reconstruction makes of it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Uav {
    /// Height of the cameras above the top of the pile.
    pub altitude_m: f32,
    /// Where the cameras are.
    pub rings: Vec<Ring>,
    /// Cameras that must see a point.
    pub least_views: u16,
    /// Noise along the line of sight.
    pub depth_noise_sd_m: f32,
    /// Noise across it, per axis.
    pub lateral_noise_sd_m: f32,
    /// Standard deviation of the smooth vertical error field.
    pub drift_sd_m: f32,
    /// Its correlation length.
    pub drift_length_m: f32,
    /// Radius over which neighbouring points are averaged: rounds edges.
    pub edge_radius_m: f32,
    /// Widest gap between two blocks that may be bridged.
    pub web_gap_m: f32,
    /// Share of the points beside such a gap that get a bridge point (label 0).
    pub web_share: f32,
    /// The sea; without it the whole pile is measured.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub waterline: Option<Waterline>,
}

impl Default for Uav {
    fn default() -> Self {
        let ring = |elevation_deg, cameras| Ring { elevation_deg, cameras };
        Self {
            altitude_m: 35.0,
            rings: vec![ring(90.0, 1), ring(70.0, 4), ring(45.0, 6)],
            least_views: 3,
            depth_noise_sd_m: 0.015,
            lateral_noise_sd_m: 0.005,
            drift_sd_m: 0.01,
            drift_length_m: 7.0,
            edge_radius_m: 0.04,
            web_gap_m: 0.1,
            web_share: 0.3,
            waterline: None,
        }
    }
}

impl Uav {
    pub(super) fn check(&self) -> Result<(), SynthError> {
        within("sensor.altitude_m", self.altitude_m, [0.1, 1000.0], "0.1 to 1000 m")?;
        check_rings(&self.rings)?;
        let cameras: u32 = self.rings.iter().map(|r| r.cameras).sum();
        within(
            "sensor.least_views",
            self.least_views as f32,
            [1.0, cameras as f32],
            "1 to the number of cameras",
        )?;
        for (key, value) in [
            ("sensor.depth_noise_sd_m", self.depth_noise_sd_m),
            ("sensor.lateral_noise_sd_m", self.lateral_noise_sd_m),
            ("sensor.drift_sd_m", self.drift_sd_m),
            ("sensor.edge_radius_m", self.edge_radius_m),
            ("sensor.web_gap_m", self.web_gap_m),
        ] {
            within(key, value, [0.0, 1.0], "0 to 1 m")?;
        }
        within("sensor.drift_length_m", self.drift_length_m, [0.01, 1e4], "0.01 to 10000 m")?;
        within("sensor.web_share", self.web_share, [0.0, 1.0], "0 to 1")?;
        let Some(water) = self.waterline else { return Ok(()) };
        within("sensor.waterline.level_m", water.level_m, [-100.0, 100.0], "-100 to 100 m")?;
        within("sensor.waterline.band_m", water.band_m, [0.0, 10.0], "0 to 10 m")?;
        within("sensor.waterline.missing", water.missing, [0.0, 1.0], "0 to 1")?;
        within("sensor.waterline.splash", water.splash, [0.0, 1.0], "0 to 1")
    }

    pub(super) fn scan(
        &self,
        targets: &Targets,
        resolved: &Resolved,
        visibility: Visibility,
        seed: SeedTree,
    ) -> Result<Scan, SynthError> {
        let turn = seed.child("flight", 0).rng().random_range(0.0..std::f32::consts::TAU);
        let cameras =
            cameras(&self.rings, self.altitude_m, &targets.bounds, resolved.pixel_m(), turn);
        let positions: Vec<Vec3> = cameras.iter().map(|c| c.position).collect();
        let wanted = resolved.target_points;
        let surface = seed.child("surface", 0);
        let seen = match visibility {
            Visibility::Exact => {
                let maps: Vec<_> = cameras
                    .into_par_iter()
                    .map(|c| RangeMap::render(c, targets).without_triangles())
                    .collect();
                seen_points(targets, &maps, self.least_views, wanted, surface)
            }
            Visibility::Katz => {
                seen_points_by_removal(targets, &positions, self.least_views, wanted, surface)?
            }
        };
        let occlusion = occlusion(&seen.points.owner, seen.view.iter().map(Option::is_some));

        let mut rng = seed.child("noise", 0).rng();
        let chosen = thinned(
            (0..seen.view.len()).filter(|&i| seen.view[i].is_some()).collect(),
            wanted,
            &mut rng,
        );
        let surface: Vec<Vec3> = chosen.iter().map(|&i| seen.points.position[i]).collect();
        let owner: Vec<u32> = chosen.iter().map(|&i| seen.points.owner[i]).collect();
        let mut points: Vec<(Vec3, u32)> =
            self.rounded(&surface).into_iter().zip(owner.iter().copied()).collect();
        for ((point, _), &i) in points.iter_mut().zip(&chosen) {
            let view = seen.view[i].expect("only seen points are chosen");
            let sight = (*point - positions[view as usize]).normalize();
            *point += self.noise(sight, &mut rng);
        }
        self.add_webs(&surface, &owner, &mut points, &mut rng);
        let drift =
            Drift::new(self.drift_sd_m, self.drift_length_m, &mut seed.child("drift", 0).rng());
        for (point, _) in &mut points {
            point.z += drift.at(*point);
        }
        if let Some(water) = &self.waterline {
            points = water.spoil(points, &mut seed.child("water", 0).rng());
        }
        Ok(Scan { points, line: Vec::new(), occlusion, positions })
    }

    /// Every point at the mean of its neighbours: flat faces stay, edges retreat, narrow gaps close.
    fn rounded(&self, surface: &[Vec3]) -> Vec<Vec3> {
        if self.edge_radius_m == 0.0 {
            return surface.to_vec();
        }
        let grid = PointGrid::new(surface, self.edge_radius_m);
        let mean = |p: &Vec3| {
            let (mut sum, mut count) = (Vec3::ZERO, 0.0);
            grid.for_each_within(*p, self.edge_radius_m, |_, q, _| {
                sum += q - *p;
                count += 1.0;
            });
            *p + sum / f32::max(count, 1.0)
        };
        surface.par_iter().map(mean).collect()
    }

    fn noise(&self, sight: Vec3, rng: &mut impl Rng) -> Vec3 {
        let mut normal = || -> f32 { StandardNormal.sample(rng) };
        let white = Vec3::new(normal(), normal(), normal());
        let along = sight * white.dot(sight);
        along * self.depth_noise_sd_m + (white - along) * self.lateral_noise_sd_m
    }

    /// Points between two blocks that nearly touch; they lie on neither.
    fn add_webs(
        &self,
        surface: &[Vec3],
        owner: &[u32],
        points: &mut Vec<(Vec3, u32)>,
        rng: &mut impl Rng,
    ) {
        if self.web_gap_m == 0.0 || self.web_share == 0.0 {
            return;
        }
        let grid = PointGrid::new(surface, self.web_gap_m);
        let chosen: Vec<usize> =
            (0..surface.len()).filter(|_| rng.random::<f32>() < self.web_share).collect();
        let across = |&i: &usize| {
            let mut nearest: Option<(f32, Vec3)> = None;
            grid.for_each_within(surface[i], self.web_gap_m, |j, q, distance2| {
                if owner[j as usize] != owner[i] && nearest.is_none_or(|(d, _)| distance2 < d) {
                    nearest = Some((distance2, q));
                }
            });
            // Closer than a third of the width there is contact, not a gap.
            nearest.filter(|(d2, _)| d2.sqrt() > self.web_gap_m / 3.0).map(|(_, q)| (surface[i], q))
        };
        let facing: Vec<Option<(Vec3, Vec3)>> = chosen.par_iter().map(across).collect();
        for (p, q) in facing.into_iter().flatten() {
            let between = p.lerp(q, rng.random_range(0.2..0.8));
            points.push((between + self.noise(Vec3::NEG_Z, rng), 0));
        }
    }
}

impl Waterline {
    /// Cuts what is under water and spoils the band above.
    fn spoil(&self, points: Vec<(Vec3, u32)>, rng: &mut impl Rng) -> Vec<(Vec3, u32)> {
        let mut kept = Vec::with_capacity(points.len());
        for (point, owner) in points {
            if point.z < self.level_m {
                continue;
            }
            if point.z > self.level_m + self.band_m {
                kept.push((point, owner));
                continue;
            }
            let u: f32 = rng.random();
            if u < self.splash {
                kept.push((point + Vec3::Z * rng.random_range(0.1..1.0_f32), 0));
            } else if u > self.missing + self.splash {
                kept.push((point, owner));
            }
        }
        kept
    }
}

/// A smooth random field: a sum of plane waves of random direction, length and phase.
struct Drift {
    waves: Vec<(Vec3, f32)>,
    amplitude_m: f32,
}

impl Drift {
    const WAVES: usize = 12;

    fn new(sd_m: f32, length_m: f32, rng: &mut impl Rng) -> Self {
        let waves = (0..Self::WAVES)
            .map(|_| {
                let azimuth = rng.random_range(0.0..std::f32::consts::TAU);
                // A wave of length L decorrelates over about L/4.
                let number =
                    std::f32::consts::TAU / (4.0 * length_m * rng.random_range(0.6..1.8_f32));
                let phase = rng.random_range(0.0..std::f32::consts::TAU);
                (Vec3::new(azimuth.cos(), azimuth.sin(), 0.0) * number, phase)
            })
            .collect();
        Self { waves, amplitude_m: sd_m * (2.0 / Self::WAVES as f32).sqrt() }
    }

    fn at(&self, p: Vec3) -> f32 {
        self.waves.iter().map(|(number, phase)| (number.dot(p) + phase).cos()).sum::<f32>()
            * self.amplitude_m
    }
}
