//! FPCCv2 with our heads: per point an embedding and a centre score (METHOD §3), and — ours — a vote for the pose
//! centre with its expected error, and whether the point lies on a block at all.

use crate::infer::{Prediction, Tile, TileVotes};
use crate::loss::{LossReport, loss};
use crate::network::{Design, Inference, Weighted};
use crate::output::{Centres, EMBEDDING, Output, Votes};
use crate::tile::{Targets, ThinScene, neighbourhood};
use crate::train::TrainConfig;
use geom::{SeedTree, Vec3};
use net::prelude::{
    Device, GradientsParams, Linear, LinearConfig, Module, Tensor, burn, relu, sigmoid,
};
use net::{BackboneConfig, GraphBackbone, Neighbourhood, Processor, floats};
use serde::{Deserialize, Serialize};

/// ln of the vote error in d_max is kept between these: one per mille to three block radii.
pub(crate) const LOG_ERROR: (f32, f32) = (-4.0, 1.1);

/// Architecture of an [`FpccV2`].
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FpccV2Config {
    /// Backbone.
    pub backbone: BackboneConfig,
}

/// The network's weights.
#[derive(Module, Debug)]
pub struct FpccV2 {
    backbone: GraphBackbone,
    embedding: Linear,
    centre_hidden: Linear,
    centre: Linear,
    vote_hidden: Linear,
    vote: Linear,
}

impl FpccV2 {
    /// Random weights.
    pub fn new(config: &FpccV2Config, device: &Device) -> Self {
        let features = config.backbone.out;
        let linear = |a: usize, b: usize| LinearConfig::new(a, b).init(device);
        Self {
            backbone: GraphBackbone::new(&config.backbone, device),
            embedding: linear(features, EMBEDDING),
            centre_hidden: linear(features, 128),
            centre: linear(128, 1),
            vote_hidden: linear(features, 128),
            vote: linear(128, 5),
        }
    }

    /// Output of the first `wanted` points without gradients, block by block: `each` hears the number of a block's first
    /// point and what the heads say. Embedding and centre score cost a fifth of all and are left out where not asked for.
    pub fn infer_blocks(
        &self,
        hood: &Neighbourhood,
        wanted: usize,
        with_embedding: bool,
        device: &Device,
        mut each: impl FnMut(usize, Votes, Option<Centres>),
    ) {
        self.backbone.infer_blocks(hood, wanted, device, |first, features| {
            let centres = with_embedding.then(|| self.centres(features.clone()));
            each(first, self.votes(features), centres);
        });
    }

    /// Output of every point without gradients.
    pub fn infer(&self, hood: &Neighbourhood, device: &Device) -> Output {
        let mut blocks: [Vec<Tensor<2>>; 5] = Default::default();
        self.infer_blocks(hood, hood.len(), true, device, |_, votes, centres| {
            let c = centres.expect("asked for");
            let parts = [c.embedding, c.centre, votes.offset, votes.log_error, votes.block];
            blocks.iter_mut().zip(parts).for_each(|(blocks, part)| blocks.push(part));
        });
        let [embedding, centre, offset, log_error, block] =
            blocks.map(|parts| Tensor::cat(parts, 0));
        Output { embedding, centre, offset, log_error, block }
    }

    /// Gradients of `loss(output)` and the loss itself; `device` has autodiff.
    pub fn gradients<T>(
        &self,
        hood: &Neighbourhood,
        device: &Device,
        loss: impl FnOnce(Output) -> (Tensor<1>, T),
    ) -> (GradientsParams, T) {
        let trace = self.backbone.trace(hood, device);
        let (loss, report) = loss(self.heads(trace.features()));
        (trace.backward(self, &loss, device), report)
    }

    /// The same by tensor operations alone, on any device; on a CPU much slower.
    pub fn gradients_by_tensors<T>(
        &self,
        hood: &Neighbourhood,
        device: &Device,
        loss: impl FnOnce(Output) -> (Tensor<1>, T),
    ) -> (GradientsParams, T) {
        let (loss, report) = loss(self.heads(self.backbone.forward_tensors(hood, device)));
        (GradientsParams::from_grads(loss.backward(), self), report)
    }

    fn heads(&self, features: Tensor<2>) -> Output {
        let Centres { embedding, centre } = self.centres(features.clone());
        let Votes { offset, log_error, block } = self.votes(features);
        Output { embedding, centre, offset, log_error, block }
    }

    /// The thesis' heads.
    fn centres(&self, features: Tensor<2>) -> Centres {
        let embedding = relu(self.embedding.forward(features.clone())); // [n, 128]
        let centre = sigmoid(self.centre.forward(relu(self.centre_hidden.forward(features)))); // [n, 1]
        Centres { embedding, centre }
    }

    /// Ours.
    fn votes(&self, features: Tensor<2>) -> Votes {
        let vote = self.vote.forward(relu(self.vote_hidden.forward(features))); // [n, 5]
        Votes {
            offset: vote.clone().narrow(1, 0, 3),
            log_error: vote.clone().narrow(1, 3, 1).clamp(LOG_ERROR.0, LOG_ERROR.1),
            block: vote.narrow(1, 4, 1),
        }
    }
}

impl Design for FpccV2Config {
    type Weights = FpccV2;

    fn fresh(&self, device: &Device) -> FpccV2 {
        FpccV2::new(self, device)
    }

    fn fault(&self) -> Option<&'static str> {
        let BackboneConfig { edge, level, .. } = &self.backbone;
        (edge.is_empty() || edge.len() != level.len()).then_some("the network has no levels")
    }

    fn matrix_weights(&self) -> u128 {
        self.backbone.matrix_weights()
    }

    /// A compact piece.
    fn cut(
        &self,
        scene: &ThinScene,
        config: &TrainConfig,
        mirror: bool,
        seed: SeedTree,
    ) -> Targets {
        scene.tile(config.tile_points, config.margin, mirror, seed)
    }

    fn gradients(
        &self,
        weights: &FpccV2,
        tile: &Targets,
        config: &TrainConfig,
        share: f32,
        device: &Device,
    ) -> (GradientsParams, LossReport) {
        let hood = neighbourhood(tile.position.clone(), &self.backbone);
        let shared = |output| {
            let (total, report) = loss(output, tile, &config.loss, device);
            (total * share, report)
        };
        match config.processor {
            Processor::Cpu => weights.gradients(&hood, device, shared),
            Processor::Gpu => weights.gradients_by_tensors(&hood, device, shared),
        }
    }

    fn loss(&self, weights: &FpccV2, tile: &Targets, config: &TrainConfig) -> LossReport {
        let device = Device::flex();
        let hood = neighbourhood(tile.position.clone(), &self.backbone);
        loss(weights.infer(&hood, &device), tile, &config.loss, &device).1
    }

    fn inference(weighted: &Weighted<Self>) -> Inference<'_> {
        Inference::Votes(weighted)
    }
}

impl TileVotes for Weighted<FpccV2Config> {
    fn predict(&self, position: &[Vec3], tile: &Tile, with_embedding: bool) -> Prediction {
        let device = Device::flex();
        let at = |slot: usize| position[tile.points[slot] as usize];
        let around = (0..tile.points.len()).map(|slot| at(slot) - tile.middle).collect();
        let hood = neighbourhood(around, &self.design.backbone);
        let mut out = Prediction::default();
        let network = &self.weights;
        network.infer_blocks(&hood, tile.core, with_embedding, &device, |first, votes, centres| {
            let offset = floats(votes.offset);
            let offsets = offset.chunks_exact(3).enumerate();
            out.vote.extend(offsets.map(|(i, o)| at(first + i) + Vec3::from_slice(o)));
            out.error.extend(floats(votes.log_error).into_iter().map(f32::exp));
            out.block.extend(floats(sigmoid(votes.block)));
            if let Some(centres) = centres {
                out.centre.extend(floats(centres.centre));
                out.embedding.extend(floats(centres.embedding));
            }
        });
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn forward_equals_the_numpy_reference() {
        let config = crate::golden::small_fpccv2();
        let device = Device::flex();
        let mut network = FpccV2::new(&config, &device);
        let bytes = include_bytes!("../tests/golden/fpccv2.safetensors");
        net::weights::from_bytes(&mut network, bytes).unwrap();
        let hood = neighbourhood(crate::golden::points(), &config.backbone);
        let out = network.infer(&hood, &device);
        let parts = [
            (out.offset, 3),
            (out.log_error, 1),
            (out.block, 1),
            (out.centre, 1),
            (out.embedding.narrow(1, 0, 4), 4),
        ];
        let want = crate::golden::rows(include_str!("../tests/golden/fpccv2.csv"));
        let mut first = 0;
        for (tensor, width) in parts {
            for (i, got) in floats(tensor).chunks_exact(width).enumerate() {
                for (q, v) in got.iter().enumerate() {
                    let w = want[i][first + q];
                    assert!(
                        (v - w).abs() < 1e-4 * w.abs().max(1.0),
                        "point {i}, column {}: {v} against {w}",
                        first + q
                    );
                }
            }
            first += width;
        }
    }
}
