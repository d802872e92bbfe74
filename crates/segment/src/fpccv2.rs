//! FPCCv2 with our heads: per point an embedding and a centre score (METHOD §3), and — ours — a vote for the pose
//! centre with its expected error, and whether the point lies on a block at all.

use net::burn::nn::{Linear, LinearConfig};
use net::burn::optim::GradientsParams;
use net::burn::tensor::activation::{relu, sigmoid};
use net::burn::tensor::{Device, Tensor};
use net::burn::{self, module::Module};
use net::{BackboneConfig, GraphBackbone, Neighbourhood};
use serde::{Deserialize, Serialize};

/// Numbers of an embedding.
pub const EMBEDDING: usize = 128;
/// ln of the vote error in d_max is kept between these: one per mille to three block radii.
const LOG_ERROR: (f32, f32) = (-4.0, 1.1);

/// What a network says of `n` points.
#[derive(Clone, Debug)]
pub struct Output {
    /// `[n, 128]`.
    pub embedding: Tensor<2>,
    /// Centre score in (0, 1), `[n, 1]`.
    pub centre: Tensor<2>,
    /// From the point to the pose centre, in d_max, `[n, 3]`.
    pub offset: Tensor<2>,
    /// ln of the expected length of the offset's error, in d_max, `[n, 1]`.
    pub log_error: Tensor<2>,
    /// Log-odds of lying on a block, `[n, 1]`.
    pub block: Tensor<2>,
}

/// The thesis' part of an [`Output`].
pub struct Centres {
    /// `[n, 128]`.
    pub embedding: Tensor<2>,
    /// Centre score in (0, 1), `[n, 1]`.
    pub centre: Tensor<2>,
}

/// Our part of an [`Output`].
pub struct Votes {
    /// From the point to the pose centre, in d_max, `[n, 3]`.
    pub offset: Tensor<2>,
    /// ln of the expected length of the offset's error, in d_max, `[n, 1]`.
    pub log_error: Tensor<2>,
    /// Log-odds of lying on a block, `[n, 1]`.
    pub block: Tensor<2>,
}

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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::SegmentModel;
    use crate::network::{Network, NetworkConfig};
    use crate::tile::neighbourhood;
    use net::floats;

    #[test]
    fn forward_equals_the_numpy_reference() {
        let model =
            SegmentModel::from_bytes(include_bytes!("../tests/golden/fpccv2.safetensors")).unwrap();
        let (NetworkConfig::FpccV2(config), Network::FpccV2(network)) =
            (&model.description.network, &model.network)
        else {
            panic!("the golden file holds a FPCCv2")
        };
        let hood = neighbourhood(crate::golden::points(), &config.backbone);
        let device = Device::flex();
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
