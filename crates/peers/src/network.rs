//! A peer's network: one of our backbones under the method's own heads.

use crate::grouping::{Group, Grouping, Method, linear_layers, matrix};
use geom::{SeedTree, Vec3};
use net::prelude::{Device, Linear, Module, Tensor, burn};
use net::{SparseUnet, UnetConfig, floats};
use segment::fpcc::{Fpcc, FpccConfig, batches, inputs};

/// What gives a point its features.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Backbone {
    /// FPCC's dynamic graph network, on random batches of the whole scene.
    Dgcnn,
    /// The sparse U-Net, on the whole scene at once.
    SparseUnet,
}

impl Backbone {
    /// As tables name it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Dgcnn => "DGCNN",
            Self::SparseUnet => "sparse U-Net",
        }
    }
}

/// Everything that decides a peer beside its scenes and seed.
#[derive(Clone, Debug, PartialEq)]
pub struct PeerConfig {
    /// Method.
    pub method: Method,
    /// Backbone.
    pub backbone: Backbone,
    /// Optimiser steps.
    pub steps: u64,
    /// Tiles of a step.
    pub replicas: usize,
    /// Points of a tile, and of a batch when a scene is looked at.
    pub points: usize,
    /// Peak learning rate.
    pub learning_rate: f64,
    /// Mirror half of the tiles.
    pub mirror: bool,
}

impl PeerConfig {
    /// A method on a backbone with what FPCC itself is trained with.
    pub fn new(method: Method, backbone: Backbone, steps: u64) -> Self {
        Self {
            method,
            backbone,
            steps,
            replicas: 2,
            points: 2048,
            learning_rate: 2e-3,
            mirror: false,
        }
    }

    pub(crate) fn fpcc(&self) -> FpccConfig {
        FpccConfig { batch_points: self.points, ..Default::default() }
    }
}

/// The network's weights: one of the two backbones, and the method's layers.
#[derive(Module, Debug)]
pub(crate) struct PeerNetwork {
    pub dgcnn: Option<Fpcc>,
    pub unet: Option<SparseUnet>,
    pub layers: Vec<Linear>,
}

impl PeerNetwork {
    pub fn new(config: &PeerConfig, grouping: &dyn Grouping, device: &Device) -> Self {
        let fpcc = config.fpcc();
        let (dgcnn, unet, features) = match config.backbone {
            Backbone::Dgcnn => (Some(Fpcc::new(&fpcc, device)), None, fpcc.joined[1]),
            Backbone::SparseUnet => {
                let sizes = UnetConfig::default();
                let features = sizes.features();
                (None, Some(SparseUnet::new(&sizes, device)), features)
            }
        };
        Self { dgcnn, unet, layers: linear_layers(&grouping.layers(features), device) }
    }
}

/// A trained peer.
#[derive(Clone, Debug)]
pub struct Peer {
    pub(crate) config: PeerConfig,
    pub(crate) network: PeerNetwork,
}

impl Peer {
    /// Groups among the points of a scene, d_max, thinned to a seventh of it; best first. No point is in two groups.
    pub fn groups(&self, position: &[Vec3], seed: SeedTree) -> Vec<Group> {
        if position.is_empty() {
            return Vec::new();
        }
        let features = self.features(position, seed);
        let grouping = self.config.method.grouping();
        let mut groups = grouping.groups(&self.network.layers, features, position);
        let mut taken = vec![false; position.len()];
        for group in &mut groups {
            group.points.retain(|&i| !std::mem::replace(&mut taken[i as usize], true));
        }
        groups.retain(|g| !g.points.is_empty());
        groups
    }

    fn features(&self, position: &[Vec3], seed: SeedTree) -> Tensor<2> {
        let device = Device::flex();
        let n = position.len();
        if let Some(unet) = &self.network.unet {
            return matrix(unet.infer(&UnetConfig::default().voxels(position)), n, &device);
        }
        let network = self.network.dgcnn.as_ref().expect("a peer has one of both backbones");
        let input = inputs(position);
        let mut rows: Vec<f32> = Vec::new();
        for batch in batches(n, self.config.points, seed) {
            let part: Vec<[f32; 6]> = batch.iter().map(|&i| input[i as usize]).collect();
            let found = floats(network.features(&part, &device));
            let wide = found.len() / batch.len();
            rows.resize(n * wide, 0.0);
            for (row, &i) in found.chunks_exact(wide).zip(&batch) {
                rows[i as usize * wide..(i as usize + 1) * wide].copy_from_slice(row);
            }
        }
        matrix(rows, n, &device)
    }
}
