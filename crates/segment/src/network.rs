//! The networks this stage knows, behind one name.

use crate::fpcc::{Fpcc, FpccConfig};
use crate::fpccv2::{FpccV2, FpccV2Config};
use crate::loss::{LossReport, loss};
use crate::model::SegmentModel;
use crate::tile::{Targets, neighbourhood};
use crate::train::TrainConfig;
use net::burn::module::Module;
use net::burn::optim::GradientsParams;
use net::burn::tensor::Device;
use net::{Processor, WeightsError};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Which network, and how large.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum NetworkConfig {
    /// The thesis' second network with our heads: the default.
    FpccV2(FpccV2Config),
    /// The thesis' first network.
    Fpcc(FpccConfig),
}

impl Default for NetworkConfig {
    fn default() -> Self {
        Self::FpccV2(FpccV2Config::default())
    }
}

/// A network with its weights.
#[derive(Clone, Debug)]
pub(crate) enum Network {
    FpccV2(Box<FpccV2>),
    Fpcc(Box<Fpcc>),
}

impl NetworkConfig {
    /// Value of `architecture` in a model file's header.
    pub(crate) fn architecture(&self) -> &'static str {
        match self {
            Self::FpccV2(_) => "fpccv2",
            Self::Fpcc(_) => "fpcc",
        }
    }

    /// The network with the weights of a file.
    pub(crate) fn load(&self, bytes: &[u8]) -> Result<Network, WeightsError> {
        let device = Device::flex();
        Ok(match self {
            Self::FpccV2(config) => {
                let mut network = FpccV2::new(config, &device);
                net::weights::from_bytes(&mut network, bytes)?;
                Network::FpccV2(Box::new(network))
            }
            Self::Fpcc(config) => {
                let mut network = Fpcc::new(config, &device);
                net::weights::from_bytes(&mut network, bytes)?;
                Network::Fpcc(Box::new(network))
            }
        })
    }

    /// Numbers that the matrices of such a network hold at least: what a file that claims these widths must hold.
    pub(crate) fn matrix_weights(&self) -> u128 {
        let product = |a: usize, b: usize| a as u128 * b as u128;
        match self {
            Self::FpccV2(c) => c.backbone.matrix_weights(),
            Self::Fpcc(c) => {
                let [first, second] = c.joined;
                [(c.edge, c.edge), (c.edge, c.global), (c.global, first), (first, second)]
                    .into_iter()
                    .fold(0, |sum: u128, (a, b)| sum.saturating_add(product(a, b)))
            }
        }
    }

    /// A number that no network can have, if there is one.
    pub(crate) fn fault(&self) -> Option<&'static str> {
        match self {
            Self::FpccV2(c)
                if c.backbone.edge.is_empty()
                    || c.backbone.edge.len() != c.backbone.level.len() =>
            {
                Some("the network has no levels")
            }
            Self::Fpcc(c) if c.batch_points == 0 => Some("the network's batches are empty"),
            _ => None,
        }
    }
}

impl Network {
    pub(crate) fn to_bytes(
        &self,
        metadata: &BTreeMap<String, String>,
    ) -> Result<Vec<u8>, WeightsError> {
        match self {
            Self::FpccV2(network) => net::weights::to_bytes(network.as_ref(), metadata),
            Self::Fpcc(network) => net::weights::to_bytes(network.as_ref(), metadata),
        }
    }
}

/// What training asks of a network.
pub(crate) trait Learner: Module + Clone + Sync {
    /// Random weights.
    fn fresh(config: &NetworkConfig, device: &Device) -> Option<Self>;
    /// Gradients of the loss on a tile; `device` has autodiff.
    fn lesson(
        &self,
        tile: &Targets,
        config: &TrainConfig,
        share: f32,
        device: &Device,
    ) -> (GradientsParams, LossReport);
    /// The loss on a tile, without gradients.
    fn judged(&self, tile: &Targets, config: &TrainConfig) -> LossReport;
    /// The weights of a model of the same architecture.
    fn take(&mut self, model: &SegmentModel) -> Result<(), WeightsError> {
        net::weights::from_bytes(self, &model.network.to_bytes(&BTreeMap::new())?)
    }
    /// As one of the networks.
    fn into_network(self) -> Network;
}

impl Learner for FpccV2 {
    fn fresh(config: &NetworkConfig, device: &Device) -> Option<Self> {
        match config {
            NetworkConfig::FpccV2(config) => Some(Self::new(config, device)),
            NetworkConfig::Fpcc(_) => None,
        }
    }

    fn lesson(
        &self,
        tile: &Targets,
        config: &TrainConfig,
        share: f32,
        device: &Device,
    ) -> (GradientsParams, LossReport) {
        let hood = neighbourhood(tile.position.clone(), self.backbone_config(config));
        let shared = |output| {
            let (total, report) = loss(output, tile, &config.loss, device);
            (total * share, report)
        };
        match config.processor {
            Processor::Cpu => self.gradients(&hood, device, shared),
            Processor::Gpu => self.gradients_by_tensors(&hood, device, shared),
        }
    }

    fn judged(&self, tile: &Targets, config: &TrainConfig) -> LossReport {
        let device = Device::flex();
        let hood = neighbourhood(tile.position.clone(), self.backbone_config(config));
        loss(self.infer(&hood, &device), tile, &config.loss, &device).1
    }

    fn into_network(self) -> Network {
        Network::FpccV2(Box::new(self.to_device(&Device::flex())))
    }
}

impl FpccV2 {
    fn backbone_config<'a>(&self, config: &'a TrainConfig) -> &'a net::BackboneConfig {
        match &config.network {
            NetworkConfig::FpccV2(network) => &network.backbone,
            NetworkConfig::Fpcc(_) => unreachable!("made from a FPCCv2 configuration"),
        }
    }
}

impl Learner for Fpcc {
    fn fresh(config: &NetworkConfig, device: &Device) -> Option<Self> {
        match config {
            NetworkConfig::Fpcc(config) => Some(Self::new(config, device)),
            NetworkConfig::FpccV2(_) => None,
        }
    }

    fn lesson(
        &self,
        tile: &Targets,
        config: &TrainConfig,
        share: f32,
        device: &Device,
    ) -> (GradientsParams, LossReport) {
        let (total, report) =
            loss(self.forward(&tile.inputs(), device).into(), tile, &config.loss, device);
        (GradientsParams::from_grads((total * share).backward(), self), report)
    }

    fn judged(&self, tile: &Targets, config: &TrainConfig) -> LossReport {
        let device = Device::flex();
        loss(self.forward(&tile.inputs(), &device).into(), tile, &config.loss, &device).1
    }

    fn into_network(self) -> Network {
        Network::Fpcc(Box::new(self.to_device(&Device::flex())))
    }
}
