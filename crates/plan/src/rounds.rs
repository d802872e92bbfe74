//! The loop: detect windows, place a block in each, until no window is left (METHOD §6).
//!
//! Windows are served largest deficit first. Those too far apart to see each other run at the same time; the result is
//! that of serving them one by one. What has settled is fixed for the rounds to come.

use crate::{
    PlanError, Policy, acceptance, batches, network_pose, random_pose, search,
    site::{Poses, Site},
    stack::Stack,
    trial::Drop,
    windows::{self, Window},
};
use geom::{Event, Observer, Pose, SeedTree, Vec2, Vec3, Warning};
use rayon::prelude::*;
use scene::{InstanceId, PlacedBlock, Placement, PlacementState};

/// Windows whose middles are nearer than this part of a window stand for one place: a failure in one closes the other. Free choice
/// just below one half, where they begin to share most of their area.
const SAME_WINDOW: f32 = 0.45;

/// A window in which nothing could be placed while its surroundings were as they were at `tick`.
struct Failure {
    place: Vec2,
    tick: u32,
    deficit_m3: f32,
}

/// What the rounds did.
#[derive(Default)]
pub(crate) struct Filled {
    /// Every block tried, with the deficit of its window; kept ones are in the stack.
    pub tried: Vec<(Placement, f32)>,
    /// Deficit from and to which a failure kept a larger window closed: with a minimum volume in between it would not have.
    closed: Vec<(f32, f32)>,
}

impl Filled {
    /// Whether the same rounds with a larger minimum volume would have kept the same blocks. Windows are served largest
    /// deficit first, so smaller ones matter to larger ones only by a block they got or a failure that closed one.
    pub fn holds_for(&self, minimum_volume_m3: f32) -> bool {
        let v = minimum_volume_m3;
        self.tried.iter().all(|(p, deficit_m3)| p.state != PlacementState::Kept || *deficit_m3 > v)
            && self.closed.iter().all(|(from, to)| v < *from || v >= *to)
    }
}

/// Runs the rounds.
pub(crate) fn fill(
    site: &Site,
    stack: &mut Stack,
    seed: SeedTree,
    observer: &dyn Observer,
) -> Result<Filled, PlanError> {
    let settings = &site.settings;
    let block = stack.catalog.get(site.model);
    let expected = windows::void_m3(&stack.surface, &stack.design) * 0.5 / block.volume_m3;
    observer.event(Event::Started { stage: "plan", total: expected.ceil() as u64 });
    let mut filled = Filled::default();
    let mut failures: Vec<Failure> = Vec::new();
    let (mut tick, mut kept) = (0, 0_u64);
    // Nobody reads or writes farther than this from a window's centre.
    let apart_m = 2.0 * (settings.local_radius_m + settings.jitter_m.max(settings.window_m));
    for round in 1..=settings.rounds {
        failures.retain(|f| {
            stack.last_change(f.place.x, f.place.y, settings.window_m + block.d_max_m) <= f.tick
        });
        let mut closed = Vec::new();
        let open = |w: &Window| {
            if !site.reach.as_ref().is_none_or(|r| r.covers(w.centre)) {
                return false;
            }
            let near = failures
                .iter()
                .filter(|f| (f.place - w.centre).length() < SAME_WINDOW * settings.window_m);
            let Some(largest_m3) = near.map(|f| f.deficit_m3).reduce(f32::max) else { return true };
            if largest_m3 < w.deficit_m3 {
                closed.push((largest_m3, w.deficit_m3));
            }
            false
        };
        let windows = windows::detect(&stack.surface, &stack.design, settings, open);
        filled.closed.append(&mut closed);
        if windows.is_empty() {
            if round == 1 {
                let message = nothing_to_do(stack, settings.minimum_volume_m3);
                observer.event(Event::Warned(Warning { stage: "plan", message }));
            }
            break;
        }
        let places: Vec<Vec2> = windows.iter().map(|w| w.centre).collect();
        let seed = seed.child("round", u64::from(round));
        for batch in batches::independent(&places, apart_m) {
            if observer.cancelled() {
                return Err(PlanError::Cancelled);
            }
            tick += 1;
            let results: Vec<Vec<Placement>> = batch
                .par_iter()
                .map(|&w| serve(site, stack, &windows[w], round, seed.child("window", w as u64)))
                .collect();
            for (&w, placements) in batch.iter().zip(results) {
                let placed = placements.iter().find(|p| p.state == PlacementState::Kept);
                if let Some(p) = placed {
                    let id = InstanceId(stack.blocks.len() as u32 + 1);
                    stack.add(
                        PlacedBlock { block: id, model: p.model, site_from_block: p.rest },
                        tick,
                    );
                    kept += 1;
                } else if settings.policy != Policy::Random || settings.random.drops > 1 {
                    failures.push(Failure {
                        place: places[w],
                        tick,
                        deficit_m3: windows[w].deficit_m3,
                    });
                }
                filled.tried.extend(placements.into_iter().map(|p| (p, windows[w].deficit_m3)));
            }
            observer.event(Event::Advanced { stage: "plan", done: kept });
        }
    }
    Ok(filled)
}

/// Why the first round found no window.
fn nothing_to_do(stack: &Stack, minimum_volume_m3: f32) -> String {
    if windows::void_m3(&stack.surface, &stack.design) <= 0.0 {
        "the design lies below the present surface everywhere: nothing is to be added, the plan has 0 blocks".into()
    } else {
        format!(
            "no window lacks the minimum volume of {minimum_volume_m3:.2} m³ within the crane's reach: the plan has 0 blocks; \
             reduce plan.minimum_volume_m3 to fill smaller gaps"
        )
    }
}

/// Tries to place one block in a window; of what was tried at most one is kept.
pub(crate) fn serve(
    site: &Site,
    stack: &Stack,
    window: &Window,
    round: u32,
    seed: SeedTree,
) -> Vec<Placement> {
    let found = match &site.poses {
        Poses::Random => return random_pose::placed(site, stack, window, round, seed),
        Poses::Network(proposer, turn_rad) => network_pose::candidates(
            stack,
            &site.settings,
            site.model,
            (*proposer, *turn_rad),
            window,
        ),
        Poses::Search(attitudes) => attitudes.candidates(stack, &site.settings, site.model, window),
    };
    search::best(site, stack, &found, round)
}

/// A block that was dropped and judged, but not yet shaken.
pub(crate) struct Dropped<'a> {
    world: Drop<'a>,
    /// Kept: if it stands the shake.
    pub placement: Placement,
    pub impact: acceptance::Impact,
}

/// Drops a block and judges it.
pub(crate) fn attempt(
    site: &Site,
    stack: &Stack,
    drop: &Pose,
    limit_m: f32,
    round: u32,
) -> Placement {
    dropped(site, stack, drop, limit_m, round).shaken(site)
}

/// Drops a block and judges all but the shake, which costs as much as the drop.
pub(crate) fn dropped<'a>(
    site: &'a Site,
    stack: &Stack,
    drop: &Pose,
    limit_m: f32,
    round: u32,
) -> Dropped<'a> {
    let mut falling = Drop::new(stack, &site.settings, site.model, drop);
    // What has rolled over the boundary does not roll back.
    let lost = |centre: Vec3| !stack.design_level_m(centre.x, centre.y).is_finite();
    let trial = falling.settle(limit_m, &lost);
    let (state, impact) =
        acceptance::judge(stack, &site.settings, site.reach.as_ref(), site.model, limit_m, &trial);
    let placement = Placement {
        order: 0,
        round,
        model: site.model,
        drop: *drop,
        rest: trial.rest,
        filled_m3: impact.filled_m3,
        contacts: trial.contacts,
        state,
    };
    Dropped { world: falling, placement, impact }
}

impl Dropped<'_> {
    /// The verdict with the shake, which only what has passed everything else is asked.
    pub fn shaken(mut self, site: &Site) -> Placement {
        if self.placement.state == PlacementState::Kept
            && self.world.shake() > site.settings.shake_limit_m
        {
            self.placement.state = PlacementState::Unstable;
        }
        self.placement
    }
}
