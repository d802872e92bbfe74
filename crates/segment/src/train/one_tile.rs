//! The steps of a training on one and the same tile: to hold losses and time of a step against another program's.

use super::{TrainConfig, optimiser};
use crate::SegmentError;
use crate::fpccv2::FpccV2;
use crate::loss::LossReport;
use crate::model::SegmentModel;
use crate::network::Learner;
use crate::tile::Targets;
use net::burn::module::Module;
use net::burn::tensor::Device;

/// Trains FPCCv2 from `model` on `tile` alone at a constant `rate`, one replica on the calling thread. Calls `done` after
/// every step with the loss before it; stops when `done` says false. Errors: a model of another network.
pub fn train_on_tile(
    model: &SegmentModel,
    tile: &Targets,
    config: &TrainConfig,
    rate: f64,
    done: &mut dyn FnMut(&LossReport) -> bool,
) -> Result<(), SegmentError> {
    let device = Device::flex().autodiff();
    let fresh = FpccV2::fresh(&config.network, &device);
    let stranger = || SegmentError::Description("it does not describe a `fpccv2` network".into());
    let mut network = fresh.ok_or_else(stranger)?;
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
