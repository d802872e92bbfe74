//! The FPCCv2 backbone (METHOD §3): three graph convolutions on one neighbourhood, joined and mixed into 512 numbers a point.
//!
//! Widths are ours (the thesis prints none): edge features 54/54/86 — with the ten relative-position numbers whole
//! registers of 64 and 96 columns — and level features 64/96/128.
//!
//! Training splices the fused pooling into the library's gradient tape: every level is a short tape of its own
//! between leaves, walked backwards by hand in [`Trace::backward`].

use crate::Neighbourhood;
use crate::graph_convolution::{GraphConvolution, floats};
use burn::module::Module;
use burn::nn::{Linear, LinearConfig};
use burn::optim::{GradientsAccumulator, GradientsParams};
use burn::tensor::activation::relu;
use burn::tensor::{Device, Tensor, TensorData};
use serde::{Deserialize, Serialize};

/// Widths of the backbone.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BackboneConfig {
    /// Neighbours K.
    pub neighbours: usize,
    /// Dilation d.
    pub dilation: usize,
    /// Features on the edges of each level.
    pub edge: Vec<usize>,
    /// Features of each level's result.
    pub level: Vec<usize>,
    /// Features of the result.
    pub out: usize,
}

impl Default for BackboneConfig {
    fn default() -> Self {
        Self {
            neighbours: 20,
            dilation: 4,
            edge: vec![54, 54, 86],
            level: vec![64, 96, 128],
            out: 512,
        }
    }
}

impl BackboneConfig {
    /// Numbers in the matrices of such a backbone, biases left out: what a file that claims these widths must hold.
    pub fn matrix_weights(&self) -> u128 {
        let product = |a: usize, b: usize| a as u128 * b as u128;
        let mut sum = product(self.out, self.out);
        let mut c_in = 3;
        for (&edge, &level) in self.edge.iter().zip(&self.level) {
            for (a, b) in [(c_in, edge), (edge, edge), (edge, level), (level, self.out)] {
                sum = sum.saturating_add(product(a, b));
            }
            c_in = level;
        }
        sum
    }
}

/// The backbone's weights.
#[derive(Module, Debug)]
pub struct GraphBackbone {
    levels: Vec<GraphConvolution>,
    join: Linear,
    mix: Linear,
}

/// A forward pass that can be walked backwards.
pub struct Trace<'a> {
    backbone: &'a GraphBackbone,
    hood: &'a Neighbourhood,
    levels: Vec<Level>,
    /// Leaves of the caller's tape: the levels' results `[n, level]`.
    leaves: Vec<Tensor<2>>,
}

/// What a level leaves behind: its edge features, its pooled leaf, and what the tape made of it.
struct Level {
    a: Vec<f32>,
    pooled: Tensor<2>,
    result: Tensor<2>,
    next_a: Option<Tensor<2>>,
}

impl GraphBackbone {
    /// Random weights.
    pub fn new(config: &BackboneConfig, device: &Device) -> Self {
        let mut c_in = 3;
        let mut levels = Vec::new();
        for (&edge, &level) in config.edge.iter().zip(&config.level) {
            levels.push(GraphConvolution::new(c_in, edge, level, device));
            c_in = level;
        }
        let joined = config.level.iter().sum();
        Self {
            levels,
            join: LinearConfig::new(joined, config.out).init(device),
            mix: LinearConfig::new(config.out, config.out).init(device),
        }
    }

    /// Features of the first `wanted` points, no gradients: `each` hears blocks `[rows, out]` in order with the number
    /// of their first point. Where a level's result is only looked at from nearby, only the part that is looked at is
    /// computed, and blocks of rows stay in the cache through a level's tensor operations.
    pub fn infer_blocks(
        &self,
        hood: &Neighbourhood,
        wanted: usize,
        device: &Device,
        mut each: impl FnMut(usize, Tensor<2>),
    ) {
        // Points that a level must answer for: those the next one looks at.
        let mut counts = vec![wanted];
        for _ in 1..self.levels.len() {
            counts.insert(0, hood.reach(counts[0]));
        }
        let seen = hood.reach(counts[0]);
        let mut a = Vec::new();
        for (first, count) in blocks(seen) {
            let position =
                hood.position[first..first + count].iter().flat_map(|p| p.to_array()).collect();
            a.extend(floats(self.levels[0].project(rows(position, count, device))));
        }
        let mut results: Vec<Vec<f32>> = Vec::new();
        for (at, level) in self.levels.iter().enumerate() {
            let pooled = level.pool_fused(&a, hood, counts[at]);
            let wide = pooled.len() / counts[at].max(1);
            a.clear();
            let mut result = Vec::new();
            for (first, count) in blocks(counts[at]) {
                let block = pooled[first * wide..(first + count) * wide].to_vec();
                let x = level.finish_values(rows(block, count, device));
                if first < wanted {
                    result.extend_from_slice(&x);
                }
                if let Some(next) = self.levels.get(at + 1) {
                    a.extend(floats(next.project(rows(x, count, device))));
                }
            }
            results.push(result);
        }
        for (first, count) in blocks(wanted) {
            let part = |(level, result): (usize, &Vec<f32>)| {
                let columns = self.levels[level].columns();
                rows(result[first * columns..(first + count) * columns].to_vec(), count, device)
            };
            each(first, self.join_levels(results.iter().enumerate().map(part).collect()));
        }
    }

    /// The same by tensor operations alone, differentiable on any device; much slower on a CPU.
    pub fn forward_tensors(&self, hood: &Neighbourhood, device: &Device) -> Tensor<2> {
        let mut x = positions(hood, device);
        let mut results = Vec::new();
        for level in &self.levels {
            x = level.finish(level.pool_tensors(level.project(x), hood));
            results.push(x.clone());
        }
        self.join_levels(results)
    }

    /// The levels' results `[n, level]` into `[n, out]`.
    pub fn join_levels(&self, results: Vec<Tensor<2>>) -> Tensor<2> {
        let x = relu(self.join.forward(Tensor::cat(results, 1))); // [n, out]
        relu(self.mix.forward(x.clone()) + x) // [n, out]
    }

    /// A forward pass with gradients; `device` has autodiff. Continue with [`Trace::features`].
    pub fn trace<'a>(&'a self, hood: &'a Neighbourhood, device: &Device) -> Trace<'a> {
        let mut levels: Vec<Level> = Vec::new();
        let mut leaves = Vec::new();
        let mut a = floats(self.levels[0].project(positions(hood, &device.clone())));
        for (at, level) in self.levels.iter().enumerate() {
            let pooled =
                rows(level.pool_fused(&a, hood, hood.len()), hood.len(), device).require_grad();
            let result = level.finish(pooled.clone());
            let next_a = self.levels.get(at + 1).map(|next| next.project(result.clone()));
            leaves.push(rows(floats(result.clone()), hood.len(), device).require_grad());
            let next_values = next_a.clone().map(floats);
            levels.push(Level { a, pooled, result, next_a });
            a = next_values.unwrap_or_default();
        }
        Trace { backbone: self, hood, levels, leaves }
    }
}

impl Trace<'_> {
    /// Features `[n, out]` on the caller's tape.
    pub fn features(&self) -> Tensor<2> {
        self.backbone.join_levels(self.leaves.clone())
    }

    /// Runs `loss` backwards through the caller's tape and the backbone: gradients of every parameter of `module`,
    /// which holds this backbone.
    pub fn backward<M: Module>(
        self,
        module: &M,
        loss: &Tensor<1>,
        device: &Device,
    ) -> GradientsParams {
        let plain = device.clone().without_autodiff();
        let mut sum = GradientsAccumulator::new();
        let mut tape = loss.backward();
        let mut leaf_grads: Vec<Option<Tensor<2>>> =
            self.leaves.iter().map(|l| l.grad_remove(&mut tape)).collect();
        sum.accumulate(module, GradientsParams::from_grads(tape, module));
        let n = self.hood.len();
        let mut next_grad: Option<Vec<f32>> = None;
        for (at, level) in self.levels.into_iter().enumerate().rev() {
            let grad = leaf_grads[at].take().expect("every level is joined into the features");
            // A scalar whose gradient at this level's results is the gradient already known.
            let mut proxy = (level.result * grad.autodiff()).sum();
            if let (Some(next_a), Some(grad)) = (level.next_a, next_grad.take()) {
                proxy = proxy + (next_a * rows(grad, n, &plain).autodiff()).sum();
            }
            let mut tape = proxy.backward();
            let pooled =
                level.pooled.grad_remove(&mut tape).expect("the pooled features are a leaf");
            let mut grads = GradientsParams::from_grads(tape, module);
            let layer = &self.backbone.levels[at];
            let grad_a =
                layer.pool_fused_backward(&level.a, self.hood, &floats(pooled), &mut grads, &plain);
            sum.accumulate(module, grads);
            next_grad = Some(grad_a);
        }
        // The first level's matrix: a = positions · W.
        let grad = next_grad.expect("a backbone has levels");
        let first = &self.backbone.levels[0];
        let x = positions(self.hood, device);
        let proxy = (first.project(x) * rows(grad, n, &plain).autodiff()).sum();
        sum.accumulate(module, GradientsParams::from_grads(proxy.backward(), module));
        sum.grads()
    }
}

/// Rows of a block: 1024 rows of 512 numbers are 2 MB.
const BLOCK: usize = 1024;

/// First row and number of rows of every block.
fn blocks(count: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..count).step_by(BLOCK).map(move |first| (first, BLOCK.min(count - first)))
}

fn positions(hood: &Neighbourhood, device: &Device) -> Tensor<2> {
    rows(hood.position.iter().flat_map(|p| p.to_array()).collect(), hood.len(), device)
}

/// `[n, len / n]` from row-major numbers.
fn rows(values: Vec<f32>, n: usize, device: &Device) -> Tensor<2> {
    let columns = values.len() / n.max(1);
    Tensor::from_data(TensorData::new(values, [n, columns]), device)
}

#[cfg(test)]
mod tests {
    use super::*;
    use burn::module::ModuleVisitor;
    use burn::module::Param;
    use geom::{SeedTree, Vec3};
    use rand::RngExt;

    fn hood(n: usize) -> Neighbourhood {
        let mut rng = SeedTree::new(5).rng();
        let mut draw = || rng.random::<f32>() * 3.0;
        let points = (0..n).map(|_| Vec3::new(draw(), draw(), draw())).collect();
        Neighbourhood::dilated(points, 6, 2)
    }

    fn small() -> BackboneConfig {
        BackboneConfig {
            neighbours: 6,
            dilation: 2,
            edge: vec![8, 12, 22],
            level: vec![9, 10, 11],
            out: 16,
        }
    }

    fn inferred(backbone: &GraphBackbone, hood: &Neighbourhood, wanted: usize) -> Vec<f32> {
        let mut out = Vec::new();
        backbone.infer_blocks(hood, wanted, &Device::flex(), |first, x| {
            assert_eq!(first * 16, out.len());
            out.extend(floats(x));
        });
        out
    }

    struct Compare<'a> {
        ours: &'a GradientsParams,
        tape: &'a GradientsParams,
        seen: usize,
    }

    impl ModuleVisitor for Compare<'_> {
        fn visit_float<const D: usize>(&mut self, param: &Param<Tensor<D>>) {
            let ours = floats(self.ours.get::<D>(param.id).expect("our gradient"));
            let tape = floats(self.tape.get::<D>(param.id).expect("the tape's gradient"));
            let scale = tape.iter().fold(0.0_f32, |a, b| a.max(b.abs()));
            for (a, b) in ours.iter().zip(&tape) {
                assert!(
                    (a - b).abs() <= 1e-3 * scale + 1e-6,
                    "parameter {}: {a} against {b}",
                    self.seen
                );
            }
            self.seen += 1;
        }
    }

    #[test]
    fn spliced_gradients_equal_the_tape() {
        let device = Device::flex().autodiff();
        device.seed(1);
        let backbone = GraphBackbone::new(&small(), &device);
        let hood = hood(60);
        let weigh = |x: Tensor<2>| {
            let n = x.dims()[0] * x.dims()[1];
            let w: Vec<f32> = (0..n).map(|i| ((i * 31 % 23) as f32 - 11.0) / 11.0).collect();
            (x * rows(w, 60, &device)).sum()
        };
        let trace = backbone.trace(&hood, &device);
        let features = trace.features();
        let plain = backbone.forward_tensors(&hood, &device);
        for (a, b) in floats(features.clone()).iter().zip(floats(plain.clone())) {
            assert!((a - b).abs() < 1e-4);
        }
        for wanted in [60, 7] {
            let got = inferred(&backbone, &hood, wanted);
            assert_eq!(got.len(), wanted * 16);
            for (a, b) in floats(features.clone()).iter().zip(got) {
                assert!((a - b).abs() < 1e-5);
            }
        }
        let ours = trace.backward(&backbone, &weigh(features), &device);
        let tape = GradientsParams::from_grads(weigh(plain).backward(), &backbone);
        let mut compare = Compare { ours: &ours, tape: &tape, seen: 0 };
        backbone.visit(&mut compare);
        assert_eq!(compare.seen, 3 * 8 + 4);
    }

    #[test]
    fn weights_survive_bytes_and_foreign_ones_are_named() {
        let device = Device::flex();
        device.seed(2);
        let backbone = GraphBackbone::new(&small(), &device);
        let bytes =
            crate::weights::to_bytes(&backbone, &[("kind".into(), "test".into())].into()).unwrap();
        assert_eq!(crate::weights::metadata(&bytes).unwrap()["kind"], "test");
        device.seed(3);
        let mut other = GraphBackbone::new(&small(), &device);
        let hood = hood(30);
        crate::weights::from_bytes(&mut other, &bytes).unwrap();
        assert_eq!(inferred(&other, &hood, 30), inferred(&backbone, &hood, 30));
        let mut wide = GraphBackbone::new(&BackboneConfig { out: 20, ..small() }, &device);
        assert!(matches!(
            crate::weights::from_bytes(&mut wide, &bytes),
            Err(crate::WeightsError::Mismatch(_))
        ));
        assert!(matches!(
            crate::weights::from_bytes(&mut other, &bytes[..40]),
            Err(crate::WeightsError::Format(_))
        ));
        assert!(matches!(
            crate::weights::from_bytes(&mut other, b"ply"),
            Err(crate::WeightsError::Format(_))
        ));
    }
}
