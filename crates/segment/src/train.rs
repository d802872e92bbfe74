//! Training: scenes stream in, tiles are cut, two replicas share a step, checkpoints resume.
//!
//! Scene `i` becomes available at a step fixed beforehand and leaves a fixed number of scenes later, so the run does not
//! depend on how fast scenes are made: same seed, same tiles, same losses to rounding.

mod folder;
pub(crate) mod one_tile;
mod picture;
mod scenes;

use crate::SegmentError;
use crate::calibration::{Calibration, CalibrationData};
use crate::loss::{LossConfig, LossReport};
use crate::model::SegmentModel;
use crate::network::{Design, Inference, NetworkConfig, Weighted};
use crate::tile::{LabelledScene, Targets};
use folder::Folder;
use geom::{Event, Observer, SeedTree, Stage};
use net::prelude::{Device, GradientsParams, Module};
use net::training::{Part, first_weights};
use net::{Checkpoint, Processor, Replicas, Schedule, Task, Training};
use scene::ShapeSignature;
use scenes::{Stream, Variants};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

pub use one_tile::train_on_tile;

/// Everything that decides a training run beside its scenes and seed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TrainConfig {
    /// Network.
    pub network: NetworkConfig,
    /// Loss.
    pub loss: LossConfig,
    /// Optimiser steps.
    pub steps: u64,
    /// Tiles of a step: one a replica.
    pub replicas: usize,
    /// Points of a tile.
    pub tile_points: usize,
    /// Edge of a thinning cell, d_max.
    pub cell: f32,
    /// Smallest part of the points kept before thinning.
    pub sparsest: f32,
    /// Points nearer than this to the cut are not taught, d_max.
    pub margin: f32,
    /// Mirror half of the tiles; off for shapes that are not their own mirror image.
    pub mirror: bool,
    /// Peak learning rate.
    pub learning_rate: f64,
    /// Steps of linear warm-up.
    pub warmup: u64,
    /// Weight decay of AdamW.
    pub weight_decay: f32,
    /// Scenes in memory.
    pub scenes_kept: u64,
    /// Scenes before the first step.
    pub scenes_first: u64,
    /// Steps until the next scene comes.
    pub steps_per_scene: u64,
    /// Thinnings of a scene.
    pub variants: u64,
    /// Steps between checkpoints.
    pub checkpoint_steps: u64,
    /// Steps between validations, on scenes never trained on.
    pub validation_steps: u64,
    /// Validation scenes.
    pub validation_scenes: u64,
    /// Scenes the confidence is fitted to once the last step is done.
    pub calibration_scenes: u64,
    /// Words for the model file: what it was trained on.
    pub name: String,
    /// Shapes of the scenes, for the model file; empty: many.
    pub shapes: Vec<ShapeSignature>,
    /// Where it computes; not part of the recipe.
    #[serde(skip)]
    pub processor: Processor,
}

impl Default for TrainConfig {
    fn default() -> Self {
        Self {
            network: NetworkConfig::default(),
            loss: LossConfig::default(),
            steps: 20_000,
            replicas: 2,
            tile_points: 2048,
            cell: 1.0 / 7.0,
            sparsest: 0.35,
            margin: 0.4,
            mirror: true,
            learning_rate: 2e-3,
            warmup: 200,
            weight_decay: 1e-2,
            scenes_kept: 120,
            scenes_first: 12,
            steps_per_scene: 20,
            variants: 2,
            checkpoint_steps: 500,
            validation_steps: 500,
            validation_scenes: 6,
            calibration_scenes: 24,
            name: String::new(),
            shapes: Vec::new(),
            processor: Processor::Cpu,
        }
    }
}

/// Which scenes the source is asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Split {
    /// Trained on.
    Train,
    /// Never trained on.
    Validation,
}

/// Where scenes come from; called from one other thread while training runs.
pub trait SceneSource: Sync {
    /// Scene `index` of a split; the same every time.
    fn scene(&self, split: Split, index: u64) -> Result<LabelledScene, String>;
}

impl<F: Fn(Split, u64) -> Result<LabelledScene, String> + Sync> SceneSource for F {
    fn scene(&self, split: Split, index: u64) -> Result<LabelledScene, String> {
        self(split, index)
    }
}

/// A finished or stopped training.
#[derive(Clone, Debug)]
pub struct Trained {
    /// The network as it is now.
    pub model: SegmentModel,
    /// Steps done.
    pub steps: u64,
    /// The last validation.
    pub validation: LossReport,
}

/// Trains in `folder`: `curve.csv`, `config.json`, `checkpoint/`, `model.safetensors`. A folder with a checkpoint is
/// resumed; `init` gives the first weights of a new run. Stops after a checkpoint when the observer is cancelled.
pub fn train(
    source: &dyn SceneSource,
    config: &TrainConfig,
    init: Option<&SegmentModel>,
    folder: &Path,
    seed: SeedTree,
    observer: &dyn Observer,
) -> Result<Trained, SegmentError> {
    config.check()?;
    let run = TrainingRun { source, config, init, folder, seed, observer };
    config.network.design().train(&run)
}

/// What a training is given.
pub(crate) struct TrainingRun<'a> {
    source: &'a dyn SceneSource,
    config: &'a TrainConfig,
    init: Option<&'a SegmentModel>,
    folder: &'a Path,
    seed: SeedTree,
    observer: &'a dyn Observer,
}

/// Trains a network of this design.
pub(crate) fn train_design<D: Design>(
    design: &D,
    run: &TrainingRun<'_>,
) -> Result<Trained, SegmentError> {
    let TrainingRun { source, config, init, seed, observer, .. } = *run;
    let device = config.processor.device()?.autodiff();
    let mut weights = first_weights(&device, seed, |device| design.fresh(device));
    if let Some(model) = init {
        take(&mut weights, model)?;
    }
    let folder = Folder::open(run.folder, config)?;
    let training: Training<'_, D::Weights> = Training::begin::<SegmentError>(
        weights,
        config.schedule(),
        folder.checkpoint(),
        device,
        observer,
    )?;
    let outcome = std::thread::scope(|scope| {
        let mut stream = Stream::new(scope, source, config, seed, training.first());
        let held_out = scenes::validation_tiles(source, config, seed)?;
        let tiles = TrainingTiles { design, config, seed, held_out, folder: &folder };
        training.run(&tiles, |step| stream.scenes_at(step))
    })?;
    let mut model = model_of(design, &outcome.network, config, outcome.steps);
    let votes = matches!(model.network.inference(), Inference::Votes(_));
    if outcome.steps == config.steps && votes {
        let calibration = calibrated(&model, source, config, seed, observer)?;
        model.description.calibrate(calibration);
        folder.finish(&model)?;
    }
    Ok(Trained { model, steps: outcome.steps, validation: outcome.judgement })
}

/// The weights of a model of the same architecture.
fn take<N: Module>(weights: &mut N, model: &SegmentModel) -> Result<(), SegmentError> {
    Ok(net::weights::from_bytes(weights, &model.network.to_bytes(&BTreeMap::new())?)?)
}

/// A network in training as a model.
fn model_of<D: Design>(
    design: &D,
    network: &D::Weights,
    config: &TrainConfig,
    steps: u64,
) -> SegmentModel {
    let weights = network.valid().to_device(&Device::flex());
    SegmentModel::of_network(Arc::new(Weighted { design: design.clone(), weights }), config, steps)
}

/// Tiles of scenes, for the training loop.
struct TrainingTiles<'a, D> {
    design: &'a D,
    config: &'a TrainConfig,
    seed: SeedTree,
    held_out: Vec<Targets>,
    folder: &'a Folder,
}

impl<D: Design> Task for TrainingTiles<'_, D> {
    type Network = D::Weights;
    type Batch = Vec<Variants>;
    type Report = LossReport;
    type Judgement = LossReport;
    type Error = SegmentError;
    const HEADER: &'static str = folder::HEADER;

    fn gradients(
        &self,
        network: &D::Weights,
        visible: &Vec<Variants>,
        part: &Part<'_>,
    ) -> (GradientsParams, LossReport) {
        let tile = scenes::draw(visible, self.config, self.seed, part.step, part.replica as u64);
        let share = 1.0 / part.replicas as f32;
        self.design.gradients(network, &tile, self.config, share, part.device)
    }

    fn mean(&self, parts: &[LossReport]) -> LossReport {
        mean(parts)
    }

    fn loss(&self, report: &LossReport) -> f32 {
        report.total
    }

    fn judge(&self, network: &D::Weights, _: u64, replicas: &Replicas) -> LossReport {
        let network = network.valid().to_device(&Device::flex());
        let count = replicas.len();
        let parts = replicas.run(|replica| {
            let mine = self.held_out.iter().skip(replica).step_by(count);
            mine.map(|tile| self.design.loss(&network, tile, self.config)).collect::<Vec<_>>()
        });
        mean(&parts.concat())
    }

    fn line(
        &self,
        step: u64,
        rate: f64,
        report: &LossReport,
        judged: Option<&LossReport>,
    ) -> String {
        folder::line(step, rate, report, judged)
    }

    fn model(&self, network: &D::Weights, steps: u64) -> Result<Vec<u8>, SegmentError> {
        model_of(self.design, network, self.config, steps).to_bytes()
    }

    fn saved(&self, _: &Checkpoint) -> Result<(), SegmentError> {
        self.folder.draw_curve()
    }
}

/// How the votes are read best on held-out scenes, others than those of the validation.
fn calibrated(
    model: &SegmentModel,
    source: &dyn SceneSource,
    config: &TrainConfig,
    seed: SeedTree,
    observer: &dyn Observer,
) -> Result<Calibration, SegmentError> {
    let mut seen = CalibrationData::default();
    observer.event(Event::Started { stage: Stage::Calibrate, total: config.calibration_scenes });
    for number in 0..config.calibration_scenes {
        let index = config.validation_scenes + number;
        let failed = |message| SegmentError::Scene { index, message };
        let scene = source.scene(Split::Validation, index).map_err(failed)?;
        seen.add(model, &scene, seed.child("calibrate", index), &Muted(observer))?;
        observer.event(Event::Advanced { stage: Stage::Calibrate, done: number + 1 });
    }
    observer.event(Event::Finished { stage: Stage::Calibrate });
    Ok(seen.fit().unwrap_or_default())
}

/// Hears nothing of the stages within, but whether to stop.
struct Muted<'a>(&'a dyn Observer);

impl Observer for Muted<'_> {
    fn event(&self, _: Event) {}

    fn cancelled(&self) -> bool {
        self.0.cancelled()
    }
}

fn mean(reports: &[LossReport]) -> LossReport {
    let n = reports.len().max(1) as f32;
    let of = |f: fn(&LossReport) -> f32| reports.iter().map(f).sum::<f32>() / n;
    LossReport {
        total: of(|r| r.total),
        pair: of(|r| r.pair),
        centre: of(|r| r.centre),
        offset: of(|r| r.offset),
        block: of(|r| r.block),
    }
}

impl TrainConfig {
    fn schedule(&self) -> Schedule {
        Schedule {
            steps: self.steps,
            learning_rate: self.learning_rate,
            warmup: self.warmup,
            weight_decay: self.weight_decay,
            replicas: self.replicas,
            checkpoint_steps: self.checkpoint_steps,
            validation_steps: self.validation_steps,
        }
    }

    fn check(&self) -> Result<(), SegmentError> {
        let at_least = |name, value: f64, least: f64, allowed| {
            if value >= least {
                Ok(())
            } else {
                Err(SegmentError::Setting { name, value, allowed })
            }
        };
        at_least("steps", self.steps as f64, 1.0, "at least 1")?;
        at_least("replicas", self.replicas as f64, 1.0, "at least 1")?;
        at_least("tile_points", self.tile_points as f64, 64.0, "at least 64")?;
        at_least("cell", f64::from(self.cell), 1e-3, "at least 0.001 d_max")?;
        at_least("sparsest", f64::from(self.sparsest), 1e-3, "0.001 to 1")?;
        at_least("scenes_kept", self.scenes_kept as f64, 1.0, "at least 1")?;
        at_least("scenes_first", self.scenes_first as f64, 1.0, "at least 1")?;
        at_least("steps_per_scene", self.steps_per_scene as f64, 1.0, "at least 1")?;
        at_least("variants", self.variants as f64, 1.0, "at least 1")?;
        at_least("checkpoint_steps", self.checkpoint_steps as f64, 1.0, "at least 1")?;
        at_least("validation_steps", self.validation_steps as f64, 1.0, "at least 1")?;
        at_least("validation_scenes", self.validation_scenes as f64, 1.0, "at least 1")
    }
}
