//! The order of placing: no block ever needs one under it to come later.
//!
//! In: placements in the order in which they were planned, each lowered from above onto those before it. Two blocks
//! whose footprints can overlap keep that order; free of each other, the farther from the crane goes first, so that
//! the crane need not swing loads over finished parts. Without a crane the planning order stays.

use crate::{crane::Reach, site::Site, stack::Stack};
use geom::Vec3;
use scene::Placement;

/// The placements in placing order, numbered from 1.
pub(crate) fn ordered(kept: Vec<Placement>, stack: &Stack, site: &Site) -> Vec<Placement> {
    let centre = |p: &Placement| p.rest * stack.catalog.get(p.model).centre;
    let centres: Vec<Vec3> = kept.iter().map(centre).collect();
    let reach_m = site.types.iter().map(|t| stack.catalog.get(t.model).d_max_m).fold(0.0, f32::max);
    let order = placing_order(&centres, reach_m, site.main().allowed.reach.as_ref());
    let numbered = order
        .iter()
        .enumerate()
        .map(|(n, &i)| Placement { order: n as u32 + 1, ..kept[i].clone() });
    numbered.collect()
}

/// Indices in placing order. `centres` in planning order, `reach_m` the blocks' d_max.
pub(crate) fn placing_order(centres: &[Vec3], reach_m: f32, crane: Option<&Reach>) -> Vec<usize> {
    let Some(crane) = crane else { return (0..centres.len()).collect() };
    let mut waits = vec![0_u32; centres.len()];
    let mut above: Vec<Vec<usize>> = vec![Vec::new(); centres.len()];
    for (i, c) in centres.iter().enumerate() {
        for j in 0..i {
            if (centres[j] - *c).truncate().length() < 2.0 * reach_m {
                above[j].push(i);
                waits[i] += 1;
            }
        }
    }
    // Farthest first; equal distances keep the planning order. Distances are not negative, so their bits sort as they do.
    let key = |i: usize| (crane.distance_m(centres[i].truncate()).to_bits(), std::cmp::Reverse(i));
    let mut ready: std::collections::BinaryHeap<_> =
        (0..centres.len()).filter(|&i| waits[i] == 0).map(key).collect();
    let mut order = Vec::with_capacity(centres.len());
    while let Some((_, std::cmp::Reverse(i))) = ready.pop() {
        order.push(i);
        for &next in &above[i] {
            waits[next] -= 1;
            if waits[next] == 0 {
                ready.push(key(next));
            }
        }
    }
    order
}
