//! The scenes a step may draw from, made ahead on one thread.

use super::{SceneSource, Split, TrainConfig};
use crate::SegmentError;
use crate::tile::{Targets, ThinScene};
use geom::SeedTree;
use rand::RngExt;
use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, sync_channel};
use std::thread::Scope;

/// A scene thinned in a few ways.
pub(super) type Variants = Arc<Vec<ThinScene>>;

/// Scenes in order, from a thread that runs a little ahead.
pub(super) struct Stream<'a> {
    config: &'a TrainConfig,
    next: Receiver<Result<Variants, SegmentError>>,
    seen: VecDeque<Variants>,
    /// Number of the scene after the last of `seen`.
    end: u64,
}

/// Fewest points a thinned scene must have to be trained on.
const FEWEST: usize = 64;
/// Scenes made ahead.
const AHEAD: usize = 4;

impl<'a> Stream<'a> {
    pub(super) fn new<'scope>(
        scope: &'scope Scope<'scope, '_>,
        source: &'a dyn SceneSource,
        config: &'a TrainConfig,
        seed: SeedTree,
        first_step: u64,
    ) -> Self
    where
        'a: 'scope,
    {
        let (send, next) = sync_channel(AHEAD);
        let start = available(config, first_step).saturating_sub(config.scenes_kept);
        scope.spawn(move || {
            let mut index = start;
            // Ends when the receiver is gone.
            while send.send(prepare(source, config, seed, Split::Train, index)).is_ok() {
                index += 1;
            }
        });
        Self { config, next, seen: VecDeque::new(), end: start }
    }

    /// The scenes that step may use; waits for those not made yet.
    pub(super) fn scenes_at(&mut self, step: u64) -> Result<Vec<Variants>, SegmentError> {
        let wanted = available(self.config, step);
        while self.end < wanted {
            let scene = self.next.recv().map_err(|_| SegmentError::Cancelled)??;
            self.seen.push_back(scene);
            self.end += 1;
            while self.seen.len() as u64 > self.config.scenes_kept {
                self.seen.pop_front();
            }
        }
        Ok(self.seen.iter().cloned().collect())
    }
}

fn available(config: &TrainConfig, step: u64) -> u64 {
    config.scenes_first + step / config.steps_per_scene
}

fn prepare(
    source: &dyn SceneSource,
    config: &TrainConfig,
    seed: SeedTree,
    split: Split,
    index: u64,
) -> Result<Variants, SegmentError> {
    let failed = |message| SegmentError::Scene { index, message };
    let scene = source.scene(split, index).map_err(failed)?;
    let node = seed.child(if split == Split::Train { "thin" } else { "thin held out" }, index);
    let variants: Vec<ThinScene> = (0..config.variants)
        .map(|v| ThinScene::new(&scene, config.cell, config.sparsest, node.child("variant", v)))
        .collect();
    match variants.iter().find(|v| v.len() < FEWEST) {
        Some(v) => Err(failed(format!(
            "only {} points are left after thinning, {FEWEST} are needed",
            v.len()
        ))),
        None => Ok(Arc::new(variants)),
    }
}

/// The tile of a step and replica.
pub(super) fn draw(
    scenes: &[Variants],
    config: &TrainConfig,
    seed: SeedTree,
    step: u64,
    replica: u64,
) -> Targets {
    let node = seed.child("tile", step).child("replica", replica);
    let mut rng = node.rng();
    let variants = &scenes[rng.random_range(0..scenes.len())];
    let variant = &variants[rng.random_range(0..variants.len())];
    cut(variant, config, config.mirror, node.child("cut", 0))
}

/// A tile as the network wants it.
fn cut(scene: &ThinScene, config: &TrainConfig, mirror: bool, seed: SeedTree) -> Targets {
    config.network.design().cut(scene, config, mirror, seed)
}

/// Two tiles of every validation scene's thinning.
pub(super) fn validation_tiles(
    source: &dyn SceneSource,
    config: &TrainConfig,
    seed: SeedTree,
) -> Result<Vec<Targets>, SegmentError> {
    let mut tiles = Vec::new();
    for index in 0..config.validation_scenes {
        let variants = prepare(source, config, seed, Split::Validation, index)?;
        for (v, variant) in variants.iter().enumerate() {
            let node = seed.child("held out", index).child("variant", v as u64);
            tiles.push(cut(variant, config, false, node));
        }
    }
    Ok(tiles)
}
