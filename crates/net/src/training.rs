//! The training loop: replicas share a step, the rate rises and falls, checkpoints resume.
//!
//! In: a network, a [`Task`] (what a step is computed from, what is written down) and a [`Schedule`]. Out: the trained
//! network, in a folder that any run may take up again. What is learnt, and from what, is the stage's.

use crate::checkpoint::{Checkpoint, CheckpointError};
use crate::numbering::numbered;
use crate::replicas::{Replicas, sum_gradients};
use crate::schedule::cosine_with_warmup;
use burn::grad_clipping::GradientClippingConfig;
use burn::module::Module;
use burn::optim::{AdamWConfig, GradientsParams, ModuleOptimizer};
use burn::tensor::Device;
use geom::{Event, Observer, SeedTree, Stage};

/// Steps between two lines of the learning curve.
const STEPS_A_LINE: u64 = 20;
/// Largest norm of a parameter's gradient. Free choice: 1 is what most trainings of the kind take, and no other was tried.
const LARGEST_GRADIENT: f32 = 1.0;
/// Keeps the optimiser from dividing by zero; Adam's own.
const EPSILON: f32 = 1e-8;

/// How long and how fast a training learns.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Schedule {
    /// Optimiser steps.
    pub steps: u64,
    /// Peak learning rate.
    pub learning_rate: f64,
    /// Steps of linear warm-up.
    pub warmup: u64,
    /// Weight decay of AdamW.
    pub weight_decay: f32,
    /// Threads that share a step.
    pub replicas: usize,
    /// Steps between checkpoints.
    pub checkpoint_steps: u64,
    /// Steps between judgements on what is never trained on.
    pub validation_steps: u64,
}

/// One replica's part of a step.
#[derive(Clone, Copy, Debug)]
pub struct Part<'a> {
    /// Number of the step, from 0.
    pub step: u64,
    /// Number of the replica.
    pub replica: usize,
    /// Replicas of the step: each weighs its loss by one over their number.
    pub replicas: usize,
    /// Where to compute, with gradients.
    pub device: &'a Device,
}

/// What a stage brings to the loop.
pub trait Task: Sync {
    /// The network.
    type Network: Module + Sync;
    /// What a step is drawn from.
    type Batch: Sync;
    /// Losses of a replica's part.
    type Report: Send;
    /// What the network is worth on data never trained on.
    type Judgement;
    /// The stage's error.
    type Error: From<TrainingError> + From<CheckpointError>;
    /// First line of `curve.csv`.
    const HEADER: &'static str;

    /// Gradients and losses of one replica's part of a step.
    fn gradients(
        &self,
        network: &Self::Network,
        batch: &Self::Batch,
        part: &Part<'_>,
    ) -> (GradientsParams, Self::Report);
    /// The losses of a step from those of its parts.
    fn mean(&self, parts: &[Self::Report]) -> Self::Report;
    /// The loss itself: a training ends when it is no number.
    fn loss(&self, report: &Self::Report) -> f32;
    /// Judges the network after so many steps.
    fn judge(&self, network: &Self::Network, steps: u64, replicas: &Replicas) -> Self::Judgement;
    /// A line of `curve.csv`, which begins with the step.
    fn line(
        &self,
        step: u64,
        rate: f64,
        report: &Self::Report,
        judged: Option<&Self::Judgement>,
    ) -> String;
    /// The bytes of `model.safetensors` after so many steps.
    fn model(&self, network: &Self::Network, steps: u64) -> Result<Vec<u8>, Self::Error>;
    /// Hears that a checkpoint was written.
    fn saved(&self, _: &Checkpoint) -> Result<(), Self::Error> {
        Ok(())
    }
}

/// Why a training could not go on.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum TrainingError {
    /// No thread for a replica.
    #[error("no thread for training: {0}")]
    Threads(String),
    /// The loss is not a number.
    #[error("training diverged at step {step}: the loss is {loss}")]
    Diverged {
        /// Step.
        step: u64,
        /// Loss.
        loss: f32,
    },
}

/// A training that has ended or was stopped.
#[derive(Clone, Debug)]
pub struct Outcome<N, J> {
    /// The network as it is now, with gradients.
    pub network: N,
    /// Steps done.
    pub steps: u64,
    /// Its judgement after the last of them.
    pub judgement: J,
}

/// A training about to take its next step: begun, or taken up from its folder.
pub struct Training<'a, N: Module> {
    schedule: Schedule,
    checkpoint: &'a Checkpoint,
    device: Device,
    replicas: Replicas,
    network: N,
    optimiser: ModuleOptimizer,
    first: u64,
    observer: &'a dyn Observer,
}

/// The optimiser of every training.
pub fn optimiser(weight_decay: f32) -> ModuleOptimizer {
    AdamWConfig::new()
        .with_weight_decay(weight_decay)
        .with_epsilon(EPSILON)
        .with_grad_clipping(Some(GradientClippingConfig::Norm(LARGEST_GRADIENT)))
        .init()
}

/// A network with the first weights of a training. They come from a generator that a process has once: two trainings
/// begun side by side would share it.
pub fn first_weights<N: Module>(
    device: &Device,
    seed: SeedTree,
    make: impl FnOnce(&Device) -> N,
) -> N {
    device.seed(seed.child("weights", 0).value());
    make(device).materialize()
}

impl<'a, N: Module + Sync> Training<'a, N> {
    /// Takes up the folder's last checkpoint, or begins with `network`; `device` has gradients.
    pub fn begin<E: From<TrainingError> + From<CheckpointError>>(
        network: N,
        schedule: Schedule,
        checkpoint: &'a Checkpoint,
        device: Device,
        observer: &'a dyn Observer,
    ) -> Result<Self, E> {
        let replicas = Replicas::new(schedule.replicas).map_err(TrainingError::Threads)?;
        let (network, optimiser, first) =
            checkpoint.resume(numbered(network), optimiser(schedule.weight_decay))?;
        observer.event(Event::Started { stage: Stage::Train, total: schedule.steps });
        Ok(Self { schedule, checkpoint, device, replicas, network, optimiser, first, observer })
    }

    /// Steps done before.
    pub fn first(&self) -> u64 {
        self.first
    }

    /// Trains to the last step, or to the checkpoint after the observer asks to stop; `batch` gives what a step is drawn
    /// from.
    pub fn run<T: Task<Network = N>>(
        self,
        task: &T,
        mut batch: impl FnMut(u64) -> Result<T::Batch, T::Error>,
    ) -> Result<Outcome<N, T::Judgement>, T::Error> {
        let Self { schedule, checkpoint, device, replicas, mut network, mut optimiser, .. } = self;
        let mut curve = checkpoint.curve(T::HEADER, self.first)?;
        let mut done = self.first;
        let mut judgement = None;
        for step in self.first..schedule.steps {
            let (gradients, report) =
                gradients(task, &network, &batch(step)?, step, &replicas, &device)?;
            let rate = schedule.rate(step);
            network = optimiser.step(rate, network, gradients);
            done = step + 1;
            let last = done == schedule.steps;
            let due = done.is_multiple_of(schedule.validation_steps) || last;
            judgement = due.then(|| task.judge(&network, done, &replicas));
            if due || done.is_multiple_of(STEPS_A_LINE) {
                curve.write(&task.line(done, rate, &report, judgement.as_ref()))?;
            }
            let stop = self.observer.cancelled();
            if done.is_multiple_of(schedule.checkpoint_steps) || last || stop {
                checkpoint.save(&network, &optimiser, done, &task.model(&network, done)?)?;
                task.saved(checkpoint)?;
            }
            self.observer.event(Event::Advanced { stage: Stage::Train, done });
            if stop {
                break;
            }
        }
        // A training that was stopped, or had no step left to do, is judged all the same.
        let judgement = judgement.unwrap_or_else(|| task.judge(&network, done, &replicas));
        self.observer.event(Event::Finished { stage: Stage::Train });
        Ok(Outcome { network, steps: done, judgement })
    }
}

/// The sum of the replicas' gradients of one step, and its losses.
fn gradients<T: Task>(
    task: &T,
    network: &T::Network,
    batch: &T::Batch,
    step: u64,
    replicas: &Replicas,
    device: &Device,
) -> Result<(GradientsParams, T::Report), T::Error> {
    let count = replicas.len();
    // Copies with leaves of their own: tapes that share a parameter are one tape, and two threads walking it backwards
    // wait for each other for ever.
    let copies: Vec<T::Network> = (0..count).map(|_| network.clone().fork(device)).collect();
    let results = replicas.run(|replica| {
        let part = Part { step, replica, replicas: count, device };
        task.gradients(&copies[replica], batch, &part)
    });
    let (gradients, reports): (Vec<_>, Vec<_>) = results.into_iter().unzip();
    let report = task.mean(&reports);
    let loss = task.loss(&report);
    if !loss.is_finite() {
        return Err(TrainingError::Diverged { step, loss }.into());
    }
    Ok((sum_gradients(network, gradients), report))
}

impl Schedule {
    fn rate(&self, step: u64) -> f64 {
        cosine_with_warmup(self.learning_rate, self.warmup, step, self.steps)
    }
}
