//! The network (METHOD §6): depth image → residual network → features → branches for place and attitude, as often as
//! there are modes, and one number a mode for how sure it is.

use crate::{PlacementError, RotationCode};
use net::prelude::{Device, Linear, LinearConfig, Module, Tensor, TensorData, burn, relu};
use net::{ImageTransformer, ImageTransformerConfig, ResNet, ResNetConfig, residual};
use plan::DepthView;
use serde::{Deserialize, Serialize};

/// What a [`PlacementNetwork`] looks like.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NetworkShape {
    /// The depth image.
    pub view: DepthView,
    /// The residual network.
    pub backbone: ResNetConfig,
    /// An image Transformer in its place.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub transformer: Option<ImageTransformerConfig>,
    /// Numbers between backbone and branches.
    pub features: usize,
    /// Answers to a window; the thesis: 1.
    pub modes: usize,
    /// How rotations are written.
    pub rotation: RotationCode,
}

impl Default for NetworkShape {
    fn default() -> Self {
        Self {
            view: DepthView { pixels: 48, edge: 1.8 },
            backbone: ResNetConfig { width: 16, pool: true, ..ResNetConfig::default() },
            transformer: None,
            features: 256,
            modes: 16,
            rotation: RotationCode::SixNumbers,
        }
    }
}

impl NetworkShape {
    /// Every number must make sense before a network is built from it.
    pub(crate) fn check(&self) -> Result<(), PlacementError> {
        let within = |name, value: f64, low: f64, high: f64, allowed| {
            let ok = (low..=high).contains(&value);
            if ok { Ok(()) } else { Err(PlacementError::Setting { name, value, allowed }) }
        };
        within("pixels", self.view.pixels.into(), 8.0, 512.0, "8 to 512")?;
        within("edge", self.view.edge.into(), 0.5, 10.0, "0.5 to 10 block lengths")?;
        within("features", self.features as f64, 1.0, 65_536.0, "1 to 65536")?;
        within("modes", self.modes as f64, 1.0, 1024.0, "1 to 1024")?;
        within("width", self.backbone.width as f64, 8.0, 1024.0, "8 to 1024")?;
        if let Some(allowed) = self.transformer.and_then(|t| t.fault(self.view.pixels as usize)) {
            let value = self.view.pixels.into();
            return Err(PlacementError::Setting { name: "transformer", value, allowed });
        }
        let odd = (self.backbone.width % residual::GROUPS) as f64;
        within("width modulo 8", odd, 0.0, 0.0, "widths are multiples of 8")
    }
}

/// Answers to `b` windows.
#[derive(Clone, Debug)]
pub(crate) struct Output {
    /// Centre of mass from the window's middle at design height, block lengths, `[b, k, 3]`.
    pub centre: Tensor<3>,
    /// Attitude as a matrix, column after column, `[b, k, 9]`.
    pub rotation: Tensor<3>,
    /// Log-odds of the modes against each other, `[b, k]`.
    pub sureness: Tensor<2>,
}

/// The network's weights.
#[derive(Module, Debug)]
pub struct PlacementNetwork {
    backbone: Option<ResNet>,
    transformer: Option<ImageTransformer>,
    features: Linear,
    place_hidden: Linear,
    place: Linear,
    attitude_hidden: Linear,
    attitude: Linear,
    sureness: Linear,
}

impl PlacementNetwork {
    /// Random weights.
    pub fn new(shape: &NetworkShape, device: &Device) -> Self {
        let linear = |a: usize, b: usize| LinearConfig::new(a, b).init(device);
        let (f, k) = (shape.features, shape.modes);
        let seen = match &shape.transformer {
            Some(transformer) => transformer.width,
            None => shape.backbone.features(shape.view.pixels as usize),
        };
        let backbone = shape.transformer.is_none().then(|| ResNet::new(&shape.backbone, device));
        Self {
            backbone,
            transformer: shape.transformer.as_ref().map(|t| ImageTransformer::new(t, device)),
            features: linear(seen, f),
            place_hidden: linear(f, f / 2 + 1),
            place: linear(f / 2 + 1, 3 * k),
            attitude_hidden: linear(f, f / 2 + 1),
            attitude: linear(f / 2 + 1, shape.rotation.numbers() * k),
            sureness: linear(f, k),
        }
    }

    /// `images`: one after another, each as [`DepthView`] says.
    pub(crate) fn forward(
        &self,
        images: Vec<f32>,
        shape: &NetworkShape,
        device: &Device,
    ) -> Output {
        let n = shape.view.pixels as usize;
        let b = images.len() / (n * n);
        let image = Tensor::<4>::from_data(TensorData::new(images, [b, 1, n, n]), device);
        let seen = match (&self.transformer, &self.backbone) {
            (Some(transformer), _) => transformer.forward(image),
            (None, Some(backbone)) => backbone.forward(image),
            (None, None) => image.flatten(1, 3),
        };
        let x = relu(self.features.forward(seen)); // [b, f]
        let place = self.place.forward(relu(self.place_hidden.forward(x.clone()))); // [b, 3k]
        let attitude = self.attitude.forward(relu(self.attitude_hidden.forward(x.clone())));
        let k = shape.modes;
        Output {
            centre: place.reshape([b, k, 3]),
            rotation: shape.rotation.matrices(attitude.reshape([b, k, shape.rotation.numbers()])),
            sureness: self.sureness.forward(x),
        }
    }
}
