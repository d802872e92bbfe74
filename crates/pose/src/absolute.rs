//! How good a pose is by itself, in lengths of the block and not beside the other blocks of its survey.
//!
//! A fault that all blocks of a survey share (a wrong size or shape, no blocks at all) is invisible to anything that
//! compares them with each other. In: an accepted block and its shell. Out: pure numbers.

use crate::finish::Accepted;
use crate::levelling::solve;
use crate::measured::Measured;
use crate::shell::Near;
use crate::sight::Seen;
use crate::template::Template;
use geom::{Quat, Vec3};
use scene::SensorKind;
use serde::{Deserialize, Serialize};

/// The numbers of one block.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Absolute {
    /// Share of the points of its shell that lie on it.
    pub shell: f32,
    /// Mean distance of the points on it, over d_max.
    pub off: f32,
    /// How far whole pieces of its surface are off together, over d_max: a pattern, not scatter.
    pub bias: f32,
    /// Share of the surface that ought to be seen and has points at it.
    pub covered: f32,
    /// Share of its inside that a sensor looked through.
    pub hollow: f32,
    /// Natural logarithm of the size that would fit best over its own.
    pub scale: f32,
    /// Standard deviation of `scale`.
    pub scale_sd: f32,
}

/// Pieces of a surface: the first of the even samples, which lie far from each other.
const PIECES: usize = 32;
/// Fewest points of a piece.
const FEWEST: usize = 4;
/// Points that a face can at all be.
const AGREES: f32 = 0.3;
/// Surface turned more than this to the sensor ought to be seen.
const FACING: f32 = 0.35;
/// A point is of a face when its normal is the face's up to this cosine.
const SAME_FACE: f32 = 0.8;
/// How far sizes are off before anything is measured.
const SCALE_PRIOR_SD: f32 = 0.1;
/// Sizes further off are another block.
const MOST_SCALE: f32 = 0.25;
/// Neighbouring points err together; this many count as one.
const POINTS_A_FACT: f64 = 16.0;

impl Absolute {
    /// Of a block with these points in its shell; `reach_m` is its surface's.
    pub fn of(
        block: &Accepted,
        shell: &[Near],
        template: &Template,
        measured: &Measured,
        reach_m: f32,
    ) -> Self {
        let d_max = template.model.d_max_m;
        let on: Vec<&Near> =
            shell.iter().filter(|n| n.off_m.abs() < reach_m && n.agreement > AGREES).collect();
        let mean = on.iter().map(|n| n.off_m.abs()).sum::<f32>() / (on.len() as f32).max(1.0);
        let (covered, hollow) = seen(block, template, measured, reach_m);
        let (scale, scale_sd) = scale(block, shell, template, measured, reach_m);
        Self {
            shell: on.len() as f32 / (shell.len() as f32).max(1.0),
            off: mean / d_max,
            bias: bias_m(block, &on, template, measured) / d_max,
            covered,
            hollow,
            scale,
            scale_sd,
        }
    }
}

/// Root mean square of the mean distances of the pieces of surface, less what scatter alone makes of few points, metres.
fn bias_m(block: &Accepted, on: &[&Near], template: &Template, measured: &Measured) -> f32 {
    let block_from_site = block.at.pose(template.model.centre).inverse();
    let anchors = &template.surface[..PIECES.min(template.surface.len())];
    let mut sums = vec![(0_usize, 0.0_f32, 0.0_f32); anchors.len()];
    for near in on {
        let p = block_from_site * measured.position[near.point as usize];
        let off = |a: &(Vec3, Vec3)| {
            (a.0 - p).length_squared() * if a.1.dot(near.face) > 0.3 { 1.0 } else { 4.0 }
        };
        let piece =
            (0..anchors.len()).min_by(|&a, &b| off(&anchors[a]).total_cmp(&off(&anchors[b])));
        if let Some(s) = piece.map(|k| &mut sums[k]) {
            *s = (s.0 + 1, s.1 + near.off_m, s.2 + near.off_m * near.off_m);
        }
    }
    let (mut square, mut weight) = (0.0, 0.0);
    for (n, sum, squares) in sums.into_iter().filter(|s| s.0 >= FEWEST) {
        let n = n as f32;
        let mean = sum / n;
        let of_the_mean = (squares / n - mean * mean).max(0.0) / (n - 1.0);
        square += n * (mean * mean - of_the_mean);
        weight += n;
    }
    (square.max(0.0) / f32::max(weight, 1.0)).sqrt()
}

/// Share of the surface that ought to be seen and has points at it, and share of the inside that was looked through.
fn seen(block: &Accepted, template: &Template, measured: &Measured, reach_m: f32) -> (f32, f32) {
    let site_from_block = block.at.pose(template.model.centre);
    let near_m = (1.5 * measured.spacing_m).max(reach_m);
    let (mut due, mut there) = (0.0_f32, 0.0_f32);
    for &(p, n) in &template.surface {
        let (p, n) = (site_from_block * p, site_from_block.rotation * n);
        match measured.sight.of_surface_facing(p, n, reach_m, FACING) {
            Some(Seen::Here) => {
                due += 1.0;
                let nearest = measured.grid.nearest_within(p, near_m);
                let at =
                    |(i, _): (u32, f32)| n.dot(measured.position[i as usize] - p).abs() < reach_m;
                there += f32::from(u8::from(nearest.is_some_and(at)));
            }
            Some(Seen::Through) => due += 1.0,
            // Turned from the side that the survey is thought to be seen from, and measured all the same.
            None if measured.viewpoint.is_some() => {
                let nearest = measured.grid.nearest_within(p, near_m);
                let seen = nearest.is_some_and(|(i, _)| {
                    measured.normal[i as usize].dot(n).abs() > SAME_FACE
                        && n.dot(measured.position[i as usize] - p).abs() < reach_m
                });
                due += f32::from(u8::from(seen));
                there += f32::from(u8::from(seen));
            }
            _ => {}
        }
    }
    let through = template
        .inside
        .iter()
        .filter(|&&p| measured.sight.looked_through(site_from_block * p, reach_m))
        .count();
    (there / due.max(1.0), through as f32 / template.inside.len().max(1) as f32)
}

/// Steps of the fit with a free size.
const SCALE_STEPS: usize = 4;

/// Logarithm of the size that would fit the shell best over the block's own, the pose moving along, and its standard
/// deviation.
fn scale(
    block: &Accepted,
    shell: &[Near],
    template: &Template,
    measured: &Measured,
    reach_m: f32,
) -> (f32, f32) {
    let centre = template.model.centre;
    let d_max = template.model.d_max_m;
    let sd = f64::from(measured.noise_sd_m.max(0.3 * template.field.cell_m()));
    let variance = (sd / f64::from(d_max)).powi(2) * POINTS_A_FACT;
    let keep_m = 2.0 * reach_m;
    let (mut at, mut log, mut free) = (block.at, 0.0_f32, 0.0);
    for _ in 0..SCALE_STEPS {
        let size = log.exp();
        let block_from_site = at.rotation.inverse();
        // Unknowns: shift, turn (both over d_max, in block axes) and logarithm of the size.
        let mut a = vec![0.0_f64; 49];
        let mut b = vec![0.0_f64; 7];
        for near in shell.iter().filter(|n| n.agreement > AGREES) {
            let x = block_from_site * (measured.position[near.point as usize] - at.centre);
            let (d, g) = template.field.at(x / size + centre);
            let (d, x) = (size * d, x / d_max);
            let turn = x.cross(g);
            let j = [g.x, g.y, g.z, turn.x, turn.y, turn.z, x.dot(g)];
            let keep = keep_m * keep_m / (keep_m * keep_m + d * d);
            let w = f64::from(near.agreement * keep * keep);
            for i in 0..7 {
                b[i] += w * f64::from(j[i] * d / d_max);
                for k in 0..7 {
                    a[i * 7 + k] += w * f64::from(j[i] * j[k]);
                }
            }
        }
        for i in 0..7 {
            let prior: f32 = if i == 6 { SCALE_PRIOR_SD } else { 0.2 };
            a[i * 7 + i] += variance * f64::from(prior).powi(-2);
        }
        b[6] -= f64::from(log) * variance * f64::from(SCALE_PRIOR_SD).powi(-2);
        let mut unit = vec![0.0; 7];
        unit[6] = 1.0;
        free = solve(&mut a.clone(), unit, 7)[6] * variance;
        let step: Vec<f32> = solve(&mut a, b, 7).into_iter().map(|v| v as f32).collect();
        let shift = Vec3::new(step[0], step[1], step[2]) * d_max;
        let turn = Vec3::new(step[3], step[4], step[5]).clamp_length_max(0.2);
        at.centre += at.rotation * shift.clamp_length_max(0.1 * d_max);
        at.rotation = (at.rotation * Quat::from_scaled_axis(turn)).normalize();
        log = (log + step[6]).clamp(-MOST_SCALE, MOST_SCALE);
    }
    (log, free.max(0.0).sqrt() as f32)
}

/// The size that fits the blocks of a survey best.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct CommonSize {
    /// Over the catalogue's.
    pub factor: f32,
    /// Its standard deviation, from how the blocks differ.
    pub factor_sd: f32,
    /// Blocks that say so.
    pub blocks: usize,
}

/// A block tells its size when that is held to this standard deviation: of a cube seen from one side it is not at all.
const HELD_SCALE_SD: f32 = 0.03;

impl Absolute {
    /// The logarithm of the size, where the block tells it; else 0.
    pub fn held_scale(&self) -> f32 {
        if self.scale_sd < HELD_SCALE_SD { self.scale } else { 0.0 }
    }
}

/// Fewest blocks that a common size is believed of.
const FEWEST_BLOCKS: usize = 3;
/// Meshes and surveys err in common by this share.
const LEAST_SCALE_SD: f32 = 0.003;
/// An echo sounder's beam is as wide as a leg is thick and returns what is nearest in it: twelve surveys of three sets by our own
/// sounder, of blocks of the catalogue's size, fit 1.1 to 2.0 % too large.
const SOUNDER_SCALE_SD: f32 = 0.0065;

/// Median of the blocks' own sizes, each counted by how well it is held; `None` with too few blocks.
pub fn common_size(blocks: &[Absolute], sensor: SensorKind) -> Option<CommonSize> {
    let of: Vec<(f32, f32)> = blocks
        .iter()
        .filter(|b| b.scale_sd < HELD_SCALE_SD)
        .map(|b| (b.scale, 1.0 / (b.scale_sd * b.scale_sd + 1e-4)))
        .filter(|b| b.0.is_finite() && b.1.is_finite())
        .collect();
    if of.len() < FEWEST_BLOCKS {
        return None;
    }
    let middle = weighted_median(of.clone());
    let off = of.iter().map(|o| ((o.0 - middle).abs(), o.1)).collect();
    let spread = 1.4826 * weighted_median(off) / (of.len() as f32).sqrt();
    Some(CommonSize {
        factor: middle.exp(),
        factor_sd: spread.hypot(if sensor == SensorKind::Mbes {
            SOUNDER_SCALE_SD
        } else {
            LEAST_SCALE_SD
        }),
        blocks: of.len(),
    })
}

/// Of values with their weights.
fn weighted_median(mut of: Vec<(f32, f32)>) -> f32 {
    of.sort_by(|a, b| a.0.total_cmp(&b.0));
    let half = 0.5 * of.iter().map(|o| o.1).sum::<f32>();
    let mut sum = 0.0;
    let middle = of.iter().find(|o| {
        sum += o.1;
        sum >= half
    });
    middle.map_or(0.0, |m| m.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    /// Every survey by our own echo sounder was once warned of, its blocks being of the catalogue's size.
    #[test]
    fn what_a_sounder_adds_to_every_block_is_no_other_size() {
        let blocks: Vec<Absolute> = (0..40)
            .map(|i| Absolute {
                scale: 0.016 + 0.0005 * (i % 5) as f32,
                scale_sd: 0.01,
                ..Default::default()
            })
            .collect();
        let deviates = |sensor| {
            let size = common_size(&blocks, sensor).unwrap();
            (size.factor - 1.0).abs() > 3.0 * size.factor_sd
        };
        assert!(deviates(SensorKind::Uav) && !deviates(SensorKind::Mbes));
    }
}
