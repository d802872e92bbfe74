//! Why nothing can be lowered straight down into a window, told by very many drops. Planning never needs it.
//!
//! In: a pile and a configuration. Out: each window that the rounds of straight lowering leave, with what became of blocks let go in it:
//! from above, as the search does with its few best poses, and from free poses anywhere in the window, those no crane lowers a block into
//! included. A window in which none of them stays by the rules cannot be opened by any path.

use crate::{
    Insertion, PlanConfig, PlanError, PlanInput,
    guided::{self, Guide},
    rounds,
    site::{self, TypeToPlace},
    stack::Stack,
    windows::{self, Window},
};
use geom::{Observer, Pose, SeedTree, Vec2};
use rayon::prelude::*;
use scene::PlacementState;

/// What became of the blocks let go in one shut window.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShutWindow {
    /// Its middle, local frame.
    pub centre: Vec2,
    /// Void it lacks, m³.
    pub deficit_m3: f32,
    /// Free poses let go.
    pub tried: u32,
    /// Of these: came to rest too high.
    pub too_high: u32,
    /// Rolled out of the window, over the boundary or out of reach.
    pub left: u32,
    /// Touched too few others, did not settle or moved under the shake.
    pub unstable: u32,
    /// More of it under other blocks than allowed, by all else kept.
    pub wedged: u32,
    /// Stay by all rules, and can be lowered straight down to where they were let go.
    pub straight: u32,
    /// Stay by all rules, and cannot.
    pub hidden: u32,
    /// Whether guided insertion places a block.
    pub opened: bool,
    /// Whether it does so along a path.
    pub path: bool,
}

/// The windows that straight lowering leaves, each with `samples` poses looked at. Errors: those of planning.
pub fn shut_windows(
    input: &PlanInput,
    config: &PlanConfig,
    samples: u32,
    seed: SeedTree,
    observer: &dyn Observer,
) -> Result<Vec<ShutWindow>, PlanError> {
    let straight = PlanConfig { insertion: Insertion::Straight, ..config.clone() };
    let site = site::prepare(input, &straight, seed, observer)?;
    let mut stack = site.stack(input);
    rounds::fill(&site, &mut stack, seed, observer)?;
    let guided = PlanConfig { insertion: Insertion::Guided, ..config.clone() };
    let guided = site::prepare(input, &guided, seed, observer)?;
    let kind = guided.main();
    let open = |w: &Window| kind.allowed.covers(w.centre);
    let found = windows::detect(&stack.surface, &stack.design, &kind.settings, open);
    let looked_at = |(number, window): (usize, &Window)| {
        if observer.cancelled() {
            return Err(PlanError::Cancelled);
        }
        let seed = seed.child("shut", number as u64);
        let mut shut = what_became(kind, &stack, window, samples, seed);
        let placed = guided::placed(kind, &stack, window, 1, seed);
        shut.opened = !placed.is_empty();
        shut.path = placed.iter().any(|p| !p.handling.path.is_empty());
        Ok(shut)
    };
    found.par_iter().enumerate().map(looked_at).collect()
}

fn what_became(
    kind: &TypeToPlace,
    stack: &Stack,
    window: &Window,
    samples: u32,
    seed: SeedTree,
) -> ShutWindow {
    let guide = Guide::new(kind, stack, window);
    let mut rng = seed.child("samples", 0).rng();
    let touching = guided::touching(kind, stack, window);
    let mut free = guide.free_poses(window, &touching, (samples, usize::MAX), &mut rng);
    free.extend(touching.iter().map(|s| guide.above(&s.pose)));
    let mut found = ShutWindow {
        centre: window.centre,
        deficit_m3: window.deficit_m3,
        tried: free.len() as u32,
        too_high: 0,
        left: 0,
        unstable: 0,
        wedged: 0,
        straight: 0,
        hidden: 0,
        opened: false,
        path: false,
    };
    for pose in free {
        *found.of(kind, stack, window, &guide, &pose) += 1;
    }
    found
}

impl ShutWindow {
    /// The count that a pose belongs to.
    fn of(
        &mut self,
        kind: &TypeToPlace,
        stack: &Stack,
        window: &Window,
        guide: &Guide,
        pose: &Pose,
    ) -> &mut u32 {
        let settings = &kind.settings;
        let dropped = rounds::dropped(kind, stack, pose, settings.roam_m, 1);
        let (wedged, contacts) = (dropped.impact.wedged, dropped.placement.contacts);
        let rest = dropped.placement.rest;
        let centre = rest * stack.catalog.get(kind.model).centre;
        let away_m = (centre.truncate() - window.centre).abs().max_element();
        if away_m > 0.5 * settings.window_m {
            return &mut self.left;
        }
        match dropped.placement.state {
            PlacementState::Outside => &mut self.left,
            PlacementState::Overflow => &mut self.too_high,
            PlacementState::Unsettled => &mut self.unstable,
            PlacementState::Unstable
                if wedged > settings.wedge_limit && contacts >= settings.minimum_supports =>
            {
                &mut self.wedged
            }
            PlacementState::Unstable => &mut self.unstable,
            PlacementState::Kept => match dropped.shaken(kind).state {
                PlacementState::Kept if guide.is_straight(&guide.above(&rest)) => {
                    &mut self.straight
                }
                PlacementState::Kept => &mut self.hidden,
                _ => &mut self.unstable,
            },
        }
    }

    /// Whether a block stays somewhere in it.
    pub fn has_rest(&self) -> bool {
        self.straight + self.hidden > 0
    }
}
