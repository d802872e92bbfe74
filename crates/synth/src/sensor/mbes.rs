//! Multibeam echo sounder: a boat passes several times; every ping is a fan of beams with a footprint.
//!
//! What the model holds, and where the defaults come from (METHOD §1.1: a real R2Sonic 2026 file over a flat bed):
//! - beams of 1.0° × 0.5°; nine sub-rays each, weighted by the beam pattern and by cos² of the incidence;
//! - steep beams take the first strong return (30 % quantile of the weighted ranges), flat ones the range at the
//!   beam's axis (phase detection), in between by chance;
//! - range noise √(q² + (a·footprint·tan incidence)²), q = 0.8 cm, correlated from beam to beam: hardly at nadir,
//!   strongly outside, as a quickly and a slowly fading part, independent from ping to ping; range quantum 0.29 cm;
//!   white noise on top where the two detections take turns (0.94 cm there against 0.8 cm beside it);
//! - per pass one roll, heave and position error: this is what the thesis' white 3 cm really is;
//! - ghosts along the arc (right range, wrong angle), spikes in the water column, nothing just below the surface.

use super::views::{SAMPLES_PER_BLOCK, occlusion, thinned};
use super::{Scan, within};
use crate::SynthError;
use crate::bed::bed_mesh;
use crate::range_map::RangeMap;
use crate::recipe::Resolved;
use crate::swath::Swath;
use crate::targets::Targets;
use geom::{SeedTree, Vec3};
use rand::{Rng, RngExt};
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;
use scene::{Catalog, Ground, Scene};
use serde::{Deserialize, Serialize};

/// The sounder, its passes and its errors.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Mbes {
    /// Passes along x, in alternating directions, spread over the site.
    pub passes: u32,
    /// Height of the head above the top of the pile.
    pub clearance_m: f32,
    /// How far the outer passes lie outside the site, in site widths.
    pub overreach: f32,
    /// Largest deviation of a pass from the x axis.
    pub heading_spread_deg: f32,
    /// Beams of a ping, at equal distances on a flat bed.
    pub beams: u32,
    /// Half the opening angle of the fan.
    pub half_swath_deg: f32,
    /// Beam width along the track.
    pub along_beam_deg: f32,
    /// Beam width across the track.
    pub across_beam_deg: f32,
    /// Range noise of a beam that hits a surface squarely.
    pub range_noise_sd_m: f32,
    /// Noise from oblique incidence, as a share of the footprint's extent in range.
    pub footprint_noise: f32,
    /// Share of the slowly fading noise in the outer beams (none at nadir).
    pub slow_share: f32,
    /// Correlation of the slow part from one beam to the next (256 beams; more beams lie closer).
    pub slow_correlation: f32,
    /// Extra noise of a beam whose detection is as likely by amplitude as by phase; none where it is certain.
    pub switch_noise_sd_m: f32,
    /// Step of the ranges.
    pub quantum_m: f32,
    /// Roll error of a pass.
    pub roll_bias_sd_deg: f32,
    /// Heave and tide error of a pass.
    pub heave_bias_sd_m: f32,
    /// Horizontal error of a pass, per axis.
    pub position_bias_sd_m: f32,
    /// Share of the soundings at a wrong angle (label 0).
    pub ghosts: f32,
    /// Share of the soundings at a shorter range (label 0).
    pub spikes: f32,
    /// Height above which nothing is measured (the water level less its noisy band); none: all is under water.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub top_level_m: Option<f32>,
}

impl Default for Mbes {
    fn default() -> Self {
        Self {
            passes: 6,
            clearance_m: 4.0,
            overreach: 0.25,
            heading_spread_deg: 5.0,
            beams: 256,
            half_swath_deg: 65.0,
            along_beam_deg: 1.0,
            across_beam_deg: 0.5,
            range_noise_sd_m: 0.008,
            footprint_noise: 0.02,
            slow_share: 0.55,
            slow_correlation: 0.985,
            switch_noise_sd_m: 0.007,
            quantum_m: 0.0029,
            roll_bias_sd_deg: 0.03,
            heave_bias_sd_m: 0.02,
            position_bias_sd_m: 0.03,
            ghosts: 0.01,
            spikes: 0.005,
            top_level_m: None,
        }
    }
}

/// Closest pings along the track: 1 m/s at 50 Hz.
const CLOSEST_PINGS_M: f32 = 0.02;
/// Rays of the swath map within one beam width.
const RAYS_PER_BEAM: f32 = 3.0;
/// Sub-rays of a beam along one direction, in beam widths, with the weights of a Gaussian pattern (−3 dB at ½).
const SUB_RAYS: [(f32, f32); 3] = [(-0.45, 0.57), (0.0, 1.0), (0.45, 0.57)];
/// Places along a track at which its soundings are counted beforehand. Free choice: the count is good to some per cent.
const PROBES: u32 = 24;
/// So many more soundings than wanted are planned, because the count is a sample.
const MORE_THAN_WANTED: f32 = 1.1;
/// Flatter incidence, as a cosine, spreads the footprint no further: beyond, the beam's own width decides.
const FLATTEST: f32 = 0.1;
/// A face seen flatter than this, as a cosine, takes the range of its map's cell: its plane is met too far off.
const LEAST_FACING: f32 = 0.05;
/// How far aside a ghost of the side lobes appears. Free choice within the first side lobes of such arrays.
const GHOST_DEG: [f32; 2] = [5.0, 20.0];
/// Least range of a spike in the water column, in ranges of the bed, and how much farther the others are. Free choice.
const SPIKE: [f32; 2] = [0.4, 0.55];
/// Beams of the file that the correlations were fitted to (METHOD §1.1).
const FITTED_BEAMS: f32 = 256.0;
/// Angles between which the correlation from beam to beam grows from hardly any to all it has: fitted to that file.
const OUTER_DEG: [f32; 2] = [17.0, 56.0];
/// Correlation of the quickly fading part from beam to beam: at nadir, its growth outwards, and the power of that: fitted too.
const FAST: [f32; 3] = [0.04, 0.83, 3.6];
/// Quantile of the weighted ranges that counts as the first strong return.
const FIRST_RETURN: f32 = 0.3;
/// Angles between which detection changes from amplitude to phase: 23 % by phase from 30° to 40°, 96 % from 40° to 50°.
const SWITCH_DEG: [f32; 2] = [34.0, 42.0];

/// One sounding before the pass' errors: beam, range, block.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sounding {
    pub angle_rad: f32,
    pub range_m: f32,
    pub owner: u32,
}

impl Mbes {
    pub(super) fn check(&self) -> Result<(), SynthError> {
        within("sensor.passes", self.passes as f32, [1.0, 100.0], "1 to 100")?;
        within("sensor.clearance_m", self.clearance_m, [0.2, 200.0], "0.2 to 200 m")?;
        within("sensor.overreach", self.overreach, [0.0, 5.0], "0 to 5 site widths")?;
        within(
            "sensor.heading_spread_deg",
            self.heading_spread_deg,
            [0.0, 30.0],
            "0 to 30 degrees",
        )?;
        within("sensor.beams", self.beams as f32, [16.0, 4096.0], "16 to 4096")?;
        within("sensor.half_swath_deg", self.half_swath_deg, [10.0, 80.0], "10 to 80 degrees")?;
        within("sensor.along_beam_deg", self.along_beam_deg, [0.05, 10.0], "0.05 to 10 degrees")?;
        within("sensor.across_beam_deg", self.across_beam_deg, [0.05, 10.0], "0.05 to 10 degrees")?;
        within("sensor.range_noise_sd_m", self.range_noise_sd_m, [0.0, 1.0], "0 to 1 m")?;
        within("sensor.footprint_noise", self.footprint_noise, [0.0, 1.0], "0 to 1")?;
        within("sensor.slow_share", self.slow_share, [0.0, 1.0], "0 to 1")?;
        within("sensor.slow_correlation", self.slow_correlation, [0.0, 0.9999], "0 to 0.9999")?;
        within("sensor.switch_noise_sd_m", self.switch_noise_sd_m, [0.0, 1.0], "0 to 1 m")?;
        within("sensor.quantum_m", self.quantum_m, [0.0, 0.5], "0 to 0.5 m")?;
        within("sensor.roll_bias_sd_deg", self.roll_bias_sd_deg, [0.0, 5.0], "0 to 5 degrees")?;
        within("sensor.heave_bias_sd_m", self.heave_bias_sd_m, [0.0, 1.0], "0 to 1 m")?;
        within("sensor.position_bias_sd_m", self.position_bias_sd_m, [0.0, 5.0], "0 to 5 m")?;
        within("sensor.ghosts", self.ghosts, [0.0, 0.5], "0 to 0.5")?;
        within("sensor.spikes", self.spikes, [0.0, 0.5], "0 to 0.5")
    }

    pub(super) fn scan(
        &self,
        targets: &Targets,
        resolved: &Resolved,
        seed: SeedTree,
    ) -> Result<Scan, SynthError> {
        let passes = self.passes(targets, resolved, seed.child("passes", 0));
        let maps: Vec<RangeMap<Swath>> =
            passes.into_par_iter().map(|p| RangeMap::render(p, targets)).collect();
        let spacing_m = self.ping_spacing_m(&maps, targets, resolved)?;

        let measured: Vec<Vec<(Vec3, u32)>> = maps
            .par_iter()
            .enumerate()
            .map(|(k, map)| self.pass(map, targets, spacing_m, seed.child("pass", k as u64)))
            .collect();
        let half = resolved.size_m.map(|s| s / 2.0);
        let top = self.top_level_m.unwrap_or(f32::INFINITY);
        let inside = |p: &Vec3| p.x.abs() <= half[0] && p.y.abs() <= half[1] && p.z <= top;
        let numbered = measured
            .into_iter()
            .enumerate()
            .flat_map(|(k, pass)| pass.into_iter().map(move |p| (p, k as u16 + 1)));
        let all: Vec<((Vec3, u32), u16)> = numbered.filter(|((p, _), _)| inside(p)).collect();
        let chosen = thinned(
            (0..all.len()).collect(),
            resolved.target_points,
            &mut seed.child("thin", 0).rng(),
        );
        let (points, line) = chosen.into_iter().map(|i| all[i]).unzip();

        let samples = targets.sample(
            SAMPLES_PER_BLOCK * targets.block_count() as f32 / targets.area_m2(),
            seed.child("surface", 0),
        );
        let sees = |(p, n): (&Vec3, &Vec3)| maps.iter().any(|m| m.sees(*p, *n));
        let occlusion =
            occlusion(&samples.owner, samples.position.iter().zip(&samples.normal).map(sees));
        // A place every 2 m of track is enough to know from where a point was seen.
        let positions = maps.iter().flat_map(|m| m.projection.track(2.0)).collect();
        Ok(Scan { points, line, occlusion, positions })
    }

    /// Pings over a flat, smooth bed `depth_m` below the head, without ghosts and spikes: (angle, range) of every beam.
    /// For comparing the noise with a real sounder's.
    pub fn flat_bed_pings(
        &self,
        depth_m: f32,
        pings: usize,
        seed: SeedTree,
    ) -> Vec<Vec<(f32, f32)>> {
        let quiet = Self { ghosts: 0.0, spikes: 0.0, ..*self };
        let width = 2.5 * depth_m * self.half_swath_deg.to_radians().tan();
        let bed = Scene { blocks: Vec::new(), ground: Ground::Level { z_m: 0.0 } };
        let targets =
            Targets::new(&bed, &Catalog::default(), bed_mesh(&bed.ground, [depth_m, width]));
        let fan = (self.half_swath_deg + 2.0 * self.across_beam_deg).to_radians();
        let step_rad = self.across_beam_deg.to_radians() / RAYS_PER_BEAM;
        let start = Vec3::new(-0.4 * depth_m, 0.0, depth_m);
        let map = RangeMap::render(
            Swath::new(start, Vec3::X, 0.8 * depth_m, 0.05 * depth_m, [-fan, fan], step_rad),
            &targets,
        );
        let mut rng = seed.rng();
        let ping = |_| {
            quiet
                .ping(&map, &targets, 0.4 * depth_m, &mut rng)
                .iter()
                .map(|s| (s.angle_rad, s.range_m))
                .collect()
        };
        (0..pings).map(ping).collect()
    }

    /// Tracks along x at even offsets across the site and beyond, directions alternating.
    fn passes(&self, targets: &Targets, resolved: &Resolved, seed: SeedTree) -> Vec<Swath> {
        let mut rng = seed.rng();
        let head_m = targets.bounds.max.z + self.clearance_m;
        let depth = head_m - targets.bounds.min.z;
        let step_m = depth * self.along_beam_deg.to_radians() / RAYS_PER_BEAM;
        let step_rad = self.across_beam_deg.to_radians() / RAYS_PER_BEAM;
        let [length, width] = resolved.size_m;
        let half_fan = (self.half_swath_deg + 2.0 * self.across_beam_deg).to_radians();
        (0..self.passes)
            .map(|k| {
                let place = if self.passes == 1 {
                    0.0
                } else {
                    2.0 * k as f32 / (self.passes - 1) as f32 - 1.0
                };
                let offset =
                    place * width * (0.5 + self.overreach) + rng.random_range(-0.2..0.2) * width;
                let spread = self.heading_spread_deg.to_radians();
                let heading = if k % 2 == 0 { 0.0 } else { std::f32::consts::PI }
                    + rng.random_range(-1.0..=1.0) * spread;
                let along = Vec3::new(heading.cos(), heading.sin(), 0.0);
                // Long enough to cover the corners of a site that the track crosses at an angle.
                let reach = 0.5 * length * heading.cos().abs() + width * heading.sin().abs() + 0.5;
                let start = Vec3::new(0.0, offset, head_m) - along * reach;
                Swath::new(start, along, 2.0 * reach, step_m, [-half_fan, half_fan], step_rad)
            })
            .collect()
    }

    /// Distance between pings that gives a few more soundings inside the site than wanted.
    fn ping_spacing_m(
        &self,
        maps: &[RangeMap<Swath>],
        targets: &Targets,
        resolved: &Resolved,
    ) -> Result<f32, SynthError> {
        let half = resolved.size_m.map(|s| s / 2.0);
        let top = self.top_level_m.unwrap_or(f32::INFINITY);
        let mut soundings_per_m = 0.0;
        for map in maps {
            let track = map.projection.length_m();
            let probes = PROBES;
            let mut hits = 0;
            for i in 0..probes {
                let along = (i as f32 + 0.5) / probes as f32 * track;
                for angle in self.angles() {
                    let hit = map
                        .first_hit(targets, along, angle)
                        .map(|(range, _)| map.projection.point(along, angle, range));
                    hits += u32::from(hit.is_some_and(|p| {
                        p.x.abs() <= half[0] && p.y.abs() <= half[1] && p.z <= top
                    }));
                }
            }
            soundings_per_m += track * hits as f32 / probes as f32;
        }
        let spacing = soundings_per_m / (MORE_THAN_WANTED * resolved.target_points as f32);
        if spacing < CLOSEST_PINGS_M {
            let reach = soundings_per_m
                / (MORE_THAN_WANTED * CLOSEST_PINGS_M * resolved.size_m[0] * resolved.size_m[1]);
            let why = format!(
                "{} passes of {} beams give at most {reach:.0} points per m² here; use more passes or beams, or a lower density",
                self.passes, self.beams
            );
            return Err(SynthError::DensityOutOfReach { density: resolved.density_per_m2, why });
        }
        Ok(spacing)
    }

    /// Beam angles: equal distances on a flat bed.
    fn angles(&self) -> impl Iterator<Item = f32> {
        let edge = self.half_swath_deg.to_radians().tan();
        let count = self.beams;
        (0..count).map(move |b| (edge * (2.0 * b as f32 / (count - 1) as f32 - 1.0)).atan())
    }

    fn pass(
        &self,
        map: &RangeMap<Swath>,
        targets: &Targets,
        spacing_m: f32,
        seed: SeedTree,
    ) -> Vec<(Vec3, u32)> {
        let mut rng = seed.rng();
        let mut normal =
            |sd: f32| -> f32 { sd * Distribution::<f32>::sample(&StandardNormal, &mut rng) };
        let roll_rad = normal(self.roll_bias_sd_deg).to_radians();
        let (x, y) = (normal(self.position_bias_sd_m), normal(self.position_bias_sd_m));
        let shift = Vec3::new(x, y, normal(self.heave_bias_sd_m));
        let mut points = Vec::new();
        let pings = (map.projection.length_m() / spacing_m) as usize;
        for ping in 0..pings {
            // Waves: pings are not quite even.
            let along = (ping as f32 + rng.random_range(0.2..0.8)) * spacing_m;
            for s in self.ping(map, targets, along, &mut rng) {
                points.push((
                    map.projection.point(along, s.angle_rad + roll_rad, s.range_m) + shift,
                    s.owner,
                ));
            }
        }
        points
    }

    /// The soundings of one ping, from left to right.
    pub(crate) fn ping(
        &self,
        map: &RangeMap<Swath>,
        targets: &Targets,
        along_m: f32,
        rng: &mut impl Rng,
    ) -> Vec<Sounding> {
        let mut noise = BeamNoise::new(self, rng);
        let mut soundings = Vec::with_capacity(self.beams as usize);
        for angle in self.angles() {
            let unit = noise.next(angle, rng);
            // The same draws for a beam whatever it meets, so that beams do not depend on each other's luck.
            let draw: [f32; 4] = std::array::from_fn(|_| rng.random());
            let switching: f32 = StandardNormal.sample(rng);
            let phase = phase_share(angle);
            let Some((range, triangle)) =
                self.detect(map, targets, along_m, angle, draw[0] < phase)
            else {
                continue;
            };
            let (sin, cos) = angle.sin_cos();
            let direction = map.projection.across * sin - Vec3::Z * cos;
            let square = -targets.normal[triangle].dot(direction);
            let slant = (1.0 - square * square).max(0.0).sqrt() / square.max(FLATTEST);
            let footprint_m = range * self.across_beam_deg.to_radians();
            let sd = self.range_noise_sd_m.hypot(self.footprint_noise * footprint_m * slant);
            let unsure = self.switch_noise_sd_m * 2.0 * (phase * (1.0 - phase)).sqrt();
            let mut s = Sounding {
                angle_rad: angle,
                range_m: range + sd * unit + unsure * switching,
                owner: targets.owner[triangle],
            };
            if draw[1] < self.ghosts {
                // Side lobes: the range of a strong echo at an angle where it is not.
                let turn_rad =
                    (GHOST_DEG[0] + (GHOST_DEG[1] - GHOST_DEG[0]) * draw[2]).to_radians();
                s.angle_rad += if draw[3] < 0.5 { turn_rad } else { -turn_rad };
                s.owner = 0;
            } else if draw[1] > 1.0 - self.spikes {
                s.range_m *= SPIKE[0] + SPIKE[1] * draw[2];
                s.owner = 0;
            }
            if self.quantum_m > 0.0 {
                s.range_m = (s.range_m / self.quantum_m).round() * self.quantum_m;
            }
            soundings.push(s);
        }
        soundings
    }

    /// Range and triangle that a beam detects.
    fn detect(
        &self,
        map: &RangeMap<Swath>,
        targets: &Targets,
        along_m: f32,
        angle: f32,
        by_phase: bool,
    ) -> Option<(f32, usize)> {
        let axis = map.first_hit(targets, along_m, angle);
        if by_phase {
            return axis;
        }
        let reference = axis.map_or(0.0, |(range, _)| range);
        let mut returns: [(f32, f32, usize); 9] = [(0.0, 0.0, 0); 9];
        let mut count = 0;
        for (u, wu) in SUB_RAYS {
            for (v, wv) in SUB_RAYS {
                let ahead = along_m + reference * u * self.along_beam_deg.to_radians();
                let across = angle + v * self.across_beam_deg.to_radians();
                if let Some((range, triangle)) = map.first_hit(targets, ahead, across) {
                    let (sin, cos) = across.sin_cos();
                    let square =
                        targets.normal[triangle].dot(map.projection.across * sin - Vec3::Z * cos);
                    returns[count] = (range, wu * wv * square * square, triangle);
                    count += 1;
                }
            }
        }
        let returns = &mut returns[..count];
        returns.sort_by(|a, b| a.0.total_cmp(&b.0));
        let strong = FIRST_RETURN * returns.iter().map(|r| r.1).sum::<f32>();
        let mut sum = 0.0;
        let first = returns.iter().find(|r| {
            sum += r.1;
            sum >= strong
        });
        first.map(|&(range, _, triangle)| (range, triangle))
    }
}

/// Share of the soundings at an angle that are detected by phase.
fn phase_share(angle_rad: f32) -> f32 {
    ((angle_rad.to_degrees().abs() - SWITCH_DEG[0]) / (SWITCH_DEG[1] - SWITCH_DEG[0]))
        .clamp(0.0, 1.0)
}

impl RangeMap<Swath> {
    /// First surface on the ray at an angle from a place of the track: range and triangle.
    fn first_hit(&self, targets: &Targets, along_m: f32, angle_rad: f32) -> Option<(f32, usize)> {
        let cell = self.projection.cell(along_m, angle_rad)?;
        if !self.range[cell].is_finite() {
            return None;
        }
        // The cell says which face; its plane says how far the ray itself goes, which differs by centimetres outside.
        let triangle = self.triangle[cell] as usize;
        let normal = targets.normal[triangle];
        let (origin, direction) = self.projection.exact_ray(along_m, angle_rad);
        let facing = normal.dot(direction);
        let range = if facing < -LEAST_FACING {
            normal.dot(targets.corners[triangle][0] - origin) / facing
        } else {
            self.range[cell]
        };
        Some((range, triangle))
    }
}

/// Unit-variance range noise along the beams of one ping.
struct BeamNoise {
    slow: f32,
    fast: f32,
    slow_share: f32,
    slow_correlation: f32,
    beams: f32,
}

impl BeamNoise {
    fn new(mbes: &Mbes, rng: &mut impl Rng) -> Self {
        let mut normal = || Distribution::<f32>::sample(&StandardNormal, rng);
        // Correlation is a matter of distance: with more beams, neighbours are more alike.
        let slow_correlation = mbes.slow_correlation.powf(FITTED_BEAMS / mbes.beams as f32);
        Self {
            slow: normal(),
            fast: normal(),
            slow_share: mbes.slow_share,
            slow_correlation,
            beams: mbes.beams as f32,
        }
    }

    fn next(&mut self, angle_rad: f32, rng: &mut impl Rng) -> f32 {
        // 0 near nadir, 1 at the edge; slow and fast parts fitted to the correlations of the real file at 1, 4, 16 beams.
        let outer = ((angle_rad.to_degrees().abs() - OUTER_DEG[0]) / (OUTER_DEG[1] - OUTER_DEG[0]))
            .clamp(0.0, 1.0);
        let mut follow = |state: f32, rho: f32| {
            rho * state
                + (1.0 - rho * rho).sqrt() * Distribution::<f32>::sample(&StandardNormal, rng)
        };
        self.slow = follow(self.slow, self.slow_correlation);
        self.fast = follow(
            self.fast,
            (FAST[0] + FAST[1] * outer.powf(FAST[2])).powf(FITTED_BEAMS / self.beams),
        );
        let share = self.slow_share * outer;
        share.sqrt() * self.slow + (1.0 - share).sqrt() * self.fast
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Root mean square of the second difference from ping to ping and its correlation over `lag` beams, for the
    /// beams between two angles.
    fn noise(pings: &[Vec<(f32, f32)>], degrees: std::ops::Range<f32>, lag: usize) -> (f64, f64) {
        let beams: Vec<usize> = (0..pings[0].len() - lag)
            .filter(|&b| degrees.contains(&pings[0][b].0.to_degrees()))
            .collect();
        let second = |w: &[Vec<(f32, f32)>], b: usize| {
            f64::from(w[0][b].1 - 2.0 * w[1][b].1 + w[2][b].1) / 6_f64.sqrt()
        };
        let (mut own, mut both, mut count) = (0.0, 0.0, 0.0);
        for w in pings.windows(3) {
            for &b in &beams {
                own += second(w, b) * second(w, b);
                both += second(w, b) * second(w, b + lag);
                count += 1.0;
            }
        }
        ((own / count).sqrt(), both / own)
    }

    /// Figures of a real R2Sonic 2026 over a flat bed: `tools/oracle/mbes_statistics.py`.
    #[test]
    fn noise_over_a_flat_bed_is_that_of_a_real_sounder() {
        let sounder = Mbes { half_swath_deg: 61.5, ..Default::default() };
        let pings = sounder.flat_bed_pings(10.5, 300, SeedTree::new(1));
        for (degrees, lag, rms_m, correlation) in [
            (0.0..20.0, 1, 0.0079, 0.05),
            (30.0..40.0, 1, 0.0094, 0.24),
            (40.0..50.0, 1, 0.0081, 0.64),
            (50.0..61.0, 1, 0.0093, 0.94),
            (50.0..61.0, 4, 0.0093, 0.68),
            (50.0..60.0, 16, 0.0093, 0.49),
        ] {
            let (rms, found) = noise(&pings, degrees.clone(), lag);
            assert!((rms / rms_m - 1.0).abs() < 0.12, "{degrees:?}: {rms} m against {rms_m} m");
            assert!(
                (found - correlation).abs() < 0.15,
                "{degrees:?}, lag {lag}: {found} against {correlation}"
            );
        }
    }
}
