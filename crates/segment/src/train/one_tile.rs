//! The steps of a training on one and the same tile: to hold losses and time of a step against another program's.

use super::{TrainConfig, optimiser};
use crate::SegmentError;
use crate::loss::LossReport;
use crate::model::SegmentModel;
use crate::network::{Learner, NetworkConfig};
use crate::tile::Targets;
use net::burn::tensor::Device;

/// Trains from `model` on `tile` alone at a constant `rate`, one replica on the calling thread. Calls `done` after every
/// step with the loss before it; stops when `done` says false.
pub fn train_on_tile(
    model: &SegmentModel,
    tile: &Targets,
    config: &TrainConfig,
    rate: f64,
    done: &mut dyn FnMut(&LossReport) -> bool,
) -> Result<(), SegmentError> {
    match config.network {
        NetworkConfig::FpccV2(_) => repeat::<crate::fpccv2::FpccV2>(model, tile, config, rate, done),
        NetworkConfig::Fpcc(_) => repeat::<crate::fpcc::Fpcc>(model, tile, config, rate, done),
    }
}

fn repeat<L: Learner>(
    model: &SegmentModel,
    tile: &Targets,
    config: &TrainConfig,
    rate: f64,
    done: &mut dyn FnMut(&LossReport) -> bool,
) -> Result<(), SegmentError> {
    let device = Device::flex().autodiff();
    let mut network = L::fresh(&config.network, &device).expect("chosen by this very configuration");
    network.take(model)?;
    let mut optimiser = optimiser(config);
    loop {
        let (gradients, report) = network.clone().fork(&device).lesson(tile, config, 1.0, &device);
        network = optimiser.step(rate, network, gradients);
        if !done(&report) {
            return Ok(());
        }
    }
}
