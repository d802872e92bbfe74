//! The third network: a sparse-convolution U-Net under the same heads as FPCCv2's.
//!
//! It looks at voxels of a seventh of d_max, as wide as the cells a survey is thinned to, needs no neighbour search and some
//! eight times fewer products a point than the graph network. A voxel's vote starts at the mean of its points and is told to
//! each of them from its own place.

use crate::fpccv2::LOG_ERROR;
use crate::infer::{Prediction, Tile, TileVotes};
use crate::loss::{LossReport, loss};
use crate::network::{Design, Inference, Weighted};
use crate::output::{EMBEDDING, Output};
use crate::tile::{Targets, ThinScene};
use crate::train::TrainConfig;
use geom::{SeedTree, Vec3};
use net::prelude::{
    Device, GradientsParams, Linear, LinearConfig, Module, Tensor, TensorData, burn, relu, sigmoid,
};
use net::{Processor, SparseUnet, UnetConfig, Voxels, floats};
use serde::{Deserialize, Serialize};

/// Features between the U-Net and the heads.
const HIDDEN: usize = 128;
/// Rows the heads see at a time.
const BLOCK: usize = 1024;

/// Architecture of a [`SparseVotes`].
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SparseVotesConfig {
    /// U-Net; its unit of length is d_max.
    pub unet: UnetConfig,
}

/// The network's weights.
#[derive(Module, Debug)]
pub struct SparseVotes {
    unet: SparseUnet,
    mix: Linear,
    embedding: Linear,
    centre: Linear,
    vote: Linear,
}

impl SparseVotes {
    /// Random weights.
    pub fn new(config: &SparseVotesConfig, device: &Device) -> Self {
        let linear = |a: usize, b: usize| LinearConfig::new(a, b).init(device);
        Self {
            unet: SparseUnet::new(&config.unet, device),
            mix: linear(config.unet.features(), HIDDEN),
            embedding: linear(HIDDEN, EMBEDDING),
            centre: linear(HIDDEN, 1),
            vote: linear(HIDDEN, 5),
        }
    }

    /// Output of every point without gradients; `position` as the voxels were made from.
    pub fn infer(&self, voxels: &Voxels, position: &[Vec3], device: &Device) -> Output {
        let n = position.len();
        let features = self.unet.infer(voxels);
        let features =
            Tensor::from_data(TensorData::new(features, [n, self.mix.weight.dims()[0]]), device);
        self.heads(features, shift(voxels, position, device))
    }

    /// Features `[n, c]`, and what a vote told from each point differs by from that told from its voxel, `[n, 3]`.
    fn heads(&self, features: Tensor<2>, shift: Tensor<2>) -> Output {
        let x = relu(self.mix.forward(features)); // [n, HIDDEN]
        let vote = self.vote.forward(x.clone()); // [n, 5]
        Output {
            embedding: relu(self.embedding.forward(x.clone())),
            centre: sigmoid(self.centre.forward(x)),
            offset: vote.clone().narrow(1, 0, 3) + shift,
            log_error: vote.clone().narrow(1, 3, 1).clamp(LOG_ERROR.0, LOG_ERROR.1),
            block: vote.narrow(1, 4, 1),
        }
    }
}

/// From each point to the mean of its voxel.
fn shift(voxels: &Voxels, position: &[Vec3], device: &Device) -> Tensor<2> {
    let to_mean = |(p, &v): (&Vec3, &u32)| (voxels.mean[v as usize] - *p).to_array();
    let rows: Vec<f32> = position.iter().zip(&voxels.voxel_of_point).flat_map(to_mean).collect();
    Tensor::from_data(TensorData::new(rows, [position.len(), 3]), device)
}

impl Design for SparseVotesConfig {
    type Weights = SparseVotes;

    fn fresh(&self, device: &Device) -> SparseVotes {
        SparseVotes::new(self, device)
    }

    fn fault(&self) -> Option<&'static str> {
        let UnetConfig { resolution, channels } = &self.unet;
        if channels.is_empty() || channels.contains(&0) {
            return Some("the network has no levels");
        }
        // Ten halvings of the finest grid are a voxel for a whole harbour.
        (*resolution == 0 || *resolution > 1000 || channels.len() > 10)
            .then_some("the network's voxels are not 1 to 1000 a d_max on at most 10 levels")
    }

    fn matrix_weights(&self) -> u128 {
        self.unet.matrix_weights()
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
        weights: &SparseVotes,
        tile: &Targets,
        config: &TrainConfig,
        share: f32,
        device: &Device,
    ) -> (GradientsParams, LossReport) {
        let voxels = self.unet.voxels(&tile.position);
        let shift = shift(&voxels, &tile.position, device);
        match config.processor {
            Processor::Cpu => {
                let trace = weights.unet.trace(&voxels, device);
                let output = weights.heads(trace.features(), shift);
                let (total, report) = loss(output, tile, &config.loss, device);
                (trace.backward(weights, &(total * share), device), report)
            }
            Processor::Gpu => {
                let features = weights.unet.forward_tensors(&voxels, device);
                let output = weights.heads(features, shift);
                let (total, report) = loss(output, tile, &config.loss, device);
                (GradientsParams::from_grads((total * share).backward(), weights), report)
            }
        }
    }

    fn loss(&self, weights: &SparseVotes, tile: &Targets, config: &TrainConfig) -> LossReport {
        let device = Device::flex();
        let voxels = self.unet.voxels(&tile.position);
        let output = weights.infer(&voxels, &tile.position, &device);
        loss(output, tile, &config.loss, &device).1
    }

    fn inference(weighted: &Weighted<Self>) -> Inference<'_> {
        Inference::Votes(weighted)
    }
}

impl TileVotes for Weighted<SparseVotesConfig> {
    fn predict(&self, position: &[Vec3], tile: &Tile, with_embedding: bool) -> Prediction {
        let device = Device::flex();
        let local: Vec<Vec3> =
            tile.points.iter().map(|&i| position[i as usize] - tile.middle).collect();
        let voxels = self.design.unet.voxels(&local);
        let features = self.weights.unet.infer(&voxels);
        let wide = self.design.unet.features();
        let mut out = Prediction::default();
        for first in (0..tile.core).step_by(BLOCK) {
            let last = (first + BLOCK).min(tile.core);
            let rows = features[first * wide..last * wide].to_vec();
            let x = Tensor::<2>::from_data(TensorData::new(rows, [last - first, wide]), &device);
            let x = relu(self.weights.mix.forward(x));
            let vote = floats(self.weights.vote.forward(x.clone()));
            for (v, slot) in vote.chunks_exact(5).zip(first..last) {
                let mean = voxels.mean[voxels.voxel_of_point[slot] as usize] + tile.middle;
                out.vote.push(mean + Vec3::from_slice(v));
                out.error.push(v[3].clamp(LOG_ERROR.0, LOG_ERROR.1).exp());
                out.block.push(1.0 / (1.0 + (-v[4]).exp()));
            }
            if with_embedding {
                out.centre.extend(floats(sigmoid(self.weights.centre.forward(x.clone()))));
                out.embedding.extend(floats(relu(self.weights.embedding.forward(x))));
            }
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::network::NetworkConfig;
    use crate::train::train_on_tile;
    use crate::{SegmentModel, TrainConfig};
    use geom::Bounds;
    use rand::RngExt;
    use std::sync::Arc;

    fn small() -> SparseVotesConfig {
        SparseVotesConfig { unet: UnetConfig { resolution: 5, channels: vec![8, 16] } }
    }

    /// Two balls.
    fn tile() -> Targets {
        let mut rng = SeedTree::new(3).rng();
        let mut targets = Targets::default();
        for i in 0..240 {
            let centre = Vec3::X * (i % 2) as f32 * 2.2;
            let mut draw = || rng.random_range(-1.0_f32..1.0);
            let off = Vec3::new(draw(), draw(), draw()).normalize_or(Vec3::X);
            targets.position.push(centre + off);
            targets.offset.push(-off);
            targets.instance.push(1 + i % 2);
            targets.inner.push(1.0);
        }
        targets.bounds = Bounds::of(targets.position.iter().copied());
        targets
    }

    fn model() -> SegmentModel {
        let device = Device::flex();
        device.seed(8);
        let config =
            TrainConfig { network: NetworkConfig::SparseUnet(small()), ..Default::default() };
        let weights = SparseVotes::new(&small(), &device);
        SegmentModel::of_network(Arc::new(Weighted { design: small(), weights }), &config, 0)
    }

    #[test]
    fn it_learns_a_tile() {
        let config =
            TrainConfig { network: NetworkConfig::SparseUnet(small()), ..Default::default() };
        let mut offsets = Vec::new();
        train_on_tile(&model(), &tile(), &config, 1e-2, &mut |report| {
            offsets.push(report.offset);
            offsets.len() < 60
        })
        .unwrap();
        assert!(offsets[59] < 0.4 * offsets[0], "{} {}", offsets[0], offsets[59]);
    }

    #[test]
    fn a_file_holds_it_and_a_tile_is_read_as_in_training() {
        let read = SegmentModel::from_bytes(&model().to_bytes().unwrap()).unwrap();
        assert_eq!(read.description.network, NetworkConfig::SparseUnet(small()));
        let device = Device::flex();
        device.seed(8);
        let weights = SparseVotes::new(&small(), &device);
        let position = tile().position;
        let all = Tile { points: (0..240).collect(), core: 200, middle: Vec3::ZERO };
        let weighted = Weighted { design: small(), weights };
        let got = weighted.predict(&position, &all, true);
        let voxels = small().unet.voxels(&position);
        let want = weighted.weights.infer(&voxels, &position, &device);
        let offset = floats(want.offset);
        for (i, vote) in got.vote.iter().enumerate() {
            let w = position[i] + Vec3::from_slice(&offset[3 * i..3 * i + 3]);
            assert!((*vote - w).length() < 1e-4);
        }
        let embedding = floats(want.embedding);
        assert!(got.embedding.iter().zip(&embedding).all(|(a, b)| (a - b).abs() < 1e-4));
        assert_eq!((got.vote.len(), got.centre.len()), (200, 200));
    }
}
