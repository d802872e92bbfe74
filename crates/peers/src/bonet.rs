//! 3D-BoNet: a fixed number of boxes from one global feature, and a mask of points for each.
//!
//! Losses are the paper's: boxes are given to true instances by the cheapest assignment of squared distance, soft overlap and
//! cross-entropy; scores; focal loss on the masks. Pairs of box and point are taken on an even sample of the tile.

use crate::grouping::{Group, Grouping, TrainingTile, instances, matrix};
use geom::{Bounds, Vec3};
use net::floats;
use net::prelude::{Device, Linear, Tensor, TensorData, relu, sigmoid, softplus};

/// Boxes: more than a bin shows parts.
const BOXES: usize = 48;
/// Steepness of a box's soft border (paper's θ₁, θ₂).
const STEEP: f32 = 100.0;
const BORDER: f32 = 20.0;
/// Points on which overlaps and masks are learnt.
const LEARNT: usize = 512;
const LEAST_POINTS: usize = 10;

pub(crate) struct BoNet;

/// Both corners `[b, 3]` in shares of the scene's extent, and log-odds `[b, 1]`.
struct Boxes {
    low: Tensor<2>,
    high: Tensor<2>,
    score: Tensor<2>,
}

impl Boxes {
    fn of(layers: &[Linear], global: Tensor<2>) -> Self {
        let x = relu(layers[0].forward(global)); // [1, 256]
        let corners = sigmoid(layers[1].forward(x.clone())).reshape([BOXES, 2, 3]);
        Self {
            low: corners.clone().min_dim(1).reshape([BOXES, 3]),
            high: corners.max_dim(1).reshape([BOXES, 3]),
            score: layers[2].forward(x).reshape([BOXES, 1]),
        }
    }

    fn select(self, rows: &[usize], device: &Device) -> Self {
        let index: Vec<i32> = rows.iter().map(|&r| r as i32).collect();
        let pick = |x: Tensor<2>| {
            let index = Tensor::from_data(TensorData::new(index.clone(), [rows.len()]), device);
            x.select(0, index)
        };
        Self { low: pick(self.low), high: pick(self.high), score: pick(self.score) }
    }
}

/// Log-odds `[b, n]` that points lie in the masks of boxes.
fn masks(layers: &[Linear], features: Tensor<2>, global: Tensor<2>, boxes: &Boxes) -> Tensor<2> {
    let (n, b) = (features.dims()[0], boxes.low.dims()[0]);
    let told = vec![boxes.low.clone(), boxes.high.clone(), sigmoid(boxes.score.clone())];
    let of_box = layers[4].forward(Tensor::cat(told, 1)) + layers[5].forward(global); // [b, 64]
    let of_point = layers[3].forward(features); // [n, 64]
    let x = relu(of_point.reshape([1, n, 64]) + of_box.reshape([b, 1, 64]));
    layers[6].forward(x.reshape([b * n, 64])).reshape([b, n])
}

/// How far inside a box a place is, 0 to 1.
fn inside(p: Vec3, low: &[f32], high: &[f32]) -> f32 {
    let axis = |a: usize| {
        let q = (STEEP * (p[a] - low[a]) * (high[a] - p[a])).clamp(-BORDER, BORDER);
        1.0 / (1.0 + (-q).exp())
    };
    axis(0).min(axis(1)).min(axis(2))
}

struct Truth {
    /// Corners of each instance, low then high.
    corners: Vec<[f32; 6]>,
    /// Sampled points of the tile, their places, and the instance of each.
    sample: Vec<usize>,
    place: Vec<Vec3>,
    instance: Vec<Option<usize>>,
}

impl Truth {
    fn of(sample: &TrainingTile<'_>) -> Self {
        let (count, instance) = instances(sample.tile);
        let place = shares(&sample.tile.position, &sample.tile.bounds);
        let mut bounds = vec![Bounds::EMPTY; count];
        for (p, i) in place.iter().zip(&instance) {
            if let Some(i) = i {
                bounds[*i] = Bounds { min: bounds[*i].min.min(*p), max: bounds[*i].max.max(*p) };
            }
        }
        let row = |b: &Bounds| [b.min.x, b.min.y, b.min.z, b.max.x, b.max.y, b.max.z];
        let n = instance.len();
        let sample: Vec<usize> = (0..n.min(LEARNT)).map(|i| i * n / n.min(LEARNT)).collect();
        Self {
            corners: bounds.iter().take(BOXES).map(row).collect(),
            place: sample.iter().map(|&i| place[i]).collect(),
            instance: sample.iter().map(|&i| instance[i]).collect(),
            sample,
        }
    }

    /// 1 where a sampled point is of an instance, `[instances · sample]`.
    fn owned(&self) -> Vec<f32> {
        let row = |t: usize| self.instance.iter().map(move |i| f32::from(*i == Some(t)));
        (0..self.corners.len()).flat_map(row).collect()
    }

    /// The box of each instance.
    fn assigned(&self, boxes: &Boxes) -> Vec<usize> {
        let (low, high) = (floats(boxes.low.clone()), floats(boxes.high.clone()));
        let owned = self.owned();
        let s = self.place.len();
        let cost = |t: usize, b: usize| {
            let (low, high) = (&low[3 * b..3 * b + 3], &high[3 * b..3 * b + 3]);
            let truth = &self.corners[t];
            let squared: f32 = (0..3)
                .map(|a| (low[a] - truth[a]).powi(2) + (high[a] - truth[a + 3]).powi(2))
                .sum();
            let (mut both, mut either, mut cross) = (0.0, 0.0, 0.0);
            for (p, q) in self.place.iter().zip(&owned[t * s..(t + 1) * s]) {
                let p = inside(*p, low, high).clamp(1e-6, 1.0 - 1e-6);
                both += p * q;
                either += p + q - p * q;
                cross -= q * p.ln() + (1.0 - q) * (1.0 - p).ln();
            }
            let sum = squared / 6.0 - both / either.max(1e-6) + cross / s.max(1) as f32;
            // A training that diverges is told by its loss, one step later.
            if sum.is_finite() { f64::from(sum) } else { 1e9 }
        };
        let count = self.corners.len();
        let table: Vec<f64> = (0..count * BOXES).map(|i| cost(i / BOXES, i % BOXES)).collect();
        let found = lsap::solve(count, BOXES, &table, false);
        found.expect("finite costs, and never more instances than boxes").1
    }
}

fn shares(position: &[Vec3], bounds: &Bounds) -> Vec<Vec3> {
    let size = bounds.size().max(Vec3::splat(1e-6));
    position.iter().map(|p| (*p - bounds.min) / size).collect()
}

impl Grouping for BoNet {
    fn layers(&self, c: usize) -> Vec<(usize, usize)> {
        vec![(c, 256), (256, BOXES * 6), (256, BOXES), (c, 64), (7, 64), (c, 64), (64, 1)]
    }

    fn loss(&self, layers: &[Linear], features: Tensor<2>, sample: &TrainingTile<'_>) -> Tensor<1> {
        let global = features.clone().max_dim(0); // [1, c]
        let boxes = Boxes::of(layers, global.clone());
        let truth = Truth::of(sample);
        let count = truth.corners.len();
        let matched = truth.assigned(&boxes);
        let mut right = vec![0.0; BOXES];
        matched.iter().for_each(|&b| right[b] = 1.0);
        let odds = boxes.score.clone();
        let right = matrix(right, BOXES, sample.device);
        let scores = (softplus(odds.clone(), 1.0) - odds * right).sum() / BOXES as f32;
        if count == 0 {
            return scores;
        }
        let device = sample.device;
        let s = truth.place.len();
        let mine = boxes.select(&matched, device);
        let half = |from: usize| -> Vec<f32> {
            truth.corners.iter().flat_map(|c| c[from..from + 3].to_vec()).collect()
        };
        let squared = (mine.low.clone() - matrix(half(0), count, device)).square().sum()
            + (mine.high.clone() - matrix(half(3), count, device)).square().sum();
        let place: Vec<f32> = truth.place.iter().flat_map(|p| p.to_array()).collect();
        let place = matrix(place, s, device).reshape([1, s, 3]);
        let low = mine.low.clone().reshape([count, 1, 3]);
        let high = mine.high.clone().reshape([count, 1, 3]);
        let depth = (place.clone() - low) * (high - place) * STEEP;
        let within = sigmoid(depth.clamp(-BORDER, BORDER)).min_dim(2).reshape([count, s]);
        let within = within.clamp(1e-6, 1.0 - 1e-6);
        let owned = matrix(truth.owned(), count, device);
        let both = (within.clone() * owned.clone()).sum_dim(1);
        let either = (within.clone() + owned.clone() - within.clone() * owned.clone()).sum_dim(1);
        let overlap = both / either.add_scalar(1e-6);
        let cross = -(owned.clone() * within.clone().log()
            + (owned.clone() * -1.0 + 1.0) * (within * -1.0 + 1.0).log());
        let corners = squared / (6 * count) as f32 - overlap.sum() / count as f32
            + cross.sum() / (count * s) as f32;
        let index: Vec<i32> = truth.sample.iter().map(|&i| i as i32).collect();
        let index = Tensor::from_data(TensorData::new(index, [s]), device);
        let seen = features.select(0, index);
        let p = sigmoid(masks(layers, seen, global, &mine)).clamp(1e-5, 1.0 - 1e-5);
        let not = p.clone() * -1.0 + 1.0;
        let hit = not.clone().square() * p.clone().log() * owned.clone() * 0.75;
        let miss = p.square() * not.log() * (owned * -1.0 + 1.0) * 0.25;
        scores + corners - (hit + miss).sum() * (4.0 / (count * s) as f32)
    }

    fn groups(&self, layers: &[Linear], features: Tensor<2>, position: &[Vec3]) -> Vec<Group> {
        let device = features.device();
        let global = features.clone().max_dim(0);
        let boxes = Boxes::of(layers, global.clone());
        let score: Vec<f32> = floats(sigmoid(boxes.score.clone()));
        let mut best = vec![(0.5_f32, None); position.len()];
        let mut groups = Vec::new();
        for b in (0..BOXES).filter(|&b| score[b] > 0.5) {
            let one = Boxes {
                low: boxes.low.clone(),
                high: boxes.high.clone(),
                score: boxes.score.clone(),
            };
            let one = one.select(&[b], &device);
            let mask = floats(sigmoid(masks(layers, features.clone(), global.clone(), &one)));
            for (best, p) in best.iter_mut().zip(mask) {
                if p > best.0 {
                    *best = (p, Some(groups.len()));
                }
            }
            groups.push(Group { points: Vec::new(), score: score[b] });
        }
        for (i, (_, group)) in best.iter().enumerate() {
            if let Some(g) = group {
                groups[*g].points.push(i as u32);
            }
        }
        groups.retain(|g| g.points.len() >= LEAST_POINTS);
        groups.sort_by(|a, b| b.score.total_cmp(&a.score));
        groups
    }
}
