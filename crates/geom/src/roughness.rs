//! How far points scatter about the surface they measure, from the points alone.
//!
//! In: positions, their spacing. Out: a robust standard deviation at places spread over the cloud, and one for all of it.
//! At each place a quadratic patch is fitted to the neighbours (a plane would take the curvature of a leg for noise), outliers
//! losing their say; the residuals across the patch are the noise. The patch must be wide against the noise, or the
//! neighbourhood is a ball that cuts the noise off: the radius grows until it is. Edges inflate a place's figure, so that the
//! lower part of the places speaks for a region.

use crate::normals::smallest_direction;
use crate::{Bounds, Mat3, PointGrid, Vec3, thin_from_lowest};
use rayon::prelude::*;

/// Places asked at most.
const MOST_PLACES: usize = 1200;
/// Points of one patch at most.
const MOST_POINTS: usize = 160;
/// Points of a large patch that are looked at: enough for its median.
const MOST_OF_A_PATCH: usize = 4000;
/// Fewest points of a patch: six coefficients and something to spare.
const FEWEST_POINTS: usize = 24;
/// Radii tried, in spacings.
const RADII: [f32; 6] = [2.2, 3.0, 4.2, 6.0, 8.5, 12.0];
/// A patch is at least so many standard deviations wide on each side.
const WIDE: f32 = 4.5;
/// Which part of the places speaks for a region: edges and contacts of blocks inflate the others.
const QUANTILE: f32 = 0.45;
/// Fewest places that speak for a region.
const FEWEST_PLACES: usize = 12;

/// Scatter of one region of a cloud.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RegionScatter {
    /// Middle of the region's places.
    pub centre: Vec3,
    /// Robust standard deviation across the surface, metres.
    pub scatter_m: f32,
    /// Places it comes from.
    pub places: usize,
}

/// Scatter of a cloud.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Scatter {
    /// Of all of it, metres; `None` where no place has enough points.
    pub overall_m: Option<f32>,
    /// Of squares in plan, in the order of their place.
    pub regions: Vec<RegionScatter>,
}

impl Scatter {
    /// At a place: that of the nearest region, else the overall one.
    pub fn at(&self, p: Vec3) -> Option<f32> {
        let away = |r: &&RegionScatter| (r.centre - p).truncate().length_squared();
        let nearest = self.regions.iter().min_by(|a, b| away(a).total_cmp(&away(b)));
        nearest.map(|r| r.scatter_m).or(self.overall_m)
    }
}

/// Scatter of `points` that lie about `spacing_m` apart, for regions of `region_m` in plan. Duplicates count once.
pub fn scatter(points: &[Vec3], spacing_m: f32, region_m: f32) -> Scatter {
    if points.is_empty() || !(spacing_m > 0.0 && region_m > 0.0) {
        return Scatter::default();
    }
    let grid = PointGrid::new(points, 2.0 * spacing_m);
    let mut places = thin_from_lowest(points, 4.0 * spacing_m).kept;
    let stride = places.len().div_ceil(MOST_PLACES).max(1);
    places = places.into_iter().step_by(stride).collect();
    let found: Vec<(Vec3, f32)> = places
        .par_iter()
        .filter_map(|&i| {
            let at = points[i as usize];
            place(at, &grid, spacing_m).map(|sd| (at, sd))
        })
        .collect();
    let overall_m = quantile(found.iter().map(|f| f.1));
    let low = Bounds::of(points.iter().copied()).min;
    let square = |p: Vec3| {
        let at = (p - low) / region_m;
        [at.x as u32, at.y as u32]
    };
    let mut by_region: Vec<([u32; 2], Vec3, f32)> =
        found.iter().map(|&(p, sd)| (square(p), p, sd)).collect();
    by_region.sort_by_key(|r| r.0);
    let regions = by_region
        .chunk_by(|a, b| a.0 == b.0)
        .filter(|r| r.len() >= FEWEST_PLACES)
        .filter_map(|r| {
            let centre = r.iter().map(|v| v.1).sum::<Vec3>() / r.len() as f32;
            let scatter_m = quantile(r.iter().map(|v| v.2))?;
            Some(RegionScatter { centre, scatter_m, places: r.len() })
        })
        .collect();
    Scatter { overall_m, regions }
}

fn quantile(values: impl Iterator<Item = f32>) -> Option<f32> {
    let mut values: Vec<f32> = values.collect();
    values.sort_by(f32::total_cmp);
    values.get((QUANTILE * values.len() as f32) as usize).copied()
}

/// Scatter at one place: that of the narrowest patch that is wide enough for it.
fn place(at: Vec3, grid: &PointGrid, spacing_m: f32) -> Option<f32> {
    let mut last = None;
    for radius in RADII {
        let radius_m = radius * spacing_m;
        let mut near: Vec<(f32, Vec3)> = Vec::new();
        grid.for_each_within(at, radius_m, |_, p, d2| near.push((d2, p - at)));
        near.sort_by(|a, b| a.0.total_cmp(&b.0));
        // The same point twice is one measurement.
        near.dedup_by(|a, b| (a.1 - b.1).length_squared() < 1e-10);
        if near.len() < FEWEST_POINTS {
            continue;
        }
        let stride = near.len().div_ceil(MOST_POINTS).max(1);
        let near: Vec<Vec3> = near.into_iter().step_by(stride).map(|n| n.1).collect();
        let Some(sd) = patch(&near, radius_m) else { continue };
        last = Some(sd);
        if radius_m >= WIDE * sd {
            break;
        }
    }
    last
}

/// How far a few points of one surface scatter about a quadratic surface over their own plane, metres: a robust standard
/// deviation, hardly changed by less than half of them lying elsewhere. `None` where they do not hold such a surface.
pub fn scatter_about_patch_m(points: &[Vec3]) -> Option<f32> {
    if points.len() < FEWEST_POINTS {
        return None;
    }
    let stride = points.len().div_ceil(MOST_OF_A_PATCH).max(1);
    let some: Vec<Vec3> = points.iter().copied().step_by(stride).collect();
    patch(&some, 0.5 * Bounds::of(some.iter().copied()).size().max_element())
}

/// Robust standard deviation of the points about a quadratic surface over their plane.
fn patch(near: &[Vec3], radius_m: f32) -> Option<f32> {
    let mean = near.iter().copied().sum::<Vec3>() / near.len() as f32;
    let mut moment = Mat3::ZERO;
    for &p in near {
        let d = p - mean;
        moment += Mat3::from_cols(d * d.x, d * d.y, d * d.z);
    }
    let w = smallest_direction(&moment)?;
    let u = w.any_orthonormal_vector();
    let v = w.cross(u);
    let local: Vec<[f32; 3]> = near
        .iter()
        .map(|&p| [u.dot(p - mean), v.dot(p - mean), w.dot(p - mean)].map(|x| x / radius_m))
        .collect();
    let basis = |[x, y, _]: [f32; 3]| [1.0, x, y, x * x, x * y, y * y];
    let mut scale = f32::INFINITY;
    let mut c = [0.0_f32; 6];
    for _ in 0..4 {
        let (mut a, mut b) = ([[0.0_f64; 6]; 6], [0.0_f64; 6]);
        for &p in &local {
            let f = basis(p);
            let off = p[2] - dot(&f, &c);
            let keep = if scale.is_finite() {
                (1.0 + (off / (3.0 * scale)).powi(2)).powi(-2)
            } else {
                1.0
            };
            for i in 0..6 {
                b[i] += f64::from(keep * f[i] * p[2]);
                for k in 0..6 {
                    a[i][k] += f64::from(keep * f[i] * f[k]);
                }
            }
        }
        c = solve(a, b)?;
        let mut off: Vec<f32> = local.iter().map(|&p| (p[2] - dot(&basis(p), &c)).abs()).collect();
        off.sort_by(f32::total_cmp);
        let n = off.len() as f32;
        // Six coefficients are fitted to the same points.
        scale = (1.4826 * off[off.len() / 2] * (n / (n - 6.0)).sqrt()).max(1e-7);
    }
    Some(scale * radius_m)
}

fn dot(a: &[f32; 6], b: &[f32; 6]) -> f32 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Cholesky; `None` when the points do not hold the surface.
fn solve(mut a: [[f64; 6]; 6], mut b: [f64; 6]) -> Option<[f32; 6]> {
    let trace: f64 = (0..6).map(|i| a[i][i]).sum();
    for i in 0..6 {
        for k in 0..=i {
            let sum = a[i][k] - (0..k).map(|m| a[i][m] * a[k][m]).sum::<f64>();
            if i == k {
                if sum <= 1e-7 * trace {
                    return None;
                }
                a[i][i] = sum.sqrt();
            } else {
                a[i][k] = sum / a[k][k];
            }
        }
    }
    for i in 0..6 {
        b[i] = (b[i] - (0..i).map(|k| a[i][k] * b[k]).sum::<f64>()) / a[i][i];
    }
    for i in (0..6).rev() {
        b[i] = (b[i] - (i + 1..6).map(|k| a[k][i] * b[k]).sum::<f64>()) / a[i][i];
    }
    Some(b.map(|v| v as f32))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::SeedTree;
    use rand::RngExt;

    /// Points on a cylinder of 0.4 m with Gaussian noise, 600 a square metre.
    fn cylinder(noise_m: f32, seed: u64) -> Vec<Vec3> {
        let mut rng = SeedTree::new(seed).rng();
        (0..9000)
            .map(|_| {
                let (a, y) = (rng.random::<f32>() * 3.1, rng.random::<f32>() * 12.0);
                let normal: f32 = (0..12).map(|_| rng.random::<f32>()).sum::<f32>() - 6.0;
                let r = 0.4 + noise_m * normal;
                Vec3::new(r * a.cos(), y, r * a.sin())
            })
            .collect()
    }

    #[test]
    fn noise_on_a_curved_surface_is_found_within_a_third() {
        for noise_m in [0.005, 0.01, 0.03, 0.05, 0.08] {
            let got = scatter(&cylinder(noise_m, 3), 0.04, 4.0);
            let sd = got.overall_m.unwrap();
            assert!((0.67..1.5).contains(&(sd / noise_m)), "{noise_m}: {sd}");
            assert!(got.regions.len() >= 2);
        }
    }

    #[test]
    fn the_noisier_half_is_told_from_the_other() {
        let mut points = cylinder(0.01, 4);
        points.extend(cylinder(0.05, 5).into_iter().map(|p| p + Vec3::X * 20.0));
        let got = scatter(&points, 0.04, 6.0);
        let (calm, noisy) = (got.at(Vec3::ZERO).unwrap(), got.at(Vec3::X * 20.0).unwrap());
        assert!(noisy > 2.5 * calm, "{calm} {noisy}");
    }

    #[test]
    fn duplicates_do_not_hide_the_noise() {
        let points = cylinder(0.02, 6);
        let twice: Vec<Vec3> = points.iter().chain(&points).copied().collect();
        let (once, twice) = (scatter(&points, 0.04, 4.0), scatter(&twice, 0.04, 4.0));
        let ratio = twice.overall_m.unwrap() / once.overall_m.unwrap();
        assert!((0.85..1.15).contains(&ratio), "{ratio}");
    }

    #[test]
    fn nothing_says_nothing() {
        assert_eq!(scatter(&[], 0.1, 1.0), Scatter::default());
        assert_eq!(scatter(&[Vec3::ZERO; 3], 0.1, 1.0).overall_m, None);
    }
}
