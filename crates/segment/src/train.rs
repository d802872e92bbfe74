//! Training: scenes stream in, tiles are cut, two replicas share a step, checkpoints resume.
//!
//! Scene `i` becomes available at a step fixed beforehand and leaves a fixed number of scenes later, so the run does not
//! depend on how fast scenes are made: same seed, same tiles, same losses to rounding.

mod checkpoint;
mod one_tile;
mod picture;
mod scenes;

use crate::SegmentError;
use crate::calibration::{Calibration, Evidence};
use crate::fpcc::Fpcc;
use crate::fpccv2::FpccV2;
use crate::loss::{LossConfig, LossReport};
use crate::model::SegmentModel;
use crate::network::{Learner, NetworkConfig};
use crate::tile::{LabelledScene, Targets};
use checkpoint::Checkpoint;
use geom::{Event, Observer, SeedTree};
use net::burn::grad_clipping::GradientClippingConfig;
use net::burn::optim::{AdamWConfig, ModuleOptimizer};
use net::burn::tensor::Device;
use net::replicas::sum_gradients;
use net::schedule::cosine_with_warmup;
use net::{Processor, Replicas};
use scene::ShapeSignature;
use scenes::Stream;
use serde::{Deserialize, Serialize};
use std::path::Path;

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
    match config.network {
        NetworkConfig::FpccV2(_) => teach::<FpccV2>(source, config, init, folder, seed, observer),
        NetworkConfig::Fpcc(_) => teach::<Fpcc>(source, config, init, folder, seed, observer),
    }
}

fn teach<L: Learner>(
    source: &dyn SceneSource,
    config: &TrainConfig,
    init: Option<&SegmentModel>,
    folder: &Path,
    seed: SeedTree,
    observer: &dyn Observer,
) -> Result<Trained, SegmentError> {
    let device = config.processor.device()?.autodiff();
    let replicas = Replicas::new(config.replicas).map_err(SegmentError::Threads)?;
    device.seed(seed.child("weights", 0).value());
    let network = L::fresh(&config.network, &device).expect("chosen by this very configuration");
    let mut network = network.materialize();
    if let Some(model) = init {
        network.take(model)?;
    }
    let checkpoint = Checkpoint::open(folder, config)?;
    let (mut network, mut optimiser, first) = checkpoint.resume(network, optimiser(config))?;
    let mut curve = checkpoint.curve(first)?;
    let mut validation = None;

    observer.event(Event::Started { stage: "train", total: config.steps });
    let network = std::thread::scope(|scope| -> Result<L, SegmentError> {
        let mut stream = Stream::new(scope, source, config, seed, first);
        let held_out = scenes::validation_tiles(source, config, seed)?;
        for step in first..config.steps {
            let visible = stream.scenes_at(step)?;
            // Copies with leaves of their own: tapes that share a parameter are one tape, and two threads walking it
            // backwards wait for each other for ever.
            let copies: Vec<L> =
                (0..replicas.len()).map(|_| network.clone().fork(&device)).collect();
            let results = replicas.run(|replica| {
                let tile = scenes::draw(&visible, config, seed, step, replica as u64);
                copies[replica].lesson(&tile, config, 1.0 / replicas.len() as f32, &device)
            });
            let (grads, reports): (Vec<_>, Vec<_>) = results.into_iter().unzip();
            let report = mean(&reports);
            if !report.total.is_finite() {
                return Err(SegmentError::Diverged { step, loss: report.total });
            }
            let rate = cosine_with_warmup(config.learning_rate, config.warmup, step, config.steps);
            let sum = sum_gradients(&network, grads);
            network = optimiser.step(rate, network, sum);
            let done = step + 1;
            let last = done == config.steps;
            if done % config.validation_steps == 0 || last {
                let judged = validate(&network, &held_out, config, &replicas);
                curve.write(done, rate, &report, Some(&judged))?;
                validation = Some(judged);
            } else if done % 20 == 0 {
                curve.write(done, rate, &report, None)?;
            }
            let stop = observer.cancelled();
            if done % config.checkpoint_steps == 0 || last || stop {
                checkpoint.save(&network, &optimiser, done, config)?;
            }
            observer.event(Event::Advanced { stage: "train", done });
            if stop {
                break;
            }
        }
        // A training that had no step left to do is judged all the same.
        if validation.is_none() {
            validation = Some(validate(&network, &held_out, config, &replicas));
        }
        Ok(network)
    })?;
    let validation = validation.unwrap_or_default();
    observer.event(Event::Finished { stage: "train" });
    let steps = checkpoint.steps_done()?;
    let mut model = SegmentModel::of_network(network.valid().into_network(), config, steps)?;
    if steps == config.steps && matches!(config.network, NetworkConfig::FpccV2(_)) {
        let calibration = calibrated(&model, source, config, seed, observer)?;
        model.description.calibrate(calibration);
        checkpoint.finish(&model)?;
    }
    Ok(Trained { model, steps, validation })
}

fn optimiser(config: &TrainConfig) -> ModuleOptimizer {
    AdamWConfig::new()
        .with_weight_decay(config.weight_decay)
        .with_epsilon(1e-8)
        .with_grad_clipping(Some(GradientClippingConfig::Norm(1.0)))
        .init()
}

/// How the votes are read best on held-out scenes, others than those of the validation.
fn calibrated(
    model: &SegmentModel,
    source: &dyn SceneSource,
    config: &TrainConfig,
    seed: SeedTree,
    observer: &dyn Observer,
) -> Result<Calibration, SegmentError> {
    let mut seen = Evidence::default();
    observer.event(Event::Started { stage: "calibrate", total: config.calibration_scenes });
    for number in 0..config.calibration_scenes {
        let index = config.validation_scenes + number;
        let failed = |message| SegmentError::Scene { index, message };
        let scene = source.scene(Split::Validation, index).map_err(failed)?;
        seen.add(model, &scene, seed.child("calibrate", index), &Muted(observer))?;
        observer.event(Event::Advanced { stage: "calibrate", done: number + 1 });
    }
    observer.event(Event::Finished { stage: "calibrate" });
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

/// Losses on held-out tiles, without gradients.
fn validate<L: Learner>(
    network: &L,
    tiles: &[Targets],
    config: &TrainConfig,
    replicas: &Replicas,
) -> LossReport {
    let network = network.valid().to_device(&Device::flex());
    let count = replicas.len();
    let parts = replicas.run(|replica| {
        let mine = tiles.iter().skip(replica).step_by(count);
        mine.map(|tile| network.judged(tile, config)).collect::<Vec<_>>()
    });
    mean(&parts.concat())
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
