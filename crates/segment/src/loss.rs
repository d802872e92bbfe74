//! Losses: the thesis' pair and centre losses (METHOD §2, Eqs. 2.3–2.11) and ours for the votes.
//!
//! Lengths are in units of d_max. Where the thesis and its authors' code differ, both readings can be chosen.

use crate::output::Output;
use crate::tile::Targets;
use net::floats;
use net::prelude::{Device, Int, Tensor, TensorData, relu, softplus};
use serde::{Deserialize, Serialize};

/// Pairs farther apart than this, d_max, cannot be of one block (Eq. 2.4).
const VALID: f32 = 2.0;
/// The error of a vote has three components, each with the same scale.
const AXES: f32 = 3.0;
/// Keeps the slope of a square root finite at 0.
const TINY: f32 = 1e-8;

/// How the distance between two embeddings enters the pair loss.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum PairDistance {
    /// ‖a − b‖, as the thesis writes.
    #[default]
    Plain,
    /// ‖a − b‖², as its authors' code computes.
    Squared,
}

/// What the sum over the pairs is divided by.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum PairSum {
    /// The number of valid pairs (ADR 0121).
    #[default]
    Mean,
    /// Nothing, as the thesis writes (Eq. 2.7).
    Sum,
    /// The number of all pairs, as its authors' code has it.
    MeanOfAll,
}

/// Whether a setting is its default: files of trainings begun before it existed do not hold it.
fn is_default<T: Default + PartialEq>(value: &T) -> bool {
    *value == T::default()
}

/// Settings of the pair loss L_EF.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PairLossConfig {
    /// ε₁: same instance, no loss below.
    pub near: f32,
    /// ε₂: different instances, no loss above.
    pub far: f32,
    /// Plain or squared distance.
    pub distance: PairDistance,
    /// Weight of pairs of one instance (authors' code: 2).
    pub pull: f32,
    /// Only pairs closer than 2 d_max count (valid-distance matrix).
    pub valid_distance: bool,
    /// Pairs weigh min(1, s_i + s_j) (attention score matrix).
    pub attention: bool,
    /// What the sum is divided by.
    #[serde(skip_serializing_if = "is_default")]
    pub sum: PairSum,
}

impl PairLossConfig {
    /// As the thesis' authors' code has it: squared distance, double pull, mean over all pairs.
    pub fn of_the_authors() -> Self {
        let (distance, sum) = (PairDistance::Squared, PairSum::MeanOfAll);
        Self { distance, pull: 2.0, sum, ..Self::default() }
    }
}

impl Default for PairLossConfig {
    fn default() -> Self {
        Self {
            near: 0.5,
            far: 1.0,
            distance: PairDistance::Plain,
            pull: 1.0,
            valid_distance: true,
            attention: true,
            sum: PairSum::Mean,
        }
    }
}

fn is_two(value: &f32) -> bool {
    *value == 2.0
}

/// Weights of the parts of the loss.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LossConfig {
    /// Pair loss.
    pub pair: PairLossConfig,
    /// Points drawn for the pair loss; all when there are fewer.
    pub pair_points: usize,
    /// Weight of the pair loss.
    pub pair_weight: f32,
    /// Weight of the centre score's loss (thesis: 3).
    pub centre_weight: f32,
    /// Weight of the offset's loss.
    pub offset_weight: f32,
    /// Weight of the expected error's loss.
    pub error_weight: f32,
    /// Weight of block / not block.
    pub block_weight: f32,
    /// β of the centre score s = 1 − (‖p − c‖ / d_max)^β (Eq. 2.5; thesis: 2).
    #[serde(skip_serializing_if = "is_two")]
    pub centre_power: f32,
    /// The centre score is taught off the blocks too, where it is 0: for networks that do not tell blocks from ground.
    pub score_ground: bool,
}

impl LossConfig {
    /// L = L_EF + 3 L_CS over every pair, as the thesis has it (Eq. 2.3).
    pub fn of_the_thesis() -> Self {
        Self {
            pair: PairLossConfig::default(),
            pair_points: usize::MAX,
            pair_weight: 1.0,
            centre_weight: 3.0,
            offset_weight: 0.0,
            error_weight: 0.0,
            block_weight: 0.0,
            centre_power: 2.0,
            score_ground: true,
        }
    }
}

impl Default for LossConfig {
    fn default() -> Self {
        Self {
            pair: PairLossConfig::default(),
            pair_points: 512,
            pair_weight: 0.5,
            centre_weight: 1.0,
            offset_weight: 2.0,
            error_weight: 0.1,
            block_weight: 0.5,
            centre_power: 2.0,
            score_ground: false,
        }
    }
}

/// A step in numbers, for curves.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LossReport {
    /// Weighted sum.
    pub total: f32,
    /// Pair loss.
    pub pair: f32,
    /// Centre score loss.
    pub centre: f32,
    /// Mean length of the offset's error over block points, d_max.
    pub offset: f32,
    /// Block / not block cross-entropy.
    pub block: f32,
}

/// The whole loss of one tile.
pub fn loss(
    output: Output,
    targets: &Targets,
    config: &LossConfig,
    device: &Device,
) -> (Tensor<1>, LossReport) {
    let n = targets.instance.len();
    let column = |v: Vec<f32>| Tensor::<2>::from_data(TensorData::new(v, [n, 1]), device);
    let on_block: Vec<f32> = targets
        .instance
        .iter()
        .zip(&targets.inner)
        .map(|(&i, &w)| if i > 0 { w } else { 0.0 })
        .collect();
    let counted = on_block.iter().sum::<f32>().max(1.0);
    let inner = targets.inner.iter().sum::<f32>().max(1.0);
    let mask = column(on_block.clone());
    let truth = targets.offset.iter().flat_map(|o| o.to_array()).collect::<Vec<f32>>();
    let truth = Tensor::<2>::from_data(TensorData::new(truth, [n, 3]), device);

    let error = (output.offset - truth).square().sum_dim(1).add_scalar(TINY).sqrt(); // [n, 1]
    let offset = (error.clone() * mask.clone()).sum() / counted;
    // Laplace in three dimensions; the error itself is held fixed so that only its expectation learns from this.
    let expected = error.detach() * (-output.log_error.clone()).exp() + output.log_error * AXES;
    let expected = (expected * mask.clone()).sum() / counted;
    let label = column(targets.instance.iter().map(|&i| f32::from(i > 0)).collect());
    let block = (softplus(output.block.clone(), 1.0) - output.block * label)
        * column(targets.inner.clone());
    let block = block.sum() / inner;
    let score: Vec<f32> = targets.centre_score(config.centre_power);
    let centre = smooth_l1(output.centre - column(score.clone()));
    let centre = if config.score_ground {
        (centre * column(targets.inner.clone())).sum() / inner
    } else {
        (centre * mask).sum() / counted
    };

    let chosen = spread(&on_block, config.pair_points);
    let index: Vec<i32> = chosen.iter().map(|&i| i as i32).collect();
    let index = Tensor::<1, Int>::from_data(TensorData::new(index, [chosen.len()]), device);
    let pair = if chosen.is_empty() {
        Tensor::<1>::zeros([1], device)
    } else {
        pair_loss(output.embedding.select(0, index), targets, &chosen, &score, &config.pair, device)
    };
    let total = offset.clone() * config.offset_weight
        + expected * config.error_weight
        + block.clone() * config.block_weight
        + centre.clone() * config.centre_weight
        + pair.clone() * config.pair_weight;
    let number = |t: &Tensor<1>| floats(t.clone())[0];
    let report = LossReport {
        total: number(&total),
        pair: number(&pair),
        centre: number(&centre),
        offset: number(&offset),
        block: number(&block),
    };
    (total, report)
}

/// L_EF over the points `chosen`, whose embeddings are `[m, 128]`.
pub fn pair_loss(
    embedding: Tensor<2>,
    targets: &Targets,
    chosen: &[usize],
    score: &[f32],
    config: &PairLossConfig,
    device: &Device,
) -> Tensor<1> {
    let m = chosen.len();
    let (mut same, mut different, mut valid) =
        (Vec::with_capacity(m * m), Vec::with_capacity(m * m), 0.0_f32);
    for &i in chosen {
        for &j in chosen {
            let near = (targets.position[i] - targets.position[j]).length_squared() < VALID * VALID;
            let counts = if near || !config.valid_distance { 1.0 } else { 0.0 };
            let attention = if config.attention { (score[i] + score[j]).min(1.0) } else { 1.0 };
            let one = targets.instance[i] == targets.instance[j];
            same.push(if one { counts * attention * config.pull } else { 0.0 });
            different.push(if one { 0.0 } else { counts * attention });
            valid += counts;
        }
    }
    let square = |v: Vec<f32>| Tensor::<2>::from_data(TensorData::new(v, [m, m]), device);
    let norm = embedding.clone().square().sum_dim(1); // [m, 1]
    let inner = embedding.clone().matmul(embedding.transpose()); // [m, m]
    let squared = relu(norm.clone() + norm.transpose() - inner * 2.0);
    let distance = match config.distance {
        // The root has no slope at 0: a point with itself must not give one.
        PairDistance::Plain => squared.add_scalar(TINY).sqrt(),
        PairDistance::Squared => squared,
    };
    let pull = relu(distance.clone().sub_scalar(config.near)) * square(same);
    let push = relu(-(distance.sub_scalar(config.far))) * square(different);
    let sum = (pull + push).sum();
    match config.sum {
        PairSum::Mean => sum / valid.max(1.0),
        PairSum::Sum => sum,
        PairSum::MeanOfAll => sum / (m * m) as f32,
    }
}

/// Smooth L1 with the knee at 1.
fn smooth_l1(x: Tensor<2>) -> Tensor<2> {
    // |x| ≤ 1 here, where smooth L1 is the half square.
    x.square() * 0.5
}

/// Up to `count` indices with a positive weight, evenly spread: points are in cell order, so this covers the tile.
fn spread(weight: &[f32], count: usize) -> Vec<usize> {
    let all: Vec<usize> = (0..weight.len()).filter(|&i| weight[i] > 0.0).collect();
    if all.len() <= count {
        return all;
    }
    (0..count).map(|i| all[i * all.len() / count]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use geom::{Bounds, SeedTree, Vec3};
    use net::prelude::Shape;
    use rand::RngExt;

    const N: usize = 12;

    fn targets() -> Targets {
        let mut rng = SeedTree::new(8).rng();
        let mut draw = |by: f32| Vec3::new(rng.random(), rng.random(), rng.random()) * by;
        let position: Vec<Vec3> = (0..N).map(|_| draw(2.5)).collect();
        let offset = (0..N).map(|_| draw(0.8)).collect();
        let instance = (0..N as u32).map(|i| i % 4).collect();
        let inner = (0..N).map(|i| f32::from(i != 5)).collect();
        Targets { bounds: Bounds::of(position.iter().copied()), position, instance, offset, inner }
    }

    fn numbers(count: usize, seed: u64) -> Vec<f32> {
        let mut rng = SeedTree::new(seed).rng();
        (0..count).map(|_| rng.random::<f32>() * 0.5).collect()
    }

    fn output(parts: &[Vec<f32>], device: &Device) -> (Output, Vec<Tensor<2>>) {
        let leaves: Vec<Tensor<2>> = parts
            .iter()
            .map(|p| {
                let t = Tensor::<2>::from_data(
                    TensorData::new(p.clone(), Shape::new([N, p.len() / N])),
                    device,
                );
                if device.is_autodiff() { t.require_grad() } else { t }
            })
            .collect();
        let [embedding, centre, offset, log_error, block] =
            [0, 1, 2, 3, 4].map(|i| leaves[i].clone());
        (Output { embedding, centre, offset, log_error, block }, leaves)
    }

    /// Every part of the loss alone, and literal variants of the pair loss.
    fn configs() -> Vec<LossConfig> {
        let none = LossConfig {
            pair_weight: 0.0,
            centre_weight: 0.0,
            offset_weight: 0.0,
            error_weight: 0.0,
            block_weight: 0.0,
            ..Default::default()
        };
        let everywhere = LossConfig { centre_weight: 1.0, score_ground: true, ..none.clone() };
        let squared =
            PairLossConfig { distance: PairDistance::Squared, pull: 2.0, ..Default::default() };
        let bare = PairLossConfig { valid_distance: false, attention: false, ..Default::default() };
        vec![
            LossConfig { centre_weight: 1.0, ..none.clone() },
            everywhere,
            LossConfig { offset_weight: 1.0, ..none.clone() },
            LossConfig { block_weight: 1.0, ..none.clone() },
            LossConfig { pair_weight: 1.0, ..none.clone() },
            LossConfig { pair_weight: 1.0, pair: squared, ..none.clone() },
            LossConfig { pair_weight: 1.0, pair: bare, ..none },
        ]
    }

    #[test]
    fn gradients_equal_finite_differences() {
        let targets = targets();
        let parts: Vec<Vec<f32>> =
            [8, 1, 3, 1, 1].iter().enumerate().map(|(i, w)| numbers(N * w, i as u64)).collect();
        let plain = Device::flex();
        let tracked = Device::flex().autodiff();
        let value = |parts: &[Vec<f32>], config: &LossConfig| {
            loss(output(parts, &plain).0, &targets, config, &plain).1.total
        };
        for (c, config) in configs().iter().enumerate() {
            let (out, leaves) = output(&parts, &tracked);
            let mut grads = loss(out, &targets, config, &tracked).0.backward();
            let mut some = false;
            for (part, leaf) in leaves.iter().enumerate() {
                let Some(grad) = leaf.grad_remove(&mut grads) else { continue };
                for (at, g) in floats(grad).into_iter().enumerate() {
                    let moved = |by: f32| {
                        let mut parts = parts.clone();
                        parts[part][at] += by;
                        value(&parts, config)
                    };
                    let want = (moved(1e-3) - moved(-1e-3)) / 2e-3;
                    assert!(
                        (g - want).abs() < 2e-3 + 0.03 * want.abs(),
                        "loss {c}, part {part}[{at}]: {g} {want}"
                    );
                    some |= g != 0.0;
                }
            }
            assert!(some, "loss {c} teaches something");
        }
    }

    #[test]
    fn the_expected_error_is_right_where_its_loss_is_least() {
        // d/ds (e·exp(−s) + 3 s) = 0 at exp(s) = e / 3, the scale of a Laplace law in space whose mean length is e.
        let targets = targets();
        let device = Device::flex().autodiff();
        let mut parts: Vec<Vec<f32>> = [8, 1, 3, 1, 1].iter().map(|w| vec![0.0; N * w]).collect();
        for i in 0..N {
            parts[3][i] = (targets.offset[i].length() / 3.0).ln();
        }
        let (out, leaves) = output(&parts, &device);
        let config = LossConfig {
            offset_weight: 0.0,
            pair_weight: 0.0,
            block_weight: 0.0,
            centre_weight: 0.0,
            ..Default::default()
        };
        let mut grads = loss(out, &targets, &config, &device).0.backward();
        assert!(floats(leaves[3].grad_remove(&mut grads).unwrap()).iter().all(|g| g.abs() < 1e-5));
    }

    #[test]
    fn pair_loss_equals_its_definition() {
        let targets = targets();
        let device = Device::flex();
        let embedding = numbers(N * 8, 3);
        let score = targets.centre_score(2.0);
        let chosen: Vec<usize> = (0..N).filter(|&i| targets.instance[i] > 0).collect();
        let config = PairLossConfig::default();
        let rows: Vec<f32> =
            chosen.iter().flat_map(|&i| embedding[i * 8..(i + 1) * 8].to_vec()).collect();
        let tensor = Tensor::<2>::from_data(TensorData::new(rows, [chosen.len(), 8]), &device);
        let got = floats(pair_loss(tensor, &targets, &chosen, &score, &config, &device))[0];
        let (mut sum, mut valid) = (0.0, 0.0);
        for &i in &chosen {
            for &j in &chosen {
                if (targets.position[i] - targets.position[j]).length() >= 2.0 {
                    continue;
                }
                valid += 1.0;
                let d: f32 = (0..8)
                    .map(|q| (embedding[i * 8 + q] - embedding[j * 8 + q]).powi(2))
                    .sum::<f32>()
                    .sqrt();
                let kappa = if targets.instance[i] == targets.instance[j] {
                    (d - 0.5).max(0.0)
                } else {
                    (1.0 - d).max(0.0)
                };
                sum += kappa * (score[i] + score[j]).min(1.0);
            }
        }
        assert!((got - sum / valid).abs() < 1e-4, "{got} {}", sum / valid);
    }
}
