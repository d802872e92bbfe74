//! How much too near slanted faces look to an echo sounder, measured on the blocks found.
//!
//! A beam is wide, and the first strong return in it counts: on a slanted face that is the nearer rim of the footprint.
//! The error grows with the slant and is nothing on level faces, so that the residuals of all blocks together show it
//! as a curve over the slant. Taking it out of the points before the last fits makes blocks no thicker than they are.

use crate::fit::{CentredPose, FitPoint};
use crate::template::Template;
use serde::{Deserialize, Serialize};

/// Bins of the curve over the cosine of the slant, from 0 (upright) to 1 (level).
const BINS: usize = 10;
/// Fewest points of a bin.
const FEWEST: usize = 150;

/// The curve: expected signed distance of a measured point from the true face, metres.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Fattening {
    value_m: [f32; BINS + 1],
}

impl Fattening {
    /// The curve that the residuals show; each is (cosine of the face's slant, signed distance).
    pub fn of(residuals: impl Iterator<Item = (f32, f32)>) -> Self {
        let mut bins: Vec<Vec<f32>> = vec![Vec::new(); BINS + 1];
        for (cos, d) in residuals.filter(|r| r.0 > -0.05) {
            bins[((cos.max(0.0) * BINS as f32).round() as usize).min(BINS)].push(d);
        }
        let mut value_m = [0.0; BINS + 1];
        let mut last = 0.0;
        for (k, bin) in bins.iter_mut().enumerate().rev() {
            if bin.len() >= FEWEST {
                bin.sort_by(f32::total_cmp);
                last = bin[bin.len() / 2];
            }
            value_m[k] = last;
        }
        // Level faces are measured truly; what they show is the blocks' own height.
        let level = value_m[BINS];
        for (k, v) in value_m.iter_mut().enumerate() {
            *v -= level * k as f32 / BINS as f32;
        }
        Self { value_m }
    }

    /// Expected signed distance at a face of this slant, metres.
    pub fn at(&self, cos: f32) -> f32 {
        let x = cos.clamp(0.0, 1.0) * BINS as f32;
        let k = (x as usize).min(BINS - 1);
        let share = x - k as f32;
        self.value_m[k] * (1.0 - share) + self.value_m[k + 1] * share
    }

    /// Moves the points back onto where their faces truly are.
    pub fn take_out(&self, points: &mut [FitPoint], template: &Template, at: &CentredPose) {
        let site_from_block = at.pose(template.model.centre);
        let block_from_site = site_from_block.inverse();
        for point in points {
            let (_, g) = template.field.at(block_from_site * point.position);
            let face = site_from_block.rotation * g;
            point.position -= face * self.at(face.z);
        }
    }
}

/// Cosine of the slant of the face each point lies nearest to, and its signed distance.
pub fn residuals(points: &[FitPoint], template: &Template, at: &CentredPose) -> Vec<(f32, f32)> {
    let site_from_block = at.pose(template.model.centre);
    let block_from_site = site_from_block.inverse();
    points
        .iter()
        .map(|point| {
            let (d, g) = template.field.at(block_from_site * point.position);
            ((site_from_block.rotation * g).z, d)
        })
        .collect()
}
