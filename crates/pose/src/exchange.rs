//! Blocks are exchanged for others where that explains more.
//!
//! Greedy acceptance may begin with a pose that lies half on one block and half on the next: of a row of cubes it then states
//! one where there are two, and nothing fits beside it any more. Each accepted block is taken out again; what the other
//! candidates of that place can add together must be clearly more than what it adds, or it goes back.

use crate::EvidenceConfig;
use crate::acceptance::{Acceptance, Candidate, accept_of, charge, explained_by};
use crate::ground::Ground;
use crate::measured::Measured;
use crate::template::Template;

/// What an exchange must add, in parts of the least a block adds.
const CLEARLY: f32 = 0.5;
/// Rounds over all blocks.
const ROUNDS: usize = 3;
/// Candidates of a place that are looked at, and that an exchange may begin with.
const LOOKED_AT: usize = 24;
const FIRST: usize = 8;
/// Candidates within this part of d_max of the block belong to its place.
const PLACE: f32 = 1.6;
/// Poses within this part of d_max and this turn of the block are itself.
const ITSELF: f32 = 0.1;
const ITSELF_RAD: f32 = 0.25;

/// The accepted set after exchanges.
pub fn exchange(
    found: Acceptance,
    candidates: &[Candidate],
    templates: &[Template],
    measured: &Measured,
    ground: Option<&Ground>,
    config: &EvidenceConfig,
) -> Acceptance {
    let mut held: Vec<usize> = found.accepted.iter().map(|a| a.0).collect();
    let bare = explained_by(ground, measured);
    let mut pile =
        Pile { candidates, templates, measured, config, bare, taken: found.taken.clone() };
    let mut exchanged = false;
    for _ in 0..ROUNDS {
        let mut again = false;
        // What was accepted last added least.
        for block in held.clone().into_iter().rev() {
            if let Some(others) = pile.instead_of(block, &held) {
                held.retain(|&h| h != block);
                held.extend(others);
                again = true;
            }
        }
        exchanged |= again;
        if !again {
            break;
        }
    }
    if !exchanged {
        return found;
    }
    let may = |i: usize| held.contains(&i);
    accept_of(&may, candidates, templates, measured, ground, config)
}

struct Pile<'a> {
    candidates: &'a [Candidate],
    templates: &'a [Template<'a>],
    measured: &'a Measured,
    config: &'a EvidenceConfig,
    /// How well points are explained before any block is.
    bare: Vec<f32>,
    /// And by the blocks that are held.
    taken: Vec<f32>,
}

impl Pile<'_> {
    /// Candidates that add clearly more than a held block; `taken` is then theirs.
    fn instead_of(&mut self, block: usize, held: &[usize]) -> Option<Vec<usize>> {
        let all = self.candidates;
        let near_m = 4.0 * self.d_max_m(block);
        let rest: Vec<usize> = held
            .iter()
            .copied()
            .filter(|&h| h != block && self.distance_m(h, block) < near_m + self.d_max_m(h))
            .collect();
        for &(i, _) in &all[block].evidence.explained {
            self.taken[i as usize] = self.bare[i as usize];
        }
        self.put(&rest);
        let found = self.better(block, &rest);
        match &found {
            Some(others) => self.put(others),
            None => self.put(&[block]),
        }
        found
    }

    fn better(&self, block: usize, rest: &[usize]) -> Option<Vec<usize>> {
        let least = self.worth(block, rest)? + CLEARLY * self.config.min_score;
        let open = self.of_its_place(block, rest);
        if self.together(&open) <= least {
            return None;
        }
        let mut best: Option<(f32, Vec<usize>)> = None;
        for first in 0..open.len().min(FIRST) {
            let (worth, set) = self.filled(first, &open);
            if worth > best.as_ref().map_or(least, |b| b.0) {
                best = Some((worth, set));
            }
        }
        best.map(|b| b.1)
    }

    /// Candidates that could be at a block's place beside the rest, with what they lose to it; those that add most first.
    fn of_its_place(&self, block: usize, rest: &[usize]) -> Vec<(usize, f32)> {
        let (template, at) = (self.candidates[block].template, self.candidates[block].at);
        let d_max = self.d_max_m(block);
        let mut near: Vec<(usize, f32)> = (0..self.candidates.len())
            .filter(|&i| i != block && self.distance_m(i, block) < PLACE * d_max)
            .filter(|&i| {
                let other = &self.candidates[i];
                other.evidence.agreement >= self.config.min_agreement
                    && !(other.template == template
                        && self.templates[template].same(
                            &other.at,
                            &at,
                            ITSELF * d_max,
                            ITSELF_RAD,
                        ))
            })
            .map(|i| (i, self.candidates[i].evidence.gain(&self.taken)))
            .filter(|(_, gain)| *gain >= self.config.min_score)
            .collect();
        near.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        near.truncate(LOOKED_AT);
        near.into_iter().filter_map(|(i, _)| Some((i, self.lost(i, rest)?))).collect()
    }

    /// What all of them would add if they did not stand in each other's way: no set of them adds more.
    fn together(&self, open: &[(usize, f32)]) -> f32 {
        let mut best: std::collections::BTreeMap<u32, f32> = std::collections::BTreeMap::new();
        let mut factor = 0.0_f32;
        for &(i, _) in open {
            let evidence = &self.candidates[i].evidence;
            factor = factor.max(evidence.point_area_m2 / evidence.unit_m2);
            for &(point, w) in &evidence.explained {
                let new = (w - self.taken[point as usize]).max(0.0);
                let held = best.entry(point).or_default();
                *held = held.max(new);
            }
        }
        factor * best.values().sum::<f32>()
    }

    /// A set that begins with an entry of the list and takes what adds most until nothing does.
    fn filled(&self, first: usize, open: &[(usize, f32)]) -> (f32, Vec<usize>) {
        let mut taken: std::collections::BTreeMap<u32, f32> = std::collections::BTreeMap::new();
        let mut lost: Vec<Option<f32>> = open.iter().map(|o| Some(o.1)).collect();
        let (mut worth, mut set, mut next) = (0.0, Vec::new(), Some(first));
        while let Some(entry) = next {
            let i = open[entry].0;
            worth += self.gain(i, &taken) - lost[entry].unwrap_or(f32::INFINITY);
            set.push(i);
            for &(point, w) in &self.candidates[i].evidence.explained {
                let held = taken.entry(point).or_default();
                *held = held.max(w);
            }
            lost[entry] = None;
            for (lost, (other, _)) in lost.iter_mut().zip(open) {
                *lost = lost.and_then(|lost| Some(lost + self.charge(*other, i)?));
            }
            let adds = |e: &usize| Some(self.gain(open[*e].0, &taken) - lost[*e]?);
            let best = (0..open.len()).filter_map(|e| Some((e, adds(&e)?)));
            let best = best.max_by(|a, b| a.1.total_cmp(&b.1).then(b.0.cmp(&a.0)));
            next = best.filter(|b| b.1 >= self.config.min_score).map(|b| b.0);
        }
        (worth, set)
    }

    /// What a candidate adds to the held blocks and to more.
    fn gain(&self, i: usize, more: &std::collections::BTreeMap<u32, f32>) -> f32 {
        let evidence = &self.candidates[i].evidence;
        let new = evidence.explained.iter().map(|(point, w)| {
            let held = self.taken[*point as usize];
            (w - more.get(point).map_or(held, |m| m.max(held))).max(0.0)
        });
        (new.sum::<f32>() * evidence.point_area_m2 - evidence.against_m2) / evidence.unit_m2
    }

    fn worth(&self, i: usize, rest: &[usize]) -> Option<f32> {
        Some(self.candidates[i].evidence.gain(&self.taken) - self.lost(i, rest)?)
    }

    fn lost(&self, i: usize, rest: &[usize]) -> Option<f32> {
        rest.iter().map(|&r| self.charge(i, r)).sum()
    }

    fn charge(&self, i: usize, held: usize) -> Option<f32> {
        let (a, b) = (&self.candidates[i], &self.candidates[held]);
        if self.distance_m(i, held) > self.d_max_m(i) + self.d_max_m(held) {
            return Some(0.0);
        }
        charge(a, b, self.templates, self.measured, self.config)
    }

    fn put(&mut self, blocks: &[usize]) {
        for &block in blocks {
            for &(i, w) in &self.candidates[block].evidence.explained {
                self.taken[i as usize] = self.taken[i as usize].max(w);
            }
        }
    }

    fn distance_m(&self, a: usize, b: usize) -> f32 {
        (self.candidates[a].at.centre - self.candidates[b].at.centre).length()
    }

    fn d_max_m(&self, i: usize) -> f32 {
        self.templates[self.candidates[i].template].model.d_max_m
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::PoseConfig;
    use crate::acceptance::accept;
    use crate::evidence::Evidence;
    use crate::fit::CentredPose;
    use crate::template::templates;
    use geom::{PointCloud, Quat, SeedTree, Vec3};
    use scene::{Catalog, Shape, Survey};
    use std::ops::Range;

    /// Two cubes side by side, and a pose half on each that explains `between` points of them.
    fn accepted(each: u32, between: u32) -> [Vec<usize>; 2] {
        let cube = blocks::shape_model("cube", Shape::Cube { size: 1.0 }, 2300.0).unwrap();
        let catalog = Catalog::new(vec![cube]);
        let config = PoseConfig::default();
        let templates = templates(&catalog, &config, SeedTree::new(1)).unwrap();
        let points = (0..400).map(|i| Vec3::new((i % 20) as f32, (i / 20) as f32, 0.0)).collect();
        let survey = Survey { cloud: PointCloud::from_positions(points), ..Survey::default() };
        let measured = Measured::new(&survey, 0.05, 1.0, 0.01, None, None);
        let candidate = |x: f32, points: Range<u32>| Candidate {
            template: 0,
            at: CentredPose { rotation: Quat::IDENTITY, centre: Vec3::new(x, 0.0, 0.0) },
            evidence: Evidence {
                explained: points.map(|i| (i, 1.0)).collect(),
                against_m2: 0.0,
                agreement: 1.0,
                unit_m2: 1.0,
                point_area_m2: 0.01,
            },
        };
        let pool = [
            candidate(0.0, 0..each),
            candidate(1.03, 100..100 + each),
            candidate(0.5, 100 - between / 2..100 + between / 2),
        ];
        let evidence = &config.evidence;
        let greedy = accept(&pool, &templates, &measured, None, evidence);
        let better = exchange(greedy.clone(), &pool, &templates, &measured, None, evidence);
        [greedy, better].map(|found| {
            let mut held: Vec<usize> = found.accepted.iter().map(|a| a.0).collect();
            held.sort_unstable();
            held
        })
    }

    #[test]
    fn two_blocks_take_the_place_of_one_that_lies_half_on_each() {
        assert_eq!(accepted(100, 120), [vec![2], vec![0, 1]]);
    }

    #[test]
    fn what_explains_no_more_changes_nothing() {
        assert_eq!(accepted(60, 122), [vec![2], vec![2]]);
        assert_eq!(accepted(100, 60), [vec![0, 1], vec![0, 1]]);
    }
}
