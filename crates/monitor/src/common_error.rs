//! What both sensors do to every block beyond the covariance of its fit.
//!
//! A survey's drift, roll or heave moves whole neighbourhoods; no fit sees it. The blocks that did not move show it: their
//! differences spread wider than their covariances say. In: differences and covariances of the pairs. Out: the extra variance
//! of a shift along, a shift up and a turn. A few blocks say little; there the sensor's usual error counts more.

use crate::body::Difference;
use crate::dense::{Matrix, cholesky, distance2, part, zeros};
use scene::SensorKind;
use serde::Serialize;

/// Standard deviations of a difference of two epochs beyond the fits' own.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct CommonError {
    /// Along each horizontal axis, metres.
    pub level_sd_m: f64,
    /// Upwards, metres.
    pub height_sd_m: f64,
    /// Turn about each axis, radians.
    pub turn_sd_rad: f64,
}

/// Pairs that the usual error counts for.
const USUAL_WEIGHT: f64 = 4.0;
/// Median of χ² with one degree of freedom.
const MEDIAN: f64 = 0.454_936;
/// 99 % of χ² with six degrees of freedom.
const NO_CHANGE: f64 = 16.812;

impl CommonError {
    /// What the sensors are known to do, both together, for blocks of this size (a bin's parts are small).
    pub fn usual(earlier: SensorKind, later: SensorKind, size_m: f64) -> Self {
        let one = |kind: SensorKind| match kind {
            SensorKind::Uav => [0.005, 0.01, 0.003],
            SensorKind::Mbes => [0.015, 0.012, 0.006],
            SensorKind::DepthCamera => [0.004 * size_m, 0.004 * size_m, 0.005],
        };
        let (a, b) = (one(earlier), one(later));
        let both = |i: usize| a[i].hypot(b[i]);
        Self { level_sd_m: both(0), height_sd_m: both(1), turn_sd_rad: both(2) }
    }

    /// As a covariance of shift and turn.
    pub(crate) fn covariance(&self) -> Matrix<6> {
        let mut out = zeros::<6>();
        let sd = [self.level_sd_m, self.level_sd_m, self.height_sd_m];
        for (i, sd) in sd.into_iter().chain([self.turn_sd_rad; 3]).enumerate() {
            out[i][i] = sd * sd;
        }
        out
    }

    /// From the pairs that did not change, each with its Mahalanobis distance so far; `usual` is where it starts.
    pub(crate) fn estimated(differences: &[(Difference, f64)], usual: Self) -> Self {
        let still: Vec<&Difference> =
            differences.iter().filter(|(_, d2)| *d2 < NO_CHANGE).map(|(d, _)| d).collect();
        let component = |axes: &[usize], usual: f64| {
            let samples: Vec<(f64, f64)> = still
                .iter()
                .flat_map(|d| axes.iter().map(|&i| (d.d[i] * d.d[i], d.covariance[i][i])))
                // The free turn of a body of revolution says nothing.
                .filter(|(_, v)| *v < 1.0)
                .collect();
            let count = still.len() as f64;
            let found = extra_variance(&samples);
            ((USUAL_WEIGHT * usual * usual + count * found) / (USUAL_WEIGHT + count)).sqrt()
        };
        Self {
            level_sd_m: component(&[0, 1], usual.level_sd_m),
            height_sd_m: component(&[2], usual.height_sd_m),
            turn_sd_rad: component(&[3, 4, 5], usual.turn_sd_rad),
        }
    }
}

/// Pairs that covariances taken as they are count for.
const AS_GIVEN_WEIGHT: f64 = 3.0;
/// Covariances are never taken for better than by this.
const LEAST_SCALE: f64 = 0.05;
/// 95 % of χ² with one degree of freedom, and the share; the middle of it likewise.
const LEVEL: (f64, f64) = (3.841_459, 0.95);
const MIDDLE: (f64, f64) = (MEDIAN, 0.5);

/// Rounds of leaving out what moved and scaling by the rest.
const SCALINGS: usize = 8;
/// 99 % of χ² with three degrees of freedom.
const NO_SHIFT: f64 = 11.345;

/// By how much the covariances of shift and of turn are too large, from the pairs that did not change: 1 where they are right or
/// too small. Fits count that points err together; where both surveys err alike, the difference errs less than both. A level of
/// detection is asked to hold in 95 of 100 cases, so that is what is brought to its place; the middle of the pairs would
/// promise too much, because a few badly seen blocks err more than the rest. Blocks that settled by a little would widen the levels
/// of all: pairs whose shift stands out of the scaled covariances are left out, and the rest scales them again. Turns are scaled
/// by all: a hidden block's turn errs by more than its covariance says, and looks like one that turned.
pub(crate) fn scales(differences: &[(Difference, f64)]) -> [f64; 2] {
    let all: Vec<&Difference> =
        differences.iter().filter(|(_, d2)| *d2 < NO_CHANGE).map(|(d, _)| d).collect();
    let turn = scale_of(&all, [3, 4, 5], LEVEL);
    // The middle of the pairs is where few that settled reach; from there the kept ones tell their own width.
    let mut shift = scale_of(&all, [0, 1, 2], MIDDLE);
    for _ in 0..SCALINGS {
        let within = |d: &&Difference| {
            let covariance = part(&scaled(&d.covariance, [shift, turn]), 0);
            cholesky(&covariance).is_some_and(|l| distance2(&l, &d.shift().to_array()) < NO_SHIFT)
        };
        let still: Vec<&Difference> = all.iter().copied().filter(within).collect();
        shift = scale_of(&still, [0, 1, 2], LEVEL);
    }
    [shift, turn]
}

/// Brings this quantile of the squares to its place: χ² with one degree of freedom, and the share.
fn scale_of(still: &[&Difference], axes: [usize; 3], (chi2, share): (f64, f64)) -> f64 {
    let mut ratio: Vec<f64> = still
        .iter()
        .flat_map(|d| axes.map(|i| (d.d[i] * d.d[i], d.covariance[i][i])))
        .filter(|(_, v)| *v > 0.0 && *v < 1.0)
        .map(|(r2, v)| r2 / v)
        .collect();
    if ratio.is_empty() {
        return 1.0;
    }
    let place = ((share * ratio.len() as f64) as usize).min(ratio.len() - 1);
    let found = *ratio.select_nth_unstable_by(place, f64::total_cmp).1 / chi2;
    let count = still.len() as f64;
    ((AS_GIVEN_WEIGHT + count * found) / (AS_GIVEN_WEIGHT + count)).clamp(LEAST_SCALE, 1.0)
}

/// A covariance of shift and turn with both parts scaled.
pub(crate) fn scaled(covariance: &Matrix<6>, scales: [f64; 2]) -> Matrix<6> {
    let root = |i: usize| scales[i / 3].sqrt();
    std::array::from_fn(|i| std::array::from_fn(|j| covariance[i][j] * root(i) * root(j)))
}

/// The variance that, added to each one's own, brings the median of square over variance to that of χ²₁.
fn extra_variance(samples: &[(f64, f64)]) -> f64 {
    if samples.is_empty() {
        return 0.0;
    }
    let median = |extra: f64| {
        let mut ratio: Vec<f64> = samples.iter().map(|(r2, v)| r2 / (v + extra)).collect();
        let middle = ratio.len() / 2;
        *ratio.select_nth_unstable_by(middle, f64::total_cmp).1
    };
    if median(0.0) <= MEDIAN {
        return 0.0;
    }
    let (mut low, mut high) = (0.0, samples.iter().map(|(r2, _)| *r2).fold(0.0, f64::max) / MEDIAN);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if median(middle) > MEDIAN { low = middle } else { high = middle }
    }
    high
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_distr::{Distribution, StandardNormal};

    #[test]
    fn covariances_too_large_are_scaled_and_those_too_small_are_not() {
        let mut rng = geom::SeedTree::new(4).rng();
        let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
        let mut of = |sd: f64, said: f64| {
            let mut covariance = zeros::<6>();
            (0..6).for_each(|i| covariance[i][i] = said * said);
            (Difference { d: std::array::from_fn(|_| sd * normal()), covariance }, 0.0)
        };
        // They err by 1 mm; the covariances say 2 mm.
        let said: Vec<(Difference, f64)> = (0..400).map(|_| of(1e-3, 2e-3)).collect();
        let [shift, turn] = scales(&said);
        assert!((shift - 0.25).abs() < 0.04 && (turn - 0.25).abs() < 0.04, "{shift} {turn}");
        // A quarter that settled by a little widens nobody's level.
        let mut settled: Vec<(Difference, f64)> = (0..130).map(|_| of(1e-3, 2e-3)).collect();
        settled.iter_mut().for_each(|(delta, _)| delta.d[2] -= 7e-3);
        let [shift, _] = scales(&[&said[..], &settled].concat());
        assert!((shift - 0.25).abs() < 0.05, "{shift}");
        let small: Vec<(Difference, f64)> = (0..90).map(|_| of(2e-3, 1e-3)).collect();
        assert_eq!(scales(&small), [1.0, 1.0]);
        assert_eq!(scales(&[]), [1.0, 1.0]);
        let scaled = scaled(&said[0].0.covariance, [0.25, 1.0]);
        assert!((scaled[0][0] - 1e-6).abs() < 1e-12 && (scaled[3][3] - 4e-6).abs() < 1e-12);
    }
}
