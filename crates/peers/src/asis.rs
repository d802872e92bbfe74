//! ASIS: a discriminative embedding of five numbers, grouped by mean shift.
//!
//! Loss and constants are the paper's (l1 distances, δ_v = 0.5, δ_d = 1.5, weights 1, 1 and 0.001; bandwidth 0.6). Its
//! association of instances with classes has nothing to associate where there is one class.

use crate::grouping::{Group, Grouping, TrainingTile, head, instances, matrix};
use geom::Vec3;
use net::floats;
use net::prelude::{Linear, Tensor, relu};

const EMBEDDING: usize = 5;
const NEAR: f32 = 0.5;
const FAR: f32 = 1.5;
const REGULAR: f32 = 0.001;
const BANDWIDTH: f32 = 0.6;
/// Steps of mean shift.
const STEPS: usize = 50;
/// Fewest points of a group.
const LEAST: usize = 10;

pub(crate) struct Asis;

impl Grouping for Asis {
    fn layers(&self, c: usize) -> Vec<(usize, usize)> {
        vec![(c, 128), (128, EMBEDDING)]
    }

    fn loss(&self, layers: &[Linear], features: Tensor<2>, sample: &TrainingTile<'_>) -> Tensor<1> {
        let embedding = head(layers, 0, features);
        let (count, instance) = instances(sample.tile);
        let n = instance.len();
        if count == 0 {
            return embedding.sum() * 0.0;
        }
        let mut size = vec![0.0_f32; count];
        instance.iter().flatten().for_each(|&i| size[i] += 1.0);
        let (mut mean, mut own, mut weight) =
            (vec![0.0; count * n], vec![0.0; n * count], vec![0.0; n]);
        for (p, i) in instance.iter().enumerate() {
            if let Some(i) = *i {
                mean[i * n + p] = 1.0 / size[i];
                own[p * count + i] = 1.0;
                weight[p] = 1.0 / (size[i] * count as f32);
            }
        }
        let centre = matrix(mean, count, sample.device).matmul(embedding.clone()); // [k, 5]
        let own = matrix(own, n, sample.device).matmul(centre.clone()); // [n, 5]
        let away = (embedding - own).abs().sum_dim(1); // [n, 1]
        let pull = relu(away.sub_scalar(NEAR)).square() * matrix(weight, n, sample.device);
        let regular = centre.clone().abs().sum_dim(1).sum() * (REGULAR / count as f32);
        let total = pull.sum() + regular;
        if count < 2 {
            return total;
        }
        let rows = centre.clone().reshape([count, 1, EMBEDDING]);
        let columns = centre.reshape([1, count, EMBEDDING]);
        let apart = (rows - columns).abs().sum_dim(2).reshape([count, count]);
        let others: Vec<f32> =
            (0..count * count).map(|i| f32::from(i / count != i % count)).collect();
        let push =
            relu(-(apart.sub_scalar(2.0 * FAR))).square() * matrix(others, count, sample.device);
        total + push.sum() / (count * (count - 1)) as f32
    }

    fn groups(&self, layers: &[Linear], features: Tensor<2>, position: &[Vec3]) -> Vec<Group> {
        let embedding = floats(head(layers, 0, features));
        let points: Vec<[f32; EMBEDDING]> = embedding
            .chunks_exact(EMBEDDING)
            .map(|e| e.try_into().expect("rows of an embedding"))
            .collect();
        debug_assert_eq!(points.len(), position.len());
        by_mode(&points)
    }
}

fn distance(a: &[f32; EMBEDDING], b: &[f32; EMBEDDING]) -> f32 {
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum::<f32>().sqrt()
}

/// Mean shift with a flat kernel from one seed a bin; every point joins the nearest mode.
fn by_mode(points: &[[f32; EMBEDDING]]) -> Vec<Group> {
    let bin = |p: &[f32; EMBEDDING]| p.map(|v| (v / BANDWIDTH).round() as i32);
    let mut bins: Vec<[i32; EMBEDDING]> = points.iter().map(bin).collect();
    bins.sort_unstable();
    bins.dedup();
    let mut modes: Vec<([f32; EMBEDDING], usize)> = Vec::new();
    for seed in bins {
        let mut at = seed.map(|v| v as f32 * BANDWIDTH);
        let mut count = 0;
        for _ in 0..STEPS {
            let mut sum = [0.0; EMBEDDING];
            count = 0;
            for p in points.iter().filter(|p| distance(p, &at) < BANDWIDTH) {
                count += 1;
                for (s, v) in sum.iter_mut().zip(p) {
                    *s += v;
                }
            }
            if count == 0 {
                break;
            }
            let next = sum.map(|s| s / count as f32);
            let still = distance(&next, &at) < 1e-3 * BANDWIDTH;
            at = next;
            if still {
                break;
            }
        }
        if count > 0 {
            modes.push((at, count));
        }
    }
    modes.sort_by_key(|m| std::cmp::Reverse(m.1));
    let mut kept: Vec<[f32; EMBEDDING]> = Vec::new();
    for (at, _) in modes {
        if kept.iter().all(|k| distance(k, &at) >= BANDWIDTH) {
            kept.push(at);
        }
    }
    let mut groups = vec![Group { score: 1.0, ..Group::default() }; kept.len()];
    for (i, p) in points.iter().enumerate() {
        let near = (0..kept.len())
            .min_by(|&a, &b| distance(&kept[a], p).total_cmp(&distance(&kept[b], p)));
        if let Some(k) = near {
            groups[k].points.push(i as u32);
        }
    }
    groups.retain(|g| g.points.len() >= LEAST);
    groups
}

#[cfg(test)]
mod tests {
    use super::*;
    use geom::SeedTree;
    use rand::RngExt;

    #[test]
    fn two_heaps_are_two_groups() {
        let mut rng = SeedTree::new(1).rng();
        let points: Vec<[f32; EMBEDDING]> = (0..90)
            .map(|i| std::array::from_fn(|_| rng.random::<f32>() * 0.3 + (i % 3 / 2) as f32 * 3.0))
            .collect();
        let groups = by_mode(&points);
        assert_eq!(groups.iter().map(|g| g.points.len()).collect::<Vec<_>>(), [60, 30]);
        assert!(by_mode(&[]).is_empty());
    }
}
