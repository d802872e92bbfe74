//! The plane most points lie on: the bed under a pile, the floor or a wall of a bin.
//!
//! In: positions, a thickness, a seed. Out: the plane with the most points within the thickness, refitted to them.
//! Random samples of three (RANSAC) with a fixed number of draws, scored on at most a few thousand points, so that
//! the result depends on nothing but its arguments. A bin's floor and walls are the planes with nothing beyond them.

use crate::normals::smallest_direction;
use crate::point_grid::PointGrid;
use crate::{Mat3, SeedTree, Vec3};
use rand::RngExt;

/// Points with `normal · p = offset_m`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// Unit normal.
    pub normal: Vec3,
    /// Distance of the plane from the origin along the normal, metres.
    pub offset_m: f32,
}

impl Plane {
    /// Signed distance of a point, positive on the normal's side, metres.
    pub fn distance_m(&self, p: Vec3) -> f32 {
        self.normal.dot(p) - self.offset_m
    }

    /// The same plane with its normal on the side of `direction`.
    pub fn facing(self, direction: Vec3) -> Self {
        if self.normal.dot(direction) < 0.0 {
            Self { normal: -self.normal, offset_m: -self.offset_m }
        } else {
            self
        }
    }

    /// Least-squares plane through the points; `None` for fewer than three or points on a line.
    pub fn through(points: &[Vec3]) -> Option<Self> {
        if points.len() < 3 {
            return None;
        }
        let mean = points.iter().copied().sum::<Vec3>() / points.len() as f32;
        let mut m = Mat3::ZERO;
        for &p in points {
            let d = p - mean;
            m += Mat3::from_cols(d * d.x, d * d.y, d * d.z);
        }
        let normal = smallest_direction(&m)?;
        Some(Self { normal, offset_m: normal.dot(mean) })
    }
}

/// Draws of three points.
const DRAWS: usize = 500;
/// Points a draw is scored on.
const SCORED: usize = 3000;

/// The plane with the most points within `thickness_m` of it, facing up (+z), and how many points those are.
/// With `max_tilt_rad` only planes tilted less than that from horizontal are considered. `None` when three points
/// not on a line cannot be found.
pub fn find_plane(
    points: &[Vec3],
    thickness_m: f32,
    max_tilt_rad: Option<f32>,
    seed: SeedTree,
) -> Option<(Plane, usize)> {
    if points.len() < 3 {
        return None;
    }
    let mut rng = seed.rng();
    let step = points.len().div_ceil(SCORED);
    let scored: Vec<Vec3> = points.iter().copied().step_by(step).collect();
    let upright = max_tilt_rad.map_or(0.0, f32::cos);
    let count = |plane: &Plane| {
        scored.iter().filter(|&&p| plane.distance_m(p).abs() <= thickness_m).count()
    };
    let mut best: Option<(usize, Plane)> = None;
    for _ in 0..DRAWS {
        let [a, b, c] = std::array::from_fn(|_| points[rng.random_range(0..points.len())]);
        let Some(normal) = (b - a).cross(c - a).try_normalize() else { continue };
        let plane = Plane { normal, offset_m: normal.dot(a) }.facing(Vec3::Z);
        if max_tilt_rad.is_some() && plane.normal.z < upright {
            continue;
        }
        let n = count(&plane);
        if best.is_none_or(|(m, _)| n > m) {
            best = Some((n, plane));
        }
    }
    let mut plane = best?.1;
    for _ in 0..3 {
        let near: Vec<Vec3> =
            points.iter().copied().filter(|&p| plane.distance_m(p).abs() <= thickness_m).collect();
        match Plane::through(&near) {
            Some(better) => plane = better.facing(Vec3::Z),
            None => break,
        }
    }
    let inliers = points.iter().filter(|&&p| plane.distance_m(p).abs() <= thickness_m).count();
    Some((plane, inliers))
}

/// Planes a bin has at most.
const MOST_WALLS: usize = 5;

/// Floor and walls of a bin: planes with nothing (but a fiftieth) beyond them, a thirtieth of the points on them at
/// least, facing the contents; the largest first. `thickness_m` is what the sensor's noise and bent walls need.
pub fn find_walls(points: &[Vec3], thickness_m: f32, seed: SeedTree) -> Vec<Plane> {
    let mut rng = seed.rng();
    let mut left: Vec<Vec3> = points.to_vec();
    let scored: Vec<Vec3> =
        points.iter().copied().step_by(points.len().div_ceil(SCORED).max(1)).collect();
    let mut walls: Vec<Plane> = Vec::new();
    while walls.len() < MOST_WALLS && left.len() >= 30 {
        // Three points of one neighbourhood: three of the whole cloud hardly ever share a wall.
        let grid = PointGrid::new(&left, 10.0 * thickness_m);
        let step = left.len().div_ceil(SCORED).max(1);
        let rest: Vec<Vec3> = left.iter().copied().step_by(step).collect();
        let beyond = |plane: &Plane| {
            scored.iter().filter(|&&p| plane.distance_m(p) < -2.0 * thickness_m).count()
        };
        let mut best: Option<(usize, Plane)> = None;
        for _ in 0..DRAWS {
            let a = left[rng.random_range(0..left.len())];
            let near = grid.within(a, 20.0 * thickness_m);
            let [b, c] =
                std::array::from_fn(|_| left[near[rng.random_range(0..near.len())] as usize]);
            let Some(normal) = (b - a).cross(c - a).try_normalize() else { continue };
            let plane = Plane { normal, offset_m: normal.dot(a) };
            let turned = Plane { normal: -normal, offset_m: -plane.offset_m };
            // A plane with everything below it is a lid or the tops of the contents, no wall.
            for plane in [plane, turned].into_iter().filter(|w| w.normal.z > -0.4) {
                let n = rest.iter().filter(|&&p| plane.distance_m(p).abs() <= thickness_m).count();
                if best.is_none_or(|(m, _)| n > m) && beyond(&plane) * 50 <= scored.len() {
                    best = Some((n, plane));
                }
            }
        }
        let Some((_, mut plane)) = best else { break };
        for _ in 0..3 {
            let near: Vec<Vec3> = left
                .iter()
                .copied()
                .filter(|&p| plane.distance_m(p).abs() <= thickness_m)
                .collect();
            if let Some(better) = Plane::through(&near) {
                plane = better.facing(plane.normal);
            }
        }
        let on = left.iter().filter(|&&p| plane.distance_m(p).abs() <= thickness_m).count();
        if on * 30 < points.len() {
            break;
        }
        left.retain(|&p| plane.distance_m(p).abs() > thickness_m);
        walls.push(plane);
    }
    walls
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finds_the_floor_under_clutter() {
        let mut points: Vec<Vec3> = (0..400)
            .map(|i| {
                Vec3::new(
                    (i % 20) as f32 * 0.1,
                    (i / 20) as f32 * 0.1,
                    0.05 * (i % 20) as f32 * 0.1,
                )
            })
            .collect();
        points.extend((0..200).map(|i| {
            Vec3::new((i % 7) as f32 * 0.2, (i % 11) as f32 * 0.15, 0.2 + (i % 13) as f32 * 0.1)
        }));
        let (plane, n) = find_plane(&points, 0.01, Some(0.3), SeedTree::new(1)).unwrap();
        assert!(n >= 400);
        let slope = -plane.normal.x / plane.normal.z;
        assert!((slope - 0.05).abs() < 2e-3 && plane.offset_m.abs() < 5e-3, "{plane:?}");
    }

    #[test]
    fn a_bin_loses_its_floor_and_walls_and_keeps_its_contents() {
        let r = |i: usize, k: f64| ((i + 1) as f64 * k).fract() as f32;
        let mut points: Vec<Vec3> =
            (0..2000).map(|i| Vec3::new(r(i, 0.754_877), r(i, 0.569_840), 0.0)).collect();
        points.extend((0..600).map(|i| Vec3::new(0.0, r(i, 0.754_877), 0.4 * r(i, 0.569_840))));
        points.extend((0..600).map(|i| Vec3::new(r(i, 0.754_877), 1.0, 0.4 * r(i, 0.569_840))));
        let bin = points.len();
        // A ball in the middle.
        points.extend((0..1500).map(|i| {
            let (z, a) = (2.0 * r(i, 0.754_877) - 1.0, r(i, 0.569_840) * std::f32::consts::TAU);
            let s = (1.0 - z * z).sqrt();
            Vec3::new(0.5, 0.5, 0.25) + Vec3::new(s * a.cos(), s * a.sin(), z) * 0.2
        }));
        let walls = find_walls(&points, 0.005, SeedTree::new(4));
        assert_eq!(walls.len(), 3, "{walls:?}");
        let inside = |p: Vec3| walls.iter().all(|w| w.distance_m(p) > 0.01);
        let kept: Vec<u32> =
            (0..points.len() as u32).filter(|&i| inside(points[i as usize])).collect();
        assert!(kept.iter().all(|&i| i as usize >= bin) && kept.len() >= 1490, "{}", kept.len());
    }

    #[test]
    fn a_line_has_no_plane() {
        let points: Vec<Vec3> = (0..50).map(|i| Vec3::X * i as f32).collect();
        assert_eq!(find_plane(&points, 0.01, None, SeedTree::new(1)), None);
        assert_eq!(find_plane(&[Vec3::X], 0.01, None, SeedTree::new(1)), None);
    }
}
