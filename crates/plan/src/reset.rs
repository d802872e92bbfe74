//! Blocks of the pile that are lifted and set elsewhere before new ones are placed (ours).
//!
//! In: how many, or which. Out: for each a placement that names the block and where it stood. Both halves are checked: a block may
//! be lifted if nothing lies over it and no neighbour moves when it is gone, and it must come to rest elsewhere by all rules of the planner,
//! to the gain of the works. A block that carries others stays; one that was asked for by number is refused by name.

use crate::{
    PlanError, PlanInput, acceptance, rounds,
    site::Site,
    stack::Stack,
    windows::{self, Window},
};
use geom::{Bounds, Event, Observer, SeedTree, Stage, Vec3, Warning};
use rayon::prelude::*;
use scene::{
    InstanceId, PlacedBlock, Placement, PlacementState, PoseLimits, PosedModel, Reset, same_block,
};
use sim::{BodyId, Touched, World};
use std::collections::BTreeSet;

/// Candidates looked at for each block that may be re-set.
const LOOKED_AT: usize = 6;
/// Windows tried for each.
const WINDOWS: usize = 8;
/// Gain, in volumes of the block and blocks above the design, below which it is not worth a lift.
const WORTH: f32 = 0.25;
/// Time in which a neighbour would follow, seconds for a 2 m block.
const FOLLOWS_S: f32 = 1.5;

/// What stands in the way of lifting a block.
#[derive(Clone, Debug, PartialEq)]
enum Held {
    /// These would move.
    Carries(Vec<InstanceId>),
    /// Something lies over it.
    Under,
}

/// The blocks of the pile that a plan lifts, found by where they stand.
pub(crate) fn lifted(input: &PlanInput, placements: &[Placement]) -> BTreeSet<InstanceId> {
    let resets = placements.iter().filter_map(|p| p.handling.reset.map(|r| (p.model, r)));
    let stands = |(model, reset): (scene::ModelId, Reset)| {
        let block = input.catalog.get(model);
        let (there, limits) = (PosedModel::new(block, reset.from), PoseLimits::same_place(block));
        let same = |b: &&PlacedBlock| {
            b.model == model && same_block(&b.posed(input.catalog), &there, limits)
        };
        input.scene.blocks.iter().find(same).map(|b| b.block)
    };
    resets.filter_map(stands).collect()
}

/// Chooses, lifts and drops; the site knows afterwards which blocks are gone from their places.
pub(crate) fn reset(
    site: &mut Site,
    input: &PlanInput,
    (most, named): (usize, &[u32]),
    earlier: &[Placement],
    seed: SeedTree,
    observer: &dyn Observer,
) -> Result<Vec<Placement>, PlanError> {
    let mut done: Vec<Placement> = earlier.to_vec();
    let mut kept_back: Vec<String> = Vec::new();
    let candidates = candidates(site, input, named)?;
    for (looked, i) in candidates.into_iter().enumerate() {
        if observer.cancelled() {
            return Err(PlanError::Cancelled);
        }
        if done.len() == earlier.len() + most || (named.is_empty() && looked >= LOOKED_AT * most) {
            break;
        }
        let block = &input.scene.blocks[i];
        if site.lifted.contains(&block.block) {
            continue;
        }
        match held(site, input, &done, block) {
            Some(why) if !named.is_empty() => return Err(refused(block.block, &why)),
            Some(why) => kept_back.push(word(block.block, &why)),
            None => match elsewhere(site, input, &done, block, seed) {
                Some(placement) => {
                    site.lifted.insert(block.block);
                    done.push(placement);
                }
                None if !named.is_empty() => {
                    kept_back.push(format!("block {} finds no better place", block.block.0));
                }
                None => {}
            },
        }
    }
    if !kept_back.is_empty() {
        let message = format!("not re-set: {}", kept_back.join("; "));
        observer.event(Event::Warned(Warning { stage: Stage::Plan, message }));
    }
    Ok(done.split_off(earlier.len()))
}

/// Blocks that may be re-set, by their place in the list: those named, else those within the works that stand too high, the highest first.
fn candidates(site: &Site, input: &PlanInput, named: &[u32]) -> Result<Vec<usize>, PlanError> {
    let blocks = &input.scene.blocks;
    if !named.is_empty() {
        let find = |&id: &u32| {
            let found = blocks.iter().position(|b| b.block.0 == id);
            found.ok_or(PlanError::NoSuchBlock { block: id, blocks: blocks.len() })
        };
        return named.iter().map(find).collect();
    }
    let stack = site.stack(input);
    let limit_m = site.main().settings.overflow_m.max(0.0);
    let above = |b: &PlacedBlock| {
        let centre = b.site_from_block * input.catalog.get(b.model).centre;
        let top = |v: &Vec3| {
            let at = b.site_from_block * *v;
            at.z - stack.design_level_m(at.x, at.y)
        };
        let corners = input.catalog.get(b.model).mesh.vertices.iter();
        let height_m = corners.map(top).filter(|h| h.is_finite()).fold(f32::NEG_INFINITY, f32::max);
        (stack.has_design(centre.x, centre.y) && height_m > limit_m).then_some(height_m)
    };
    let mut found: Vec<(f32, usize)> =
        blocks.iter().enumerate().filter_map(|(i, b)| above(b).map(|h| (h, i))).collect();
    found.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    Ok(found.into_iter().map(|(_, i)| i).collect())
}

/// The pile without one more block, with what was set elsewhere before.
fn without<'s>(
    site: &'s Site,
    input: &PlanInput<'s>,
    done: &[Placement],
    block: InstanceId,
) -> Stack<'s> {
    let lifted: BTreeSet<InstanceId> = site.lifted.iter().copied().chain([block]).collect();
    let mut stack = site.stack_but(input, &lifted);
    for p in done {
        let block = p.handling.reset.map_or(InstanceId(0), |r| r.block);
        stack.add(PlacedBlock { block, model: p.model, site_from_block: p.rest }, 0);
    }
    stack
}

/// Why a block cannot be lifted.
fn held(site: &Site, input: &PlanInput, done: &[Placement], block: &PlacedBlock) -> Option<Held> {
    let stack = without(site, input, done, block.block);
    let carried = carried(site, input, &stack, block);
    if !carried.is_empty() {
        return Some(Held::Carries(carried));
    }
    let found = acceptance::impact(&stack, block.model, &block.site_from_block);
    (found.wedged > site.main().settings.wedge_limit).then_some(Held::Under)
}

/// The neighbours that move when a block is gone, but would not beside it: recognised poses are centimetres off, and some settle anyway.
fn carried(site: &Site, input: &PlanInput, stack: &Stack, block: &PlacedBlock) -> Vec<InstanceId> {
    let settings = &site.main().settings;
    let model = input.catalog.get(block.model);
    let at = block.site_from_block * model.centre;
    let radius_m = settings.local_radius_m;
    let near = stack.near(at.x, at.y, radius_m);
    let shape = |model: scene::ModelId| &site.shapes[model.0 as usize];
    let world = |with: bool, touching: &[usize]| {
        let mut world = World::new(&settings.physics);
        world.add_ground(stack.ground, &Bounds { min: at, max: at }.grown(radius_m));
        let mut ids: Vec<(usize, BodyId)> = Vec::new();
        for &i in &near {
            let b = &stack.blocks[i];
            let id = match touching.contains(&i) {
                true => world.add_moving(shape(b.model), &b.site_from_block),
                false => world.add_fixed(shape(b.model), &b.site_from_block),
            };
            ids.push((i, id));
        }
        let own = with.then(|| world.add_fixed(shape(block.model), &block.site_from_block));
        (world, ids, own)
    };
    let (still, ids, own) = world(true, &[]);
    let contacts = own.map_or(Vec::new(), |own| still.contacts(own));
    let touching: Vec<usize> = ids
        .iter()
        .filter(|(_, id)| contacts.iter().any(|c| c.other == Touched::Block(*id)))
        .map(|(i, _)| *i)
        .collect();
    let moved = |with: bool| -> Vec<f32> {
        let (mut world, ids, _) = world(with, &touching);
        let time_s = FOLLOWS_S * settings.physics.length_unit_m.sqrt();
        world.step((time_s / world.step_s()).ceil() as usize);
        let centre =
            |i: usize, pose: geom::Pose| pose * input.catalog.get(stack.blocks[i].model).centre;
        let of = |(i, id): &(usize, BodyId)| {
            let now = world.pose(*id).unwrap_or(stack.blocks[*i].site_from_block);
            (centre(*i, now) - centre(*i, stack.blocks[*i].site_from_block)).length()
        };
        ids.iter().map(of).collect()
    };
    let (beside, gone) = (moved(true), moved(false));
    let follows = |k: &usize| gone[*k] - beside[*k] > settings.shake_limit_m;
    (0..near.len()).filter(follows).map(|k| stack.blocks[near[k]].block).collect()
}

/// Where a lifted block does the works most good; `None` where none is worth it.
fn elsewhere(
    site: &Site,
    input: &PlanInput,
    done: &[Placement],
    block: &PlacedBlock,
    seed: SeedTree,
) -> Option<Placement> {
    let kind = site.of_model(block.model)?;
    let stack = without(site, input, done, block.block);
    let model = input.catalog.get(block.model);
    let open = |w: &Window| kind.allowed.covers(w.centre);
    let mut found = windows::detect(&stack.surface, &stack.design, &kind.settings, open);
    found.truncate(WINDOWS);
    let seed = seed.child("reset", u64::from(block.block.0));
    let served = |(n, w): (usize, &Window)| {
        let tried = rounds::serve_type(kind, &stack, w, 0, seed.child("window", n as u64));
        tried.into_iter().find(|p| p.state == PlacementState::Kept)
    };
    let placed: Vec<Option<Placement>> = found.par_iter().enumerate().map(served).collect();
    // What it fills there, less what it filled where it stands.
    let now = acceptance::impact(&stack, block.model, &block.site_from_block);
    let worth = |p: &Placement| {
        let then = acceptance::impact(&stack, p.model, &p.rest);
        let filled = (then.filled_m3 - now.filled_m3) / model.volume_m3;
        let above = (now.protruding_m3 - then.protruding_m3) / model.volume_m3;
        filled + above
    };
    let best = placed.into_iter().flatten().max_by(|a, b| worth(a).total_cmp(&worth(b)))?;
    if worth(&best) < WORTH {
        return None;
    }
    let mut placement = best;
    placement.handling.reset = Some(Reset { block: block.block, from: block.site_from_block });
    Some(placement)
}

fn word(block: InstanceId, why: &Held) -> String {
    match why {
        Held::Carries(others) => format!("block {} carries {}", block.0, numbers(others)),
        Held::Under => format!("block {} lies under others", block.0),
    }
}

fn refused(block: InstanceId, why: &Held) -> PlanError {
    let why = match why {
        Held::Carries(others) => format!("it carries {}, which would move", numbers(others)),
        Held::Under => "others lie over it".into(),
    };
    PlanError::HeldBlock { block: block.0, why }
}

fn numbers(blocks: &[InstanceId]) -> String {
    let all: Vec<String> = blocks.iter().map(|b| b.0.to_string()).collect();
    format!("{} {}", if all.len() == 1 { "block" } else { "blocks" }, all.join(", "))
}
