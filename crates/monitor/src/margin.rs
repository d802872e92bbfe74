//! How sure a pair is: by how much the best assignment without it is worse than the best of all.
//!
//! In: the possible pairs and a best assignment. Out: a margin for each pair, in nats. Another partner that looks likely counts
//! only as far as it is to be had: one that is surely another block's costs what that block loses. Without the pair, its
//! two blocks are joined by the cheapest way through the graph of what may be changed: an edge that is not used may be
//! taken, one that is may be given up, and every block may be left alone.

use crate::matching::{Edge, Pair};
use rayon::prelude::*;
use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap};

/// From here on a pair is sure, and nobody asks how sure.
const SURE: f64 = 20.0;
/// Differences of sums of gains below this are rounding.
const ROUNDING: f64 = 1e-9;

/// Sets the margin of each pair of a best assignment over `edges`.
pub(crate) fn set_margins(pairs: &mut [Pair], edges: &[Edge], earlier: usize, later: usize) {
    let graph = Graph::new(pairs, edges, earlier, later);
    pairs.par_iter_mut().for_each(|p| p.margin = graph.margin(p.earlier, p.later));
}

/// What may be changed of an assignment: earlier blocks, then later ones, then the place of those left alone.
struct Graph {
    /// To and cost of the ways from each node.
    ways: Vec<Vec<(usize, f64)>>,
    /// Cheapest way from the last node to each: with them no cost is below 0.
    potential: Vec<f64>,
    /// Gain of each used pair by its earlier block.
    used: Vec<f64>,
    /// The best other gain of each block.
    other: Vec<f64>,
    earlier: usize,
}

impl Graph {
    fn new(pairs: &[Pair], edges: &[Edge], earlier: usize, later: usize) -> Self {
        let alone = earlier + later;
        let mut partner = vec![usize::MAX; alone];
        for p in pairs {
            partner[p.earlier] = earlier + p.later;
            partner[earlier + p.later] = p.earlier;
        }
        let mut ways = vec![Vec::new(); alone + 1];
        let (mut used, mut other) = (vec![0.0_f64; earlier], vec![0.0_f64; alone]);
        for e in edges {
            let (a, b) = (e.earlier, earlier + e.later);
            if partner[a] == b {
                ways[b].push((a, -e.gain));
                used[a] = e.gain;
            } else {
                ways[a].push((b, e.gain));
                other[a] = other[a].min(e.gain);
                other[b] = other[b].min(e.gain);
            }
        }
        for node in 0..alone {
            // A paired earlier block may be left alone, a lone one may be taken; of later blocks the other way round.
            let from_it = (node < earlier) == (partner[node] != usize::MAX);
            let (from, to) = if from_it { (node, alone) } else { (alone, node) };
            ways[from].push((to, 0.0));
        }
        let potential = potentials(&ways, alone);
        Self { ways, potential, used, other, earlier }
    }

    fn margin(&self, earlier: usize, later: usize) -> f64 {
        let (from, to) = (earlier, self.earlier + later);
        let own = -self.used[earlier];
        // What both would have if every other partner were free.
        if own + self.other[from] + self.other[to] >= SURE {
            return SURE;
        }
        let (start, end) = (self.potential[from], self.potential[to]);
        let whole = |reduced: f64| own + reduced + end - start;
        let mut nearest = BTreeMap::from([(from, 0.0_f64)]);
        let mut open = BinaryHeap::from([(Reverse(Ordered(0.0)), from)]);
        while let Some((Reverse(Ordered(cost)), node)) = open.pop() {
            if whole(cost) >= SURE {
                return SURE;
            }
            if nearest.get(&to).is_some_and(|best| *best <= cost) {
                break;
            }
            if nearest[&node] < cost {
                continue;
            }
            for &(next, step) in &self.ways[node] {
                let next_cost =
                    cost + (step + self.potential[node] - self.potential[next]).max(0.0);
                if nearest.get(&next).is_none_or(|known| next_cost < *known) {
                    nearest.insert(next, next_cost);
                    open.push((Reverse(Ordered(next_cost)), next));
                }
            }
        }
        nearest.get(&to).map_or(SURE, |best| whole(*best).clamp(0.0, SURE))
    }
}

/// Cheapest way from `start` to each node; there is no round trip that gains, or the assignment were not the best.
fn potentials(ways: &[Vec<(usize, f64)>], start: usize) -> Vec<f64> {
    let mut best = vec![f64::INFINITY; ways.len()];
    best[start] = 0.0;
    let mut changed = vec![start];
    for _ in 0..ways.len() {
        let mut next = Vec::new();
        for &node in &changed {
            for &(to, step) in &ways[node] {
                if best[node] + step < best[to] - ROUNDING {
                    best[to] = best[node] + step;
                    next.push(to);
                }
            }
        }
        if next.is_empty() {
            break;
        }
        next.sort_unstable();
        next.dedup();
        changed = next;
    }
    // What cannot be reached has no way to anywhere either.
    best.into_iter().map(|v| if v.is_finite() { v } else { 0.0 }).collect()
}

/// A finite cost with an order.
#[derive(Clone, Copy, PartialEq)]
struct Ordered(f64);

impl Eq for Ordered {}

impl PartialOrd for Ordered {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Ordered {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.0.total_cmp(&other.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::matching::assigned;
    use proptest::prelude::*;

    fn total(pairs: &[Pair], edges: &[Edge]) -> f64 {
        let gain = |p: &Pair| {
            edges.iter().find(|e| e.earlier == p.earlier && e.later == p.later).unwrap().gain
        };
        pairs.iter().map(gain).sum()
    }

    proptest! {
        /// The margin is what a search for the best assignment without the pair finds.
        #[test]
        fn a_margin_is_the_loss_without_the_pair(gains in prop::collection::vec(-9.0_f64..4.0, 30)) {
            let edges: Vec<Edge> = gains.iter().enumerate().filter(|(_, g)| **g < 0.0)
                .map(|(k, &gain)| Edge { earlier: k / 6, later: k % 6, gain }).collect();
            let mut pairs = assigned(&edges).unwrap();
            set_margins(&mut pairs, &edges, 5, 6);
            for p in &pairs {
                let without: Vec<Edge> = edges.iter()
                    .filter(|e| e.earlier != p.earlier || e.later != p.later).copied().collect();
                let loss = total(&assigned(&without).unwrap(), &edges) - total(&pairs, &edges);
                prop_assert!((p.margin - loss).abs() < 1e-6, "{} {loss}", p.margin);
            }
        }
    }

    #[test]
    fn a_partner_that_is_surely_anothers_leaves_no_doubt() {
        let edge = |earlier, later, gain| Edge { earlier, later, gain };
        // Block 0 moved beside where 1 stands unmoved: 1's place is as likely for it as its own.
        let edges = [edge(0, 0, -8.0), edge(0, 1, -8.5), edge(1, 1, -40.0)];
        let mut pairs = assigned(&edges).unwrap();
        set_margins(&mut pairs, &edges, 2, 2);
        assert!(pairs.iter().all(|p| p.margin > 7.0), "{pairs:?}");
        // Two blocks that might have changed places.
        let edges = [edge(0, 0, -8.0), edge(0, 1, -7.8), edge(1, 1, -8.0), edge(1, 0, -7.9)];
        let mut pairs = assigned(&edges).unwrap();
        set_margins(&mut pairs, &edges, 2, 2);
        assert!(pairs.iter().all(|p| (p.margin - 0.3).abs() < 1e-6), "{pairs:?}");
    }
}
