//! Pairs of places for a block to choose between, where an answer teaches most.
//!
//! In: the pile as it is. Out: for windows of it all places that keep every rule, the shake included; and of those the pairs with
//! the largest expected information about the weights.

use crate::{
    Learned, PlanConfig, PlanError, PlanInput, Policy, rounds, search,
    signs::{self, Signs},
    site, windows,
};
use geom::{Observer, SeedTree};
use rayon::prelude::*;
use scene::{Placement, PlacementState};

/// Windows that pairs are taken from.
const WINDOWS: usize = 24;

/// Where a block could go, and its signs.
#[derive(Clone, Debug)]
pub struct Candidate {
    /// The block at rest.
    pub placement: Placement,
    /// Its signs on the pile as it is.
    pub signs: Signs,
}

/// Two places of one window.
#[derive(Clone, Debug)]
pub struct CandidatePair {
    /// The first.
    pub a: Candidate,
    /// The second.
    pub b: Candidate,
    /// Expected information of a choice, nats.
    pub information: f64,
}

/// All stable places that policy `search` finds in `most` windows (0: all), every window by itself on the pile as it is.
pub fn stable_places(
    input: &PlanInput,
    config: &PlanConfig,
    most: usize,
    seed: SeedTree,
    observer: &dyn Observer,
) -> Result<Vec<Vec<Candidate>>, PlanError> {
    let config = PlanConfig { policy: Policy::Search, pattern: None, ..config.clone() };
    let site = site::prepare(input, &config, seed, observer)?;
    let stack = site.stack(input);
    let kind = site.main();
    let open = |w: &windows::Window| kind.allowed.covers(w.centre);
    let mut found = windows::detect(&stack.surface, &stack.design, &kind.settings, open);
    windows::thin(&mut found, most);
    let of = |window: &windows::Window| {
        if observer.cancelled() {
            return Err(PlanError::Cancelled);
        }
        let poses = rounds::poses(kind, &stack, window);
        let (resting, _) = search::resting(kind, &stack, &poses, 1);
        let judged = |r: search::Resting| {
            let impact = r.dropped.impact;
            let placement = r.dropped.shaken(kind);
            let signs = signs::signs_of(kind, &stack, &placement, &impact);
            Candidate { placement, signs }
        };
        let stable = |c: &Candidate| c.placement.state == PlacementState::Kept;
        Ok(resting.into_iter().map(judged).filter(stable).collect())
    };
    found.par_iter().map(of).collect()
}

/// The pair of each window that teaches most, the best windows first, at most `count`.
pub fn pairs_to_choose(
    input: &PlanInput,
    config: &PlanConfig,
    learned: &Learned,
    count: usize,
    seed: SeedTree,
    observer: &dyn Observer,
) -> Result<Vec<CandidatePair>, PlanError> {
    let windows = stable_places(input, config, WINDOWS, seed, observer)?;
    let mut pairs: Vec<CandidatePair> =
        windows.iter().filter_map(|places| most_telling(places, learned)).collect();
    // Stable: windows of equal information keep their order.
    pairs.sort_by(|x, y| y.information.total_cmp(&x.information));
    pairs.truncate(count);
    Ok(pairs)
}

/// The two places whose comparison teaches most; `None` where there are no two.
pub fn most_telling(places: &[Candidate], learned: &Learned) -> Option<CandidatePair> {
    let mut best: Option<(f64, usize, usize)> = None;
    for i in 0..places.len() {
        for j in i + 1..places.len() {
            let information = learned.information(&places[i].signs, &places[j].signs);
            if best.is_none_or(|(most, ..)| information > most) {
                best = Some((information, i, j));
            }
        }
    }
    let (information, i, j) = best?;
    Some(CandidatePair { a: places[i].clone(), b: places[j].clone(), information })
}
