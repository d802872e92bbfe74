//! Policy `network`: a network proposes poses from the window's depth image, physics verifies the best few (METHOD §6).
//!
//! The planner knows no network, only [`Proposer`]. A proposal is an attitude and a place; how deep the block gets follows
//! exactly from the height map, and so does the score by which proposals are ranked, the one policy `search` uses.

use crate::{
    Settings,
    depth_image::{DepthView, depth_image},
    search::{self, Candidate, Places},
    silhouette::Silhouette,
    stack::Stack,
    windows::Window,
};
use geom::{Quat, Vec2};
use scene::ModelId;

/// A pose to try.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Proposal {
    /// Centre of mass from the middle of the window, block lengths.
    pub centre: Vec2,
    /// Attitude of the block.
    pub rotation: Quat,
}

/// Whatever proposes poses for a window.
pub trait Proposer: Sync {
    /// The image it wants.
    fn view(&self) -> DepthView;
    /// Proposals for a depth image, the surest first. It may be looked at turned about the vertical, by `turn_rad` first.
    fn propose(&self, depth: &[f32], turn_rad: f32) -> Vec<Proposal>;
}

/// The best proposed poses of a window, best first, all different.
pub(crate) fn candidates(
    stack: &Stack,
    settings: &Settings,
    model: ModelId,
    (proposer, turn_rad): (&dyn Proposer, f32),
    window: &Window,
) -> Vec<Candidate> {
    let block = stack.catalog.get(model);
    let image = depth_image(stack, settings, window.centre, &proposer.view(), block.d_box_m);
    let proposals = proposer.propose(&image, turn_rad);
    let reach = search::reach_cells(settings);
    let nudge = settings.network.nudge_cells as usize;
    let mut silhouettes = Vec::new();
    let mut places = Vec::new();
    for proposal in proposals.into_iter().take(settings.network.proposals as usize) {
        let cell = |v: f32| (v * block.d_box_m / settings.cell_m).round() + reach as f32;
        let inside = |v: f32| v.clamp(0.0, 2.0 * reach as f32) as usize;
        let (px, py) = (inside(cell(proposal.centre.x)), inside(cell(proposal.centre.y)));
        let about = |p: usize| p.saturating_sub(nudge)..=(p + nudge).min(2 * reach);
        places.push(Places {
            x: about(px),
            y: about(py),
            step: settings.search.step_cells as usize,
        });
        silhouettes.push(Silhouette::new(block, proposal.rotation, settings.cell_m));
    }
    let verify = settings.network.verify as usize;
    search::candidates(stack, settings, model, &silhouettes, |a| places[a].clone(), verify, window)
}
