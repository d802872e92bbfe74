//! What both sensors do to every block beyond the covariance of its fit.
//!
//! A survey's drift, roll or heave moves whole neighbourhoods; no fit sees it. The blocks that did not move show it: their
//! differences spread wider than their covariances say. In: differences and covariances of the pairs. Out: the extra variance
//! of a shift along, a shift up and a turn. A few blocks say little; there the sensor's usual error counts more.

use crate::body::Difference;
use crate::dense::{Matrix, zeros};
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
    /// What a sensor is known to do, for blocks of this size (a bin's parts are small).
    pub(crate) fn of(sensor: SensorKind, size_m: f64) -> Self {
        let [level_sd_m, height_sd_m, turn_sd_rad] = match sensor {
            SensorKind::Uav => [0.005, 0.01, 0.003],
            SensorKind::Mbes => [0.015, 0.012, 0.006],
            SensorKind::DepthCamera => [0.004 * size_m, 0.004 * size_m, 0.005],
        };
        Self { level_sd_m, height_sd_m, turn_sd_rad }
    }

    /// The same of two surveys' difference.
    pub fn usual(earlier: SensorKind, later: SensorKind, size_m: f64) -> Self {
        let (a, b) = (Self::of(earlier, size_m), Self::of(later, size_m));
        Self {
            level_sd_m: a.level_sd_m.hypot(b.level_sd_m),
            height_sd_m: a.height_sd_m.hypot(b.height_sd_m),
            turn_sd_rad: a.turn_sd_rad.hypot(b.turn_sd_rad),
        }
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
/// 95 % of χ² with one degree of freedom, and the share.
const LEVEL: (f64, f64) = (3.841_459, 0.95);

/// By how much the covariances of shift and of turn are too large, from the pairs that did not change: 1 where they are right or
/// too small. Fits count that points err together; where both surveys err alike, the difference errs less than both. A level of
/// detection is asked to hold in 95 of 100 cases, so that is what is brought to its place; the middle of the pairs would
/// promise too much, because a few badly seen blocks err more than the rest.
pub(crate) fn scales(differences: &[(Difference, f64)]) -> [f64; 2] {
    let still: Vec<&Difference> =
        differences.iter().filter(|(_, d2)| *d2 < NO_CHANGE).map(|(d, _)| d).collect();
    let scale = |axes: [usize; 3]| {
        let mut ratio: Vec<f64> = still
            .iter()
            .flat_map(|d| axes.map(|i| (d.d[i] * d.d[i], d.covariance[i][i])))
            .filter(|(_, v)| *v > 0.0 && *v < 1.0)
            .map(|(r2, v)| r2 / v)
            .collect();
        if ratio.is_empty() {
            return 1.0;
        }
        let place = ((LEVEL.1 * ratio.len() as f64) as usize).min(ratio.len() - 1);
        let found = *ratio.select_nth_unstable_by(place, f64::total_cmp).1 / LEVEL.0;
        let count = still.len() as f64;
        ((AS_GIVEN_WEIGHT + count * found) / (AS_GIVEN_WEIGHT + count)).clamp(LEAST_SCALE, 1.0)
    };
    [scale([0, 1, 2]), scale([3, 4, 5])]
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

    #[test]
    fn covariances_too_large_are_scaled_and_those_too_small_are_not() {
        let of = |d: f64, sd: f64| {
            let mut covariance = zeros::<6>();
            (0..6).for_each(|i| covariance[i][i] = sd * sd);
            (Difference { d: [d; 6], covariance }, 0.0)
        };
        // One in twenty errs by 1.96 standard deviations of 1 mm; the covariances say 2 mm.
        let error = |i: i32| if i % 20 == 0 { 1.96e-3 } else { 0.5e-3 };
        let said: Vec<(Difference, f64)> = (0..100).map(|i| of(error(i), 2e-3)).collect();
        let [shift, turn] = scales(&said);
        assert!((shift - 0.272).abs() < 0.01 && shift == turn, "{shift} {turn}");
        let small: Vec<(Difference, f64)> = (0..90).map(|_| of(2e-3, 1e-3)).collect();
        assert_eq!(scales(&small), [1.0, 1.0]);
        assert_eq!(scales(&[]), [1.0, 1.0]);
        let scaled = scaled(&said[0].0.covariance, [0.25, 1.0]);
        assert!((scaled[0][0] - 1e-6).abs() < 1e-12 && (scaled[3][3] - 4e-6).abs() < 1e-12);
    }
}
