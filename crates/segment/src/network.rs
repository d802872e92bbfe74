//! The networks this stage knows: one list, and what a network must be able to do.
//!
//! A network is a file with its sizes and weights and one `impl Design`; its line in [`architectures!`] makes it
//! trainable, loadable by the `architecture` in a model file's header, and usable by the stage.

use crate::SegmentError;
use crate::fpcc::FpccConfig;
use crate::fpccv2::FpccV2Config;
use crate::infer::{OwnClusters, TileVotes};
use crate::loss::LossReport;
use crate::model::SegmentModel;
use crate::sparse_votes::SparseVotesConfig;
use crate::tile::{Targets, ThinScene};
use crate::train::{self, TrainConfig, Trained, TrainingRun};
use geom::SeedTree;
use net::WeightsError;
use net::prelude::{Device, GradientsParams, Module};
use serde::{Deserialize, Serialize, Serializer};
use std::collections::BTreeMap;
use std::fmt::Debug;
use std::sync::Arc;

macro_rules! architectures {
    ($($(#[$doc:meta])* $variant:ident($sizes:ty) = $name:literal,)+) => {
        /// Which network, and how large.
        #[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
        #[serde(tag = "architecture")]
        pub enum NetworkConfig {
            $($(#[$doc])* #[serde(rename = $name)] $variant($sizes),)+
        }

        /// Values of `architecture` in a model file's header.
        pub(crate) const ARCHITECTURES: &[&str] = &[$($name),+];

        impl NetworkConfig {
            /// Value of `architecture` in a model file's header.
            pub fn architecture(&self) -> &'static str {
                match self {
                    $(Self::$variant(_) => $name,)+
                }
            }

            /// A number that no such network can have, if there is one.
            pub fn fault(&self) -> Option<&'static str> {
                self.design().fault()
            }

            /// What it can do.
            pub(crate) fn design(&self) -> &dyn Architecture {
                match self {
                    $(Self::$variant(sizes) => sizes,)+
                }
            }

            /// Writes the sizes alone, for a header that names the architecture beside them.
            pub(crate) fn sizes<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
                match self {
                    $(Self::$variant(sizes) => sizes.serialize(to),)+
                }
            }
        }
    };
}

architectures! {
    /// The thesis' second network with our heads: the default.
    FpccV2(FpccV2Config) = "fpccv2",
    /// The thesis' first network.
    Fpcc(FpccConfig) = "fpcc",
    /// A sparse-convolution U-Net with our heads.
    SparseUnet(SparseVotesConfig) = "sparse-unet",
}

impl Default for NetworkConfig {
    fn default() -> Self {
        Self::FpccV2(FpccV2Config::default())
    }
}

/// The names of all architectures, for a message.
pub(crate) fn known() -> String {
    ARCHITECTURES.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ")
}

/// A network's sizes, and how it learns and is read.
pub(crate) trait Design: Clone + Debug + Send + Sync + 'static {
    /// Its weights.
    type Weights: Module + Sync;
    /// Random weights.
    fn fresh(&self, device: &Device) -> Self::Weights;
    /// A number that no such network can have, if there is one.
    fn fault(&self) -> Option<&'static str>;
    /// Numbers that its matrices hold at least: what a file that claims these sizes must hold.
    fn matrix_weights(&self) -> u128;
    /// A training tile as this network wants it.
    fn cut(&self, scene: &ThinScene, config: &TrainConfig, mirror: bool, seed: SeedTree)
    -> Targets;
    /// Gradients of `share` times the loss on a tile, and the loss; `device` has gradients.
    fn gradients(
        &self,
        weights: &Self::Weights,
        tile: &Targets,
        config: &TrainConfig,
        share: f32,
        device: &Device,
    ) -> (GradientsParams, LossReport);
    /// The loss on a tile, without gradients.
    fn loss(&self, weights: &Self::Weights, tile: &Targets, config: &TrainConfig) -> LossReport;
    /// How instances are read from it.
    fn inference(weighted: &Weighted<Self>) -> Inference<'_>;
}

/// A network's sizes with its weights.
#[derive(Clone, Debug)]
pub(crate) struct Weighted<D: Design> {
    pub design: D,
    pub weights: D::Weights,
}

/// How the stage gets instances out of a network.
pub(crate) enum Inference<'a> {
    /// Every point votes for its block's centre.
    Votes(&'a dyn TileVotes),
    /// The network has a clustering of its own, whatever is chosen.
    OwnClusters(&'a dyn OwnClusters),
}

/// A network with its weights, whichever it is.
pub(crate) trait Network: Debug + Send + Sync {
    /// As a safetensors file with these words in its header.
    fn to_bytes(&self, metadata: &BTreeMap<String, String>) -> Result<Vec<u8>, WeightsError>;
    /// How instances are read from it.
    fn inference(&self) -> Inference<'_>;
}

impl<D: Design> Network for Weighted<D> {
    fn to_bytes(&self, metadata: &BTreeMap<String, String>) -> Result<Vec<u8>, WeightsError> {
        net::weights::to_bytes(&self.weights, metadata)
    }

    fn inference(&self) -> Inference<'_> {
        D::inference(self)
    }
}

/// A [`Design`], whichever it is.
pub(crate) trait Architecture {
    /// A number that no such network can have, if there is one.
    fn fault(&self) -> Option<&'static str>;
    /// Numbers that its matrices hold at least.
    fn matrix_weights(&self) -> u128;
    /// The network with the weights of a file.
    fn load(&self, bytes: &[u8]) -> Result<Arc<dyn Network>, WeightsError>;
    /// A training tile as this network wants it.
    fn cut(&self, scene: &ThinScene, config: &TrainConfig, mirror: bool, seed: SeedTree)
    -> Targets;
    /// Trains one.
    fn train(&self, run: &TrainingRun<'_>) -> Result<Trained, SegmentError>;
    /// Trains one on a single tile.
    fn train_on_tile(
        &self,
        model: &SegmentModel,
        tile: &Targets,
        config: &TrainConfig,
        rate: f64,
        done: &mut dyn FnMut(&LossReport) -> bool,
    ) -> Result<(), SegmentError>;
}

impl<D: Design> Architecture for D {
    fn fault(&self) -> Option<&'static str> {
        Design::fault(self)
    }

    fn matrix_weights(&self) -> u128 {
        Design::matrix_weights(self)
    }

    fn load(&self, bytes: &[u8]) -> Result<Arc<dyn Network>, WeightsError> {
        let mut weights = self.fresh(&Device::flex());
        net::weights::from_bytes(&mut weights, bytes)?;
        Ok(Arc::new(Weighted { design: self.clone(), weights }))
    }

    fn cut(
        &self,
        scene: &ThinScene,
        config: &TrainConfig,
        mirror: bool,
        seed: SeedTree,
    ) -> Targets {
        Design::cut(self, scene, config, mirror, seed)
    }

    fn train(&self, run: &TrainingRun<'_>) -> Result<Trained, SegmentError> {
        train::train_design(self, run)
    }

    fn train_on_tile(
        &self,
        model: &SegmentModel,
        tile: &Targets,
        config: &TrainConfig,
        rate: f64,
        done: &mut dyn FnMut(&LossReport) -> bool,
    ) -> Result<(), SegmentError> {
        train::one_tile::train_design(self, model, tile, config, rate, done)
    }
}
