//! From a pile and a design surface to a stacking plan (METHOD §6).
//!
//! In: recognised blocks on a ground, the design surface, a block to add. Out: which block goes where, in which
//! attitude and order, what was tried and removed, and the figures of the finished works. [`plan()`] is the whole method:
//! detect windows that lack volume, choose an initial pose, drop, settle, check, until no window is left.

mod acceptance;
mod assortment;
mod attitudes;
mod batches;
mod built;
mod carried;
mod choices;
mod config;
mod crane;
mod depth_image;
mod each_window;
mod error;
mod generate_and_test;
mod ground;
mod guided;
mod improve;
mod learn;
mod lifts;
mod network_pose;
mod next;
mod objective;
mod obstacles;
mod order;
mod pairs;
mod pattern;
pub mod porosity;
mod quantities;
mod random_pose;
mod region;
mod replan;
mod reset;
mod rounds;
mod search;
mod shut;
mod signs;
mod silhouette;
mod site;
mod stack;
mod summary;
mod surfaces;
mod surveyed;
mod trial;
mod uncertainty;
mod unfilled;
mod volumes;
pub mod windows;

pub use assortment::{BlockChoice, ZoneConfig};
pub use built::BuildingConfig;
pub use choices::{Aim, choices};
pub use config::{
    Insertion, Inside, NetworkConfig, PlanConfig, Policy, RandomConfig, SearchConfig, Settings,
};
pub use crane::CraneConfig;
pub use depth_image::{DEEPEST, DepthView, FORBIDDEN};
pub use each_window::{WindowAnswer, each_window};
pub use error::PlanError;
pub use generate_and_test::{GenerateConfig, GoodDrop, WindowSample, generate_and_test};
pub use ground::{GroundConfig, estimate_ground};
pub use learn::{Learned, MovedWeight, Opinion, learn};
pub use lifts::{Attitude, Lift, WorksConfig, attitude, lifts};
pub use network_pose::{Proposal, Proposer};
pub use next::{Next, next_blocks};
pub use objective::ObjectiveConfig;
pub use obstacles::with_obstacles;
pub use pairs::{Candidate, CandidatePair, most_telling, pairs_to_choose, stable_places};
pub use pattern::{AttitudeRule, Bond, PatternConfig};
pub use quantities::section_quantities;
pub use shut::{ShutWindow, shut_windows};
pub use signs::{SignWeights, Signs, signs_of_plan};
pub use site::{PlanInput, block_to_place, check_extent, raster_bytes};
pub use surfaces::{
    CrossSection, Surfaces, SurfacesInput, cross_sections, cross_sections_every, design_lines,
    point_deficits_m, surfaces, works_line,
};
pub use uncertainty::{
    Percentiles, PlanVariant, ThresholdRange, Uncertainty, UncertaintyConfig, uncertainty,
};
pub use unfilled::{Unfilled, UnfilledReason, unfilled};
pub use volumes::{OfVolume, plans_over_volumes};

use geom::{Event, Observer, SeedTree, Stage};
use improve::Effort;
use scene::{Placement, PlacementState, Plan};

/// Makes the plan. Same input, configuration and seed give the same plan, bit for bit, at any thread count.
pub fn plan(
    input: &PlanInput,
    config: &PlanConfig,
    seed: SeedTree,
    observer: &dyn Observer,
) -> Result<Plan, PlanError> {
    replan(input, &Plan::default(), config, seed, observer)
}

/// Plans on from an earlier plan: what of it is built must be in `input` (as recognised or as placed blocks), what still
/// holds is carried over unchanged, the rest is planned anew.
pub fn replan(
    input: &PlanInput,
    previous: &Plan,
    config: &PlanConfig,
    seed: SeedTree,
    observer: &dyn Observer,
) -> Result<Plan, PlanError> {
    let mut site = site::prepare(input, config, seed, observer)?;
    let before = summary::before(&site.stack(input));
    let first = first_blocks(&mut site, input, previous, seed, observer)?;
    let mut stack = site.stack_with(input, &first);
    let fixed = first.len();
    let filled = rounds::fill(&site, &mut stack, seed, observer)?;
    let (shut, opened) = (filled.shut, filled.opened);
    let mut tried = first;
    tried.extend(filled.tried.into_iter().map(|(placement, _)| placement));
    let effort = Effort::of(&site.main().settings, fixed);
    let (stack, tried) = bettered((&site, input), stack, tried, &effort, seed, observer)?;
    let mut plan = finished(&site, &stack, &before, tried);
    (plan.summary.shut, plan.summary.opened) = (shut, opened);
    observer.event(Event::Finished { stage: Stage::Plan });
    Ok(plan)
}

/// What comes before the rounds: blocks of the pile that are set elsewhere, and what an earlier plan still holds.
fn first_blocks(
    site: &mut site::Site,
    input: &PlanInput,
    previous: &Plan,
    seed: SeedTree,
    observer: &dyn Observer,
) -> Result<Vec<Placement>, PlanError> {
    let mut previous = previous.clone();
    let stands = |p: &Placement| !reset::lifted(input, std::slice::from_ref(p)).is_empty();
    previous.placements.retain(|p| p.is_new() || stands(p));
    // A block that no longer can be set where the earlier plan says stays where it stands.
    let carried = loop {
        site.lifted = reset::lifted(input, &previous.placements);
        let carried = replan::carry_over(site, &mut site.stack(input), &previous);
        let stays = |p: &Placement| p.is_new() || carried.iter().any(|c| c.drop == p.drop);
        if previous.placements.iter().all(stays) {
            break carried;
        }
        previous.placements.retain(|p| p.is_new() || carried.iter().any(|c| c.drop == p.drop));
    };
    let (most, named) = (site.most_reset as usize, site.reset_blocks.clone());
    let left = most.saturating_sub(carried.iter().filter(|p| !p.is_new()).count());
    if left == 0 {
        return Ok(carried);
    }
    let set = reset::reset(site, input, (left, &named), &carried, seed, observer)?;
    Ok(carried.into_iter().chain(set).collect())
}

/// The plan of the rounds, improved if that is asked for, and the pile with it.
fn bettered<'s>(
    (site, input): (&'s site::Site, &PlanInput<'s>),
    stack: stack::Stack<'s>,
    tried: Vec<Placement>,
    effort: &Effort,
    seed: SeedTree,
    observer: &dyn Observer,
) -> Result<(stack::Stack<'s>, Vec<Placement>), PlanError> {
    if effort.passes <= 0.0 {
        return Ok((stack, tried));
    }
    let (kept, removed): (Vec<_>, Vec<_>) =
        tried.into_iter().partition(|p| p.state == PlacementState::Kept);
    let before = site.stack(input);
    let kept = improve::improve(site, &before, kept, effort, seed.child("improve", 0), observer)?;
    let stack = site.stack_with(input, &kept);
    Ok((stack, kept.into_iter().chain(removed).collect()))
}

/// What was tried, in placing order and with its figures.
fn finished(
    site: &site::Site,
    stack: &stack::Stack,
    before: &summary::Before,
    tried: Vec<Placement>,
) -> Plan {
    let (kept, removed): (Vec<_>, Vec<_>) =
        tried.into_iter().partition(|p| p.state == PlacementState::Kept);
    let placements = order::ordered(kept, stack, site);
    let summary = summary::summary(site, stack, before, &placements, &removed);
    Plan { placements, removed, summary }
}
