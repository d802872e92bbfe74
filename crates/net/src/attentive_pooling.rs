//! The graph convolution of METHOD §3 (Eqs. 3.1–3.6) as one fused operation, forward and backward.
//!
//! In: per-point features `a` already multiplied by the layer's matrix (so that the product runs once a point, not once
//! a neighbour), the neighbourhood, and the layer's weights. Out, per point, with l the ten relative-position numbers:
//!   r_k = relu(a_i − a_k + l_k·position + bias),  f_k = r_k ⊕ l_k,  w = softmax over k (f·attention),  Σ_k w_k ⊙ f_k.
//! Written out, the K-fold tensors of a tile would go through memory some thirty times a step; here a few points at a
//! time stay in the cache and the backward pass recomputes instead of remembering.

use crate::Neighbourhood;
use crate::small_gemm::{COLUMNS, add_product, add_transposed_product, exp_nonpositive};
use pulp::{Simd, WithSimd};
use rayon::prelude::*;

/// Numbers in a relative position.
pub const RELATIVE: usize = 10;
/// Row stride of the relative positions.
const RELATIVE_STRIDE: usize = 16;
/// Points a thread works on at a time; 16 · 20 rows of 96 columns are 120 kB.
const POINTS: usize = 16;

/// Weights of one graph convolution of `c` features, row-major.
#[derive(Clone, Copy, Debug)]
pub struct PoolingWeights<'a> {
    /// `[10, c]`.
    pub position: &'a [f32],
    /// `[c]`.
    pub bias: &'a [f32],
    /// `[c + 10, c + 10]`.
    pub attention: &'a [f32],
}

/// Gradients of everything [`pool`] takes.
#[derive(Clone, Debug, PartialEq)]
pub struct PoolingGradients {
    /// `[n, c]`.
    pub a: Vec<f32>,
    /// `[10, c]`.
    pub position: Vec<f32>,
    /// `[c]`.
    pub bias: Vec<f32>,
    /// `[c + 10, c + 10]`.
    pub attention: Vec<f32>,
}

/// Pooled features `[count, c + 10]` of the first `count` points; `a` `[m, c]` reaches as far as their neighbours do
/// ([`Neighbourhood::reach`]). Runs on the current rayon pool.
pub fn pool(
    a: &[f32],
    hood: &Neighbourhood,
    count: usize,
    weights: PoolingWeights<'_>,
) -> Vec<f32> {
    assert!(a.len() >= hood.reach(count) * weights.bias.len(), "one row of features a neighbour");
    let layer = Layer::new(a, hood, weights);
    let mut out = vec![0.0; count * layer.wide];
    let arch = pulp::Arch::new();
    out.par_chunks_mut(POINTS * layer.wide).enumerate().for_each_init(
        || Buffers::new(&layer),
        |buffers, (chunk, out)| {
            arch.dispatch(Forward { layer: &layer, first: chunk * POINTS, buffers, out });
        },
    );
    unpad(out, layer.wide, layer.c + RELATIVE)
}

/// Gradients for the gradient `grad` `[n, c + 10]` of the pooled features; single-threaded.
pub fn pool_backward(
    a: &[f32],
    hood: &Neighbourhood,
    weights: PoolingWeights<'_>,
    grad: &[f32],
) -> PoolingGradients {
    assert_eq!(a.len(), hood.len() * weights.bias.len(), "one row of features a point");
    let layer = Layer::new(a, hood, weights);
    let (wide, f) = (layer.wide, layer.c + RELATIVE);
    let grad = pad(grad, f, wide, hood.len());
    let attention_transposed = transpose(&layer.attention, wide);
    let mut sums = Sums {
        a: vec![0.0; hood.len() * wide],
        position: vec![0.0; RELATIVE_STRIDE * wide],
        bias: vec![0.0; wide],
        attention: vec![0.0; wide * wide],
    };
    let mut buffers = Buffers::new(&layer);
    let mut out = vec![0.0; POINTS * wide];
    let arch = pulp::Arch::new();
    for first in (0..hood.len()).step_by(POINTS) {
        let count = POINTS.min(hood.len() - first);
        arch.dispatch(Backward {
            layer: &layer,
            attention_transposed: &attention_transposed,
            first,
            grad: &grad[first * wide..(first + count) * wide],
            buffers: &mut buffers,
            out: &mut out[..count * wide],
            sums: &mut sums,
        });
    }
    PoolingGradients {
        a: unpad(sums.a, wide, layer.c),
        position: unpad(sums.position[..RELATIVE * wide].to_vec(), wide, layer.c),
        bias: sums.bias[..layer.c].to_vec(),
        attention: unpad(sums.attention[..f * wide].to_vec(), wide, f),
    }
}

/// Inputs with columns padded to whole registers; the padding is zero and stays zero through every step.
struct Layer<'a> {
    hood: &'a Neighbourhood,
    c: usize,
    wide: usize,
    a: Vec<f32>,
    position: Vec<f32>,
    bias: Vec<f32>,
    attention: Vec<f32>,
}

impl<'a> Layer<'a> {
    fn new(a: &[f32], hood: &'a Neighbourhood, weights: PoolingWeights<'_>) -> Self {
        let c = weights.bias.len();
        let f = c + RELATIVE;
        assert_eq!(weights.position.len(), RELATIVE * c, "position weights");
        assert_eq!(weights.attention.len(), f * f, "attention weights");
        let wide = f.next_multiple_of(COLUMNS);
        let mut attention = pad(weights.attention, f, wide, f);
        attention.resize(wide * wide, 0.0);
        Self {
            hood,
            c,
            wide,
            a: pad(a, c, wide, a.len() / c),
            position: pad(weights.position, c, wide, RELATIVE),
            bias: pad(weights.bias, c, wide, 1),
            attention,
        }
    }
}

/// What a thread keeps in its cache: all `[POINTS · k, …]`.
struct Buffers {
    relative: Vec<f32>,
    features: Vec<f32>,
    weights: Vec<f32>,
    grads: Vec<f32>,
    line: Vec<f32>,
}

impl Buffers {
    fn new(layer: &Layer<'_>) -> Self {
        let rows = POINTS * layer.hood.k;
        Self {
            relative: vec![0.0; rows * RELATIVE_STRIDE],
            features: vec![0.0; rows * layer.wide],
            weights: vec![0.0; rows * layer.wide],
            grads: vec![0.0; rows * layer.wide],
            line: vec![0.0; 2 * layer.wide],
        }
    }
}

struct Sums {
    a: Vec<f32>,
    position: Vec<f32>,
    bias: Vec<f32>,
    attention: Vec<f32>,
}

struct Forward<'a, 'b> {
    layer: &'a Layer<'b>,
    first: usize,
    buffers: &'a mut Buffers,
    out: &'a mut [f32],
}

impl WithSimd for Forward<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        forward(simd, self.layer, self.first, self.buffers, self.out);
    }
}

/// Fills `features` and `weights` (after the softmax) for the points from `first` on, and `out`.
#[inline(always)]
fn forward<S: Simd>(
    simd: S,
    layer: &Layer<'_>,
    first: usize,
    buffers: &mut Buffers,
    out: &mut [f32],
) {
    let (k, wide, c) = (layer.hood.k, layer.wide, layer.c);
    let count = out.len() / wide;
    let rows = count * k;
    let features = &mut buffers.features[..rows * wide];
    let relative = &mut buffers.relative[..rows * RELATIVE_STRIDE];
    for point in 0..count {
        let i = first + point;
        layer.hood.relative_positions(i, |slot, l| {
            relative[(point * k + slot) * RELATIVE_STRIDE..][..RELATIVE].copy_from_slice(&l);
        });
        let own = &layer.a[i * wide..(i + 1) * wide];
        for (slot, &j) in layer.hood.row(i).iter().enumerate() {
            let other = &layer.a[j as usize * wide..(j as usize + 1) * wide];
            let row = &mut features[(point * k + slot) * wide..][..wide];
            for (((f, own), other), bias) in row.iter_mut().zip(own).zip(other).zip(&layer.bias) {
                *f = own - other + bias;
            }
        }
    }
    add_product(simd, relative, RELATIVE_STRIDE, RELATIVE, &layer.position, features, wide);
    for (row, l) in features.chunks_exact_mut(wide).zip(relative.chunks_exact(RELATIVE_STRIDE)) {
        for f in row.iter_mut() {
            *f = if *f > 0.0 { *f } else { 0.0 };
        }
        row[c..c + RELATIVE].copy_from_slice(&l[..RELATIVE]);
    }
    let weights = &mut buffers.weights[..rows * wide];
    weights.fill(0.0);
    add_product(simd, features, wide, wide, &layer.attention, weights, wide);
    for (point, out) in out.chunks_exact_mut(wide).enumerate() {
        let block = point * k * wide..(point + 1) * k * wide;
        softmax_pool(&mut weights[block.clone()], &features[block], out, &mut buffers.line);
    }
}

/// Softmax over the rows, column by column, in place; `out` becomes the weighted sum of the features.
#[inline(always)]
fn softmax_pool(weights: &mut [f32], features: &[f32], out: &mut [f32], line: &mut [f32]) {
    let wide = out.len();
    let (top, sum) = line.split_at_mut(wide);
    top.fill(f32::NEG_INFINITY);
    for row in weights.chunks_exact(wide) {
        for (t, &w) in top.iter_mut().zip(row) {
            *t = if w > *t { w } else { *t };
        }
    }
    sum.fill(0.0);
    out.fill(0.0);
    for (row, f) in weights.chunks_exact_mut(wide).zip(features.chunks_exact(wide)) {
        for ((((w, f), top), sum), out) in
            row.iter_mut().zip(f).zip(top.iter()).zip(sum.iter_mut()).zip(out.iter_mut())
        {
            let e = exp_nonpositive(*w - *top);
            *w = e;
            *sum += e;
            *out += e * f;
        }
    }
    for (s, o) in sum.iter_mut().zip(out.iter_mut()) {
        *s = 1.0 / *s;
        *o *= *s;
    }
    for row in weights.chunks_exact_mut(wide) {
        for (w, s) in row.iter_mut().zip(sum.iter()) {
            *w *= s;
        }
    }
}

struct Backward<'a, 'b> {
    layer: &'a Layer<'b>,
    attention_transposed: &'a [f32],
    first: usize,
    grad: &'a [f32],
    buffers: &'a mut Buffers,
    out: &'a mut [f32],
    sums: &'a mut Sums,
}

impl WithSimd for Backward<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { layer, attention_transposed, first, grad, buffers, out, sums } = self;
        forward(simd, layer, first, buffers, out);
        let (k, wide, c) = (layer.hood.k, layer.wide, layer.c);
        let rows = out.len() / wide * k;
        let (features, weights) =
            (&buffers.features[..rows * wide], &mut buffers.weights[..rows * wide]);
        let grads = &mut buffers.grads[..rows * wide];
        // Through the weighted sum and the softmax: both need w ⊙ g; the second also f − out.
        for row in 0..rows {
            let point = row / k;
            let g = &grad[point * wide..(point + 1) * wide];
            let o = &out[point * wide..(point + 1) * wide];
            let at = row * wide..(row + 1) * wide;
            let direct = &mut grads[at.clone()];
            for ((((w, f), direct), g), o) in weights[at.clone()]
                .iter_mut()
                .zip(&features[at])
                .zip(direct.iter_mut())
                .zip(g)
                .zip(o)
            {
                let d = *w * g;
                *direct = d;
                *w = d * (f - o);
            }
        }
        add_transposed_product(simd, features, wide, weights, &mut sums.attention, wide);
        add_product(simd, weights, wide, wide, attention_transposed, grads, wide);
        // Through the relu; the relative positions are inputs without a gradient.
        for (grad, f) in grads.chunks_exact_mut(wide).zip(features.chunks_exact(wide)) {
            for (grad, f) in grad.iter_mut().zip(f) {
                *grad = if *f > 0.0 { *grad } else { 0.0 };
            }
            grad[c..].fill(0.0);
        }
        add_transposed_product(
            simd,
            &buffers.relative[..rows * RELATIVE_STRIDE],
            RELATIVE_STRIDE,
            grads,
            &mut sums.position,
            wide,
        );
        let own = &mut buffers.line[..wide];
        for (point, block) in grads.chunks_exact(k * wide).enumerate() {
            let i = first + point;
            own.fill(0.0);
            for (row, &j) in block.chunks_exact(wide).zip(layer.hood.row(i)) {
                let other = &mut sums.a[j as usize * wide..(j as usize + 1) * wide];
                for ((own, other), g) in own.iter_mut().zip(other).zip(row) {
                    *own += g;
                    *other -= g;
                }
            }
            let mine = &mut sums.a[i * wide..(i + 1) * wide];
            for ((own, mine), bias) in own.iter().zip(mine).zip(sums.bias.iter_mut()) {
                *mine += own;
                *bias += own;
            }
        }
    }
}

fn pad(rows: &[f32], columns: usize, wide: usize, count: usize) -> Vec<f32> {
    let mut out = vec![0.0; count * wide];
    for (to, from) in out.chunks_exact_mut(wide).zip(rows.chunks_exact(columns)) {
        to[..columns].copy_from_slice(from);
    }
    out
}

fn unpad(rows: Vec<f32>, wide: usize, columns: usize) -> Vec<f32> {
    if wide == columns {
        return rows;
    }
    rows.chunks_exact(wide).flat_map(|r| &r[..columns]).copied().collect()
}

fn transpose(square: &[f32], n: usize) -> Vec<f32> {
    (0..n * n).map(|at| square[at % n * n + at / n]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use geom::{SeedTree, Vec3};
    use rand::RngExt;

    struct Sample {
        hood: Neighbourhood,
        a: Vec<f32>,
        position: Vec<f32>,
        bias: Vec<f32>,
        attention: Vec<f32>,
    }

    impl Sample {
        fn new(n: usize, c: usize) -> Self {
            let mut rng = SeedTree::new(3).rng();
            let mut draw = |count: usize, scale: f32| -> Vec<f32> {
                (0..count).map(|_| (rng.random::<f32>() - 0.5) * scale).collect()
            };
            let xyz = draw(3 * n, 2.0);
            let points = xyz.chunks_exact(3).map(Vec3::from_slice).collect();
            Self {
                hood: Neighbourhood::dilated(points, 5, 2),
                a: draw(n * c, 2.0),
                position: draw(RELATIVE * c, 1.0),
                bias: draw(c, 1.0),
                attention: draw((c + RELATIVE) * (c + RELATIVE), 1.0),
            }
        }

        fn weights(&self) -> PoolingWeights<'_> {
            PoolingWeights {
                position: &self.position,
                bias: &self.bias,
                attention: &self.attention,
            }
        }

        /// The definition, in f64.
        fn reference(&self) -> Vec<f64> {
            let c = self.bias.len();
            let f = c + RELATIVE;
            let k = self.hood.k;
            let mut out = Vec::new();
            for i in 0..self.hood.len() {
                let mut l = vec![[0.0_f32; RELATIVE]; k];
                self.hood.relative_positions(i, |slot, v| l[slot] = v);
                let features: Vec<Vec<f64>> = (0..k)
                    .map(|s| {
                        let j = self.hood.row(i)[s] as usize;
                        let mut row: Vec<f64> = (0..c)
                            .map(|q| {
                                let along: f64 = (0..RELATIVE)
                                    .map(|t| {
                                        f64::from(l[s][t]) * f64::from(self.position[t * c + q])
                                    })
                                    .sum();
                                let own =
                                    f64::from(self.a[i * c + q]) - f64::from(self.a[j * c + q]);
                                (own + along + f64::from(self.bias[q])).max(0.0)
                            })
                            .collect();
                        row.extend(l[s].iter().map(|&v| f64::from(v)));
                        row
                    })
                    .collect();
                for q in 0..f {
                    let score = |s: usize| -> f64 {
                        (0..f)
                            .map(|t| features[s][t] * f64::from(self.attention[t * f + q]))
                            .sum::<f64>()
                    };
                    let e: Vec<f64> = (0..k).map(|s| score(s).exp()).collect();
                    let sum: f64 = e.iter().sum();
                    out.push((0..k).map(|s| e[s] / sum * features[s][q]).sum());
                }
            }
            out
        }
    }

    #[test]
    fn forward_equals_the_definition() {
        let sample = Sample::new(37, 22);
        let got = pool(&sample.a, &sample.hood, 37, sample.weights());
        for (g, w) in got.iter().zip(sample.reference()) {
            assert!((f64::from(*g) - w).abs() < 1e-5, "{g} {w}");
        }
    }

    #[test]
    fn backward_equals_finite_differences_of_the_definition() {
        let sample = Sample::new(21, 22);
        let n = sample.hood.len() * (22 + RELATIVE);
        let seed: Vec<f32> = (0..n).map(|i| ((i * 29 % 17) as f32 - 8.0) / 8.0).collect();
        let loss = |sample: &Sample| -> f64 {
            sample.reference().iter().zip(&seed).map(|(o, s)| o * f64::from(*s)).sum()
        };
        let grads = pool_backward(&sample.a, &sample.hood, sample.weights(), &seed);
        let check = |name: &str, got: &[f32], column: &dyn Fn(&mut Sample) -> &mut Vec<f32>| {
            for at in (0..got.len()).step_by(1 + got.len() / 40) {
                // Small, because the reference has kinks where a relu switches.
                let step = 2e-5;
                let moved = |by: f32| {
                    let mut sample = Sample::new(21, 22);
                    column(&mut sample)[at] += by;
                    loss(&sample)
                };
                let want = (moved(step) - moved(-step)) / f64::from(2.0 * step);
                let error = (f64::from(got[at]) - want).abs();
                assert!(
                    error < 0.02 * want.abs().max(0.5),
                    "{name}[{at}]: {} against {want}",
                    got[at]
                );
            }
        };
        check("a", &grads.a, &|c| &mut c.a);
        check("position", &grads.position, &|c| &mut c.position);
        check("bias", &grads.bias, &|c| &mut c.bias);
        check("attention", &grads.attention, &|c| &mut c.attention);
    }

    #[cfg(target_arch = "x86_64")]
    #[test]
    fn the_width_of_a_register_changes_no_bit() {
        let (Some(eight), Some(sixteen)) = (pulp::x86::V3::try_new(), pulp::x86::V4::try_new())
        else {
            return;
        };
        let sample = Sample::new(40, 13);
        let layer = Layer::new(&sample.a, &sample.hood, sample.weights());
        let forward = |wide: bool| {
            let (mut buffers, mut out) = (Buffers::new(&layer), vec![0.0; POINTS * layer.wide]);
            let work = Forward { layer: &layer, first: 0, buffers: &mut buffers, out: &mut out };
            match wide {
                true => Simd::vectorize(sixteen, work),
                false => Simd::vectorize(eight, work),
            }
            out
        };
        let bits = |values: Vec<f32>| values.into_iter().map(f32::to_bits).collect::<Vec<_>>();
        assert_eq!(bits(forward(false)), bits(forward(true)));
    }
}
