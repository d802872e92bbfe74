//! Whether a block that has settled may stay: overflow check and constructability (METHOD §6 step 4).

use crate::{Settings, crane::Allowed, stack::Stack, trial::Trial};
use geom::{HeightMap, Pose, Vec3};
use scene::{ModelId, PlacementState};

/// A block this much of d_box under another is a leg leaning on it, not a block below it. Free choice: a leg of a tetrapod is 0.3
/// of its height thick.
const LEANING: f32 = 0.1;

/// What a block at rest does to the surface.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Impact {
    /// Void below the design it takes away.
    pub filled_m3: f32,
    /// Volume between the old surface and the new one.
    pub raised_m3: f32,
    /// Part of that above the design.
    pub protruding_m3: f32,
    /// Share of its footprint that lies under the old surface: it slipped under something.
    pub wedged: f32,
}

/// Measures a posed block against the surface before it came.
pub(crate) fn impact(stack: &Stack, model: ModelId, pose: &Pose) -> Impact {
    let block = stack.catalog.get(model);
    let surface = &stack.surface;
    let centre = *pose * block.centre;
    let rect = surface.rect_around(centre.x, centre.y, block.d_max_m + surface.cell_m);
    if rect.area() == 0 {
        return Impact::default();
    }
    let first = surface.centre(rect.x0, rect.y0);
    let (nx, ny) = (rect.x1 - rect.x0, rect.y1 - rect.y0);
    let part =
        HeightMap { origin: [first.x, first.y], cell_m: surface.cell_m, nx, ny, z_m: Vec::new() };
    let (top, under) = part.top_and_underside(&block.mesh, pose);
    let slack_m = LEANING * block.d_box_m;
    let (mut found, mut covered, mut under_cells) = (Impact::default(), 0, 0);
    for iy in 0..ny {
        for ix in 0..nx {
            let z = top.at(ix, iy);
            if z.is_nan() {
                continue;
            }
            let (before, design) = (
                surface.at(rect.x0 + ix, rect.y0 + iy),
                stack.design.at(rect.x0 + ix, rect.y0 + iy),
            );
            let after = before.max(z);
            covered += 1;
            under_cells += u32::from(under.at(ix, iy) < before - slack_m);
            found.raised_m3 += after - before;
            if design.is_finite() {
                found.filled_m3 += (design - before).max(0.0) - (design - after).max(0.0);
                found.protruding_m3 += (after - design).max(0.0) - (before - design).max(0.0);
            }
        }
    }
    let area = surface.cell_m * surface.cell_m;
    found.filled_m3 *= area;
    found.raised_m3 *= area;
    found.protruding_m3 *= area;
    found.wedged = under_cells as f32 / covered.max(1) as f32;
    found
}

/// How far a centroid stands above the design there; NaN outside the works.
pub(crate) fn above_design_m(stack: &Stack, centre: Vec3) -> f32 {
    centre.z - stack.design_level_m(centre.x, centre.y)
}

/// The verdict before the shake, the cheap questions first: [`PlacementState::Kept`] says that only the shake is left.
pub(crate) fn judge(
    stack: &Stack,
    settings: &Settings,
    allowed: &Allowed,
    model: ModelId,
    limit_m: f32,
    trial: &Trial,
) -> (PlacementState, Impact) {
    let block = stack.catalog.get(model);
    let centre = trial.rest * block.centre;
    let found = impact(stack, model, &trial.rest);
    let state = if trial.displaced_m > limit_m {
        PlacementState::Unstable
    } else if !stack.is_inside(model, &trial.rest, settings.inside)
        || !allowed.covers(centre.truncate())
        || !allowed.hook_high_enough(centre.z)
    {
        PlacementState::Outside
    } else if !trial.at_rest {
        PlacementState::Unsettled
    } else if !(above_design_m(stack, centre) <= settings.overflow_m) {
        PlacementState::Overflow
    } else if (trial.contacts < settings.minimum_supports && !trial.on_ground)
        || found.wedged > settings.wedge_limit
        || trial.pushed_m > settings.shake_limit_m
    {
        PlacementState::Unstable
    } else {
        PlacementState::Kept
    };
    (state, found)
}
