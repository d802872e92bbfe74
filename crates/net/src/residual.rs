//! Residual networks on images (He et al., CVPR 2016): 18, 34 or 50 layers deep, any width.
//!
//! Width 64 is the paper's; a quarter of it trains on two processor cores. Two things differ from the paper. Group
//! normalisation stands in for batch normalisation: an image's answer must not depend on what else is in its batch, nor
//! a training on how many threads share one. And the last map is handed on cell by cell instead of averaged, because it
//! matters here *where* in the image something is.

use burn::module::Module;
use burn::nn::conv::{Conv2d, Conv2dConfig};
use burn::nn::pool::MaxPool2dConfig;
use burn::nn::{GroupNorm, GroupNormConfig, Initializer, PaddingConfig2d};
use burn::tensor::activation::relu;
use burn::tensor::{Device, Tensor};
use serde::{Deserialize, Serialize};

/// Groups of a normalisation; widths are multiples of it.
pub const GROUPS: usize = 8;

/// How deep.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum ResNetDepth {
    /// 18 layers: pairs of 3 × 3 convolutions.
    #[default]
    #[serde(rename = "resnet-18")]
    Layers18,
    /// 34 layers: more of them.
    #[serde(rename = "resnet-34")]
    Layers34,
    /// 50 layers: bottlenecks of 1 × 1, 3 × 3 and 1 × 1.
    #[serde(rename = "resnet-50")]
    Layers50,
}

/// Architecture of a [`ResNet`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ResNetConfig {
    /// Layers.
    pub depth: ResNetDepth,
    /// Channels of the first stage, a multiple of [`GROUPS`]; each of the three stages after it has twice as many.
    pub width: usize,
    /// Whether the first map is halved by a maximum pool, as in the paper; off for small images.
    pub pool: bool,
}

impl Default for ResNetConfig {
    fn default() -> Self {
        Self { depth: ResNetDepth::Layers18, width: 64, pool: true }
    }
}

impl ResNetConfig {
    /// Blocks of each stage.
    fn blocks(&self) -> [usize; 4] {
        match self.depth {
            ResNetDepth::Layers18 => [2, 2, 2, 2],
            ResNetDepth::Layers34 | ResNetDepth::Layers50 => [3, 4, 6, 3],
        }
    }

    /// Channels a stage's blocks hand on, over the stage's width.
    fn expansion(&self) -> usize {
        if self.depth == ResNetDepth::Layers50 { 4 } else { 1 }
    }

    /// Numbers of the result for a square image.
    pub fn features(&self, pixels: usize) -> usize {
        let halvings = if self.pool { 5 } else { 4 };
        let edge = (0..halvings).fold(pixels, |edge, _| edge.div_ceil(2));
        8 * self.width * self.expansion() * edge * edge
    }
}

/// The network's weights.
#[derive(Module, Debug)]
pub struct ResNet {
    stem: Conv2d,
    stem_norm: GroupNorm,
    blocks: Vec<Residual>,
    pool: bool,
}

/// Convolutions beside a shortcut.
#[derive(Module, Debug)]
struct Residual {
    convolutions: Vec<Conv2d>,
    norms: Vec<GroupNorm>,
    shortcut: Option<Conv2d>,
}

impl ResNet {
    /// Random weights for images of one channel.
    pub fn new(config: &ResNetConfig, device: &Device) -> Self {
        let mut blocks = Vec::new();
        let mut c_in = config.width;
        for (stage, count) in config.blocks().into_iter().enumerate() {
            let width = config.width << stage;
            for block in 0..count {
                let stride = if stage > 0 && block == 0 { 2 } else { 1 };
                let c_out = width * config.expansion();
                blocks.push(Residual::new(c_in, width, c_out, stride, device));
                c_in = c_out;
            }
        }
        Self {
            stem: convolution(1, config.width, 7, 2, device),
            stem_norm: norm(config.width, device),
            blocks,
            pool: config.pool,
        }
    }

    /// Images `[b, 1, n, n]` to features `[b, f]`.
    pub fn forward(&self, image: Tensor<4>) -> Tensor<2> {
        let mut x = relu(self.stem_norm.forward(self.stem.forward(image)));
        if self.pool {
            let margin = PaddingConfig2d::Explicit(1, 1, 1, 1);
            x = MaxPool2dConfig::new([3, 3])
                .with_strides([2, 2])
                .with_padding(margin)
                .init()
                .forward(x);
        }
        for block in &self.blocks {
            x = block.forward(x);
        }
        x.flatten(1, 3)
    }
}

impl Residual {
    fn new(c_in: usize, width: usize, c_out: usize, stride: usize, device: &Device) -> Self {
        // A bottleneck where the block hands on more than its width.
        let shapes: &[(usize, usize, usize, usize)] = if c_out == width {
            &[(c_in, width, 3, stride), (width, width, 3, 1)]
        } else {
            &[(c_in, width, 1, 1), (width, width, 3, stride), (width, c_out, 1, 1)]
        };
        let shortcut =
            (c_in != c_out || stride != 1).then(|| convolution(c_in, c_out, 1, stride, device));
        Self {
            convolutions: shapes
                .iter()
                .map(|&(a, b, k, s)| convolution(a, b, k, s, device))
                .collect(),
            norms: shapes.iter().map(|&(_, b, _, _)| norm(b, device)).collect(),
            shortcut,
        }
    }

    fn forward(&self, x: Tensor<4>) -> Tensor<4> {
        let beside = match &self.shortcut {
            Some(shortcut) => shortcut.forward(x.clone()),
            None => x.clone(),
        };
        let last = self.convolutions.len() - 1;
        let mut y = x;
        for (at, (convolution, norm)) in self.convolutions.iter().zip(&self.norms).enumerate() {
            y = norm.forward(convolution.forward(y));
            if at < last {
                y = relu(y);
            }
        }
        relu(y + beside)
    }
}

fn convolution(c_in: usize, c_out: usize, kernel: usize, stride: usize, device: &Device) -> Conv2d {
    let margin = kernel / 2;
    Conv2dConfig::new([c_in, c_out], [kernel, kernel])
        .with_stride([stride, stride])
        .with_padding(PaddingConfig2d::Explicit(margin, margin, margin, margin))
        .with_bias(false)
        .with_initializer(Initializer::KaimingNormal {
            gain: std::f64::consts::SQRT_2,
            fan_out_only: false,
        })
        .init(device)
}

fn norm(channels: usize, device: &Device) -> GroupNorm {
    GroupNormConfig::new(GROUPS, channels).init(device)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::graph_convolution::floats;
    use burn::tensor::TensorData;

    fn images(count: usize, n: usize) -> Tensor<4> {
        let values: Vec<f32> =
            (0..count * n * n).map(|i| ((i * 37 % 101) as f32) / 50.0 - 1.0).collect();
        Tensor::from_data(TensorData::new(values, [count, 1, n, n]), &Device::flex())
    }

    #[test]
    fn every_depth_gives_the_announced_features_and_no_image_sees_another() {
        let device = Device::flex();
        device.seed(1);
        for depth in [ResNetDepth::Layers18, ResNetDepth::Layers34, ResNetDepth::Layers50] {
            for pool in [false, true] {
                let config = ResNetConfig { depth, width: 8, pool };
                let network = ResNet::new(&config, &device);
                let both = network.forward(images(2, 20));
                assert_eq!(both.dims(), [2, config.features(20)]);
                let one = floats(network.forward(images(2, 20).narrow(0, 1, 1)));
                for (a, b) in one.iter().zip(floats(both.narrow(0, 1, 1))) {
                    assert!((a - b).abs() < 1e-4, "{a} against {b}");
                }
            }
        }
    }

    #[test]
    fn the_layers_are_as_many_as_the_name_says() {
        let device = Device::flex();
        for (depth, layers) in
            [(ResNetDepth::Layers18, 17), (ResNetDepth::Layers34, 33), (ResNetDepth::Layers50, 49)]
        {
            let network = ResNet::new(&ResNetConfig { depth, width: 8, pool: true }, &device);
            // Shortcuts are not counted, and the last layer is the head's.
            assert_eq!(
                1 + network.blocks.iter().map(|b| b.convolutions.len()).sum::<usize>(),
                layers
            );
        }
    }
}
