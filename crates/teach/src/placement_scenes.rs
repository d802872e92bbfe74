//! What the placement network learns from: piles of a recipe with a level design above them, made when they are asked for.

use geom::{Bounds, Observer, SeedTree, Vec3};
use placement::{Background, PlacementError, Sample, Split, TrainConfig, make_samples};
use plan::PlanConfig;
use scene::{BlockModel, Catalog, DesignSurface, Scene};
use std::path::Path;
use synth::Recipe;

/// A recipe with its blocks and the one that is placed on its piles.
#[derive(Clone, Copy, Debug)]
pub struct PlacementScenes<'a> {
    /// Recipe of the background piles; its sensor is not used.
    pub recipe: &'a Recipe,
    /// Its blocks.
    pub catalog: &'a Catalog,
    /// The block to place.
    pub block: &'a BlockModel,
}

impl PlacementScenes<'_> {
    /// Windows to learn from and windows to judge by; what was made is kept in `folder`.
    pub fn samples(
        &self,
        config: &TrainConfig,
        folder: &Path,
        seed: SeedTree,
        observer: &dyn Observer,
    ) -> Result<[Vec<Sample>; 2], PlacementError> {
        let source = |split: Split, index: u64| self.background(split, index, seed);
        let planning = PlanConfig { block: Some(self.block.name.clone()), ..PlanConfig::default() };
        let make = |split| {
            let (view, amount) = (&config.network.view, &config.samples);
            let drops = seed.child("drops", 0);
            make_samples(
                &source,
                self.catalog,
                &planning,
                view,
                amount,
                split,
                folder,
                drops,
                observer,
            )
        };
        Ok([make(Split::Train)?, make(Split::HeldOut)?])
    }

    /// A pile with a level design that lies a third to one and a third blocks above the middle of its centres.
    pub fn background(
        &self,
        split: Split,
        index: u64,
        seed: SeedTree,
    ) -> Result<Background, String> {
        let seed = seed.child(if split == Split::Train { "train" } else { "held out" }, index);
        let scene = synth::scene(self.recipe, self.catalog, seed).map_err(|e| e.to_string())?.scene;
        let draw = (seed.child("design", 0).value() >> 40) as f32 / (1_u64 << 24) as f32;
        let design = level_above(&scene, self.catalog, self.block.d_box_m * (0.33 + draw));
        Ok(Background { design, scene })
    }
}

fn level_above(scene: &Scene, catalog: &Catalog, depth_m: f32) -> DesignSurface {
    let centres: Vec<Vec3> =
        scene.blocks.iter().map(|b| b.site_from_block * catalog.get(b.model).centre).collect();
    let bounds = Bounds::of(centres.iter().copied()).grown(0.5 * catalog.d_max_m());
    let mut heights: Vec<f32> = centres.iter().map(|c| c.z).collect();
    heights.sort_by(f32::total_cmp);
    let middle = heights[heights.len() / 2];
    let (low, high) = (bounds.min.as_dvec3(), bounds.max.as_dvec3());
    let boundary = vec![[low.x, low.y], [high.x, low.y], [high.x, high.y], [low.x, high.y]];
    DesignSurface::Level { level_m: f64::from(middle + depth_m), boundary }
}
