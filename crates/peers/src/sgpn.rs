//! SGPN: a similarity matrix, one proposal a point, and merging.
//!
//! Loss: double hinge on squared distances of features (margin K₁ = 10, α = 2), and a confidence that learns each proposal's
//! overlap with the truth. Grouping: points nearer than half the margin to a point are its proposal; proposals of little
//! confidence or few points go, of proposals that overlap by more than 0.6 the larger stays. The margin between classes (K₂) is
//! left out with the classes. A matrix of all points of a scene is too large: it is made on an even sample, and the other
//! points follow the sample point next to them, which stands for the paper's merging of blocks.

use crate::grouping::{Group, Grouping, TrainingTile, head, instances, matrix};
use geom::{PointGrid, Vec3};
use net::floats;
use net::prelude::{Linear, Tensor, TensorData, relu, sigmoid};

const SIMILARITY: usize = 64;
const MARGIN: f32 = 10.0;
const ALPHA: f32 = 2.0;
/// Weight of the confidence's loss.
const CONFIDENCE: f32 = 10.0;
const LEAST_CONFIDENCE: f32 = 0.1;
const LEAST_POINTS: usize = 10;
const MERGED: f32 = 0.6;
/// Points whose pairs are looked at in a step, and in a scene.
const LEARNT: usize = 768;
const LOOKED_AT: usize = 2048;

pub(crate) struct Sgpn;

impl Sgpn {
    fn features(layers: &[Linear], features: Tensor<2>) -> Tensor<2> {
        head(layers, 0, features)
    }

    fn confidence(layers: &[Linear], features: Tensor<2>) -> Tensor<2> {
        sigmoid(head(layers, 2, features))
    }
}

/// Squared distances of all pairs of rows.
fn squared_distances(x: Tensor<2>) -> Tensor<2> {
    let norm = x.clone().square().sum_dim(1);
    relu(norm.clone() + norm.transpose() - x.clone().matmul(x.transpose()) * 2.0)
}

/// Every so-manieth of `n`, at most `most`.
fn spread(n: usize, most: usize) -> Vec<usize> {
    let count = n.min(most);
    (0..count).map(|i| i * n / count).collect()
}

fn rows(x: Tensor<2>, index: &[usize]) -> Tensor<2> {
    let device = x.device();
    let index: Vec<i32> = index.iter().map(|&i| i as i32).collect();
    let n = index.len();
    x.select(0, Tensor::from_data(TensorData::new(index, [n]), &device))
}

impl Grouping for Sgpn {
    fn layers(&self, c: usize) -> Vec<(usize, usize)> {
        vec![(c, 128), (128, SIMILARITY), (c, 64), (64, 1)]
    }

    fn loss(&self, layers: &[Linear], features: Tensor<2>, sample: &TrainingTile<'_>) -> Tensor<1> {
        let (_, instance) = instances(sample.tile);
        let on: Vec<usize> = (0..instance.len()).filter(|&i| instance[i].is_some()).collect();
        if on.is_empty() {
            return features.sum() * 0.0;
        }
        let chosen: Vec<usize> = spread(on.len(), LEARNT).into_iter().map(|i| on[i]).collect();
        let m = chosen.len();
        let x = rows(features, &chosen);
        let d = squared_distances(Self::features(layers, x.clone())); // [m, m]
        let same = |i: usize, j: usize| instance[chosen[i]] == instance[chosen[j]];
        let alike: Vec<f32> = (0..m * m).map(|k| f32::from(same(k / m, k % m))).collect();
        let unlike: Vec<f32> = alike.iter().map(|a| 1.0 - a).collect();
        let similarity = d.clone() * matrix(alike, m, sample.device)
            + relu(-(d.clone().sub_scalar(MARGIN))) * matrix(unlike, m, sample.device) * ALPHA;
        let distance = floats(d.detach());
        let overlap: Vec<f32> = (0..m)
            .map(|i| {
                let (mut both, mut either) = (0, 0);
                for j in 0..m {
                    let (near, one) = (distance[i * m + j] < MARGIN / 2.0, same(i, j));
                    both += usize::from(near && one);
                    either += usize::from(near || one);
                }
                both as f32 / either.max(1) as f32
            })
            .collect();
        let off = Self::confidence(layers, x) - matrix(overlap, m, sample.device);
        similarity.sum() / (m * m) as f32 + off.square().sum() * (CONFIDENCE / m as f32)
    }

    fn groups(&self, layers: &[Linear], features: Tensor<2>, position: &[Vec3]) -> Vec<Group> {
        let chosen = spread(position.len(), LOOKED_AT);
        let m = chosen.len();
        if m == 0 {
            return Vec::new();
        }
        let x = rows(features, &chosen);
        let distance = floats(squared_distances(Self::features(layers, x.clone())));
        let confidence = floats(Self::confidence(layers, x));
        let near = |i: usize| -> Vec<bool> {
            distance[i * m..(i + 1) * m].iter().map(|d| *d < MARGIN / 2.0).collect()
        };
        let merged = merge((0..m).map(|i| (near(i), confidence[i])).collect());
        // Every other point follows the sample point next to it.
        let places: Vec<Vec3> = chosen.iter().map(|&i| position[i]).collect();
        let grid = PointGrid::new(&places, 0.3);
        let mut label = vec![None; m];
        for (g, (member, _)) in merged.iter().enumerate().rev() {
            (0..m).filter(|&i| member[i]).for_each(|i| label[i] = Some(g));
        }
        let mut groups: Vec<Group> =
            merged.iter().map(|(_, score)| Group { points: Vec::new(), score: *score }).collect();
        for (i, p) in position.iter().enumerate() {
            if let Some((near, _)) = grid.nearest_within(*p, 0.5)
                && let Some(g) = label[near as usize]
            {
                groups[g].points.push(i as u32);
            }
        }
        groups.retain(|g| g.points.len() >= LEAST_POINTS);
        groups
    }
}

/// The paper's GroupMerging: surest first; one that overlaps a kept one by more than the limit adds nothing but, when it is
/// the larger, takes its place.
fn merge(mut proposals: Vec<(Vec<bool>, f32)>) -> Vec<(Vec<bool>, f32)> {
    let size = |member: &[bool]| member.iter().filter(|m| **m).count();
    proposals.retain(|(m, c)| *c >= LEAST_CONFIDENCE && size(m) >= LEAST_POINTS);
    proposals.sort_by(|a, b| b.1.total_cmp(&a.1));
    let mut kept: Vec<(Vec<bool>, f32)> = Vec::new();
    for (member, score) in proposals {
        let overlap = |other: &[bool]| {
            let both = member.iter().zip(other).filter(|(a, b)| **a && **b).count();
            both as f32 / (size(&member) + size(other) - both).max(1) as f32
        };
        match kept.iter_mut().find(|k| overlap(&k.0) > MERGED) {
            Some(same) if size(&member) > size(&same.0) => same.0 = member,
            Some(_) => {}
            None => kept.push((member, score)),
        }
    }
    // What is mostly contained in surer groups is no group of its own.
    let mut taken = vec![false; kept.first().map_or(0, |k| k.0.len())];
    kept.retain(|(member, _)| {
        let free = member.iter().zip(&taken).filter(|(m, t)| **m && !**t).count();
        let is_own = 2 * free > size(member);
        if is_own {
            taken.iter_mut().zip(member).for_each(|(t, m)| *t |= *m);
        }
        is_own
    });
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn overlapping_proposals_are_one_and_the_larger_stays() {
        let of = |from: usize, to: usize| (0..60).map(|i| (from..to).contains(&i)).collect();
        let merged =
            merge(vec![(of(0, 20), 0.9), (of(0, 24), 0.8), (of(30, 60), 0.7), (of(0, 60), 0.05)]);
        assert_eq!(merged.len(), 2);
        assert_eq!(merged[0], (of(0, 24), 0.9));
        assert!(merge(Vec::new()).is_empty());
    }

    #[test]
    fn a_sample_is_even_and_never_larger_than_what_there_is() {
        assert_eq!(spread(10, 4), [0, 2, 5, 7]);
        assert_eq!(spread(3, 9), [0, 1, 2]);
        assert!(spread(0, 9).is_empty());
    }
}
