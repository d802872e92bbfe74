//! A sparse convolution with its normalisation: gather the neighbours' rows, multiply, scatter into the voxels' rows.
//!
//! In: rows of voxels, a table of neighbours, weights. Out: rows, forward and backward. For a few voxels at a time and one
//! offset of the kernel after the other, the rows of the neighbours there are gathered and multiplied by that offset's matrix
//! while it is in the cache; absent neighbours cost nothing. Backward is the same walk with the table turned round.
//! A row is then normalised over its channels and cut at zero, as the graph convolutions do it: no voxel's result may
//! depend on what else is in the batch.

use crate::graph_convolution::floats;
use crate::small_gemm::{COLUMNS, add_product, add_transposed_product};
use crate::voxels::NONE;
use burn::module::{Initializer, Module, Param};
use burn::optim::GradientsParams;
use burn::tensor::{Device, Tensor, TensorData};
use pulp::{Simd, WithSimd};
use rayon::prelude::*;

/// Voxels a thread works on at a time.
const ROWS: usize = 128;
/// Rows of weights are padded to a multiple of this.
const INNER: usize = 8;
/// Added to a row's variance.
const EPSILON: f32 = 1e-5;

/// Which row of the input stands at each offset of every output row.
#[derive(Clone, Copy, Debug)]
pub struct Table<'a> {
    /// `[outputs · kernel]`, [`NONE`] for no row.
    pub index: &'a [u32],
    /// Offsets.
    pub kernel: usize,
    /// Offset `k` is read at `kernel − 1 − k`: a neighbours' table walked backwards.
    pub mirrored: bool,
}

impl Table<'_> {
    fn outputs(&self) -> usize {
        self.index.len() / self.kernel
    }

    fn at(&self, row: usize, k: usize) -> u32 {
        let k = if self.mirrored { self.kernel - 1 - k } else { k };
        self.index[row * self.kernel + k]
    }
}

/// A table to walk forward and the one to walk back.
#[derive(Clone, Copy, Debug)]
pub struct Links<'a> {
    /// From outputs to inputs.
    pub forward: Table<'a>,
    /// From inputs to outputs, offset by offset.
    pub backward: Table<'a>,
}

/// Convolution without bias, normalisation over the channels, relu.
#[derive(Module, Debug)]
pub struct SparseConvolution {
    /// `[kernel, c_in, c_out]`.
    weight: Param<Tensor<3>>,
    /// `[c_out]`.
    gain: Param<Tensor<1>>,
    /// `[c_out]`.
    bias: Param<Tensor<1>>,
}

/// What the backward pass needs of a forward one.
#[derive(Clone, Debug, Default)]
pub struct Step {
    x: Vec<f32>,
    normed: Vec<f32>,
    inverse_sd: Vec<f32>,
    /// The result, `[outputs, c_out]`.
    pub y: Vec<f32>,
}

impl SparseConvolution {
    /// Random weights.
    pub fn new(kernel: usize, c_in: usize, c_out: usize, device: &Device) -> Self {
        // A surface fills about a third of a kernel of 27.
        let fan = (kernel.div_ceil(3) * c_in) as f64;
        let init = Initializer::Normal { mean: 0.0, std: (2.0 / fan).sqrt() };
        Self {
            weight: init.init([kernel, c_in, c_out], device),
            gain: Initializer::Ones.init([c_out], device),
            bias: Initializer::Zeros.init([c_out], device),
        }
    }

    /// Rows of inputs into rows of outputs.
    pub fn forward(&self, x: Vec<f32>, table: Table<'_>) -> Step {
        let [kernel, c_in, c_out] = self.weight.dims();
        assert_eq!(kernel, table.kernel, "a table of this kernel");
        let mut y = convolve(&x, table, &floats(self.weight.val()), c_in, c_out);
        let (gain, bias) = (floats(self.gain.val()), floats(self.bias.val()));
        let mut step =
            Step { x, normed: vec![0.0; y.len()], inverse_sd: Vec::new(), y: Vec::new() };
        for (row, normed) in y.chunks_exact_mut(c_out).zip(step.normed.chunks_exact_mut(c_out)) {
            let mean = row.iter().sum::<f32>() / c_out as f32;
            let variance = row.iter().map(|v| (v - mean) * (v - mean)).sum::<f32>() / c_out as f32;
            let inverse = 1.0 / (variance + EPSILON).sqrt();
            for (((v, n), g), b) in row.iter_mut().zip(normed).zip(&gain).zip(&bias) {
                *n = (*v - mean) * inverse;
                *v = (*n * g + b).max(0.0);
            }
            step.inverse_sd.push(inverse);
        }
        step.y = y;
        step
    }

    /// Gradient of the inputs for that of the outputs; the weights' gradients go into `grads`.
    pub fn backward(
        &self,
        step: &Step,
        grad: &[f32],
        links: Links<'_>,
        grads: &mut GradientsParams,
        device: &Device,
    ) -> Vec<f32> {
        let [kernel, c_in, c_out] = self.weight.dims();
        let gain = floats(self.gain.val());
        let (mut gain_grad, mut bias_grad) = (vec![0.0; c_out], vec![0.0; c_out]);
        let mut inner = vec![0.0; grad.len()];
        for (row, inverse) in step.inverse_sd.iter().enumerate() {
            let at = row * c_out..(row + 1) * c_out;
            let (g, y, n) = (&grad[at.clone()], &step.y[at.clone()], &step.normed[at.clone()]);
            let out = &mut inner[at];
            let (mut sum, mut along) = (0.0, 0.0);
            for q in 0..c_out {
                let through = if y[q] > 0.0 { g[q] } else { 0.0 };
                gain_grad[q] += through * n[q];
                bias_grad[q] += through;
                out[q] = through * gain[q];
                sum += out[q];
                along += out[q] * n[q];
            }
            let (sum, along) = (sum / c_out as f32, along / c_out as f32);
            for q in 0..c_out {
                out[q] = inverse * (out[q] - sum - n[q] * along);
            }
        }
        let weight_grad = weight_gradient(&step.x, &inner, links.forward, c_in, c_out);
        let shape = |values: Vec<f32>, n: usize| {
            Tensor::<1>::from_data(TensorData::new(values, [n]), device)
        };
        grads.register(
            self.weight.id,
            Tensor::<3>::from_data(TensorData::new(weight_grad, [kernel, c_in, c_out]), device),
        );
        grads.register(self.gain.id, shape(gain_grad, c_out));
        grads.register(self.bias.id, shape(bias_grad, c_out));
        let weight = floats(self.weight.val());
        let turned: Vec<f32> = (0..kernel * c_in * c_out)
            .map(|at| {
                let (k, rest) = (at / (c_in * c_out), at % (c_in * c_out));
                weight[k * c_in * c_out + rest % c_in * c_out + rest / c_in]
            })
            .collect();
        convolve(&inner, links.backward, &turned, c_out, c_in)
    }

    /// The same forward pass by tensor operations, differentiable on any device; slow.
    pub fn forward_tensors(&self, x: Tensor<2>, table: Table<'_>) -> Tensor<2> {
        let device = x.device();
        let [kernel, c_in, c_out] = self.weight.dims();
        let outputs = table.outputs();
        let zero = Tensor::<2>::zeros([1, c_in], &device);
        let inputs = x.dims()[0];
        let x = Tensor::cat(vec![x, zero], 0);
        let mut sum = Tensor::<2>::zeros([outputs, c_out], &device);
        for k in 0..kernel {
            let index: Vec<i32> = (0..outputs)
                .map(|row| match table.at(row, k) {
                    NONE => inputs as i32,
                    i => i as i32,
                })
                .collect();
            let index = Tensor::from_data(TensorData::new(index, [outputs]), &device);
            let weight = self.weight.val().narrow(0, k, 1).reshape([c_in, c_out]);
            sum = sum + x.clone().select(0, index).matmul(weight);
        }
        let mean = sum.clone().mean_dim(1);
        let centred = sum - mean;
        let variance = centred.clone().square().mean_dim(1);
        let normed = centred / (variance + EPSILON).sqrt();
        let row = |p: &Param<Tensor<1>>| p.val().reshape([1, c_out]);
        burn::tensor::activation::relu(normed * row(&self.gain) + row(&self.bias))
    }
}

/// `[outputs, c_out]`: for every output the sum over the offsets of its neighbour's row times that offset's matrix.
fn convolve(x: &[f32], table: Table<'_>, weight: &[f32], c_in: usize, c_out: usize) -> Vec<f32> {
    let wide = c_out.next_multiple_of(COLUMNS);
    let weight = padded(weight, c_out, wide);
    let mut out = vec![0.0; table.outputs() * wide];
    let arch = pulp::Arch::new();
    out.par_chunks_mut(ROWS * wide).enumerate().for_each_init(
        || (vec![0.0; ROWS * c_in], vec![0.0; ROWS * wide]),
        |(gathered, product), (chunk, out)| {
            let first = chunk * ROWS;
            arch.dispatch(Convolve {
                x,
                table,
                weight: &weight,
                c_in,
                wide,
                first,
                gathered,
                product,
                out,
            });
        },
    );
    if wide == c_out {
        return out;
    }
    out.chunks_exact(wide).flat_map(|r| &r[..c_out]).copied().collect()
}

struct Convolve<'a> {
    x: &'a [f32],
    table: Table<'a>,
    weight: &'a [f32],
    c_in: usize,
    wide: usize,
    first: usize,
    gathered: &'a mut [f32],
    product: &'a mut [f32],
    out: &'a mut [f32],
}

impl WithSimd for Convolve<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { x, table, weight, c_in, wide, first, gathered, product, out } = self;
        let rows = out.len() / wide;
        let mut slots = [0_u8; ROWS];
        for k in 0..table.kernel {
            let count = gather(x, table, k, first, rows, c_in, c_in, gathered, &mut slots);
            if count == 0 {
                continue;
            }
            let matrix = &weight[k * c_in * wide..(k + 1) * c_in * wide];
            let product = &mut product[..count * wide];
            product.fill(0.0);
            add_product(simd, &gathered[..count * c_in], c_in, c_in, matrix, product, wide);
            for (row, &slot) in product.chunks_exact(wide).zip(&slots) {
                let to = &mut out[usize::from(slot) * wide..][..wide];
                for (to, v) in to.iter_mut().zip(row) {
                    *to += v;
                }
            }
        }
    }
}

/// Copies the rows that stand at offset `k` of the outputs from `first` on; says which outputs have one, and how many.
#[inline(always)]
#[allow(clippy::too_many_arguments)]
fn gather(
    x: &[f32],
    table: Table<'_>,
    k: usize,
    first: usize,
    rows: usize,
    columns: usize,
    stride: usize,
    gathered: &mut [f32],
    slots: &mut [u8; ROWS],
) -> usize {
    let mut count = 0;
    for slot in 0..rows {
        let from = table.at(first + slot, k);
        if from != NONE {
            let row = &x[from as usize * columns..(from as usize + 1) * columns];
            gathered[count * stride..count * stride + columns].copy_from_slice(row);
            slots[count] = slot as u8;
            count += 1;
        }
    }
    count
}

/// `[kernel, c_in, c_out]` for the gradient `[outputs, c_out]` of the sums.
fn weight_gradient(
    x: &[f32],
    grad: &[f32],
    table: Table<'_>,
    c_in: usize,
    c_out: usize,
) -> Vec<f32> {
    let (tall, wide) = (c_in.next_multiple_of(INNER), c_out.next_multiple_of(COLUMNS));
    let grad = padded(grad, c_out, wide);
    let mut sums = vec![0.0; table.kernel * tall * wide];
    pulp::Arch::new().dispatch(WeightGradient {
        x,
        grad: &grad,
        table,
        c_in,
        tall,
        wide,
        sums: &mut sums,
    });
    let rows = sums.chunks_exact(tall * wide).flat_map(|m| &m[..c_in * wide]);
    let dense: Vec<f32> = rows.copied().collect();
    if wide == c_out {
        return dense;
    }
    dense.chunks_exact(wide).flat_map(|r| &r[..c_out]).copied().collect()
}

struct WeightGradient<'a> {
    x: &'a [f32],
    grad: &'a [f32],
    table: Table<'a>,
    c_in: usize,
    tall: usize,
    wide: usize,
    sums: &'a mut [f32],
}

impl WithSimd for WeightGradient<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { x, grad, table, c_in, tall, wide, sums } = self;
        let (mut gathered, mut picked) = (vec![0.0; ROWS * tall], vec![0.0; ROWS * wide]);
        let mut slots = [0_u8; ROWS];
        for first in (0..table.outputs()).step_by(ROWS) {
            let rows = ROWS.min(table.outputs() - first);
            for k in 0..table.kernel {
                let count = gather(x, table, k, first, rows, c_in, tall, &mut gathered, &mut slots);
                if count == 0 {
                    continue;
                }
                for (row, &slot) in picked.chunks_exact_mut(wide).zip(&slots[..count]) {
                    let from = first + usize::from(slot);
                    row.copy_from_slice(&grad[from * wide..(from + 1) * wide]);
                }
                let to = &mut sums[k * tall * wide..(k + 1) * tall * wide];
                add_transposed_product(
                    simd,
                    &gathered[..count * tall],
                    tall,
                    &picked[..count * wide],
                    to,
                    wide,
                );
            }
        }
    }
}

fn padded(rows: &[f32], columns: usize, wide: usize) -> Vec<f32> {
    let mut out = vec![0.0; rows.len() / columns * wide];
    for (to, from) in out.chunks_exact_mut(wide).zip(rows.chunks_exact(columns)) {
        to[..columns].copy_from_slice(from);
    }
    out
}
