//! PointGroup: points shifted by their predicted offset, groups of the original and of the shifted set, a score for each.
//!
//! Loss: the offset's l1 distance and direction, block or not, and in the second half of a training the binary cross-entropy of
//! each group's score against its overlap, soft between .25 and .75. The ball's radius is the paper's one and a half voxels.
//! Its score network is a small U-Net on each group; here two layers and a maximum over the group's points stand for it.

use crate::ball_query::connected;
use crate::grouping::{Group, Grouping, TrainingTile, head, instances, iou, matrix};
use geom::Vec3;
use net::floats;
use net::prelude::{Linear, Tensor, TensorData, relu, softplus};
use segment::tile::Targets;

/// One and a half cells of a seventh of d_max.
const RADIUS: f32 = 1.5 / 7.0;
/// Fewest points of a group.
const LEAST: usize = 20;
/// Groups that overlap a surer one by more are dropped.
const SUPPRESSED: f32 = 0.3;
/// Least score of a group that is kept.
const LEAST_SCORE: f32 = 0.09;
/// Groups scored in a step of training.
const SCORED: usize = 32;

pub(crate) struct PointGroup;

impl PointGroup {
    fn offset(layers: &[Linear], features: Tensor<2>) -> Tensor<2> {
        head(layers, 0, features)
    }

    fn on_block(layers: &[Linear], features: Tensor<2>) -> Tensor<2> {
        head(layers, 2, features)
    }

    /// Log-odds `[1, 1]` that a group is right.
    fn score(layers: &[Linear], features: &Tensor<2>, group: &[u32]) -> Tensor<2> {
        let index: Vec<i32> = group.iter().map(|&i| i as i32).collect();
        let n = index.len();
        let index = Tensor::from_data(TensorData::new(index, [n]), &features.device());
        let x = relu(layers[4].forward(features.clone().select(0, index))).max_dim(0);
        layers[5].forward(x)
    }
}

/// Groups of both sets.
fn both_sets(position: &[Vec3], offset: &[f32], member: &[bool]) -> Vec<Vec<u32>> {
    let shifted: Vec<Vec3> = position
        .iter()
        .zip(offset.chunks_exact(3))
        .map(|(p, o)| {
            let o = Vec3::from_slice(o);
            // A block is no wider than two d_max: an offset beyond comes from a training that has only begun.
            *p + o.clamp_length_max(2.0)
        })
        .collect();
    let mut groups = connected(position, member, RADIUS, LEAST);
    groups.extend(connected(&shifted, member, RADIUS, LEAST));
    groups
}

/// Largest overlap of a group with a true instance.
fn overlap(group: &[u32], truth: &[Vec<u32>]) -> f32 {
    truth.iter().map(|t| iou(group, t)).fold(0.0, f32::max)
}

fn true_groups(tile: &Targets) -> Vec<Vec<u32>> {
    let (count, instance) = instances(tile);
    let mut groups = vec![Vec::new(); count];
    for (p, i) in instance.iter().enumerate() {
        if let Some(i) = i {
            groups[*i].push(p as u32);
        }
    }
    groups
}

impl Grouping for PointGroup {
    fn layers(&self, c: usize) -> Vec<(usize, usize)> {
        vec![(c, 64), (64, 3), (c, 32), (32, 1), (c, 64), (64, 1)]
    }

    fn loss(&self, layers: &[Linear], features: Tensor<2>, sample: &TrainingTile<'_>) -> Tensor<1> {
        let (tile, device) = (sample.tile, sample.device);
        let n = tile.position.len();
        let offset = Self::offset(layers, features.clone());
        let truth: Vec<f32> = tile.offset.iter().flat_map(|o| o.to_array()).collect();
        let truth = matrix(truth, n, device);
        let on: Vec<f32> = tile.instance.iter().map(|i| f32::from(*i > 0)).collect();
        let counted = on.iter().sum::<f32>().max(1.0);
        let on = matrix(on, n, device);
        let distance = (offset.clone() - truth.clone()).abs().sum_dim(1);
        let length = |x: Tensor<2>| x.square().sum_dim(1).add_scalar(1e-8).sqrt();
        let along =
            (offset.clone() * truth.clone()).sum_dim(1) / (length(offset.clone()) * length(truth));
        let odds = Self::on_block(layers, features.clone());
        let block = softplus(odds.clone(), 1.0) - odds.clone() * on.clone();
        let mut total = ((distance - along) * on).sum() / counted + block.sum() / n as f32;
        if sample.progress < 0.5 {
            return total;
        }
        let member: Vec<bool> = floats(odds.detach()).iter().map(|o| *o > 0.0).collect();
        let groups = both_sets(&tile.position, &floats(offset.detach()), &member);
        let truth = true_groups(tile);
        let scored = groups.len().min(SCORED);
        for k in 0..scored {
            let group = &groups[k * groups.len() / scored];
            // Soft between a quarter and three quarters.
            let target = ((overlap(group, &truth) - 0.25) / 0.5).clamp(0.0, 1.0);
            let odds = Self::score(layers, &features, group);
            total = total + (softplus(odds.clone(), 1.0) - odds * target).sum() / scored as f32;
        }
        total
    }

    fn groups(&self, layers: &[Linear], features: Tensor<2>, position: &[Vec3]) -> Vec<Group> {
        let offset = floats(Self::offset(layers, features.clone()));
        let member: Vec<bool> =
            floats(Self::on_block(layers, features.clone())).iter().map(|o| *o > 0.0).collect();
        let mut found: Vec<Group> = both_sets(position, &offset, &member)
            .into_iter()
            .map(|points| {
                let odds = floats(Self::score(layers, &features, &points))[0];
                Group { points, score: 1.0 / (1.0 + (-odds).exp()) }
            })
            .filter(|g| g.score >= LEAST_SCORE)
            .collect();
        found.sort_by(|a, b| b.score.total_cmp(&a.score));
        let mut kept: Vec<Group> = Vec::new();
        for group in found {
            if kept.iter().all(|k| iou(&k.points, &group.points) <= SUPPRESSED) {
                kept.push(group);
            }
        }
        kept
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_that_touch_are_parted_by_their_offsets() {
        // A row of points that hangs together; its halves point to their own middles.
        let position: Vec<Vec3> = (0..60).map(|i| Vec3::X * 0.1 * i as f32).collect();
        let middle = |i: usize| if i < 30 { 1.5 } else { 4.5 };
        let offset: Vec<f32> =
            (0..60).flat_map(|i| [middle(i) - 0.1 * i as f32, 0.0, 0.0]).collect();
        let groups = both_sets(&position, &offset, &[true; 60]);
        assert_eq!(groups.iter().map(Vec::len).collect::<Vec<_>>(), [60, 30, 30]);
    }
}
