//! The steps of a training on one and the same tile: to hold losses and time of a step against another program's.

use super::{TrainConfig, take};
use crate::SegmentError;
use crate::loss::LossReport;
use crate::model::SegmentModel;
use crate::network::Design;
use crate::tile::Targets;
use net::prelude::{Device, Module};
use net::training::optimiser;

/// Trains the network of `config` from `model` on `tile` alone at a constant `rate`, one replica on the calling thread.
/// Calls `done` after every step with the loss before it; stops when `done` says false. Errors: a model of another network.
pub fn train_on_tile(
    model: &SegmentModel,
    tile: &Targets,
    config: &TrainConfig,
    rate: f64,
    done: &mut dyn FnMut(&LossReport) -> bool,
) -> Result<(), SegmentError> {
    config.network.design().train_on_tile(model, tile, config, rate, done)
}

/// The same for a network of this design.
pub(crate) fn train_design<D: Design>(
    design: &D,
    model: &SegmentModel,
    tile: &Targets,
    config: &TrainConfig,
    rate: f64,
    done: &mut dyn FnMut(&LossReport) -> bool,
) -> Result<(), SegmentError> {
    let device = Device::flex().autodiff();
    let mut network = design.fresh(&device);
    take(&mut network, model)?;
    let mut optimiser = optimiser(config.weight_decay);
    loop {
        let copy = network.clone().fork(&device);
        let (gradients, report) = design.gradients(&copy, tile, config, 1.0, &device);
        network = optimiser.step(rate, network, gradients);
        if !done(&report) {
            return Ok(());
        }
    }
}
