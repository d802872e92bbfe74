//! FPCC (METHOD §2): the dynamic graph network of the thesis' second chapter, with its two heads.
//!
//! Input per point: (x, y, z) minus the scene's minimum, and the same over the scene's extent per axis, six numbers taken
//! before a scene is drawn into batches. Three edge convolutions, the first on Euclidean neighbours, the others on
//! neighbours in feature space; joined, a global maximum, two heads. The authors' frozen batch normalisation is left
//! out, not copied. Runs as tensor operations on any device.

use crate::loss::{LossReport, loss};
use crate::network::{Design, Inference, Weighted};
use crate::output::Output;
use crate::tile::{Targets, ThinScene};
use crate::train::TrainConfig;
use geom::{Bounds, SeedTree, Vec3, knn};
use net::floats;
use net::prelude::{
    Device, GradientsParams, Int, Linear, LinearConfig, Module, Tensor, TensorData, burn, relu,
    sigmoid,
};
use rand::RngExt;
use rand::seq::SliceRandom;
use serde::{Deserialize, Serialize};

/// Widest piece shown in training, d_max: as wide as the pieces of a survey.
const WIDEST_PIECE: f32 = 10.0;
/// The narrowest, in parts of the widest: free choice, so that a scene's extent, which the input is divided by, varies.
const NARROWEST_PIECE: f32 = 0.6;

/// The thesis' number of neighbours: files written before it could be set do not hold it.
const NEIGHBOURS: usize = 20;

fn is_the_thesis(neighbours: &usize) -> bool {
    *neighbours == NEIGHBOURS
}

/// Sizes of the network; the thesis' by default.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct FpccConfig {
    /// Points drawn into a batch.
    pub batch_points: usize,
    /// Features of each edge convolution.
    pub edge: usize,
    /// Features of the global maximum.
    pub global: usize,
    /// Features of the two layers after it.
    pub joined: [usize; 2],
    /// Neighbours K of an edge convolution, the point itself included.
    #[serde(skip_serializing_if = "is_the_thesis")]
    pub neighbours: usize,
}

impl Default for FpccConfig {
    fn default() -> Self {
        Self {
            batch_points: 4096,
            edge: 64,
            global: 1024,
            joined: [512, 256],
            neighbours: NEIGHBOURS,
        }
    }
}

/// The six input numbers of every point of a scene.
pub fn inputs(position: &[Vec3]) -> Vec<[f32; 6]> {
    inputs_in(position, &Bounds::of(position.iter().copied()))
}

/// The same for some points of a scene with these bounds.
pub fn inputs_in(position: &[Vec3], bounds: &Bounds) -> Vec<[f32; 6]> {
    // A scene without extent along an axis is at 0 of it.
    let size = bounds.size().max(Vec3::splat(f32::MIN_POSITIVE));
    position
        .iter()
        .map(|&p| {
            let (q, r) = (p - bounds.min, (p - bounds.min) / size);
            [q.x, q.y, q.z, r.x, r.y, r.z]
        })
        .collect()
}

/// The same for a training tile.
fn inputs_of(tile: &Targets) -> Vec<[f32; 6]> {
    inputs_in(&tile.position, &tile.bounds)
}

/// Every point of the scene once, in random batches of `size`; the last batch is filled up with points already drawn.
pub fn batches(points: usize, size: usize, seed: SeedTree) -> Vec<Vec<u32>> {
    let mut order: Vec<u32> = (0..points as u32).collect();
    let mut rng = seed.rng();
    order.shuffle(&mut rng);
    let mut out: Vec<Vec<u32>> = order.chunks(size.max(1)).map(<[u32]>::to_vec).collect();
    if let Some(last) = out.last_mut() {
        let missing = size.saturating_sub(last.len());
        last.extend(order.iter().cycle().take(missing));
    }
    out
}

/// What FPCC says of `n` points.
#[derive(Clone, Debug)]
pub struct FpccOutput {
    /// `[n, 128]`.
    pub embedding: Tensor<2>,
    /// Centre score, `[n, 1]`.
    pub centre: Tensor<2>,
}

impl From<FpccOutput> for Output {
    /// FPCC votes for nothing and knows no ground: those parts are zeros that no loss should weigh.
    fn from(output: FpccOutput) -> Self {
        let (n, device) = (output.centre.dims()[0], output.centre.device());
        let zeros = |width: usize| Tensor::<2>::zeros([n, width], &device);
        let (offset, log_error, block) = (zeros(3), zeros(1), zeros(1));
        Self { embedding: output.embedding, centre: output.centre, offset, log_error, block }
    }
}

/// An edge convolution: [x_i, x_j − x_i] → linear → relu (→ linear → relu) → maximum over j.
#[derive(Module, Debug)]
struct EdgeConvolution {
    /// Both halves of the first layer: of x_i and of x_j − x_i.
    own: Linear,
    other: Linear,
    second: Option<Linear>,
}

impl EdgeConvolution {
    fn new(c_in: usize, first: usize, second: Option<usize>, device: &Device) -> Self {
        Self {
            own: LinearConfig::new(c_in, first).init(device),
            other: LinearConfig::new(c_in, first).with_bias(false).init(device),
            second: second.map(|s| LinearConfig::new(first, s).init(device)),
        }
    }

    /// `x` `[n, c_in]`, `index` `[n · k]` → `[n, c_out]`.
    fn forward(&self, x: Tensor<2>, index: Tensor<1, Int>) -> Tensor<2> {
        let n = x.dims()[0];
        let k = index.dims()[0] / n;
        // W·[x_i, x_j − x_i] = A x_i + B (x_j − x_i): per point, then gathered.
        let b = self.other.forward(x.clone()); // [n, c]
        let a = self.own.forward(x) - b.clone(); // [n, c]
        let c = b.dims()[1];
        let edges = relu(a.reshape([n, 1, c]) + b.select(0, index).reshape([n, k, c])); // [n, k, c]
        let edges = match &self.second {
            Some(second) => {
                let y = relu(second.forward(edges.reshape([n * k, c]))); // [n · k, c']
                let wide = y.dims()[1];
                y.reshape([n, k, wide])
            }
            None => edges,
        };
        let wide = edges.dims()[2];
        edges.max_dim(1).reshape([n, wide]) // [n, c_out]
    }
}

/// The network's weights.
#[derive(Module, Debug)]
pub struct Fpcc {
    first: EdgeConvolution,
    second: EdgeConvolution,
    third: EdgeConvolution,
    global: Linear,
    join: Linear,
    mix: Linear,
    embedding: Linear,
    centre_hidden: Linear,
    centre: Linear,
    neighbours: usize,
}

impl Fpcc {
    /// Random weights.
    pub fn new(config: &FpccConfig, device: &Device) -> Self {
        let linear = |a: usize, b: usize| LinearConfig::new(a, b).init(device);
        let (edge, [join, mix]) = (config.edge, config.joined);
        Self {
            first: EdgeConvolution::new(6, edge, Some(edge), device),
            second: EdgeConvolution::new(edge, edge, Some(edge), device),
            third: EdgeConvolution::new(edge, edge, None, device),
            global: linear(3 * edge, config.global),
            join: linear(3 * edge + config.global, join),
            mix: linear(join, mix),
            embedding: linear(mix, 128),
            centre_hidden: linear(mix, 128),
            centre: linear(128, 1),
            neighbours: config.neighbours,
        }
    }

    /// `input` of one batch → output; differentiable on an autodiff device.
    pub fn forward(&self, input: &[[f32; 6]], device: &Device) -> FpccOutput {
        let features = self.features(input, device);
        FpccOutput {
            embedding: relu(self.embedding.forward(features.clone())),
            centre: sigmoid(self.centre.forward(relu(self.centre_hidden.forward(features)))),
        }
    }

    /// What both heads read, `[n, joined[1]]`: the backbone alone, for other heads to be held against these.
    pub fn features(&self, input: &[[f32; 6]], device: &Device) -> Tensor<2> {
        let n = input.len();
        let x =
            Tensor::<2>::from_data(TensorData::new(input.as_flattened().to_vec(), [n, 6]), device);
        let position: Vec<Vec3> = input.iter().map(|v| Vec3::new(v[0], v[1], v[2])).collect();
        let index = |rows: Vec<u32>| {
            let rows: Vec<i32> = rows.into_iter().map(|i| i as i32).collect();
            let count = rows.len();
            Tensor::<1, Int>::from_data(TensorData::new(rows, [count]), device)
        };
        let a = self.first.forward(x, index(knn(&position, self.neighbours).index)); // [n, 64]
        let b = self.second.forward(a.clone(), index(nearest_features(a.clone(), self.neighbours))); // [n, 64]
        let c = self.third.forward(b.clone(), index(nearest_features(b.clone(), self.neighbours))); // [n, 64]
        let local = Tensor::cat(vec![a, b, c], 1); // [n, 192]
        let global = relu(self.global.forward(local.clone())).max_dim(0); // [1, 1024]
        let joined = Tensor::cat(vec![local, global.repeat_dim(0, n)], 1); // [n, 1216]
        relu(self.mix.forward(relu(self.join.forward(joined)))) // [n, 256]
    }
}

impl Design for FpccConfig {
    type Weights = Fpcc;

    fn fresh(&self, device: &Device) -> Fpcc {
        Fpcc::new(self, device)
    }

    fn fault(&self) -> Option<&'static str> {
        if self.neighbours == 0 {
            return Some("the network's points have no neighbours");
        }
        (self.batch_points == 0).then_some("the network's batches are empty")
    }

    fn matrix_weights(&self) -> u128 {
        let [first, second] = self.joined;
        [(self.edge, self.edge), (self.edge, self.global), (self.global, first), (first, second)]
            .into_iter()
            .fold(0, |sum: u128, (a, b)| sum.saturating_add(a as u128 * b as u128))
    }

    /// Points drawn from a piece as wide as a scene.
    fn cut(
        &self,
        scene: &ThinScene,
        config: &TrainConfig,
        mirror: bool,
        seed: SeedTree,
    ) -> Targets {
        let edge = seed.child("edge", 0).rng().random_range(NARROWEST_PIECE..1.0) * WIDEST_PIECE;
        scene.sample(self.batch_points, edge, config.margin, mirror, seed)
    }

    fn gradients(
        &self,
        weights: &Fpcc,
        tile: &Targets,
        config: &TrainConfig,
        share: f32,
        device: &Device,
    ) -> (GradientsParams, LossReport) {
        let output = weights.forward(&inputs_of(tile), device).into();
        let (total, report) = loss(output, tile, &config.loss, device);
        (GradientsParams::from_grads((total * share).backward(), weights), report)
    }

    fn loss(&self, weights: &Fpcc, tile: &Targets, config: &TrainConfig) -> LossReport {
        let device = Device::flex();
        let output = weights.forward(&inputs_of(tile), &device).into();
        loss(output, tile, &config.loss, &device).1
    }

    fn inference(weighted: &Weighted<Self>) -> Inference<'_> {
        Inference::OwnClusters(weighted)
    }
}

/// The `k` rows nearest to each row of `x`, itself included; row-major `[n · k]`, ties to the lower index.
fn nearest_features(x: Tensor<2>, k: usize) -> Vec<u32> {
    let x = x.detach();
    let n = x.dims()[0];
    let k = k.min(n);
    let norm = x.clone().square().sum_dim(1); // [n, 1]
    let squared = floats(norm.clone() + norm.transpose() - x.clone().matmul(x.transpose()) * 2.0); // [n, n]
    let mut out = Vec::with_capacity(n * k);
    for (i, row) in squared.chunks_exact(n).enumerate() {
        let mut order: Vec<(f32, u32)> = row
            .iter()
            .enumerate()
            .map(|(j, &d)| (if i == j { -1.0 } else { d.max(0.0) }, j as u32))
            .collect();
        let by = |a: &(f32, u32), b: &(f32, u32)| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1));
        if k < n {
            order.select_nth_unstable_by(k - 1, by);
        }
        order[..k].sort_by(by);
        out.extend(order[..k].iter().map(|o| o.1));
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn batches_use_every_point_once_before_filling_up() {
        let b = batches(10, 4, SeedTree::new(1));
        assert_eq!(b.iter().map(Vec::len).collect::<Vec<_>>(), [4, 4, 4]);
        let mut first: Vec<u32> = b.concat()[..10].to_vec();
        first.sort_unstable();
        assert_eq!(first, (0..10).collect::<Vec<_>>());
        assert!(batches(0, 4, SeedTree::new(1)).is_empty());
        assert_eq!(batches(3, 8, SeedTree::new(1))[0].len(), 8);
    }

    #[test]
    fn forward_equals_the_numpy_reference() {
        let device = Device::flex();
        let bytes = include_bytes!("../tests/golden/fpcc.safetensors");
        let mut net = Fpcc::new(&crate::golden::small_fpcc(), &device);
        net::weights::from_bytes(&mut net, bytes).unwrap();
        let out = net.forward(&inputs(&crate::golden::points()), &device);
        let (centre, embedding) = (floats(out.centre), floats(out.embedding));
        let want = crate::golden::rows(include_str!("../tests/golden/fpcc.csv"));
        for (i, row) in want.iter().enumerate() {
            assert!((centre[i] - row[0]).abs() < 1e-4, "centre of point {i}");
            for (q, v) in row[1..].iter().enumerate() {
                assert!(
                    (embedding[i * 128 + q] - v).abs() < 1e-3 * v.abs().max(1.0),
                    "embedding of point {i}"
                );
            }
        }
    }

    #[test]
    fn order_of_the_points_does_not_matter() {
        let device = Device::flex();
        device.seed(4);
        let net = Fpcc::new(&FpccConfig::default(), &device);
        let mut rng = SeedTree::new(9).rng();
        // Random, because equal distances are decided by the order.
        let points: Vec<Vec3> =
            (0..60).map(|_| Vec3::new(rng.random(), rng.random(), rng.random())).collect();
        let input = inputs(&points);
        let mut turned = input.clone();
        turned.reverse();
        let mut there = floats(net.forward(&turned, &device).centre);
        there.reverse();
        for (a, b) in floats(net.forward(&input, &device).centre).iter().zip(&there) {
            assert!((a - b).abs() < 1e-5);
        }
    }
}
