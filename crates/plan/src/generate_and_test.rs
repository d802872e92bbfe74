//! Training data for a placement network, by generate-and-test (dissertation §4.7.2–4.7.4).
//!
//! In: a background pile with a design above it. Out: for each window its depth image and, of many random drops,
//! those that stay where they were let go (sideways displacement within the limit) and leave the smallest deficit.
//! The best is the thesis' target; the runners-up are kept because there is rarely one right answer: see
//! [`WindowSample::best`].

use crate::{
    PlanConfig, PlanError, PlanInput, Policy, acceptance,
    depth_image::{DepthView, depth_image, window_origin},
    random_pose, site,
    trial::Drop,
    windows,
};
use geom::{Observer, Pose, SeedTree, Stage, Vec2};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// How much to generate.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct GenerateConfig {
    /// Random drops a window (the thesis: 1000–3000).
    pub drops: u32,
    /// Most windows, taken evenly from the largest deficit to the smallest; 0: all that lack the minimum volume.
    pub windows: u32,
    /// The depth image (the thesis: 512 pixels; more than a pixel a height-map cell shows nothing new).
    pub view: DepthView,
    /// How many of the best drops are kept.
    pub keep: u32,
}

impl Default for GenerateConfig {
    fn default() -> Self {
        Self { drops: 1000, windows: 0, view: DepthView { pixels: 32, edge: 1.5 }, keep: 16 }
    }
}

/// A drop that stayed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GoodDrop {
    /// Pose of the drop: the block's centre relative to the window's centre at design height, attitude symmetry-canonical.
    pub drop: Pose,
    /// Void it fills, m³: the larger, the smaller the remaining deficit V.
    pub filled_m3: f32,
    /// Sideways displacement while settling.
    pub displaced_m: f32,
}

/// One window: what the network sees and what it should answer.
#[derive(Clone, Debug, PartialEq)]
pub struct WindowSample {
    /// Centre of the window, local frame.
    pub centre: Vec2,
    /// Depth of the surface below the design, block lengths, rows from south to north; see [`DepthView`].
    pub depth: Vec<f32>,
    /// The best drops, best first; empty when none stayed.
    pub best: Vec<GoodDrop>,
    /// Drops made.
    pub drops: u32,
}

/// Slides over the background and drops blocks in every window. The policy of `config` does not matter.
pub fn generate_and_test(
    input: &PlanInput,
    config: &PlanConfig,
    generate: &GenerateConfig,
    seed: SeedTree,
    observer: &dyn Observer,
) -> Result<Vec<WindowSample>, PlanError> {
    let config = PlanConfig { policy: Policy::Random, ..config.clone() };
    let site = site::prepare(input, &config, seed, observer)?;
    let stack = site.stack(input);
    let kind = site.main();
    let settings = &kind.settings;
    let block = stack.catalog.get(kind.model);
    let mut found = windows::detect(&stack.surface, &stack.design, settings, |_| true);
    windows::thin(&mut found, generate.windows as usize);
    observer.event(geom::Event::Started { stage: Stage::Generate, total: found.len() as u64 });
    let done = std::sync::atomic::AtomicU64::new(0);
    let sample = |(number, window): (usize, &windows::Window)| {
        if observer.cancelled() {
            return Err(PlanError::Cancelled);
        }
        let mut rng = seed.child("window", number as u64).rng();
        let origin = window_origin(&stack, window.centre);
        let mut best: Vec<GoodDrop> = Vec::new();
        for _ in 0..generate.drops {
            let Some(drop) = random_pose::pose(&stack, settings, kind.model, window, &mut rng)
            else {
                continue;
            };
            let trial = Drop::new(&stack, settings, kind.model, &drop)
                .settle(settings.displacement_limit_m, &|_| false);
            if !trial.at_rest || trial.displaced_m > settings.displacement_limit_m {
                continue;
            }
            let filled_m3 = acceptance::impact(&stack, kind.model, &trial.rest).filled_m3;
            let canonical = block.symmetry.canonical(&drop);
            let centre = canonical * block.centre - origin;
            let drop = Pose::from_parts(centre, canonical.rotation);
            best.push(GoodDrop { drop, filled_m3, displaced_m: trial.displaced_m });
        }
        best.sort_by(|a, b| b.filled_m3.total_cmp(&a.filled_m3));
        best.truncate(generate.keep as usize);
        let done = done.fetch_add(1, std::sync::atomic::Ordering::Relaxed) + 1;
        observer.event(geom::Event::Advanced { stage: Stage::Generate, done });
        let depth = depth_image(&stack, settings, window.centre, &generate.view, block.d_box_m);
        Ok(WindowSample { centre: window.centre, depth, best, drops: generate.drops })
    };
    let samples = found.par_iter().enumerate().map(sample).collect();
    observer.event(geom::Event::Finished { stage: Stage::Generate });
    samples
}
