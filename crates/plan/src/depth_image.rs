//! A window as a network sees it: how far the surface lies below the design, pixel by pixel, in block lengths.
//!
//! Where a block may not lie (beyond the boundary of the works) the image shows [`FORBIDDEN`], a surface a whole block
//! above the design. Depths are cut off there and at [`DEEPEST`], so that no image holds anything a network was not shown.

use crate::{Inside, Settings, stack::Stack};
use geom::{Vec2, Vec3};
use serde::{Deserialize, Serialize};

/// Depth of a place where nothing may lie, block lengths.
pub const FORBIDDEN: f32 = -1.0;
/// Largest depth an image tells, block lengths.
pub const DEEPEST: f32 = 2.0;

/// Which part of the surface an image shows, and how finely.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DepthView {
    /// Pixels along an edge.
    pub pixels: u32,
    /// Edge in block lengths.
    pub edge: f32,
}

impl DepthView {
    /// Where a pixel's centre lies from the middle of the image, block lengths.
    pub fn offset(&self, pixel: usize) -> f32 {
        ((pixel as f32 + 0.5) / self.pixels as f32 - 0.5) * self.edge
    }
}

/// The image about a place, rows from south to north. Beyond the map its border continues.
pub(crate) fn depth_image(
    stack: &Stack,
    settings: &Settings,
    centre: Vec2,
    view: &DepthView,
    block_length_m: f32,
) -> Vec<f32> {
    let surface = &stack.surface;
    let origin = window_origin(stack, centre);
    let last = surface.centre(surface.nx - 1, surface.ny - 1);
    let n = view.pixels as usize;
    let at = |i: usize, j: usize| {
        let x = (origin.x + view.offset(i) * block_length_m).clamp(surface.origin[0], last.x);
        let y = (origin.y + view.offset(j) * block_length_m).clamp(surface.origin[1], last.y);
        let forbidden = settings.inside == Inside::Whole && !stack.has_design(x, y);
        let depth = (origin.z - surface.sample_m(x, y).unwrap_or(origin.z)) / block_length_m;
        if forbidden { FORBIDDEN } else { depth.clamp(FORBIDDEN, DEEPEST) }
    };
    (0..n).flat_map(|j| (0..n).map(move |i| (i, j))).map(|(i, j)| at(i, j)).collect()
}

/// The middle of a window at design height: what proposed poses and training targets are told from.
pub(crate) fn window_origin(stack: &Stack, centre: Vec2) -> Vec3 {
    let level = stack.design_level_m(centre.x, centre.y);
    centre.extend(if level.is_finite() { level } else { 0.0 })
}
