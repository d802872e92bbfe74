//! Planning on from a plan that is partly built, or whose site was surveyed anew: only what changed is planned again.
//!
//! A planned block that stands where it was planned is done. Any other is dropped once more, in its order, onto the pile as it is now;
//! if it comes to rest where the plan says, it keeps its place in the plan to the last bit. What no longer holds is let
//! go, and the rounds fill the space.

use crate::{Policy, batches, rounds, site::Site, stack::Stack};
use geom::Vec2;
use rayon::prelude::*;
use scene::{
    InstanceId, PlacedBlock, Placement, PlacementState, Plan, PoseLimits, PosedModel, same_block,
};

/// A placement still holds if its block comes to rest within this part of the displacement that any block is allowed,
const SAME_PLACE: f32 = 0.25;
/// and turned by no more than this. Free choices: an unchanged neighbourhood gives 0 for both.
const SAME_TURN_RAD: f32 = 0.1;

/// Placements of `previous` that are still to do and still hold; they are in the stack afterwards.
pub(crate) fn carry_over(site: &Site, stack: &mut Stack, previous: &Plan) -> Vec<Placement> {
    let radius_m = site.types.iter().map(|t| t.settings.local_radius_m).fold(0.0, f32::max);
    let open: Vec<&Placement> =
        previous.placements.iter().filter(|p| !is_built(stack, p)).collect();
    let places: Vec<Vec2> =
        open.iter().map(|p| (p.drop * stack.catalog.get(p.model).centre).truncate()).collect();
    let mut carried: Vec<(usize, Placement)> = Vec::new();
    for batch in batches::independent(&places, 2.0 * radius_m) {
        let found: Vec<Option<Placement>> =
            batch.par_iter().map(|&i| still_holds(site, stack, open[i])).collect();
        for (&i, placement) in batch.iter().zip(found) {
            if let Some(p) = placement {
                let block = InstanceId(stack.blocks.len() as u32 + 1);
                stack.add(PlacedBlock { block, model: p.model, site_from_block: p.rest }, 0);
                carried.push((i, p));
            }
        }
    }
    carried.sort_by_key(|(i, _)| *i);
    carried.into_iter().map(|(_, p)| p).collect()
}

/// Whether a block of this type stands near enough to the planned place.
fn is_built(stack: &Stack, p: &Placement) -> bool {
    let block = stack.catalog.get(p.model);
    let (planned, limits) = (PosedModel::new(block, p.rest), PoseLimits::same_place(block));
    let centre = p.rest * block.centre;
    stack.near(centre.x, centre.y, limits.displacement_m).into_iter().any(|i| {
        let there = &stack.blocks[i];
        there.model == p.model && same_block(&there.posed(stack.catalog), &planned, limits)
    })
}

/// The placement where a block dropped there now comes to rest as it says.
pub(crate) fn still_holds(site: &Site, stack: &Stack, p: &Placement) -> Option<Placement> {
    let block = stack.catalog.get(p.model);
    let kind = site.of_model(p.model)?;
    let settings = &kind.settings;
    let limit_m = match settings.policy {
        Policy::Random => settings.roam_m,
        _ => settings.displacement_limit_m,
    };
    let way = (p.handling.path.as_slice(), &p.drop);
    let again = rounds::carried(kind, stack, way, limit_m, p.round)?.shaken(kind);
    let limits = PoseLimits {
        displacement_m: SAME_PLACE * settings.displacement_limit_m,
        rotation_rad: SAME_TURN_RAD,
    };
    let rests = |pose| PosedModel::new(block, pose);
    let same = same_block(&rests(again.rest), &rests(p.rest), limits);
    (again.state == PlacementState::Kept && same).then(|| p.clone())
}
