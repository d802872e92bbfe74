//! Weights of the signs from ratings: Bayesian logistic regression with today's weights as the mean of the prior (ours).
//!
//! In: blocks called good or bad and choices between two places. Out: weights with their spread, and what moved each of them.
//! P(good) = σ(b − θ·z), P(a better than b) = σ(θ·(z_b − z_a)), z the signs in units of their usual spread; θ and b are
//! normal before any rating. The posterior is a normal at its mode with the curvature there (Laplace).

use crate::signs::{SignWeights, Signs};
use rand::Rng;
use rand_distr::{Distribution, StandardNormal};
use scene::SIGNS;
use serde::Serialize;

const N: usize = SIGNS.len();
/// With the bias of single ratings.
const D: usize = N + 1;
/// Usual spread of each sign among places that keep the rules: standard deviations over the windows of a span, rounded.
const SPREAD: [f64; N] = [0.1, 0.1, 0.03, 0.2, 0.05, 0.2];
/// How decided a foreman is who thinks as the search does: θ of today's weights is this times them. One block length of height
/// alone is then never in doubt, a twentieth of it is.
const DECIDED: f64 = 10.0;
/// Standard deviation of the prior of θ, in usual spreads, and of b.
const PRIOR_SD: [f64; 2] = [1.5, 2.0];
/// Mean of b before any rating: three of four planned blocks are called good.
const MOSTLY_GOOD: f64 = 1.1;
/// Part of an observation's residual from which it counts as one that moved a weight.
const MOVED: f64 = 0.02;

/// What a person said.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Opinion {
    /// Of one place.
    Single {
        /// Its signs.
        signs: Signs,
        /// Whether they would build it.
        good: bool,
    },
    /// Of two.
    Pair {
        /// Signs of the one they would build.
        better: Signs,
        /// Signs of the other.
        worse: Signs,
    },
}

impl Opinion {
    /// The direction in which θ and b make what was said likelier.
    fn direction(&self) -> [f64; D] {
        let z = |s: &Signs, i: usize| f64::from(s[i]) / SPREAD[i];
        std::array::from_fn(|i| match self {
            Self::Single { signs, good } if i < N => {
                if *good {
                    -z(signs, i)
                } else {
                    z(signs, i)
                }
            }
            Self::Single { good, .. } => {
                if *good {
                    1.0
                } else {
                    -1.0
                }
            }
            Self::Pair { better, worse } if i < N => z(worse, i) - z(better, i),
            Self::Pair { .. } => 0.0,
        })
    }
}

/// Weights that were learned.
#[derive(Clone, Debug, PartialEq)]
pub struct Learned {
    /// Weights for the search: never negative, with the sum today's have in usual spreads.
    pub weights: SignWeights,
    /// What became of each weight.
    pub moved: Vec<MovedWeight>,
    mean: [f64; D],
    /// Lower triangle L of the posterior's covariance L·Lᵀ.
    spread: [[f64; D]; D],
}

/// One weight before and after.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MovedWeight {
    /// Its sign.
    pub sign: &'static str,
    /// Before.
    pub today: f32,
    /// After.
    pub learned: f32,
    /// Standard deviation after.
    pub sd: f32,
    /// Opinions that made it larger.
    pub raised_by: u32,
    /// Opinions that made it smaller.
    pub lowered_by: u32,
}

/// Learns from opinions; from none come today's weights.
pub fn learn(opinions: &[Opinion], today: SignWeights) -> Learned {
    let prior = prior(today);
    let directions: Vec<[f64; D]> = opinions.iter().map(Opinion::direction).collect();
    let mut mean = prior;
    for _ in 0..50 {
        let (gradient, curvature) = slope(&directions, &mean, &prior);
        let step = solved(&lower(&curvature), &gradient);
        // A full step of Newton can overshoot where the likelihood is flat.
        let size = step.iter().map(|s| s * s).sum::<f64>().sqrt();
        let part = (2.0 / size.max(1e-12)).min(1.0);
        (0..D).for_each(|i| mean[i] += part * step[i]);
        if size < 1e-9 {
            break;
        }
    }
    let (_, curvature) = slope(&directions, &mean, &prior);
    let spread = lower(&inverse(&curvature));
    let weights = weights(&mean, today);
    let moved = moved(&directions, &prior, &mean, &spread, today, weights);
    Learned { weights, moved, mean, spread }
}

impl Learned {
    /// What is expected to be learned from a choice between two, in nats: mutual information of answer and weights.
    pub fn information(&self, a: &Signs, b: &Signs) -> f64 {
        let direction = Opinion::Pair { better: *a, worse: *b }.direction();
        let mean: f64 = (0..D).map(|i| direction[i] * self.mean[i]).sum();
        let along = |j: usize| (j..D).map(|i| direction[i] * self.spread[i][j]).sum::<f64>();
        let sd = (0..D).map(|j| along(j).powi(2)).sum::<f64>().sqrt();
        let entropy = |p: f64| {
            let part = |p: f64| if p > 0.0 { -p * p.ln() } else { 0.0 };
            part(p) + part(1.0 - p)
        };
        // Over ±4 standard deviations.
        let steps = 40;
        let (mut mass, mut likely, mut own) = (0.0, 0.0, 0.0);
        for k in 0..=steps {
            let x = 8.0 * (f64::from(k) / f64::from(steps) - 0.5);
            let (w, p) = ((-0.5 * x * x).exp(), sigmoid(mean + sd * x));
            (mass, likely, own) = (mass + w, likely + w * p, own + w * entropy(p));
        }
        (entropy(likely / mass) - own / mass).max(0.0)
    }

    /// Weights drawn from the posterior, as Thompson sampling acts on them; they may be negative.
    pub fn drawn(&self, rng: &mut impl Rng) -> Signs {
        let normal: [f64; D] = std::array::from_fn(|_| StandardNormal.sample(rng));
        let theta =
            |i: usize| self.mean[i] + (0..=i).map(|j| self.spread[i][j] * normal[j]).sum::<f64>();
        std::array::from_fn(|i| (theta(i) / SPREAD[i] / DECIDED) as f32)
    }
}

/// Mean of θ and b before any rating.
fn prior(today: SignWeights) -> [f64; D] {
    let w = today.to_array();
    std::array::from_fn(|i| match i < N {
        true => DECIDED * f64::from(w[i]) * SPREAD[i],
        false => MOSTLY_GOOD,
    })
}

fn sigmoid(x: f64) -> f64 {
    1.0 / (1.0 + (-x).exp())
}

fn prior_precision(i: usize) -> f64 {
    PRIOR_SD[usize::from(i >= N)].powi(-2)
}

/// Gradient of the log posterior and the negative of its curvature.
fn slope(directions: &[[f64; D]], at: &[f64; D], prior: &[f64; D]) -> ([f64; D], [[f64; D]; D]) {
    let mut gradient: [f64; D] = std::array::from_fn(|i| prior_precision(i) * (prior[i] - at[i]));
    let mut curvature = [[0.0; D]; D];
    (0..D).for_each(|i| curvature[i][i] = prior_precision(i));
    for d in directions {
        let p = sigmoid((0..D).map(|i| d[i] * at[i]).sum());
        for i in 0..D {
            gradient[i] += (1.0 - p) * d[i];
            for j in 0..D {
                curvature[i][j] += p * (1.0 - p) * d[i] * d[j];
            }
        }
    }
    (gradient, curvature)
}

/// Lower triangle of a positive definite matrix (Cholesky).
fn lower(m: &[[f64; D]; D]) -> [[f64; D]; D] {
    let mut l = [[0.0; D]; D];
    for i in 0..D {
        for j in 0..=i {
            let sum: f64 = (0..j).map(|k| l[i][k] * l[j][k]).sum();
            l[i][j] = match i == j {
                true => (m[i][i] - sum).max(1e-12).sqrt(),
                false => (m[i][j] - sum) / l[j][j],
            };
        }
    }
    l
}

/// Solution of L·Lᵀ·x = b.
fn solved(l: &[[f64; D]; D], b: &[f64; D]) -> [f64; D] {
    let (mut y, mut x) = ([0.0; D], [0.0; D]);
    for i in 0..D {
        y[i] = (b[i] - (0..i).map(|k| l[i][k] * y[k]).sum::<f64>()) / l[i][i];
    }
    for i in (0..D).rev() {
        x[i] = (y[i] - (i + 1..D).map(|k| l[k][i] * x[k]).sum::<f64>()) / l[i][i];
    }
    x
}

fn inverse(m: &[[f64; D]; D]) -> [[f64; D]; D] {
    let l = lower(m);
    let column = |j: usize| solved(&l, &std::array::from_fn(|i| f64::from(u8::from(i == j))));
    let columns: [[f64; D]; D] = std::array::from_fn(column);
    std::array::from_fn(|i| std::array::from_fn(|j| columns[j][i]))
}

/// θ as weights: none negative, the sum in usual spreads as today's.
fn weights(mean: &[f64; D], today: SignWeights) -> SignWeights {
    let positive: [f64; N] = std::array::from_fn(|i| mean[i].max(0.0));
    let before: f64 = prior(today)[..N].iter().sum();
    let after: f64 = positive.iter().sum();
    if after <= 0.0 {
        return today;
    }
    let scale = before / after / DECIDED;
    SignWeights::of_array(std::array::from_fn(|i| (positive[i] * scale / SPREAD[i]) as f32))
}

fn moved(
    directions: &[[f64; D]],
    prior: &[f64; D],
    mean: &[f64; D],
    spread: &[[f64; D]; D],
    today: SignWeights,
    learned: SignWeights,
) -> Vec<MovedWeight> {
    let (before, after) = (today.to_array(), learned.to_array());
    let total: f64 = (0..N).map(|i| mean[i].max(0.0)).sum::<f64>().max(1e-9);
    let scale = prior[..N].iter().sum::<f64>() / total / DECIDED;
    let of = |i: usize| {
        let push = |d: &[f64; D]| (1.0 - sigmoid((0..D).map(|k| d[k] * prior[k]).sum())) * d[i];
        let sd = (0..D).map(|j| spread[i][j].powi(2)).sum::<f64>().sqrt();
        MovedWeight {
            sign: SIGNS[i],
            today: before[i],
            learned: after[i],
            sd: (sd * scale / SPREAD[i]) as f32,
            raised_by: directions.iter().filter(|d| push(d) > MOVED).count() as u32,
            lowered_by: directions.iter().filter(|d| push(d) < -MOVED).count() as u32,
        }
    };
    (0..N).map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use geom::SeedTree;

    const TODAY: SignWeights = SignWeights {
        above: 1.0,
        raised: 0.25,
        protruding: 2.0,
        loose: 0.0,
        wedged: 0.0,
        far: 0.0,
    };

    fn signs(rng: &mut impl Rng) -> Signs {
        std::array::from_fn(|i| {
            let n: f32 = StandardNormal.sample(rng);
            n * SPREAD[i] as f32
        })
    }

    #[test]
    fn nothing_said_is_nothing_learned() {
        let learned = learn(&[], TODAY);
        for (a, b) in learned.weights.to_array().iter().zip(TODAY.to_array()) {
            assert!((a - b).abs() < 1e-5, "{:?}", learned.weights);
        }
        assert!(learned.moved.iter().all(|m| m.raised_by + m.lowered_by == 0));
    }

    #[test]
    fn a_foreman_who_hates_loose_blocks_is_understood() {
        let mut rng = SeedTree::new(3).rng();
        let hidden = SignWeights { loose: 2.0, ..TODAY };
        let mut opinions = Vec::new();
        for _ in 0..60 {
            let (a, b) = (signs(&mut rng), signs(&mut rng));
            let (better, worse) = if hidden.cost(&a) < hidden.cost(&b) { (a, b) } else { (b, a) };
            opinions.push(Opinion::Pair { better, worse });
        }
        let learned = learn(&opinions, TODAY);
        let pairs: Vec<(Signs, Signs)> =
            (0..1000).map(|_| (signs(&mut rng), signs(&mut rng))).collect();
        let agrees = |w: &SignWeights| {
            let right = |(a, b): &&(Signs, Signs)| {
                (w.cost(a) < w.cost(b)) == (hidden.cost(a) < hidden.cost(b))
            };
            pairs.iter().filter(right).count()
        };
        let (before, after) = (agrees(&TODAY), agrees(&learned.weights));
        assert!(before < 750 && after > 880, "{before} {after} {:?}", learned.weights);
        let loose = &learned.moved[3];
        assert!(loose.learned > 1.0 && loose.raised_by > loose.lowered_by, "{loose:?}");
    }

    #[test]
    fn a_bad_block_moves_its_own_sign() {
        let loose = Opinion::Single { signs: [0.0, 0.0, 0.0, 0.8, 0.0, 0.0], good: false };
        let held = Opinion::Single { signs: [0.0; N], good: true };
        let learned = learn(&[loose, held, loose, held], TODAY);
        assert!(learned.weights.loose > 0.1, "{:?}", learned.weights);
        assert!(learned.weights.to_array().iter().all(|w| *w >= 0.0));
    }

    #[test]
    fn what_is_known_already_tells_nothing() {
        let learned = learn(&[], TODAY);
        let same = learned.information(&[0.1; N], &[0.1; N]);
        let mut other = [0.1; N];
        other[3] = 0.6;
        assert!(same < 1e-9, "{same}");
        assert!(learned.information(&[0.1; N], &other) > 0.01);
    }
}
