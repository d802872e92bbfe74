//! Training: windows turned at random, replicas share a batch, checkpoints resume.

use crate::evaluate::{Errors, errors};
use crate::image::{stored_view, turned};
use crate::loss::{LossReport, Target, loss};
use crate::network::{NetworkShape, PlacementNetwork};
use crate::samples::{Sample, SampleConfig};
use crate::{ModelDescription, PlacementError, PlacementModel};
use geom::{Observer, Quat, SeedTree};
use net::prelude::{Device, GradientsParams, Module};
use net::training::{Part, first_weights};
use net::{Checkpoint, Replicas, Schedule, Task, Training};
use rand::RngExt;
use scene::{BlockModel, ShapeSignature};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Everything that decides a training beside its piles and seed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TrainConfig {
    /// Network.
    pub network: NetworkShape,
    /// Data.
    pub samples: SampleConfig,
    /// Optimiser steps.
    pub steps: u64,
    /// Windows of a step.
    pub batch: usize,
    /// Threads that share a batch.
    pub replicas: usize,
    /// Good drops of a window that teach; the thesis: 1.
    pub targets: usize,
    /// A drop that fills this much less than the best teaches 1/e as much.
    pub tolerance: f32,
    /// Peak learning rate.
    pub learning_rate: f64,
    /// Steps of linear warm-up.
    pub warmup: u64,
    /// Weight decay of AdamW.
    pub weight_decay: f32,
    /// Steps between checkpoints.
    pub checkpoint_steps: u64,
    /// Steps between judgements on held-out windows.
    pub validation_steps: u64,
    /// Words for the model file: what it was trained on.
    pub name: String,
}

impl Default for TrainConfig {
    fn default() -> Self {
        Self {
            network: NetworkShape::default(),
            samples: SampleConfig::default(),
            steps: 4000,
            batch: 32,
            replicas: 2,
            targets: 16,
            tolerance: 0.05,
            learning_rate: 1e-3,
            warmup: 100,
            weight_decay: 1e-2,
            checkpoint_steps: 200,
            validation_steps: 200,
            name: String::new(),
        }
    }
}

/// A finished or stopped training.
#[derive(Clone, Debug)]
pub struct Trained {
    /// The network as it is now.
    pub model: PlacementModel,
    /// Steps done.
    pub steps: u64,
    /// Errors on the held-out windows.
    pub errors: Errors,
}

/// Trains in `folder`: `curve.csv`, `config.json`, `checkpoint/`, `model.safetensors`. A folder with a checkpoint is resumed.
/// Stops after a checkpoint when the observer is cancelled.
pub fn train(
    samples: &[Sample],
    held_out: &[Sample],
    block: &BlockModel,
    config: &TrainConfig,
    folder: &Path,
    seed: SeedTree,
    observer: &dyn Observer,
) -> Result<Trained, PlacementError> {
    config.check()?;
    if samples.is_empty() {
        return Err(PlacementError::NoSamples);
    }
    let device = Device::flex().autodiff();
    let network =
        first_weights(&device, seed, |device| PlacementNetwork::new(&config.network, device));
    // A training may go on for longer than first meant, with nothing else changed.
    let lasting = TrainConfig { steps: 0, ..config.clone() };
    let settings = serde_json::to_string_pretty(&lasting)
        .map_err(|e| PlacementError::Description(e.to_string()))?;
    let checkpoint = Checkpoint::open(folder, &settings)?;
    let schedule = config.schedule();
    let training: Training<'_, PlacementNetwork> =
        Training::begin::<PlacementError>(network, schedule, &checkpoint, device, observer)?;
    let windows = Windows { samples, held_out, block, config, seed };
    let outcome = training.run(&windows, |_| Ok(()))?;
    let model = windows.model_of(&outcome.network, outcome.steps);
    Ok(Trained { model, steps: outcome.steps, errors: outcome.judgement })
}

/// Windows with their good drops, for the training loop.
struct Windows<'a> {
    samples: &'a [Sample],
    held_out: &'a [Sample],
    block: &'a BlockModel,
    config: &'a TrainConfig,
    seed: SeedTree,
}

impl Windows<'_> {
    fn model_of(&self, network: &PlacementNetwork, steps: u64) -> PlacementModel {
        let description = ModelDescription {
            name: self.config.name.clone(),
            network: self.config.network,
            steps,
            block: ShapeSignature::of(self.block),
        };
        PlacementModel::new(description, network.valid())
    }
}

impl Task for Windows<'_> {
    type Network = PlacementNetwork;
    type Batch = ();
    type Report = LossReport;
    type Judgement = Errors;
    type Error = PlacementError;
    const HEADER: &'static str = "step,learning_rate,loss,pose,sureness,\
                                  held_out_rotation_deg,held_out_displacement,nearest_rotation_deg,nearest_displacement";

    fn gradients(
        &self,
        network: &PlacementNetwork,
        (): &(),
        part: &Part<'_>,
    ) -> (GradientsParams, LossReport) {
        let seed = self.seed.child("batch", part.step);
        let (images, targets) = draw(self.samples, self.config, seed, part.replica);
        let output = network.forward(images, &self.config.network, part.device);
        let (total, report) = loss(output, &targets, &self.block.symmetry, part.device);
        let tape = total.div_scalar(part.replicas as f32).backward();
        (GradientsParams::from_grads(tape, network), report)
    }

    fn mean(&self, parts: &[LossReport]) -> LossReport {
        mean(parts)
    }

    fn loss(&self, report: &LossReport) -> f32 {
        report.total
    }

    fn judge(&self, network: &PlacementNetwork, steps: u64, _: &Replicas) -> Errors {
        errors(&self.model_of(network, steps), self.held_out, &self.block.symmetry)
    }

    fn line(&self, step: u64, rate: f64, report: &LossReport, judged: Option<&Errors>) -> String {
        line(step, rate, report, judged)
    }

    fn model(&self, network: &PlacementNetwork, steps: u64) -> Result<Vec<u8>, PlacementError> {
        self.model_of(network, steps).to_bytes()
    }
}

/// The images of a replica's part of a batch and what they teach.
fn draw(
    samples: &[Sample],
    config: &TrainConfig,
    seed: SeedTree,
    replica: usize,
) -> (Vec<f32>, Vec<Target>) {
    let to = config.network.view;
    let from = stored_view(&to);
    let mut rng = seed.child("replica", replica as u64).rng();
    let part = (config.batch / config.replicas).max(1);
    let mut images = Vec::new();
    let mut targets = Vec::new();
    for _ in 0..part {
        let sample = &samples[rng.random_range(0..samples.len())];
        let turn_rad = rng.random::<f32>() * std::f32::consts::TAU;
        images.extend(turned(&sample.depth(), &from, &to, turn_rad));
        targets.push(target(sample, config, turn_rad));
    }
    (images, targets)
}

/// The good drops of a window turned with it, better ones weighing more.
fn target(sample: &Sample, config: &TrainConfig, turn_rad: f32) -> Target {
    let turn = Quat::from_rotation_z(turn_rad);
    let best = sample.good.first().map_or(0.0, |g| g.filled);
    let weight = |filled: f32| ((filled - best) / (config.tolerance * best.max(1e-3))).exp();
    let taught = &sample.good[..config.targets.min(sample.good.len())];
    let sum: f32 = taught.iter().map(|g| weight(g.filled)).sum();
    let poses = taught.iter().map(|g| (turn * g.centre, turn * g.rotation, weight(g.filled) / sum));
    Target { poses: poses.collect() }
}

fn mean(reports: &[LossReport]) -> LossReport {
    let n = reports.len().max(1) as f32;
    let of = |f: fn(&LossReport) -> f32| reports.iter().map(f).sum::<f32>() / n;
    LossReport { total: of(|r| r.total), pose: of(|r| r.pose), sureness: of(|r| r.sureness) }
}

fn line(step: u64, rate: f64, report: &LossReport, found: Option<&Errors>) -> String {
    let judged = found.map_or_else(
        || ",,,".to_owned(),
        |e| {
            format!(
                "{:.2},{:.4},{:.2},{:.4}",
                e.rotation_rad.to_degrees(),
                e.displacement,
                e.nearest_rotation_rad.to_degrees(),
                e.nearest_displacement
            )
        },
    );
    format!(
        "{step},{rate:.3e},{:.5},{:.5},{:.5},{judged}",
        report.total, report.pose, report.sureness
    )
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

    fn check(&self) -> Result<(), PlacementError> {
        let at_least = |name, value: f64, least: f64, allowed| {
            if value >= least {
                Ok(())
            } else {
                Err(PlacementError::Setting { name, value, allowed })
            }
        };
        self.network.check()?;
        at_least("steps", self.steps as f64, 1.0, "at least 1")?;
        at_least("batch", self.batch as f64, 1.0, "at least 1")?;
        at_least("replicas", self.replicas as f64, 1.0, "at least 1")?;
        at_least("targets", self.targets as f64, 1.0, "at least 1")?;
        at_least("tolerance", f64::from(self.tolerance), 1e-6, "above 0")?;
        at_least("learning_rate", self.learning_rate, 0.0, "not negative")?;
        at_least("checkpoint_steps", self.checkpoint_steps as f64, 1.0, "at least 1")?;
        at_least("validation_steps", self.validation_steps as f64, 1.0, "at least 1")
    }
}
