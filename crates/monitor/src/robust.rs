//! Robust least squares for a motion from many small statements about it.

use crate::dense::{Matrix, cholesky, inverse, solve, zeros};
use crate::motion::{Motion, PARAMETERS};

/// One statement: rows of derivative and what is left, both divided by their standard deviation.
pub(crate) struct Tie {
    pub rows: Vec<([f64; PARAMETERS], f64)>,
    /// How much it counts, from 0 to 1.
    pub weight: f64,
    /// Ties of one place share their errors; where it is.
    pub cluster: [i32; 2],
}

/// What is known of the parameters beforehand: standard deviations of shift (m), tilt, yaw (rad) and scale. Wide: they
/// only hold what the ties leave open.
const PRIOR_SD: [f64; PARAMETERS] = [10.0, 10.0, 10.0, 0.05, 0.05, 0.1, 0.01];
/// Tukey's limit in standard deviations of a tie, round by round.
const LIMITS: [f64; 8] = [30.0, 15.0, 8.0, 5.0, 4.0, 4.0, 4.0, 4.0];
/// From so many clusters on their spread tells the covariance.
const CLUSTERS: usize = 8;

/// A motion from ties.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Solution {
    pub motion: Motion,
    pub covariance: Matrix<PARAMETERS>,
    /// Ties with a weight.
    pub inliers: usize,
}

/// Tukey-weighted Gauss-Newton from `start`; parameters that are not `free` keep their value. `None`: too few ties.
pub(crate) fn fit(
    start: Motion,
    free: [bool; PARAMETERS],
    ties: impl Fn(&Motion) -> Vec<Tie>,
) -> Option<Solution> {
    let mut motion = start;
    let mut last = None;
    for limit in LIMITS {
        let system = System::of(&ties(&motion), limit, &motion, free);
        if system.inliers < 3 {
            return None;
        }
        let l = cholesky(&system.a)?;
        let step = solve(&l, &system.b);
        motion = motion.then(&step);
        last = Some(system);
    }
    let system = last?;
    let covariance = system.covariance(free)?;
    Some(Solution { motion, covariance, inliers: system.inliers })
}

struct System {
    a: Matrix<PARAMETERS>,
    b: [f64; PARAMETERS],
    inliers: usize,
    /// Gradient of each cluster.
    gradients: Vec<[f64; PARAMETERS]>,
}

impl System {
    fn of(ties: &[Tie], limit: f64, motion: &Motion, free: [bool; PARAMETERS]) -> Self {
        let mut a = zeros::<PARAMETERS>();
        let mut b = [0.0; PARAMETERS];
        let mut inliers = 0;
        let mut gradients = std::collections::BTreeMap::<[i32; 2], [f64; PARAMETERS]>::new();
        for tie in ties {
            let size2 = tie.rows.iter().map(|(_, r)| r * r).sum::<f64>() / tie.rows.len() as f64;
            let u2 = size2 / (limit * limit);
            if u2 >= 1.0 || tie.weight <= 0.0 {
                continue;
            }
            inliers += usize::from(tie.weight > 0.5);
            let w = tie.weight * (1.0 - u2).powi(2);
            let gradient = gradients.entry(tie.cluster).or_default();
            for (j, r) in &tie.rows {
                for i in 0..PARAMETERS {
                    let wj = w * j[i];
                    b[i] -= wj * r;
                    gradient[i] -= wj * r;
                    for k in 0..PARAMETERS {
                        a[i][k] += wj * j[k];
                    }
                }
            }
        }
        for (i, value) in motion.parameters().into_iter().enumerate() {
            // What is not free is held where it is.
            let (sd, value) = if free[i] { (PRIOR_SD[i], value) } else { (1e-9, 0.0) };
            a[i][i] += sd.powi(-2);
            b[i] = if free[i] { b[i] - value * sd.powi(-2) } else { 0.0 };
        }
        Self { a, b, inliers, gradients: gradients.into_values().collect() }
    }

    /// Inverse curvature, widened where clusters scatter more than their ties say.
    fn covariance(&self, free: [bool; PARAMETERS]) -> Option<Matrix<PARAMETERS>> {
        let formal = inverse(&self.a)?;
        let mut widen = [1.0; PARAMETERS];
        let count = self.gradients.len();
        if count >= CLUSTERS {
            let mut spread = [0.0; PARAMETERS];
            for g in &self.gradients {
                for i in 0..PARAMETERS {
                    let part: f64 = (0..PARAMETERS).map(|k| formal[i][k] * g[k]).sum();
                    spread[i] += part * part;
                }
            }
            let correction = count as f64 / (count as f64 - 4.0);
            for i in 0..PARAMETERS {
                widen[i] = (spread[i] * correction / formal[i][i]).sqrt().max(1.0);
            }
        }
        let mut out = zeros::<PARAMETERS>();
        for i in (0..PARAMETERS).filter(|i| free[*i]) {
            for k in (0..PARAMETERS).filter(|k| free[*k]) {
                out[i][k] = formal[i][k] * widen[i] * widen[k];
            }
        }
        Some(out)
    }
}
