//! What both sensors do to every block beyond the covariance of its fit.
//!
//! A survey's drift, roll or heave moves whole neighbourhoods; no fit sees it. The blocks that did not move show it: their
//! differences spread wider than their covariances say. In: differences and covariances of the pairs. Out: the extra variance
//! of a shift along, a shift up and a turn. A few blocks say little; there the sensor's usual error counts more.

use crate::body::Difference;
use crate::dense::{Matrix, part, zeros};
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
/// For calling a change covariances are never taken for better than by this.
const LEAST_FOR_CHANGES: f64 = 0.05;
/// For a level never by this: both surveys' errors alike leave a hundredth of what the fits say.
const LEAST_FOR_LEVELS: f64 = 0.002;
/// 95 % of χ² with one degree of freedom, and the share.
const LEVEL: (f64, f64) = (3.841_459, 0.95);
/// Rounds of leaving out what settled.
const ROUNDS: usize = 20;
/// Shifts beyond so many standard deviations are settling, not error, and the variance of a standard normal without what lies beyond.
const SETTLED: (f64, f64) = (4.0, 0.9989);

/// By how much covariances are too large: 1 where they are right or too small. Fits count that points err together; where both
/// surveys err alike, the difference errs less than both.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Scales {
    /// For calling a change: of shift, of turn. 95 of 100 pairs lie within 1.96 standard deviations, those that settled by less than
    /// anybody can tell among them, and the few badly seen ones that err more than the rest: who calls a change must not
    /// promise too much.
    change: [f64; 2],
    /// For the stated level of a shift: along, up. What settled is left out, so that 95 of 100 blocks that stood still lie within it. A
    /// drone's heights err several times as much as its places; a sounder's do not.
    level: [f64; 2],
}

impl Scales {
    /// From the pairs that did not change, each with its Mahalanobis distance.
    pub fn of(differences: &[(Difference, f64)]) -> Self {
        let still: Vec<&Difference> =
            differences.iter().filter(|(_, d2)| *d2 < NO_CHANGE).map(|(d, _)| d).collect();
        // Squares over their variances, ascending.
        let ratios = |axes: &[usize]| -> Vec<f64> {
            let mut ratios: Vec<f64> = still
                .iter()
                .flat_map(|d| axes.iter().map(|&i| (d.d[i] * d.d[i], d.covariance[i][i])))
                .filter(|(_, v)| *v > 0.0 && *v < 1.0)
                .map(|(r2, v)| r2 / v)
                .collect();
            ratios.sort_by(f64::total_cmp);
            ratios
        };
        let count = still.len() as f64;
        let share = count / (AS_GIVEN_WEIGHT + count);
        let change = |axes: [usize; 3]| {
            let found = at_level(&ratios(&axes)).unwrap_or(1.0);
            (1.0 - share + share * found).clamp(LEAST_FOR_CHANGES, 1.0)
        };
        // Scales differ by factors: their logarithms are averaged.
        let level = |axes: &[usize]| {
            let found = without_settled(&ratios(axes)).unwrap_or(1.0);
            found.powf(share).clamp(LEAST_FOR_LEVELS, 1.0)
        };
        Self {
            change: [change([0, 1, 2]), change([3, 4, 5])],
            level: [level(&[0, 1]), level(&[2])],
        }
    }

    /// Covariance of shift and turn for calling a change.
    pub fn change(&self, covariance: &Matrix<6>) -> Matrix<6> {
        let [shift, turn] = self.change;
        scaled(covariance, [shift, shift, shift, turn, turn, turn])
    }

    /// Covariance of the shift for the stated level. A turn's level is that of the change.
    pub fn level(&self, covariance: &Matrix<6>) -> Matrix<3> {
        let [along, up] = self.level;
        scaled(&part(covariance, 0), [along, along, up])
    }
}

fn scaled<const N: usize>(covariance: &Matrix<N>, scales: [f64; N]) -> Matrix<N> {
    let root = scales.map(f64::sqrt);
    std::array::from_fn(|i| std::array::from_fn(|j| covariance[i][j] * root[i] * root[j]))
}

/// The scale that brings 95 of 100 to their place; `None` of none.
fn at_level(ascending: &[f64]) -> Option<f64> {
    let last = ascending.len().checked_sub(1)?;
    let place = ((LEVEL.1 * ascending.len() as f64) as usize).min(last);
    Some(ascending[place] / LEVEL.0)
}

/// The mean of those within four standard deviations, begun at what the middle says; `None` of none.
fn without_settled(ascending: &[f64]) -> Option<f64> {
    let mut found = ascending.get(ascending.len() / 2)? / MEDIAN;
    for _ in 0..ROUNDS {
        let inside = ascending.partition_point(|r| *r <= SETTLED.0 * SETTLED.0 * found);
        if inside == 0 {
            break;
        }
        let mean = ascending[..inside].iter().sum::<f64>() / inside as f64;
        found = mean / SETTLED.1;
    }
    Some(found)
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

    fn of(d: f64, sd: f64) -> (Difference, f64) {
        let mut covariance = zeros::<6>();
        (0..6).for_each(|i| covariance[i][i] = sd * sd);
        (Difference { d: [d; 6], covariance }, 0.0)
    }

    #[test]
    fn covariances_too_large_are_scaled_and_those_too_small_are_not() {
        // One in twenty errs by 1.96 standard deviations of 1 mm; the covariances say 2 mm.
        let error = |i: i32| if i % 20 == 0 { 1.96e-3 } else { 0.5e-3 };
        let said: Vec<(Difference, f64)> = (0..100).map(|i| of(error(i), 2e-3)).collect();
        let scales = Scales::of(&said);
        let [shift, turn] = scales.change;
        assert!((shift - 0.272).abs() < 0.01 && shift == turn, "{scales:?}");
        let small: Vec<(Difference, f64)> = (0..90).map(|_| of(2e-3, 1e-3)).collect();
        let as_given = Scales { change: [1.0; 2], level: [1.0; 2] };
        assert_eq!((Scales::of(&small), Scales::of(&[])), (as_given, as_given));
        let halved = Scales { change: [0.25, 1.0], level: [0.25, 0.04] };
        let (change, level) =
            (halved.change(&said[0].0.covariance), halved.level(&said[0].0.covariance));
        assert!((change[2][2] - 1e-6).abs() < 1e-12 && (change[3][3] - 4e-6).abs() < 1e-12);
        assert!((level[0][0] - 1e-6).abs() < 1e-12 && (level[2][2] - 0.16e-6).abs() < 1e-12);
    }

    #[test]
    fn a_level_counts_no_settling_as_error() {
        // Normal errors of 1 mm by their own quantiles; every fifth block settled by 1 to 2 cm. The covariances say 6 mm.
        let quantile = |i: usize| {
            let (u, mut x) = ((i as f64 + 0.5) / 80.0, 0.0_f64);
            for _ in 0..60 {
                let density = (-0.5 * x * x).exp() / std::f64::consts::TAU.sqrt();
                x -= (normal_share(x) - u) / density.max(1e-3);
            }
            x
        };
        let still = (0..80).map(|i| of(quantile(i) * 1e-3, 6e-3));
        let settled = (0..20).map(|i| of(0.01 + 0.0005 * f64::from(i), 6e-3));
        let all: Vec<(Difference, f64)> = still.chain(settled).collect();
        let scales = Scales::of(&all);
        for level in scales.level {
            let sd_mm = 6.0 * level.sqrt();
            assert!((0.9..1.25).contains(&sd_mm), "{sd_mm} of {scales:?}");
        }
        assert!(scales.change[0] > 10.0 * scales.level[0], "{scales:?}");
    }

    /// Share of a standard normal below `x`, by its series.
    fn normal_share(x: f64) -> f64 {
        let (mut term, mut sum) = (x, x);
        for k in 1..200 {
            term *= x * x / (2.0 * f64::from(k) + 1.0);
            sum += term;
        }
        0.5 + sum * (-0.5 * x * x).exp() / std::f64::consts::TAU.sqrt()
    }
}
