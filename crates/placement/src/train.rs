//! Training: windows turned at random, replicas share a batch, checkpoints resume.

use crate::evaluate::{Errors, errors};
use crate::image::{stored_view, turned};
use crate::loss::{Lesson, LossReport, loss};
use crate::network::{NetworkShape, PlacementNetwork};
use crate::samples::{Sample, SampleConfig};
use crate::{ModelDescription, PlacementError, PlacementModel};
use geom::{Event, Observer, Quat, SeedTree};
use net::burn::grad_clipping::GradientClippingConfig;
use net::burn::module::Module;
use net::burn::optim::{AdamWConfig, GradientsParams};
use net::burn::tensor::Device;
use net::replicas::sum_gradients;
use net::schedule::cosine_with_warmup;
use net::{Checkpoint, Replicas};
use rand::RngExt;
use scene::{BlockModel, ShapeSignature, SymmetryGroup};
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

const HEADER: &str = "step,learning_rate,loss,pose,sureness,\
                      held_out_rotation_deg,held_out_displacement,nearest_rotation_deg,nearest_displacement";

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
    let replicas = Replicas::new(config.replicas).map_err(PlacementError::Threads)?;
    let optimiser = AdamWConfig::new()
        .with_weight_decay(config.weight_decay)
        .with_epsilon(1e-8)
        .with_grad_clipping(Some(GradientClippingConfig::Norm(1.0)))
        .init();
    device.seed(seed.child("weights", 0).value());
    let network = PlacementNetwork::new(&config.network, &device).materialize();
    // A training may go on for longer than first meant, with nothing else changed.
    let lasting = TrainConfig { steps: 0, ..config.clone() };
    let settings = serde_json::to_string_pretty(&lasting)
        .map_err(|e| PlacementError::Description(e.to_string()))?;
    let checkpoint = Checkpoint::open(folder, &settings)?;
    let (mut network, mut optimiser, first) = checkpoint.resume(network, optimiser)?;
    let mut curve = checkpoint.curve(HEADER, first)?;
    let described = |network: &PlacementNetwork, steps: u64| {
        let description = ModelDescription {
            name: config.name.clone(),
            network: config.network,
            steps,
            block: ShapeSignature::of(block),
        };
        PlacementModel::new(description, network.valid())
    };
    observer.event(Event::Started { stage: "train", total: config.steps });
    let mut done = first;
    for step in first..config.steps {
        // Copies with leaves of their own: tapes that share a parameter are one tape, and two threads walking it
        // backwards wait for each other for ever.
        let copies: Vec<PlacementNetwork> =
            (0..replicas.len()).map(|_| network.clone().fork(&device)).collect();
        let results = replicas.run(|replica| {
            let drawn = draw(samples, config, seed.child("batch", step), replica);
            gradients(&copies[replica], drawn, block, config, replicas.len(), &device)
        });
        let (parts, reports): (Vec<_>, Vec<_>) = results.into_iter().unzip();
        let report = mean(&reports);
        if !report.total.is_finite() {
            return Err(PlacementError::Diverged { step, loss: report.total });
        }
        let rate = cosine_with_warmup(config.learning_rate, config.warmup, step, config.steps);
        let sum = sum_gradients(&network, parts);
        network = optimiser.step(rate, network, sum);
        done = step + 1;
        let last = done == config.steps;
        let judged = done % config.validation_steps == 0 || last;
        if judged || done % 20 == 0 {
            let found =
                judged.then(|| errors(&described(&network, done), held_out, &block.symmetry));
            curve.write(&line(done, rate, &report, found.as_ref()))?;
        }
        let stop = observer.cancelled();
        if done % config.checkpoint_steps == 0 || last || stop {
            checkpoint.save(&network, &optimiser, done, &described(&network, done).to_bytes()?)?;
        }
        observer.event(Event::Advanced { stage: "train", done });
        if stop {
            break;
        }
    }
    observer.event(Event::Finished { stage: "train" });
    let model = described(&network, done);
    let errors = errors(&model, held_out, &block.symmetry);
    Ok(Trained { model, steps: done, errors })
}

/// The images of a replica's part of a batch and what they teach.
fn draw(
    samples: &[Sample],
    config: &TrainConfig,
    seed: SeedTree,
    replica: usize,
) -> (Vec<f32>, Vec<Lesson>) {
    let to = config.network.view;
    let from = stored_view(&to);
    let mut rng = seed.child("replica", replica as u64).rng();
    let part = (config.batch / config.replicas).max(1);
    let mut images = Vec::new();
    let mut lessons = Vec::new();
    for _ in 0..part {
        let sample = &samples[rng.random_range(0..samples.len())];
        let turn_rad = rng.random::<f32>() * std::f32::consts::TAU;
        images.extend(turned(&sample.depth(), &from, &to, turn_rad));
        lessons.push(lesson(sample, config, turn_rad));
    }
    (images, lessons)
}

/// The good drops of a window turned with it, better ones weighing more.
fn lesson(sample: &Sample, config: &TrainConfig, turn_rad: f32) -> Lesson {
    let turn = Quat::from_rotation_z(turn_rad);
    let best = sample.good.first().map_or(0.0, |g| g.filled);
    let weight = |filled: f32| ((filled - best) / (config.tolerance * best.max(1e-3))).exp();
    let taught = &sample.good[..config.targets.min(sample.good.len())];
    let sum: f32 = taught.iter().map(|g| weight(g.filled)).sum();
    let poses = taught.iter().map(|g| (turn * g.centre, turn * g.rotation, weight(g.filled) / sum));
    Lesson { poses: poses.collect() }
}

fn gradients(
    network: &PlacementNetwork,
    (images, lessons): (Vec<f32>, Vec<Lesson>),
    block: &BlockModel,
    config: &TrainConfig,
    replicas: usize,
    device: &Device,
) -> (GradientsParams, LossReport) {
    let symmetry: &SymmetryGroup = &block.symmetry;
    let output = network.forward(images, &config.network, device);
    let (total, report) = loss(output, &lessons, symmetry, device);
    let tape = total.div_scalar(replicas as f32).backward();
    (GradientsParams::from_grads(tape, network), report)
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
