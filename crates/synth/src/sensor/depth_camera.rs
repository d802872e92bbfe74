//! A depth camera above a bin: one view, noise that grows with the square of the distance and is smooth over
//! neighbouring pixels, quantised depth, flying pixels at outlines, nothing at grazing incidence, and for structured light
//! nothing where the projector's light does not reach.
//!
//! Defaults are those of a short-range stereo camera (2 mm at 1 m, growing with z², depth steps well below 1 mm).

use super::views::{SAMPLES_PER_BLOCK, occlusion};
use super::{Scan, within};
use crate::SynthError;
use crate::camera::Camera;
use crate::range_map::{Projection, RangeMap};
use crate::recipe::Resolved;
use crate::targets::Targets;
use geom::{Quat, SeedTree, Vec3};
use rand::{Rng, RngExt};
use rand_distr::{Distribution, StandardNormal};
use serde::{Deserialize, Serialize};

/// The camera and its errors.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct DepthCamera {
    /// Height above the top of the pile; the image holds `density_per_m2` points a square metre at this height.
    pub height_m: f32,
    /// Largest height: each scene draws its own from `height_m` up, and sees with pixels that much wider; 0: always
    /// `height_m`.
    pub most_height_m: f32,
    /// Distance of a structured-light camera's projector from its lens: what the projector does not light has no depth;
    /// 0: a camera without one.
    pub projector_m: f32,
    /// Largest tilt from straight down; each scene draws its own, towards any side.
    pub most_tilt_deg: f32,
    /// Noise of one pixel at 1 m; grows with the square of the distance.
    pub noise_at_1m_sd_m: f32,
    /// Pixels over which the noise is smooth; 1: white.
    pub correlation_px: f32,
    /// Step of the depth values.
    pub quantum_m: f32,
    /// Share of the outline pixels whose depth lies between front and back (label 0).
    pub flying_share: f32,
    /// Surfaces seen flatter than this angle give no depth.
    pub least_incidence_deg: f32,
}

impl Default for DepthCamera {
    fn default() -> Self {
        Self {
            height_m: 0.5,
            most_height_m: 0.0,
            projector_m: 0.0,
            most_tilt_deg: 8.0,
            noise_at_1m_sd_m: 0.002,
            correlation_px: 4.0,
            quantum_m: 0.0002,
            flying_share: 0.3,
            least_incidence_deg: 10.0,
        }
    }
}

/// A step of depth between neighbouring pixels above this many pixel widths is an outline.
const OUTLINE: f32 = 6.0;

impl DepthCamera {
    pub(super) fn check(&self) -> Result<(), SynthError> {
        within("sensor.height_m", self.height_m, [0.01, 100.0], "0.01 to 100 m")?;
        if self.most_height_m != 0.0 {
            within(
                "sensor.most_height_m",
                self.most_height_m,
                [self.height_m, 100.0],
                "0, or from sensor.height_m to 100 m",
            )?;
        }
        within("sensor.projector_m", self.projector_m, [0.0, 10.0], "0 to 10 m")?;
        within("sensor.most_tilt_deg", self.most_tilt_deg, [0.0, 60.0], "0 to 60 degrees")?;
        within("sensor.noise_at_1m_sd_m", self.noise_at_1m_sd_m, [0.0, 1.0], "0 to 1 m")?;
        within("sensor.correlation_px", self.correlation_px, [1.0, 100.0], "1 to 100 pixels")?;
        within("sensor.quantum_m", self.quantum_m, [0.0, 0.1], "0 to 0.1 m")?;
        within("sensor.flying_share", self.flying_share, [0.0, 1.0], "0 to 1")?;
        within(
            "sensor.least_incidence_deg",
            self.least_incidence_deg,
            [0.0, 60.0],
            "0 to 60 degrees",
        )
    }

    pub(super) fn scan(
        &self,
        targets: &Targets,
        resolved: &Resolved,
        seed: SeedTree,
    ) -> Result<Scan, SynthError> {
        let mut rng = seed.child("noise", 0).rng();
        let region = targets.bounds;
        let tilt = rng.random_range(0.0..=self.most_tilt_deg).to_radians();
        let side = rng.random_range(0.0..std::f32::consts::TAU);
        let up = Quat::from_rotation_z(side) * Quat::from_rotation_x(tilt) * Vec3::Z;
        let height_m = if self.most_height_m > self.height_m {
            rng.random_range(self.height_m..=self.most_height_m)
        } else {
            self.height_m
        };
        let position = region.centre() + up * (height_m + region.size().z / 2.0);
        // The same image from farther away: pixels grow with the distance.
        let pixel_m = height_m / self.height_m / resolved.density_per_m2.sqrt();
        let map = RangeMap::render(Camera::looking_at(&region, position, pixel_m), targets);
        let beam = (self.projector_m > 0.0).then(|| {
            let aside = up.any_orthonormal_vector() * self.projector_m;
            RangeMap::render(Camera::looking_at(&region, position + aside, pixel_m), targets)
        });

        let samples = targets.sample(
            SAMPLES_PER_BLOCK * targets.block_count() as f32 / targets.area_m2(),
            seed.child("surface", 0),
        );
        let sees = |(p, n): (&Vec3, &Vec3)| map.sees(*p, *n);
        let occlusion =
            occlusion(&samples.owner, samples.position.iter().zip(&samples.normal).map(sees));
        let points = self.points(&map, beam.as_ref(), targets, &mut rng);
        Ok(Scan { points, line: Vec::new(), occlusion, positions: vec![position] })
    }

    fn points(
        &self,
        map: &RangeMap<Camera>,
        beam: Option<&RangeMap<Camera>>,
        targets: &Targets,
        rng: &mut impl Rng,
    ) -> Vec<(Vec3, u32)> {
        let [columns, rows] = map.projection.size();
        let field = NoiseField::new(columns, rows, self.correlation_px, rng);
        let least_cos = self.least_incidence_deg.to_radians().sin();
        let mut points = Vec::new();
        for row in 1..rows - 1 {
            for column in 1..columns - 1 {
                let cell = row * columns + column;
                // One draw a pixel whatever it meets, so that a change here leaves the other pixels alone.
                let (fly, between): (f32, f32) = (rng.random(), rng.random_range(0.15..0.85));
                let mut depth = map.range[cell];
                if !depth.is_finite() {
                    continue;
                }
                let (origin, direction) = map.projection.ray(column, row);
                let pixel_m = depth * map.projection.pixel();
                let behind = [cell - 1, cell + 1, cell - columns, cell + columns]
                    .into_iter()
                    .map(|c| map.range[c])
                    .filter(|d| d.is_finite() && *d > depth + OUTLINE * pixel_m)
                    .fold(f32::NEG_INFINITY, f32::max);
                let triangle = map.triangle[cell] as usize;
                let mut owner = targets.owner[triangle];
                if behind.is_finite() && fly < self.flying_share {
                    depth += between * (behind - depth);
                    owner = 0;
                } else if -targets.normal[triangle].dot(direction.normalize()) < least_cos {
                    continue;
                }
                let lit = |beam: &RangeMap<Camera>| {
                    beam.sees(origin + direction * map.range[cell], targets.normal[triangle])
                };
                if !beam.is_none_or(lit) {
                    continue;
                }
                depth += self.noise_at_1m_sd_m * depth * depth * field.at(column, row);
                if self.quantum_m > 0.0 {
                    depth = (depth / self.quantum_m).round() * self.quantum_m;
                }
                points.push((origin + direction * depth, owner));
            }
        }
        points
    }
}

/// Unit-variance noise, smooth over `pitch` pixels.
struct NoiseField {
    pitch: f32,
    columns: usize,
    nodes: Vec<f32>,
}

impl NoiseField {
    fn new(columns: usize, rows: usize, pitch: f32, rng: &mut impl Rng) -> Self {
        let count = |n: usize| (n as f32 / pitch).ceil() as usize + 2;
        let nodes = (0..count(columns) * count(rows)).map(|_| StandardNormal.sample(rng)).collect();
        Self { pitch, columns: count(columns), nodes }
    }

    fn at(&self, column: usize, row: usize) -> f32 {
        let (u, v) = (column as f32 / self.pitch, row as f32 / self.pitch);
        let (i, j) = (u as usize, v as usize);
        let (fu, fv) = (u - i as f32, v - j as f32);
        let node = |i: usize, j: usize| self.nodes[j * self.columns + i];
        let weights = [(1.0 - fu) * (1.0 - fv), fu * (1.0 - fv), (1.0 - fu) * fv, fu * fv];
        let values = [node(i, j), node(i + 1, j), node(i, j + 1), node(i + 1, j + 1)];
        let sum: f32 = weights.iter().zip(&values).map(|(w, v)| w * v).sum();
        // Interpolation averages; dividing by the weights' length restores the variance.
        sum / weights.iter().map(|w| w * w).sum::<f32>().sqrt()
    }
}
