//! One dilated graph convolution with attentive pooling (METHOD §3): the weights, and the two ways to run it.
//!
//! The pooled part runs fused ([`crate::attentive_pooling`]) or as tensor operations ([`GraphConvolution::pool_tensors`]),
//! which any device can run and differentiate; a test holds one against the other.

use crate::Neighbourhood;
use crate::attentive_pooling::{PoolingWeights, RELATIVE, pool, pool_backward};
use crate::row_norm::{NormWeights, normalise};
use burn::module::{Initializer, Module, Param};
use burn::nn::{LayerNorm, LayerNormConfig, Linear, LinearConfig};
use burn::optim::GradientsParams;
use burn::tensor::activation::{relu, softmax};
use burn::tensor::{Device, Int, Tensor, TensorData};

/// Added to a row's variance; the library's own, which both ways share.
const EPSILON: f32 = 1e-5;

/// A graph convolution from `c_in` to `c_out` features by way of `c` features on every edge.
#[derive(Module, Debug)]
pub struct GraphConvolution {
    /// Point features into edge features, `[c_in, c]`; applied before the difference, which is the same and K× cheaper.
    feature: Linear,
    /// Relative position into edge features, `[10, c]`.
    position: Param<Tensor<2>>,
    /// `[c]`.
    bias: Param<Tensor<1>>,
    /// Scores of the attention, `[c + 10, c + 10]`.
    attention: Param<Tensor<2>>,
    out: Linear,
    norm: LayerNorm,
}

impl GraphConvolution {
    /// Random weights.
    pub fn new(c_in: usize, c: usize, c_out: usize, device: &Device) -> Self {
        let wide = c + RELATIVE;
        let uniform = |fan: usize| {
            let b = (1.0 / fan as f64).sqrt();
            Initializer::Uniform { min: -b, max: b }
        };
        Self {
            feature: LinearConfig::new(c_in, c).with_bias(false).init(device),
            position: uniform(RELATIVE).init([RELATIVE, c], device),
            bias: uniform(RELATIVE).init([c], device),
            attention: uniform(wide).init([wide, wide], device),
            out: LinearConfig::new(wide, c_out).init(device),
            norm: LayerNormConfig::new(c_out).with_epsilon(f64::from(EPSILON)).init(device),
        }
    }

    /// Features of a result.
    pub fn columns(&self) -> usize {
        self.out.weight.dims()[1]
    }

    /// Edge features' share of each point, `[n, c]`.
    pub fn project(&self, features: Tensor<2>) -> Tensor<2> {
        self.feature.forward(features)
    }

    /// Pooled `[n, c + 10]` into the level's result `[n, c_out]`.
    pub fn finish(&self, pooled: Tensor<2>) -> Tensor<2> {
        relu(self.norm.forward(self.out.forward(pooled)))
    }

    /// The same outside any gradient tape, with the same bits on every processor; row-major.
    pub fn finish_values(&self, pooled: Tensor<2>) -> Vec<f32> {
        let mut values = floats(self.out.forward(pooled));
        let gain = floats(self.norm.gamma.val());
        let bias = match &self.norm.beta {
            Some(beta) => floats(beta.val()),
            None => vec![0.0; gain.len()],
        };
        let weights = NormWeights { gain: &gain, bias: &bias, epsilon: EPSILON };
        normalise(&mut values, weights);
        values
    }

    /// The pooled part of the first `count` points, fused, outside any gradient tape.
    pub fn pool_fused(&self, a: &[f32], hood: &Neighbourhood, count: usize) -> Vec<f32> {
        let (position, bias, attention) = self.values();
        pool(
            a,
            hood,
            count,
            PoolingWeights { position: &position, bias: &bias, attention: &attention },
        )
    }

    /// Gradient of `a` for the gradient of the pooled features; the weights' gradients go into `grads`.
    pub fn pool_fused_backward(
        &self,
        a: &[f32],
        hood: &Neighbourhood,
        grad: &[f32],
        grads: &mut GradientsParams,
        device: &Device,
    ) -> Vec<f32> {
        let (position, bias, attention) = self.values();
        let weights = PoolingWeights { position: &position, bias: &bias, attention: &attention };
        let g = pool_backward(a, hood, weights, grad);
        let (c, wide) = (bias.len(), bias.len() + RELATIVE);
        grads.register(
            self.position.id,
            Tensor::<2>::from_data(TensorData::new(g.position, [RELATIVE, c]), device),
        );
        grads.register(self.bias.id, Tensor::<1>::from_data(TensorData::new(g.bias, [c]), device));
        grads.register(
            self.attention.id,
            Tensor::<2>::from_data(TensorData::new(g.attention, [wide, wide]), device),
        );
        g.a
    }

    /// The pooled part as tensor operations. Shapes: `a` `[n, c]` → `[n, c + 10]`.
    pub fn pool_tensors(&self, a: Tensor<2>, hood: &Neighbourhood) -> Tensor<2> {
        let device = a.device();
        let (n, k, c) = (hood.len(), hood.k, self.bias.dims()[0]);
        let index: Vec<i32> = hood.index.iter().map(|&i| i as i32).collect();
        let index = Tensor::<1, Int>::from_data(TensorData::new(index, [n * k]), &device);
        let mut relative = Vec::with_capacity(n * k * RELATIVE);
        for i in 0..n {
            hood.relative_positions(i, |_, l| relative.extend(l));
        }
        let relative =
            Tensor::<2>::from_data(TensorData::new(relative, [n * k, RELATIVE]), &device);
        let other = a.clone().select(0, index).reshape([n, k, c]);
        let own = a.reshape([n, 1, c]);
        let along = (relative.clone().matmul(self.position.val())
            + self.bias.val().reshape([1, c]))
        .reshape([n, k, c]);
        let r = relu(own - other + along); // [n, k, c]
        let f = Tensor::cat(vec![r, relative.reshape([n, k, RELATIVE])], 2); // [n, k, c + 10]
        let wide = c + RELATIVE;
        let scores =
            f.clone().reshape([n * k, wide]).matmul(self.attention.val()).reshape([n, k, wide]);
        (softmax(scores, 1) * f).sum_dim(1).reshape([n, wide])
    }

    fn values(&self) -> (Vec<f32>, Vec<f32>, Vec<f32>) {
        (floats(self.position.val()), floats(self.bias.val()), floats(self.attention.val()))
    }
}

/// The numbers of a tensor, row-major.
pub fn floats<const D: usize>(tensor: Tensor<D>) -> Vec<f32> {
    tensor.into_data().try_to_vec::<f32>().expect("the networks compute in f32")
}
