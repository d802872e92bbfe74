//! Which later block is which earlier one: one assignment for all of them.
//!
//! In: blocks of both epochs in one frame. Out: pairs. A pair costs −log of how likely its shift and turn are: either the
//! block did not move (both covariances) or it did (a prior on motion: shifts of some tenths of its size, any
//! turn). A gate on the covariances alone would lose every block that really moved. Left unmatched, a block
//! costs a fixed amount; pairs that cost more than both are no pairs.

use crate::MonitorError;
use crate::body::{Body, difference};
use crate::dense::{Matrix, cholesky, distance2, log_det, sum};
use crate::detection::LEVEL;
use crate::margin::set_margins;
use geom::{DVec3, PointGrid, Vec3};
use rayon::prelude::*;
use scene::Catalog;
use serde::{Deserialize, Serialize};

/// How blocks are matched.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct MatchConfig {
    /// Largest distance of two centres of one pair, in block lengths. What went farther is called missing and new: nobody can
    /// say that it is the same block.
    pub gate_blocks: f64,
    /// Most that a block rises when it moves, in block lengths: blocks are heavy, and none of 511 rose by more than 0.06 in ten
    /// simulated storms. What lies higher than that is another block.
    pub rise_blocks: f64,
    /// Standard deviation of the shift of a block that moved, per axis, in block lengths.
    pub move_sd_blocks: f64,
    /// Share of the blocks that are expected to have moved.
    pub moved_share: f64,
    /// Density (per block length³ and rad³) below which leaving both blocks alone is likelier, per block.
    pub alone: f64,
}

impl MatchConfig {
    /// Whether a block of this size may have gone so far, when nobody knows its height better than to `up_m`.
    pub(crate) fn may_go(&self, shift: DVec3, size_m: f64, up_m: f64) -> bool {
        shift.length() <= self.gate_blocks * size_m && shift.z <= self.rise_blocks * size_m + up_m
    }
}

impl Default for MatchConfig {
    fn default() -> Self {
        Self {
            gate_blocks: 0.5,
            rise_blocks: 0.15,
            move_sd_blocks: 0.3,
            moved_share: 0.1,
            alone: 1e-4,
        }
    }
}

/// A pair: places in the two lists.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Pair {
    pub earlier: usize,
    pub later: usize,
    /// By how much the best assignment without this pair is worse, in nats; large = no doubt.
    pub margin: f64,
}

/// A possible pair: its cost less the cost of leaving both alone, below 0.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Edge {
    pub earlier: usize,
    pub later: usize,
    pub gain: f64,
}

/// The best set of pairs, ascending by the earlier block. `common` is what both sensors do to every block.
pub(crate) fn matched(
    earlier: &[Body],
    later: &[Body],
    catalog: &Catalog,
    common: &Matrix<6>,
    config: &MatchConfig,
) -> Result<Vec<Pair>, MonitorError> {
    let edges = edges(earlier, later, catalog, common, config);
    let mut pairs = certain(&edges, earlier.len(), later.len());
    let fixed =
        |e: &Edge, pairs: &[Pair]| pairs.binary_search_by_key(&e.earlier, |p| p.earlier).is_ok();
    let mut taken = vec![false; later.len()];
    pairs.iter().for_each(|p| taken[p.later] = true);
    let open: Vec<Edge> =
        edges.iter().filter(|e| !fixed(e, &pairs) && !taken[e.later]).copied().collect();
    for component in components(&open, earlier.len(), later.len()) {
        pairs.extend(assigned(&component)?);
    }
    pairs.sort_by_key(|p| p.earlier);
    set_margins(&mut pairs, &edges, earlier.len(), later.len());
    Ok(pairs)
}

fn edges(
    earlier: &[Body],
    later: &[Body],
    catalog: &Catalog,
    common: &Matrix<6>,
    config: &MatchConfig,
) -> Vec<Edge> {
    let largest_m = catalog.iter().map(|(_, m)| m.d_box_m).fold(0.0, f32::max);
    let reach_m = config.gate_blocks as f32 * largest_m;
    let centres: Vec<Vec3> = later.iter().map(|b| b.centre.as_vec3()).collect();
    let grid = PointGrid::new(&centres, reach_m.max(f32::MIN_POSITIVE));
    let of = |i: usize| -> Vec<Edge> {
        let near = grid.within(earlier[i].centre.as_vec3(), reach_m);
        let edge = |j: u32| {
            let gain = gain(&earlier[i], &later[j as usize], catalog, common, config)?;
            Some(Edge { earlier: i, later: j as usize, gain })
        };
        near.into_iter().filter_map(edge).collect()
    };
    (0..earlier.len()).into_par_iter().map(of).collect::<Vec<_>>().concat()
}

/// Cost of the pair less that of leaving both alone; `None` when it is no possible pair.
fn gain(
    a: &Body,
    b: &Body,
    catalog: &Catalog,
    common: &Matrix<6>,
    config: &MatchConfig,
) -> Option<f64> {
    let told_apart = a.model != b.model && a.type_judged && b.type_judged;
    let model = catalog.get(a.model);
    let size = f64::from(model.d_box_m);
    let delta = difference(a, b, catalog);
    let sd_up_m = (delta.covariance[2][2] + common[2][2]).max(0.0).sqrt();
    if told_apart || !config.may_go(delta.shift(), size, LEVEL * sd_up_m) {
        return None;
    }
    let l = cholesky(&sum(&delta.covariance, common))?;
    let tau = std::f64::consts::TAU;
    // Lengths in block lengths, so that parts in a bin and blocks in the sea have the same prior.
    let still = -0.5 * (distance2(&l, &delta.d) + log_det(&l) + 6.0 * tau.ln()) + 3.0 * size.ln();
    let t2 = delta.shift().length_squared() / (size * config.move_sd_blocks).powi(2);
    let turns = model.symmetry.order() as f64 / (2.0 * tau * tau);
    let moved = -0.5 * (t2 + 3.0 * (tau * config.move_sd_blocks.powi(2)).ln()) + turns.ln();
    let likelihood =
        log_sum(still + (1.0 - config.moved_share).ln(), moved + config.moved_share.ln());
    let gain = 2.0 * config.alone.ln() - likelihood;
    (gain < 0.0).then_some(gain)
}

fn log_sum(a: f64, b: f64) -> f64 {
    let top = a.max(b);
    top + ((a - top).exp() + (b - top).exp()).ln()
}

/// The best gain of each block and the best of its others.
#[derive(Clone, Copy)]
struct Best {
    gain: f64,
    partner: usize,
    next: f64,
}

fn best(edges: &[Edge], count: usize, side: impl Fn(&Edge) -> (usize, usize)) -> Vec<Best> {
    let mut out = vec![Best { gain: 0.0, partner: usize::MAX, next: 0.0 }; count];
    for e in edges {
        let (own, other) = side(e);
        let b = &mut out[own];
        if e.gain < b.gain {
            *b = Best { gain: e.gain, partner: other, next: b.gain };
        } else if e.gain < b.next {
            b.next = e.gain;
        }
    }
    out
}

/// Pairs of every best assignment: worth more together than the best either has without the other, so that swapping them in
/// never loses. They are nearly all of a pile, and what is left falls into small components.
fn certain(edges: &[Edge], earlier: usize, later: usize) -> Vec<Pair> {
    let of_earlier = best(edges, earlier, |e| (e.earlier, e.later));
    let of_later = best(edges, later, |e| (e.later, e.earlier));
    let mutual = |(i, b): (usize, &Best)| {
        let back = of_later.get(b.partner)?;
        let sure = back.partner == i && b.gain <= b.next + back.next;
        sure.then_some(Pair { earlier: i, later: b.partner, margin: 0.0 })
    };
    of_earlier.iter().enumerate().filter_map(mutual).collect()
}

fn components(edges: &[Edge], earlier: usize, later: usize) -> Vec<Vec<Edge>> {
    let mut parent: Vec<usize> = (0..earlier + later).collect();
    fn root(parent: &mut [usize], mut i: usize) -> usize {
        while parent[i] != i {
            parent[i] = parent[parent[i]];
            i = parent[i];
        }
        i
    }
    for e in edges {
        let (a, b) = (root(&mut parent, e.earlier), root(&mut parent, earlier + e.later));
        parent[a.max(b)] = a.min(b);
    }
    let mut by_root: std::collections::BTreeMap<usize, Vec<Edge>> = Default::default();
    for e in edges {
        by_root.entry(root(&mut parent, e.earlier)).or_default().push(*e);
    }
    by_root.into_values().collect()
}

/// The best pairs of one component. An entry 0 means *both alone*, so no dummies are needed.
pub(crate) fn assigned(edges: &[Edge]) -> Result<Vec<Pair>, MonitorError> {
    let list = |side: fn(&Edge) -> usize| {
        let mut all: Vec<usize> = edges.iter().map(side).collect();
        all.sort_unstable();
        all.dedup();
        all
    };
    let (rows, columns) = (list(|e| e.earlier), list(|e| e.later));
    let mut cost = vec![0.0; rows.len() * columns.len()];
    let at = |e: &Edge| {
        let r = rows.binary_search(&e.earlier).expect("it was put in");
        let c = columns.binary_search(&e.later).expect("it was put in");
        r * columns.len() + c
    };
    edges.iter().for_each(|e| cost[at(e)] = e.gain);
    let (r, c) = lsap::solve(rows.len(), columns.len(), &cost, false)
        .map_err(|_| MonitorError::Assignment { blocks: rows.len() })?;
    let used = r.into_iter().zip(c).filter(|&(i, j)| cost[i * columns.len() + j] < 0.0);
    Ok(used.map(|(i, j)| Pair { earlier: rows[i], later: columns[j], margin: 0.0 }).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn total(pairs: &[Pair], edges: &[Edge]) -> f64 {
        let gain = |p: &Pair| {
            edges
                .iter()
                .find(|e| e.earlier == p.earlier && e.later == p.later)
                .map_or(9.0, |e| e.gain)
        };
        pairs.iter().map(gain).sum()
    }

    proptest! {
        /// Taking the certain pairs first costs nothing.
        #[test]
        fn certain_pairs_are_in_a_best_assignment(gains in prop::collection::vec(-20.0_f64..6.0, 36)) {
            let edges: Vec<Edge> = gains.iter().enumerate().filter(|(_, g)| **g < 0.0)
                .map(|(k, &gain)| Edge { earlier: k / 6, later: k % 6, gain }).collect();
            let all = assigned(&edges).unwrap();
            let mut split = certain(&edges, 6, 6);
            let open: Vec<Edge> = edges.iter()
                .filter(|e| split.iter().all(|p| p.earlier != e.earlier && p.later != e.later)).copied().collect();
            for component in components(&open, 6, 6) {
                split.extend(assigned(&component).unwrap());
            }
            prop_assert!((total(&all, &edges) - total(&split, &edges)).abs() < 1e-9);
        }
    }
}
