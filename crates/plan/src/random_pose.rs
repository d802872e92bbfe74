//! Policy `random`: any attitude, anywhere about the window's centre, lowered to just above the pile (the thesis' baseline);
//! with many drops a window the best of them (the thesis' generate-and-test as a planner).

use crate::{
    Settings, attitudes, rounds, silhouette, site::TypeToPlace, stack::Stack, windows::Window,
};
use geom::{Pose, SeedTree, Vec3};
use rand::{Rng, RngExt};
use scene::{ModelId, Placement, PlacementState};

/// Height above first contact from which a block falls, in d_box. Free choice: far enough not to touch, near enough not to bounce.
const CLEARANCE: f32 = 0.05;

/// Poses drawn until one lies inside the boundary.
const DRAWS: usize = 8;

/// Drops into a window as often as the settings say; of what was tried at most one is kept.
pub(crate) fn placed(
    kind: &TypeToPlace,
    stack: &Stack,
    window: &Window,
    round: u32,
    seed: SeedTree,
) -> Vec<Placement> {
    let settings = &kind.settings;
    let mut rng = seed.rng();
    if settings.random.drops == 1 {
        let pose = pose(stack, settings, kind.model, window, &mut rng);
        return pose
            .map(|drop| rounds::attempt(kind, stack, &drop, settings.roam_m, round))
            .into_iter()
            .collect();
    }
    let mut best: Option<Placement> = None;
    let mut failed = Vec::new();
    for _ in 0..settings.random.drops {
        let Some(drop) = pose(stack, settings, kind.model, window, &mut rng) else { continue };
        let dropped = rounds::dropped(kind, stack, &drop, settings.displacement_limit_m, round);
        // One that could not win anyway need not be shaken.
        if best.as_ref().is_some_and(|b| dropped.impact.filled_m3 <= b.filled_m3) {
            continue;
        }
        let placement = dropped.shaken(kind);
        match placement.state {
            PlacementState::Kept => best = Some(placement),
            _ => failed.push(placement),
        }
    }
    best.map_or(failed, |placement| vec![placement])
}

/// A pose to let go from; `None` when none drawn lies inside the boundary.
pub(crate) fn pose(
    stack: &Stack,
    settings: &Settings,
    model: ModelId,
    window: &Window,
    rng: &mut impl Rng,
) -> Option<Pose> {
    let block = stack.catalog.get(model);
    let clearance_m = CLEARANCE * block.d_box_m;
    for _ in 0..DRAWS {
        let rotation = attitudes::random(rng);
        let mut jitter_m = || (2.0 * rng.random::<f32>() - 1.0) * settings.jitter_m;
        let (x, y) = (window.centre.x + jitter_m(), window.centre.y + jitter_m());
        let height_m = silhouette::lowered_height_m(&stack.surface, block, rotation, x, y);
        let pose = height_m
            .map(|z| silhouette::pose_at(block, rotation, Vec3::new(x, y, z + clearance_m)));
        // A crane lets nothing go outside.
        if let Some(pose) = pose.filter(|p| stack.is_inside(model, p, settings.inside)) {
            return Some(pose);
        }
    }
    None
}
