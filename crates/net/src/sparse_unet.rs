//! A U-Net of sparse convolutions (Graham et al., CVPR 2018; the backbone of PointGroup, CVPR 2020), in our own make.
//!
//! In: a cloud as [`Voxels`]. Out: one row of features a point. On every level a convolution over the 27 neighbours, a
//! halving into the next level, and back: a doubling, joined with what the level knew, and a convolution over both. Training
//! walks back by hand, as the graph backbone does: the caller's tape begins at a leaf, see [`UnetTrace`].

use crate::graph_convolution::floats;
use crate::sparse_convolution::{Links, SparseConvolution, Step, Table};
use crate::voxels::{CHILDREN, INPUT, NEIGHBOURS, VoxelLevel, Voxels};
use burn::module::Module;
use burn::optim::GradientsParams;
use burn::tensor::{Device, Tensor, TensorData};
use serde::{Deserialize, Serialize};

/// Widths of the network.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct UnetConfig {
    /// Voxels along the caller's unit of length.
    pub resolution: usize,
    /// Channels of each level, finest first.
    pub channels: Vec<usize>,
}

impl Default for UnetConfig {
    fn default() -> Self {
        Self { resolution: 7, channels: vec![32, 48, 64, 64] }
    }
}

impl UnetConfig {
    /// The cloud as this network reads it.
    pub fn voxels(&self, points: &[geom::Vec3]) -> Voxels {
        Voxels::new(points, 1.0 / self.resolution as f32, self.channels.len())
    }

    /// Features of a point.
    pub fn features(&self) -> usize {
        self.channels[0]
    }

    /// Numbers in the matrices of such a network: what a file that claims these widths must hold.
    pub fn matrix_weights(&self) -> u128 {
        let product = |k: usize, a: usize, b: usize| {
            (k as u128).saturating_mul(a as u128).saturating_mul(b as u128)
        };
        let first = self.channels.first().map_or(0, |&c| product(NEIGHBOURS, INPUT, c));
        let level = |i: usize| {
            let c = self.channels[i];
            let next = self.channels.get(i + 1);
            let around = product(NEIGHBOURS, c, c);
            next.map_or(around, |&n| {
                around.saturating_add(product(2 * CHILDREN, c, n)).saturating_add(product(
                    NEIGHBOURS,
                    c.saturating_mul(2),
                    c,
                ))
            })
        };
        (0..self.channels.len()).fold(first, |sum, i| sum.saturating_add(level(i)))
    }
}

/// The network's weights.
#[derive(Module, Debug)]
pub struct SparseUnet {
    first: SparseConvolution,
    /// One a level.
    down: Vec<SparseConvolution>,
    /// From each level into the next, and back.
    halve: Vec<SparseConvolution>,
    double: Vec<SparseConvolution>,
    /// Over both halves; none on the last level.
    up: Vec<SparseConvolution>,
}

/// Every convolution's pass, in the order of the network's fields.
struct Steps {
    first: Step,
    down: Vec<Step>,
    halve: Vec<Step>,
    double: Vec<Step>,
    up: Vec<Step>,
}

/// A forward pass that can be walked backwards.
pub struct UnetTrace<'a> {
    network: &'a SparseUnet,
    voxels: &'a Voxels,
    steps: Steps,
    leaf: Tensor<2>,
}

impl SparseUnet {
    /// Random weights.
    pub fn new(config: &UnetConfig, device: &Device) -> Self {
        let c = &config.channels;
        let around = |a: usize, b: usize| SparseConvolution::new(NEIGHBOURS, a, b, device);
        let between = |a: usize, b: usize| SparseConvolution::new(CHILDREN, a, b, device);
        let last = c.len() - 1;
        Self {
            first: around(INPUT, c[0]),
            down: c.iter().map(|&c| around(c, c)).collect(),
            halve: (0..last).map(|i| between(c[i], c[i + 1])).collect(),
            double: (0..last).map(|i| between(c[i + 1], c[i])).collect(),
            up: (0..last).map(|i| around(2 * c[i], c[i])).collect(),
        }
    }

    /// Features `[points, c]`, no gradients. Runs on the current rayon pool.
    pub fn infer(&self, voxels: &Voxels) -> Vec<f32> {
        let steps = self.run(voxels);
        gather_points(voxels, finest(&steps))
    }

    /// A forward pass with gradients; `device` has autodiff.
    pub fn trace<'a>(&'a self, voxels: &'a Voxels, device: &Device) -> UnetTrace<'a> {
        let steps = self.run(voxels);
        let n = voxels.voxel_of_point.len();
        let rows = gather_points(voxels, finest(&steps));
        let columns = rows.len() / n.max(1);
        let leaf = Tensor::from_data(TensorData::new(rows, [n, columns]), device).require_grad();
        UnetTrace { network: self, voxels, steps, leaf }
    }

    /// The same by tensor operations alone, differentiable on any device; much slower on a CPU.
    pub fn forward_tensors(&self, voxels: &Voxels, device: &Device) -> Tensor<2> {
        let count = voxels.levels[0].count;
        let x = Tensor::from_data(TensorData::new(voxels.input.clone(), [count, INPUT]), device);
        let mut x = self.first.forward_tensors(x, around(&voxels.levels[0]).forward);
        let mut kept = Vec::new();
        for (i, level) in voxels.levels.iter().enumerate() {
            x = self.down[i].forward_tensors(x, around(level).forward);
            if let Some(halve) = self.halve.get(i) {
                kept.push(x.clone());
                x = halve.forward_tensors(x, halving(level).forward);
            }
        }
        for (i, own) in kept.into_iter().enumerate().rev() {
            let level = &voxels.levels[i];
            let wide = self.double[i].forward_tensors(x, doubling(level).forward);
            x = self.up[i].forward_tensors(Tensor::cat(vec![own, wide], 1), around(level).forward);
        }
        let index: Vec<i32> = voxels.voxel_of_point.iter().map(|&v| v as i32).collect();
        let n = index.len();
        x.select(0, Tensor::from_data(TensorData::new(index, [n]), device))
    }

    fn run(&self, voxels: &Voxels) -> Steps {
        let levels = &voxels.levels;
        let mut steps = Steps {
            first: self.first.forward(voxels.input.clone(), around(&levels[0]).forward),
            down: Vec::new(),
            halve: Vec::new(),
            double: Vec::new(),
            up: Vec::new(),
        };
        let mut x = steps.first.y.clone();
        for (i, level) in levels.iter().enumerate() {
            let step = self.down[i].forward(x, around(level).forward);
            x = step.y.clone();
            steps.down.push(step);
            if let Some(halve) = self.halve.get(i) {
                let step = halve.forward(x, halving(level).forward);
                x = step.y.clone();
                steps.halve.push(step);
            }
        }
        // Coarsest first; turned round at the end, so that number i is level i again.
        for i in (0..self.up.len()).rev() {
            let step = self.double[i].forward(x, doubling(&levels[i]).forward);
            let both = joined(&steps.down[i].y, &step.y, levels[i].count);
            steps.double.push(step);
            let step = self.up[i].forward(both, around(&levels[i]).forward);
            x = step.y.clone();
            steps.up.push(step);
        }
        steps.double.reverse();
        steps.up.reverse();
        steps
    }
}

impl UnetTrace<'_> {
    /// Features `[points, c]` on the caller's tape.
    pub fn features(&self) -> Tensor<2> {
        self.leaf.clone()
    }

    /// Runs `loss` backwards through the caller's tape and the network: gradients of every parameter of `module`, which
    /// holds this network.
    pub fn backward<M: Module>(
        self,
        module: &M,
        loss: &Tensor<1>,
        device: &Device,
    ) -> GradientsParams {
        let plain = device.clone().without_autodiff();
        let mut tape = loss.backward();
        let rows = self.leaf.grad_remove(&mut tape).map(floats);
        let mut grads = GradientsParams::from_grads(tape, module);
        let (net, levels, steps) = (self.network, &self.voxels.levels, &self.steps);
        let count = levels[0].count;
        let columns = self.leaf.dims()[1];
        let mut grad = vec![0.0; count * columns];
        let rows = rows.unwrap_or_else(|| vec![0.0; self.voxels.voxel_of_point.len() * columns]);
        for (row, &v) in rows.chunks_exact(columns).zip(&self.voxels.voxel_of_point) {
            for (to, g) in grad[v as usize * columns..].iter_mut().zip(row) {
                *to += g;
            }
        }
        // What each level's own rows are told by the join above them.
        let mut own: Vec<Vec<f32>> = Vec::new();
        for i in 0..net.up.len() {
            let level = &levels[i];
            let both = net.up[i].backward(&steps.up[i], &grad, around(level), &mut grads, &plain);
            let (kept, wide) = parted(&both, level.count);
            own.push(kept);
            grad = net.double[i].backward(
                &steps.double[i],
                &wide,
                doubling(level),
                &mut grads,
                &plain,
            );
        }
        for i in (0..levels.len()).rev() {
            let level = &levels[i];
            if let (Some(halve), Some(kept)) = (net.halve.get(i), own.get(i)) {
                grad = halve.backward(&steps.halve[i], &grad, halving(level), &mut grads, &plain);
                for (g, k) in grad.iter_mut().zip(kept) {
                    *g += k;
                }
            }
            grad = net.down[i].backward(&steps.down[i], &grad, around(level), &mut grads, &plain);
        }
        net.first.backward(&steps.first, &grad, around(&levels[0]), &mut grads, &plain);
        grads
    }
}

fn around(level: &VoxelLevel) -> Links<'_> {
    let table = |mirrored| Table { index: &level.neighbours, kernel: NEIGHBOURS, mirrored };
    Links { forward: table(false), backward: table(true) }
}

fn halving(level: &VoxelLevel) -> Links<'_> {
    let table = |index| Table { index, kernel: CHILDREN, mirrored: false };
    Links { forward: table(&level.children), backward: table(&level.parents) }
}

fn doubling(level: &VoxelLevel) -> Links<'_> {
    let Links { forward, backward } = halving(level);
    Links { forward: backward, backward: forward }
}

fn finest(steps: &Steps) -> &[f32] {
    steps.up.first().map_or(&steps.down[0].y, |s| &s.y)
}

fn gather_points(voxels: &Voxels, rows: &[f32]) -> Vec<f32> {
    let columns = rows.len() / voxels.levels[0].count.max(1);
    let row = |&v: &u32| rows[v as usize * columns..(v as usize + 1) * columns].iter().copied();
    voxels.voxel_of_point.iter().flat_map(row).collect()
}

/// Rows of both, side by side.
fn joined(a: &[f32], b: &[f32], rows: usize) -> Vec<f32> {
    let (wide_a, wide_b) = (a.len() / rows.max(1), b.len() / rows.max(1));
    let mut out = Vec::with_capacity(a.len() + b.len());
    for row in 0..rows {
        out.extend(&a[row * wide_a..(row + 1) * wide_a]);
        out.extend(&b[row * wide_b..(row + 1) * wide_b]);
    }
    out
}

/// Both halves of rows.
fn parted(both: &[f32], rows: usize) -> (Vec<f32>, Vec<f32>) {
    let wide = both.len() / rows.max(1);
    let half = |right: bool| {
        let side = move |row: &[f32]| {
            if right { row[wide / 2..].to_vec() } else { row[..wide / 2].to_vec() }
        };
        both.chunks_exact(wide.max(1)).flat_map(side).collect()
    };
    (half(false), half(true))
}

#[cfg(test)]
mod tests {
    use super::*;
    use burn::module::{ModuleVisitor, Param};
    use geom::{SeedTree, Vec3};
    use rand::RngExt;

    fn small() -> UnetConfig {
        UnetConfig { resolution: 4, channels: vec![12, 8, 16] }
    }

    fn points(n: usize) -> Vec<Vec3> {
        let mut rng = SeedTree::new(7).rng();
        (0..n)
            .map(|_| {
                let (x, y): (f32, f32) = (rng.random(), rng.random());
                Vec3::new(4.0 * x, 4.0 * y, (3.0 * x).sin() * 0.5)
            })
            .collect()
    }

    /// A fixed scalar of the features that gives every one its own weight.
    fn weigh(features: Tensor<2>) -> Tensor<1> {
        let [n, c] = features.dims();
        let w: Vec<f32> = (0..n * c).map(|i| ((i * 31 % 17) as f32 - 8.0) / 40.0).collect();
        let w = Tensor::<2>::from_data(TensorData::new(w, [n, c]), &features.device());
        (features * w).sum()
    }

    struct Compare<'a> {
        ours: &'a GradientsParams,
        tape: &'a GradientsParams,
        seen: usize,
    }

    impl ModuleVisitor for Compare<'_> {
        fn visit_float<const D: usize>(&mut self, param: &Param<Tensor<D>>) {
            let ours = floats(self.ours.get::<D>(param.id).expect("ours"));
            let tape = floats(self.tape.get::<D>(param.id).expect("the tape's"));
            let size = tape.iter().map(|v| v.abs()).fold(0.0_f32, f32::max).max(1e-3);
            for (a, b) in ours.iter().zip(&tape) {
                assert!((a - b).abs() < 2e-3 * size, "{a} {b} of {size}");
            }
            self.seen += 1;
        }
    }

    #[test]
    fn forward_and_gradients_equal_the_tape() {
        let device = Device::flex().autodiff();
        device.seed(3);
        let network = SparseUnet::new(&small(), &device);
        let voxels = small().voxels(&points(500));
        assert!(voxels.levels[0].count < 500 && voxels.levels[2].count > 1);
        let plain = network.forward_tensors(&voxels, &device);
        let trace = network.trace(&voxels, &device);
        let features = trace.features();
        for (a, b) in floats(plain.clone()).iter().zip(floats(features.clone())) {
            assert!((a - b).abs() < 1e-4, "{a} {b}");
        }
        assert_eq!(network.infer(&voxels), floats(features.clone()));
        let ours = trace.backward(&network, &weigh(features), &device);
        let tape = GradientsParams::from_grads(weigh(plain).backward(), &network);
        let mut compare = Compare { ours: &ours, tape: &tape, seen: 0 };
        network.visit(&mut compare);
        // Three of every convolution: the first, three down, two between and back, two up.
        assert_eq!(compare.seen, 3 * (1 + 3 + 2 + 2 + 2));
    }

    #[test]
    fn the_order_of_the_points_does_not_matter() {
        let device = Device::flex();
        device.seed(5);
        let network = SparseUnet::new(&small(), &device);
        let points = points(300);
        let there = network.infer(&small().voxels(&points));
        let turned: Vec<Vec3> = points.iter().rev().copied().collect();
        let back = network.infer(&small().voxels(&turned));
        for (a, b) in there.chunks(12).zip(back.chunks(12).rev()) {
            assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-4));
        }
    }

    #[test]
    fn an_empty_cloud_has_no_features() {
        let device = Device::flex();
        let network = SparseUnet::new(&small(), &device);
        assert!(network.infer(&small().voxels(&[])).is_empty());
    }

    #[test]
    fn a_file_must_hold_what_the_widths_ask_for() {
        let device = Device::flex();
        let bytes = crate::weights::to_bytes(&SparseUnet::new(&small(), &device), &[].into());
        let bytes = bytes.unwrap().len() as u128;
        let asked = small().matrix_weights() * 4;
        assert!(asked <= bytes && asked > bytes * 8 / 10, "{asked} of {bytes}");
    }
}
