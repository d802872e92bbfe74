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
mod choices;
mod config;
mod crane;
mod depth_image;
mod each_window;
mod error;
mod generate_and_test;
mod ground;
mod improve;
mod learn;
mod lifts;
mod network_pose;
mod next;
mod objective;
mod obstacles;
mod order;
mod pairs;
pub mod porosity;
mod quantities;
mod random_pose;
mod region;
mod replan;
mod rounds;
mod search;
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
pub use config::{Inside, NetworkConfig, PlanConfig, Policy, RandomConfig, SearchConfig, Settings};
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
pub use quantities::section_quantities;
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
    let site = site::prepare(input, config, seed, observer)?;
    let mut stack = site.stack(input);
    let before = summary::before(&stack);
    let carried = replan::carry_over(&site, &mut stack, previous);
    let fixed = carried.len();
    let filled = rounds::fill(&site, &mut stack, seed, observer)?;
    let mut tried = carried;
    tried.extend(filled.tried.into_iter().map(|(placement, _)| placement));
    let effort = Effort::of(&site.main().settings, fixed);
    let (stack, tried) = bettered((&site, input), stack, tried, &effort, seed, observer)?;
    let plan = finished(&site, &stack, &before, tried);
    observer.event(Event::Finished { stage: Stage::Plan });
    Ok(plan)
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
