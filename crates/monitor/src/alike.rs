//! Which blocks stood still, where others moved alike.
//!
//! In: what is left between the blocks of each pair under one motion. Out: groups of pairs that share a shift (the still ones
//! among them share none) and, for each pair, the probability that it belongs to each. A mean of all would lie between two groups, and
//! weights that fall with distance end at whatever they begin with; a mixture of Gaussians with one common error and a wide
//! density for blocks that moved each its own way holds them apart. A group counts when the pairs are much likelier with it,
//! when it lies apart from the others, and farther from the largest than the sensors alone may shift a part of the pile.

use crate::body::Difference;
use crate::common_error::CommonError;
use crate::dense::{Matrix, cholesky, distance2, log_det};
use geom::DVec3;
use rayon::prelude::*;

/// Most pairs that are asked about groups; of more, evenly spread ones tell as well.
const MOST_PAIRS: usize = 1000;
/// Fewest pairs among which groups are looked for, and the fewest of a group and their share.
const LEAST_PAIRS: usize = 10;
const LEAST_OF_GROUP: f64 = 4.0;
const LEAST_SHARE: f64 = 0.1;
/// Most groups.
const MOST_GROUPS: usize = 3;
/// Nats by which the pairs must be likelier for a further group (its shift and its share).
const NATS: f64 = 10.0;
/// Least distance of two groups, in standard deviations of a pair in that direction.
const APART_SD: f64 = 2.5;
/// Least distance from the largest group, in standard deviations of what the sensors usually do.
const BEYOND_SENSORS_SD: f64 = 1.5;
/// Rounds of expectation and maximisation, and those that a start is tried for.
const ROUNDS: usize = 60;
const TRIAL_ROUNDS: usize = 5;
/// Places a further group is tried from, and the pairs it is tried on.
const STARTS: usize = 24;
const TRIAL_PAIRS: usize = 240;

/// How blocks that moved each its own way lie: the prior of matching.
#[derive(Clone, Copy, Debug)]
pub(crate) struct OwnWay {
    /// Standard deviation of a shift along each axis, metres.
    pub shift_sd_m: f64,
    /// Rotations that map the block onto itself.
    pub symmetries: f64,
}

impl OwnWay {
    fn log_density(&self, d: &[f64; 6]) -> f64 {
        let tau = std::f64::consts::TAU;
        let s2 = self.shift_sd_m.powi(2);
        let shift2 = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
        -0.5 * (shift2 / s2 + 3.0 * (tau * s2).ln()) + (self.symmetries / (2.0 * tau * tau)).ln()
    }
}

/// Pairs in groups that share a shift.
#[derive(Clone, Debug)]
pub(crate) struct Groups {
    /// Shift of each group, the largest group first.
    pub shift_m: Vec<DVec3>,
    /// Share of all pairs in each.
    pub share: Vec<f64>,
    /// Probability of each pair to be of each group, pair by pair.
    pub member: Vec<Vec<f64>>,
    /// How likely the pairs are, less what the groups cost, nats.
    pub score: f64,
}

impl Groups {
    /// The group nearest to no shift.
    pub fn nearest(&self) -> usize {
        let length = |i: &usize| self.shift_m[*i].length();
        (0..self.shift_m.len()).min_by(|a, b| length(a).total_cmp(&length(b))).unwrap_or(0)
    }

    /// Probability of each pair to be of a group.
    pub fn weights(&self, group: usize) -> Vec<f64> {
        self.member.iter().map(|m| m[group]).collect()
    }
}

/// The groups of the pairs whose differences these are. One group at least; its shift is then the mean of all.
pub(crate) fn groups(pairs: &[Difference], usual: &CommonError, own_way: &OwnWay) -> Groups {
    let asked: Vec<Difference> =
        pairs.iter().step_by(pairs.len().div_ceil(MOST_PAIRS).max(1)).copied().collect();
    let mut best = Mixture::one(usual).settled(&asked, own_way, ROUNDS);
    if asked.len() >= LEAST_PAIRS {
        while best.shift_m.len() < MOST_GROUPS {
            let Some(more) = one_more(&best, &asked, own_way) else { break };
            let gain = more.score - best.score;
            if gain <= 0.0 || !more.lie_apart(&asked, usual) {
                break;
            }
            best = more;
        }
    }
    best.ordered(pairs, own_way)
}

/// The likeliest mixture with a group more, begun at the shift of one of the pairs.
fn one_more(best: &Mixture, pairs: &[Difference], own_way: &OwnWay) -> Option<Mixture> {
    let few: Vec<Difference> =
        pairs.iter().step_by(pairs.len().div_ceil(TRIAL_PAIRS)).copied().collect();
    let starts: Vec<DVec3> =
        few.iter().step_by(few.len().div_ceil(STARTS)).map(Difference::shift).collect();
    let tried: Vec<Mixture> = starts
        .par_iter()
        .map(|at| best.with_group(*at).settled(&few, own_way, TRIAL_ROUNDS))
        .collect();
    let likeliest = tried.into_iter().max_by(|a, b| a.score.total_cmp(&b.score))?;
    Some(likeliest.settled(pairs, own_way, ROUNDS))
}

#[derive(Clone, Debug)]
struct Mixture {
    shift_m: Vec<DVec3>,
    share: Vec<f64>,
    /// Share of pairs that moved each its own way.
    own_way: f64,
    /// Variance beyond the pairs' own covariances: along, up, turn.
    error: [f64; 3],
    score: f64,
}

/// Which error counts for which part of a difference.
const PART: [usize; 6] = [0, 0, 1, 2, 2, 2];

impl Mixture {
    fn one(usual: &CommonError) -> Self {
        let sd = [usual.level_sd_m, usual.height_sd_m, usual.turn_sd_rad];
        Self {
            shift_m: vec![DVec3::ZERO],
            share: vec![0.9],
            own_way: 0.1,
            error: sd.map(|s| s * s),
            score: f64::NEG_INFINITY,
        }
    }

    /// One group more that begins with a third of the largest and half the common error.
    fn with_group(&self, at: DVec3) -> Self {
        let mut out = self.clone();
        let third = out.share[0] / 3.0;
        out.share[0] -= third;
        out.share.push(third);
        out.shift_m.push(at);
        out.error = out.error.map(|v| 0.25 * v);
        out
    }

    fn covariance(&self, pair: &Difference) -> Matrix<6> {
        let mut c = pair.covariance;
        (0..6).for_each(|i| c[i][i] += self.error[PART[i]]);
        c
    }

    /// Logarithm of the share of each group, then of those on their own way, in the density of a pair.
    fn parts(&self, pair: &Difference, own_way: &OwnWay) -> Vec<f64> {
        let mut out = Vec::with_capacity(self.shift_m.len() + 1);
        let l = cholesky(&self.covariance(pair));
        for (shift, share) in self.shift_m.iter().zip(&self.share) {
            out.push(l.as_ref().map_or(f64::NEG_INFINITY, |l| {
                let left = less(&pair.d, *shift);
                let tau = std::f64::consts::TAU;
                share.ln() - 0.5 * (distance2(l, &left) + log_det(l) + 6.0 * tau.ln())
            }));
        }
        out.push(self.own_way.ln() + own_way.log_density(&pair.d));
        out
    }

    /// Expectation and maximisation until nothing changes.
    fn settled(mut self, pairs: &[Difference], own_way: &OwnWay, rounds: usize) -> Self {
        self.score = f64::NEG_INFINITY;
        for _ in 0..rounds {
            let (members, log_likelihood) = self.members(pairs, own_way);
            let score = log_likelihood - NATS * self.shift_m.len() as f64;
            let settled = score - self.score < 1e-3;
            self.score = score;
            if settled {
                break;
            }
            self.maximise(pairs, &members);
        }
        self
    }

    /// Probability of each pair to be of each group, and the logarithm of how likely all are.
    fn members(&self, pairs: &[Difference], own_way: &OwnWay) -> (Vec<Vec<f64>>, f64) {
        let one = |pair: &Difference| {
            let parts = self.parts(pair, own_way);
            let top = parts.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            let sum: f64 = parts.iter().map(|v| (v - top).exp()).sum();
            let member: Vec<f64> = parts.iter().map(|v| (v - top).exp() / sum).collect();
            (member, top + sum.ln())
        };
        let all: Vec<(Vec<f64>, f64)> = pairs.par_iter().map(one).collect();
        let log_likelihood = all.iter().map(|a| a.1).sum();
        (all.into_iter().map(|a| a.0).collect(), log_likelihood)
    }

    fn maximise(&mut self, pairs: &[Difference], members: &[Vec<f64>]) {
        let count = pairs.len() as f64;
        let groups = self.shift_m.len();
        let share = |k: usize| members.iter().map(|m| m[k]).sum::<f64>() / count;
        self.own_way = share(groups).max(0.01);
        for k in 0..groups {
            self.share[k] = share(k).max(1e-6);
            for axis in 0..3 {
                let (mut sum, mut weight) = (0.0, 1e-12);
                for (pair, member) in pairs.iter().zip(members) {
                    let w = member[k] / (pair.covariance[axis][axis] + self.error[PART[axis]]);
                    sum += w * pair.d[axis];
                    weight += w;
                }
                self.shift_m[k][axis] = sum / weight;
            }
        }
        let (mut sum, mut weight) = ([0.0; 3], [1e-12; 3]);
        for (pair, member) in pairs.iter().zip(members) {
            for k in 0..groups {
                let left = less(&pair.d, self.shift_m[k]);
                for i in 0..6 {
                    let own = pair.covariance[i][i];
                    let w = member[k] / (own + self.error[PART[i]]).powi(2);
                    sum[PART[i]] += w * (left[i] * left[i] - own);
                    weight[PART[i]] += w;
                }
            }
        }
        // Never quite none: a pair known too well would draw a group of its own.
        self.error = std::array::from_fn(|i| (sum[i] / weight[i]).max(0.01 * self.error[i]));
    }

    /// Whether every group is large enough, apart from the others and beyond what the sensors do to a part of a pile.
    fn lie_apart(&self, pairs: &[Difference], usual: &CommonError) -> bool {
        let count = pairs.len() as f64;
        let large = |s: &f64| *s >= LEAST_SHARE && s * count >= LEAST_OF_GROUP;
        let largest = (0..self.share.len())
            .max_by(|&a, &b| self.share[a].total_cmp(&self.share[b]).then(b.cmp(&a)))
            .unwrap_or(0);
        let usual2 = [usual.level_sd_m, usual.level_sd_m, usual.height_sd_m].map(|s| s * s);
        let own = typical(pairs);
        let own2: [f64; 3] = std::array::from_fn(|i| own[i] + self.error[PART[i]]);
        let away = |from: DVec3, to: DVec3, variance: &[f64; 3]| {
            let d = (to - from).to_array();
            (0..3).map(|i| d[i] * d[i] / variance[i]).sum::<f64>().sqrt()
        };
        let beyond = |k: usize| {
            k == largest
                || away(self.shift_m[largest], self.shift_m[k], &usual2) >= BEYOND_SENSORS_SD
        };
        let apart = |k: usize| {
            (0..k).all(|other| away(self.shift_m[other], self.shift_m[k], &own2) >= APART_SD)
        };
        self.share.iter().all(large) && (0..self.share.len()).all(|k| beyond(k) && apart(k))
    }

    fn ordered(mut self, pairs: &[Difference], own_way: &OwnWay) -> Groups {
        let mut order: Vec<usize> = (0..self.share.len()).collect();
        order.sort_by(|&a, &b| self.share[b].total_cmp(&self.share[a]).then(a.cmp(&b)));
        self.shift_m = order.iter().map(|&k| self.shift_m[k]).collect();
        self.share = order.iter().map(|&k| self.share[k]).collect();
        let (member, _) = self.members(pairs, own_way);
        Groups { shift_m: self.shift_m, share: self.share, member, score: self.score }
    }
}

fn less(d: &[f64; 6], shift: DVec3) -> [f64; 6] {
    [d[0] - shift.x, d[1] - shift.y, d[2] - shift.z, d[3], d[4], d[5]]
}

/// Median variance of a pair's shift along each axis.
fn typical(pairs: &[Difference]) -> [f64; 3] {
    std::array::from_fn(|i| {
        let mut all: Vec<f64> = pairs.iter().map(|p| p.covariance[i][i]).collect();
        all.sort_by(f64::total_cmp);
        all.get(all.len() / 2).copied().unwrap_or(0.0)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dense::zeros;
    use rand_distr::{Distribution, StandardNormal};
    use scene::SensorKind;

    const SD: f64 = 0.0085;

    fn drawn(count: usize, seed: u64, shift: impl Fn(usize) -> DVec3) -> Vec<Difference> {
        let mut rng = geom::SeedTree::new(seed).rng();
        let mut covariance = zeros::<6>();
        (0..6).for_each(|i| covariance[i][i] = SD * SD);
        let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
        let mut one = |i: usize| {
            let mut d: [f64; 6] = std::array::from_fn(|_| SD * normal());
            let by = shift(i).to_array();
            (0..3).for_each(|k| d[k] += by[k]);
            Difference { d, covariance }
        };
        (0..count).map(&mut one).collect()
    }

    fn found(pairs: &[Difference]) -> Groups {
        let usual = CommonError::usual(SensorKind::Uav, SensorKind::Uav, 1.0);
        groups(pairs, &usual, &OwnWay { shift_sd_m: 0.6, symmetries: 12.0 })
    }

    #[test]
    fn two_of_five_that_sink_alike_are_told_from_three_that_stay() {
        for (seed, down) in [(1, 0.04), (2, 0.05), (3, 0.10)] {
            let all =
                drawn(60, seed, |i| if i % 5 < 2 { DVec3::NEG_Z * down } else { DVec3::ZERO });
            let groups = found(&all);
            assert_eq!(groups.shift_m.len(), 2, "{down}: {groups:?}");
            assert!(groups.shift_m[0].length() < 0.004, "{down}: {:?}", groups.shift_m);
            assert!((groups.shift_m[1].z + down).abs() < 0.005, "{down}: {:?}", groups.shift_m);
            assert!((groups.share[0] - 0.6).abs() < 0.06, "{:?}", groups.share);
        }
    }

    #[test]
    fn blocks_that_stay_or_go_each_its_own_way_are_one_group() {
        for seed in 0..20 {
            assert_eq!(found(&drawn(60, seed, |_| DVec3::ZERO)).shift_m.len(), 1, "{seed}");
            let way = |i: usize| match i % 3 {
                0 => DVec3::new((i as f64).sin(), (1.7 * i as f64).cos(), -0.5) * 0.3,
                _ => DVec3::ZERO,
            };
            let groups = found(&drawn(60, seed, way));
            assert_eq!(groups.shift_m.len(), 1, "{seed}: {:?}", groups.shift_m);
            assert!(groups.shift_m[0].length() < 0.005, "{seed}: {:?}", groups.shift_m);
        }
    }

    #[test]
    fn three_groups_are_three() {
        let by = |i: usize| match i % 5 {
            0 => DVec3::NEG_Z * 0.06,
            1 => DVec3::Y * 0.05,
            _ => DVec3::ZERO,
        };
        let groups = found(&drawn(80, 9, by));
        assert_eq!(groups.shift_m.len(), 3, "{:?}", groups.shift_m);
        assert!(groups.shift_m[0].length() < 0.004 && groups.share[0] > 0.5, "{groups:?}");
    }
}
