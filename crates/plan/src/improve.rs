//! Policy `search`, second edition: a finished plan made better by lifting blocks out and filling the space anew (ours).
//!
//! In: what the rounds kept, in planning order. Out: the same or a better list. One trial takes a place, lifts the blocks there,
//! drops everything that was placed later beside them once more, in its order, and fills the windows of the place again
//! under a fresh set of attitudes. Of what was filled the best first part stays, if by the weights of [`ObjectiveConfig`] it is
//! better than before. Every block that stays was dropped, settled, judged and shaken on the pile as it is at its turn, so no rule of the
//! planner is touched. Trials that cannot see each other run at the same time; the result does not depend on the threads.

use crate::{
    ObjectiveConfig, PlanError, Settings, batches,
    region::{Base, Region},
    search::Attitudes,
    site::{Poses, Site, TypeToPlace},
    stack::Stack,
    windows,
};
use geom::{Event, Observer, SeedTree, Stage, Vec2};
use rand::{RngExt, seq::SliceRandom};
use rayon::prelude::*;
use scene::Placement;

/// Sets of attitudes the trials choose from. With every second of them a window gets the block of most worth instead of the
/// deepest.
const TURNS: u64 = 4;
/// Blocks nearer than these to a place, in d_box, are lifted together; 0: the block alone. One is drawn for each trial.
const LIFTED: [f32; 4] = [0.0, 0.0, 0.6, 0.9];
/// Gain below which a change is not worth making: rounding of the sums.
const WORTH: f32 = 1e-3;
/// Part of the minimum volume from which an unfilled place is worth a trial.
const PLACE: f32 = 0.5;

/// How long and by what a plan is improved.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Effort {
    /// Trials for each block of the plan.
    pub passes: f32,
    /// Loss that is accepted with probability 1/e at the start, falling to 0: a way out of what no single trial betters.
    pub temperature: f32,
    /// So many blocks from the first on stay where they are.
    pub fixed: usize,
    pub objective: ObjectiveConfig,
}

impl Effort {
    /// What the settings ask for, with so many blocks that stay.
    pub fn of(settings: &Settings, fixed: usize) -> Self {
        let (search, objective) = (&settings.search, settings.objective);
        Self { passes: search.improve, temperature: search.temperature, fixed, objective }
    }
}

/// The blocks of the rounds, bettered.
pub(crate) fn improve(
    site: &Site,
    base: &Stack,
    mut kept: Vec<Placement>,
    effort: &Effort,
    seed: SeedTree,
    observer: &dyn Observer,
) -> Result<Vec<Placement>, PlanError> {
    let total = (effort.passes * kept.len() as f32).ceil() as u64;
    let round = kept.iter().map(|p| p.round).max().unwrap_or(0) + 1;
    let trials = Trials { site, turns: turned(site, base, seed), effort, round };
    observer.event(Event::Started { stage: Stage::Improve, total });
    let mut base = Base::new(site, base, &kept);
    let (mut done, mut pass) = (0_u64, 0_u64);
    while done < total && !kept.is_empty() {
        let seed = seed.child("pass", pass);
        let mut places = places(site, &base, &kept, seed);
        places.truncate((total - done) as usize);
        let centres: Vec<Vec2> = places.iter().map(|p| p.centre).collect();
        for batch in batches::independent(&centres, base.apart_m()) {
            if observer.cancelled() {
                return Err(PlanError::Cancelled);
            }
            let cooled = effort.temperature * (1.0 - done as f32 / total as f32);
            let trial = |&i: &usize| {
                let seed = seed.child("trial", i as u64);
                trials.at(&base, &kept, &places[i], cooled, seed)
            };
            let found: Vec<Option<Change>> = batch.par_iter().map(trial).collect();
            apply(site, &mut base, &mut kept, found.into_iter().flatten().collect());
            done += batch.len() as u64;
            observer.event(Event::Advanced { stage: Stage::Improve, done });
        }
        pass += 1;
    }
    observer.event(Event::Finished { stage: Stage::Improve });
    Ok(kept)
}

/// The types with other sets of attitudes.
fn turned<'a>(site: &Site<'a>, stack: &Stack, seed: SeedTree) -> Vec<Vec<TypeToPlace<'a>>> {
    let of = |kind: &TypeToPlace<'a>, turn: u64| {
        let block = stack.catalog.get(kind.model);
        let attitudes = Attitudes::new(block, &kind.settings, seed.child("attitudes", turn));
        TypeToPlace {
            settings: kind.settings.clone(),
            model: kind.model,
            poses: Poses::Search(attitudes),
            guided: None,
            allowed: kind.allowed.clone(),
            stock: kind.stock,
            cost: kind.cost,
            by_worth: kind.by_worth.filter(|_| turn % 2 == 1),
        }
    };
    (0..TURNS).map(|turn| site.types.iter().map(|kind| of(kind, turn)).collect()).collect()
}

/// Where a trial is made.
struct Place {
    centre: Vec2,
    /// Blocks nearer than this are lifted; at least the nearest.
    lifted_m: f32,
}

/// Every block and every place that still lacks a good part of a block, in an order drawn from the seed.
fn places(site: &Site, base: &Base, kept: &[Placement], seed: SeedTree) -> Vec<Place> {
    let mut rng = seed.child("order", 0).rng();
    let block = base.block(site);
    let mut settings = site.types.last().unwrap_or(site.main()).settings.clone();
    settings.minimum_volume_m3 *= PLACE;
    let open = windows::detect(&base.surface, base.design, &settings, |_| true);
    let mut centres: Vec<Vec2> = open.iter().map(|w| w.centre).collect();
    centres.extend(kept.iter().map(|p| base.centre(p).truncate()));
    centres.shuffle(&mut rng);
    let mut place = |centre: Vec2| {
        let lifted_m = LIFTED[rng.random_range(0..LIFTED.len())] * block.d_box_m;
        Place { centre, lifted_m }
    };
    centres.into_iter().map(&mut place).collect()
}

/// A change that is worth making.
struct Change {
    centre: Vec2,
    /// Blocks that go, by their place in the list.
    lifted: Vec<usize>,
    added: Vec<Placement>,
}

/// What all trials share.
struct Trials<'t, 'a> {
    site: &'t Site<'a>,
    turns: Vec<Vec<TypeToPlace<'a>>>,
    effort: &'t Effort,
    /// What new blocks are said to be of.
    round: u32,
}

impl Trials<'_, '_> {
    /// Lifts, drops again, fills; `None` where that is no better.
    fn at(
        &self,
        base: &Base,
        kept: &[Placement],
        place: &Place,
        temperature: f32,
        seed: SeedTree,
    ) -> Option<Change> {
        let mut rng = seed.rng();
        let toe_first = rng.random_range(0..3) == 0;
        let fixed = self.effort.fixed;
        let mut lifted = base.within(kept, place.centre, place.lifted_m);
        if lifted.is_empty() {
            lifted.extend(base.nearest(kept, place.centre));
        }
        lifted.retain(|&i| i >= fixed);
        let mut region = Region::without(self.site, base, kept, place.centre, &lifted, fixed)?;
        let lifted = region.gone.clone();
        let (best, added) = self.filled(base, kept, &mut region, toe_first, seed);
        let tolerated = match temperature > 0.0 {
            true => temperature * rng.random::<f32>().max(1e-6).ln(),
            false => WORTH,
        };
        let change = !(added.is_empty() && lifted.is_empty());
        (change && best > tolerated).then_some(Change { centre: place.centre, lifted, added })
    }

    /// Fills a region; the gain over the works as they are, and the blocks of it.
    fn filled(
        &self,
        base: &Base,
        kept: &[Placement],
        region: &mut Region,
        toe_first: bool,
        seed: SeedTree,
    ) -> (f32, Vec<Placement>) {
        let (site, objective) = (self.site, &self.effort.objective);
        let types = &self.turns[seed.child("turn", 0).rng().random_range(0..self.turns.len())];
        let gone = region.gone.clone();
        let lost: f32 =
            gone.iter().map(|&i| objective.of_block(site, &region.stack, &kept[i])).sum();
        let void_before_m3 = base.void_m3(region);
        let left = base.stock_left(site, kept, &gone);
        let emptied_m3 = void_before_m3 - region.void_m3();
        let mut best = objective.of_void(site, &region.stack, emptied_m3) - lost;
        let (mut best_count, mut worth) = (0, 0.0);
        let mut added: Vec<Placement> = Vec::new();
        region.fill(types, left, toe_first, seed, |stack, p, void_m3| {
            worth += objective.of_block(site, stack, p);
            added.push(Placement { round: self.round, ..p.clone() });
            let gain = objective.of_void(site, stack, void_before_m3 - void_m3) + worth - lost;
            if gain > best {
                (best, best_count) = (gain, added.len());
            }
        });
        added.truncate(best_count);
        (best, added)
    }
}

/// Makes the changes; one that would take more of a type than there is stays undone.
fn apply(site: &Site, base: &mut Base, kept: &mut Vec<Placement>, changes: Vec<Change>) {
    let mut gone: Vec<usize> = Vec::new();
    let mut added: Vec<Placement> = Vec::new();
    let mut centres = Vec::new();
    for change in changes {
        let all_gone: Vec<usize> = gone.iter().chain(&change.lifted).copied().collect();
        let all_added: Vec<&Placement> = added.iter().chain(&change.added).collect();
        let enough =
            site.types.iter().zip(base.stock_left(site, kept, &all_gone)).all(|(t, left)| {
                let new = all_added.iter().filter(|p| p.model == t.model).count();
                left.is_none_or(|left| new <= left as usize)
            });
        if enough {
            gone = all_gone;
            added.extend(change.added);
            centres.push(change.centre);
        }
    }
    if centres.is_empty() {
        return;
    }
    gone.sort_unstable();
    let mut i = 0;
    kept.retain(|_| {
        i += 1;
        gone.binary_search(&(i - 1)).is_err()
    });
    kept.extend(added);
    centres.into_iter().for_each(|c| base.renew(kept, c));
}
