//! What the points of a survey lie on: wide planes, as beds and walls are, or nothing, as leaves are.

use geom::{Plane, PointGrid, Vec3};
use serde::Serialize;

/// Places asked.
const PLACES: usize = 2000;
/// Points of a patch, at least and at most.
const FEWEST: usize = 12;
const MOST: usize = 200;
/// Half the width of a patch for scatter, in block lengths: within it a block is nearly flat.
const NEAR: f32 = 0.15;
/// Half the width of a patch for ground, in block lengths: no face of a block is so large.
const WIDE: f32 = 1.0;
/// A plane, when points are off it by this share of the patch's half width: sand and gravel are, blocks are not.
const FLAT: f32 = 0.06;
/// No surface, from here on: points that fill a ball evenly are off any plane by 0.45 of its radius, those of an edge by 0.2.
const FILLED: f32 = 0.3;

/// Shares of the points.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Texture {
    /// On planes wider than two blocks: bed, walls, decks.
    pub flat_share: f64,
    /// On no surface at all: leaves, spray, noise.
    pub scattered_share: f64,
}

impl Texture {
    /// Of points at the survey's own density; `block_m` is the largest edge of the smallest block.
    pub fn of(points: &[Vec3], block_m: f32) -> Self {
        if points.is_empty() || !(block_m > 0.0) {
            return Self::default();
        }
        let grid = PointGrid::new(points, NEAR * block_m);
        let step = points.len().div_ceil(PLACES).max(1);
        let places: Vec<Vec3> = points.iter().copied().step_by(step).collect();
        let share = |half_m: f32, holds: &dyn Fn(f32) -> bool| {
            let met =
                places.iter().filter(|p| rough(points, &grid, **p, half_m).is_some_and(holds));
            met.count() as f64 / places.len() as f64
        };
        Self {
            flat_share: share(WIDE * block_m, &|rough| rough < FLAT),
            scattered_share: share(NEAR * block_m, &|rough| rough > FILLED),
        }
    }
}

/// How far the points about a place are off their plane, over the half width; `None` with too few of them.
fn rough(points: &[Vec3], grid: &PointGrid, place: Vec3, half_m: f32) -> Option<f32> {
    let near = grid.within(place, half_m);
    let step = near.len().div_ceil(MOST).max(1);
    let near: Vec<Vec3> = near.iter().step_by(step).map(|&i| points[i as usize]).collect();
    let plane = (near.len() >= FEWEST).then(|| Plane::through(&near)).flatten()?;
    let square: f32 = near.iter().map(|p| plane.distance_m(*p).powi(2)).sum();
    Some((square / near.len() as f32).sqrt() / half_m)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A cheap even sequence in [0, 1).
    fn even(i: usize, step: f64) -> f32 {
        (i as f64 * step).fract() as f32
    }

    #[test]
    fn a_bed_is_flat_and_a_bush_fills_its_place() {
        let bed: Vec<Vec3> = (0..20_000)
            .map(|i| {
                Vec3::new(10.0 * even(i, 0.618_034), 10.0 * even(i, 0.754_878), 0.02 * even(i, 0.3))
            })
            .collect();
        let told = Texture::of(&bed, 2.0);
        assert!(told.flat_share > 0.95 && told.scattered_share < 0.01, "{told:?}");
        let bush: Vec<Vec3> = (0..40_000)
            .map(|i| {
                Vec3::new(
                    4.0 * even(i, 0.819_173),
                    4.0 * even(i, 0.671_044),
                    4.0 * even(i, 0.549_700),
                )
            })
            .collect();
        let told = Texture::of(&bush, 2.0);
        assert!(told.flat_share < 0.01 && told.scattered_share > 0.8, "{told:?}");
    }

    #[test]
    fn nothing_is_said_of_nothing() {
        assert_eq!(Texture::of(&[], 2.0), Texture::default());
    }
}
