//! From votes to centre hypotheses: modes of the weighted density of votes, found by mean shift.
//!
//! A vote counts the more the smaller the error the network expects of it. Lengths in d_max. How wide the kernel is
//! belongs to the weights: a network votes sharply on a shape it was trained on and loosely on one it never saw.

use geom::{PointGrid, Vec3};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Votes that count less are left out: they cost time and move nothing.
const LEAST_WEIGHT: f32 = 1e-3;
/// The Gaussian kernel is cut off at so many widths, where it is 4 %.
const KERNEL_REACH: f32 = 2.5;
/// A step of mean shift whose square is below this, a thousandth of d_max, has arrived.
const STILL_SQUARED: f32 = 1e-6;

/// Modes nearer than this are one hypothesis.
const SAME: f32 = 0.2;
/// Smallest expected error taken at its word.
const LEAST_ERROR: f32 = 0.08;
/// Steps of mean shift.
const STEPS: usize = 12;

/// A vote.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Vote {
    /// Where the block's centre should be.
    pub at: Vec3,
    /// How much it counts.
    pub weight: f32,
}

/// A mode of the votes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Peak {
    /// Where.
    pub at: Vec3,
    /// Density: the weight of the votes under the kernel.
    pub density: f32,
}

/// Weight of a vote of a point that lies on a block with probability `block` and is off by about `error`.
pub(crate) fn weight(block: f32, error: f32) -> f32 {
    let e = LEAST_ERROR / error.max(LEAST_ERROR);
    block * e * e
}

/// All modes under a kernel of this width, densest first.
pub(crate) fn peaks(votes: &[Vote], width: f32) -> Vec<Peak> {
    // Votes are pooled in cells of half a width first: they come by the hundred a block.
    let mut cells: BTreeMap<[i32; 3], (Vec3, f32)> = BTreeMap::new();
    let edge = width / 2.0;
    for v in votes.iter().filter(|v| v.weight > LEAST_WEIGHT && v.at.is_finite()) {
        let key = (v.at / edge).floor();
        let entry =
            cells.entry([key.x as i32, key.y as i32, key.z as i32]).or_insert((Vec3::ZERO, 0.0));
        entry.0 += v.at * v.weight;
        entry.1 += v.weight;
    }
    let pooled: Vec<Vote> =
        cells.values().map(|&(sum, weight)| Vote { at: sum / weight, weight }).collect();
    let positions: Vec<Vec3> = pooled.iter().map(|v| v.at).collect();
    let grid = PointGrid::new(&positions, KERNEL_REACH * width);
    let look = |at: Vec3| {
        let (mut sum, mut mass) = (Vec3::ZERO, 0.0);
        grid.for_each_within(at, KERNEL_REACH * width, |i, p, d2| {
            let k = pooled[i as usize].weight * (-d2 / (2.0 * width * width)).exp();
            sum += (p - at) * k;
            mass += k;
        });
        (at + sum / mass.max(1e-12), mass)
    };
    let mut found: Vec<Peak> = pooled
        .par_iter()
        .map(|v| {
            let mut at = v.at;
            for _ in 0..STEPS {
                let next = look(at).0;
                let still = (next - at).length_squared() < STILL_SQUARED;
                at = next;
                if still {
                    break;
                }
            }
            Peak { at, density: look(at).1 }
        })
        .collect();
    let order = |p: &Peak| (p.at.x, p.at.y, p.at.z);
    found.sort_by(|a, b| {
        let tie = order(a).partial_cmp(&order(b)).unwrap_or(std::cmp::Ordering::Equal);
        b.density.total_cmp(&a.density).then(tie)
    });
    suppressed(found, SAME)
}

/// Keeps each peak that is farther than `radius` from all denser ones kept; input densest first.
pub(crate) fn suppressed(sorted: Vec<Peak>, radius: f32) -> Vec<Peak> {
    let mut cells: BTreeMap<[i32; 3], Vec<usize>> = BTreeMap::new();
    let mut kept: Vec<Peak> = Vec::new();
    for peak in sorted {
        let key = (peak.at / radius).floor();
        let key = [key.x as i32, key.y as i32, key.z as i32];
        let mut free = true;
        for x in -1..=1 {
            for y in -1..=1 {
                for z in -1..=1 {
                    if let Some(near) = cells.get(&[key[0] + x, key[1] + y, key[2] + z]) {
                        free &= near.iter().all(|&i| (kept[i].at - peak.at).length() > radius);
                    }
                }
            }
        }
        if free {
            cells.entry(key).or_default().push(kept.len());
            kept.push(peak);
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;
    use geom::SeedTree;
    use rand::RngExt;

    #[test]
    fn two_clouds_of_votes_are_two_peaks_and_noise_is_thin() {
        let mut rng = SeedTree::new(2).rng();
        let mut near =
            |c: Vec3, by: f32| c + by * (Vec3::new(rng.random(), rng.random(), rng.random()) - 0.5);
        let (a, b) = (Vec3::new(1.0, 2.0, 0.3), Vec3::new(1.9, 2.0, 0.2));
        let mut votes: Vec<Vote> =
            (0..100).map(|_| Vote { at: near(a, 0.3), weight: 1.0 }).collect();
        votes.extend((0..40).map(|_| Vote { at: near(b, 0.3), weight: 1.0 }));
        votes.extend((0..30).map(|_| Vote { at: near(a, 8.0), weight: 0.2 }));
        let found = peaks(&votes, 0.12);
        assert!((found[0].at - a).length() < 0.06 && (found[1].at - b).length() < 0.06);
        assert!(
            found[0].density > found[1].density
                && found[1].density > 10.0 * found.get(2).map_or(0.0, |p| p.density)
        );
    }

    #[test]
    fn no_votes_no_peaks() {
        assert!(peaks(&[], 0.12).is_empty());
        assert!(peaks(&[Vote { at: Vec3::ZERO, weight: 0.0 }], 0.12).is_empty());
    }
}
