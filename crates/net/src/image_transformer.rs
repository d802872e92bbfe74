//! An image Transformer (Dosovitskiy et al., ICLR 2021): the picture in patches, each a token with its place, attention between
//! all of them, the mean of what comes out.
//!
//! The place of a patch is told by sines and cosines joined to its pixels, not learnt; normalisation stands before each layer, and nothing is
//! dropped out, so that an answer does not depend on chance.

use burn::module::Module;
use burn::nn::transformer::{
    TransformerEncoder, TransformerEncoderConfig, TransformerEncoderInput,
};
use burn::nn::{LayerNorm, LayerNormConfig, Linear, LinearConfig};
use burn::tensor::{Device, Tensor, TensorData};
use serde::{Deserialize, Serialize};

/// Wavelengths of the place's code along each side: the image, its half, quarter and eighth.
const WAVES: usize = 4;
/// Numbers that tell a patch's place.
const PLACE: usize = 4 * WAVES;

/// Architecture of an [`ImageTransformer`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ImageTransformerConfig {
    /// Edge of a patch, pixels; the image's edge is a multiple of it.
    pub patch: usize,
    /// Numbers of a token, a multiple of `heads`.
    pub width: usize,
    /// Heads of an attention.
    pub heads: usize,
    /// Layers.
    pub layers: usize,
}

impl Default for ImageTransformerConfig {
    fn default() -> Self {
        Self { patch: 6, width: 128, heads: 4, layers: 4 }
    }
}

impl ImageTransformerConfig {
    /// What of it no network for images of this size can have, if anything.
    pub fn fault(&self, pixels: usize) -> Option<&'static str> {
        let Self { patch, width, heads, layers } = *self;
        if patch == 0 || !pixels.is_multiple_of(patch) {
            return Some("patch: the image's pixels are a multiple of it");
        }
        if heads == 0 || width == 0 || !width.is_multiple_of(heads) || width > 1024 {
            return Some("width: a multiple of heads, at most 1024");
        }
        (layers == 0 || layers > 24).then_some("layers: 1 to 24")
    }
}

/// The network's weights.
#[derive(Module, Debug)]
pub struct ImageTransformer {
    embed: Linear,
    encoder: TransformerEncoder,
    norm: LayerNorm,
    patch: usize,
}

impl ImageTransformer {
    /// Random weights for images of one channel.
    pub fn new(config: &ImageTransformerConfig, device: &Device) -> Self {
        let width = config.width;
        let encoder = TransformerEncoderConfig::new(width, 2 * width, config.heads, config.layers)
            .with_dropout(0.0)
            .with_norm_first(true);
        Self {
            embed: LinearConfig::new(config.patch * config.patch + PLACE, width).init(device),
            encoder: encoder.init(device),
            norm: LayerNormConfig::new(width).init(device),
            patch: config.patch,
        }
    }

    /// Images `[b, 1, n, n]` to features `[b, width]`.
    pub fn forward(&self, image: Tensor<4>) -> Tensor<2> {
        let device = image.device();
        let [b, _, n, _] = image.dims();
        let (p, g) = (self.patch, n / self.patch);
        let tokens: Tensor<3> =
            image.reshape([b, g, p, g, p]).swap_dims(2, 3).reshape([b, g * g, p * p]);
        let place = Tensor::<3>::from_data(TensorData::new(places(g), [1, g * g, PLACE]), &device)
            .repeat_dim(0, b);
        let x = self.embed.forward(Tensor::cat(vec![tokens, place], 2)); // [b, g², width]
        let x = self.norm.forward(self.encoder.forward(TransformerEncoderInput::new(x)));
        let width = x.dims()[2];
        x.mean_dim(1).reshape([b, width])
    }
}

/// The code of each patch's place in a grid of `g × g`, row by row.
fn places(g: usize) -> Vec<f32> {
    let along = |at: usize| {
        let t = (at as f32 + 0.5) / g as f32 * std::f32::consts::TAU;
        (0..WAVES).flat_map(move |k| {
            let (s, c) = (t * (1 << k) as f32 * 0.5).sin_cos();
            [s, c]
        })
    };
    (0..g * g).flat_map(|i| along(i / g).chain(along(i % g))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::floats;

    #[test]
    fn it_sees_where_something_is_and_no_image_sees_another() {
        let device = Device::flex();
        device.seed(3);
        let config = ImageTransformerConfig { patch: 4, width: 16, heads: 2, layers: 2 };
        let network = ImageTransformer::new(&config, &device);
        let mut pixels = vec![0.0_f32; 2 * 64];
        pixels[9] = 1.0; // first image: upper left patch
        pixels[64 + 9 + 4] = 1.0; // second: the same, a patch to the right
        let both = Tensor::<4>::from_data(TensorData::new(pixels.clone(), [2, 1, 8, 8]), &device);
        let both = floats(network.forward(both));
        assert_eq!(both.len(), 2 * 16);
        let apart = (0..16).map(|i| (both[i] - both[16 + i]).abs()).fold(0.0, f32::max);
        assert!(apart > 1e-4, "a place makes no difference");
        let one =
            Tensor::<4>::from_data(TensorData::new(pixels[..64].to_vec(), [1, 1, 8, 8]), &device);
        for (a, b) in floats(network.forward(one)).iter().zip(&both) {
            assert!((a - b).abs() < 1e-4, "{a} against {b}");
        }
    }

    #[test]
    fn impossible_sizes_are_named() {
        let config = ImageTransformerConfig::default();
        assert_eq!(config.fault(48), None);
        assert!(config.fault(50).is_some_and(|f| f.starts_with("patch")));
        assert!(ImageTransformerConfig { heads: 3, ..config }.fault(48).is_some());
        assert!(ImageTransformerConfig { layers: 0, ..config }.fault(48).is_some());
    }
}
