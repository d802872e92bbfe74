//! The next blocks to place, from what stands as it was really placed.
//!
//! In: the plan, the blocks placed so far with their real poses, the numbers they had. Out: the next ones in the plan's order: as
//! planned where they still come to rest so, else in the best pose the search finds at that place; the rest of the plan stays.

use crate::{
    PlanConfig, PlanError, PlanInput, each_window::window_at, replan, reset, rounds, site,
    stack::Stack,
};
use geom::{Observer, SeedTree};
use scene::{InstanceId, PlacedBlock, Placement, PlacementState, Plan};
use std::collections::BTreeSet;

/// What to do about one block of the plan.
#[derive(Clone, Debug, PartialEq)]
pub enum Next {
    /// Place it as planned.
    AsPlanned(Placement),
    /// Its place has changed: place it like this.
    Moved(Placement),
    /// It does not come to rest there any more, in no pose; its number in the plan.
    GivenUp(u32),
}

/// The next `count` blocks that can be placed, and those given up on the way. `done`: numbers that need no placing any more.
pub fn next_blocks(
    input: &PlanInput,
    config: &PlanConfig,
    plan: &Plan,
    (done, count): (&BTreeSet<u32>, usize),
    seed: SeedTree,
    observer: &dyn Observer,
) -> Result<Vec<Next>, PlanError> {
    let mut site = site::prepare(input, config, seed, observer)?;
    let open: Vec<Placement> =
        plan.placements.iter().filter(|p| !done.contains(&p.order)).cloned().collect();
    site.lifted = reset::lifted(input, &open);
    let mut stack = site.stack(input);
    let (mut list, mut found) = (Vec::new(), 0);
    for p in plan.placements.iter().filter(|p| !done.contains(&p.order)) {
        if found == count {
            break;
        }
        let next = match replan::still_holds(&site, &stack, p) {
            Some(p) => Next::AsPlanned(p),
            None => match elsewhere(&site, &stack, p, seed) {
                Some(moved) => Next::Moved(moved),
                None => Next::GivenUp(p.order),
            },
        };
        if let Next::AsPlanned(p) | Next::Moved(p) = &next {
            found += 1;
            let block = InstanceId(stack.blocks.len() as u32 + 1);
            stack.add(PlacedBlock { block, model: p.model, site_from_block: p.rest }, 1);
        }
        list.push(next);
    }
    Ok(list)
}

/// The best pose for a block near where it was planned.
fn elsewhere(site: &site::Site, stack: &Stack, p: &Placement, seed: SeedTree) -> Option<Placement> {
    let kind = site.of_model(p.model)?;
    let centre = (p.rest * stack.catalog.get(p.model).centre).truncate();
    let window = window_at(stack, centre, kind.settings.window_m);
    let seed = seed.child("next", u64::from(p.order));
    let tried = rounds::serve_type(kind, stack, &window, p.round, seed);
    let kept = tried.into_iter().find(|t| t.state == PlacementState::Kept)?;
    let handling = scene::Handling { reset: p.handling.reset, ..kept.handling };
    Some(Placement { order: p.order, handling, ..kept })
}
