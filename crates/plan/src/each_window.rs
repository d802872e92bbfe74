//! What a policy makes of each window of the pile as it is, every window by itself: to judge a choice of poses against
//! generate-and-test in the same windows. Planning never needs it.

use crate::{
    PlanConfig, PlanError, PlanInput, rounds, site,
    stack::Stack,
    windows::{self, Window, cell_deficit_m3},
};
use geom::{Observer, SeedTree, Vec2};
use rayon::prelude::*;
use scene::{Placement, PlacementState};

/// One window.
#[derive(Clone, Debug)]
pub struct WindowAnswer {
    /// Centre of the window, local frame.
    pub centre: Vec2,
    /// The block it would get; `None` when all that was tried was removed.
    pub kept: Option<Placement>,
}

/// The answers to `most` windows (0: all), those of [`generate_and_test`](crate::generate_and_test()) with as many.
pub fn each_window(
    input: &PlanInput,
    config: &PlanConfig,
    most: u32,
    seed: SeedTree,
    observer: &dyn Observer,
) -> Result<Vec<WindowAnswer>, PlanError> {
    let site = site::prepare(input, config, seed, observer)?;
    let stack = site.stack(input);
    let mut found = windows::detect(&stack.surface, &stack.design, &site.main().settings, |_| true);
    windows::thin(&mut found, most as usize);
    let answer = |(number, window): (usize, &windows::Window)| {
        if observer.cancelled() {
            return Err(PlanError::Cancelled);
        }
        let tried =
            rounds::serve_type(site.main(), &stack, window, 1, seed.child("window", number as u64));
        let kept = tried.into_iter().find(|p| p.state == PlacementState::Kept);
        Ok(WindowAnswer { centre: window.centre, kept })
    };
    found.par_iter().enumerate().map(answer).collect()
}

/// The window about a place.
pub(crate) fn window_at(stack: &Stack, centre: Vec2, window_m: f32) -> Window {
    let cells = stack.surface.rect_around(centre.x, centre.y, 0.5 * window_m);
    let row = |iy: usize| (cells.x0..cells.x1).map(move |ix| iy * stack.surface.nx + ix);
    let deficit_m3 = (cells.y0..cells.y1)
        .flat_map(row)
        .map(|cell| cell_deficit_m3(&stack.surface, &stack.design, cell))
        .sum();
    Window { cells, centre, deficit_m3 }
}
