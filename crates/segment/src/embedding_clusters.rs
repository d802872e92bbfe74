//! The thesis' clustering (METHOD §2): Algorithm 1 picks centres by score, then every point joins the centre nearest
//! in embedding space — among those in reach — and is noise when that one is farther away than d_max.

use crate::infer::Prediction;
use crate::output::EMBEDDING;
use geom::{PointGrid, Vec3};

/// Centres (indices of points) and the centre each point joined.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Clusters {
    pub centres: Vec<u32>,
    /// Index into `centres`; `None` is noise.
    pub member: Vec<Option<u32>>,
}

/// Centres beyond this are not compared, d_max. The text compares all of a scene; in a survey of a thousand blocks
/// embeddings repeat. A centre nearest in embedding space but beyond d_max still makes the point noise.
const COMPARED: f32 = 2.0;

/// Clusters points (d_max) by score and embedding.
pub(crate) fn cluster(
    position: &[Vec3],
    prediction: &Prediction,
    threshold: f32,
    suppression: f32,
) -> Clusters {
    let centres = suppressed_centres(position, &prediction.centre, threshold, suppression);
    let places: Vec<Vec3> = centres.iter().map(|&c| position[c as usize]).collect();
    let grid = PointGrid::new(&places, COMPARED);
    let embedding = |i: usize| &prediction.embedding[i * EMBEDDING..(i + 1) * EMBEDDING];
    let member = (0..position.len())
        .map(|i| {
            let mut best: Option<(f32, u32, f32)> = None;
            grid.for_each_within(position[i], COMPARED, |c, _, d2| {
                let other = embedding(centres[c as usize] as usize);
                let gap: f32 = embedding(i).iter().zip(other).map(|(a, b)| (a - b) * (a - b)).sum();
                if best.is_none_or(|b| (gap, c) < (b.0, b.1)) {
                    best = Some((gap, c, d2));
                }
            });
            best.filter(|b| b.2 <= 1.0).map(|b| b.1)
        })
        .collect();
    Clusters { centres, member }
}

/// Algorithm 1: the best-scored point above the threshold becomes a centre, all within the radius of it go, repeat.
fn suppressed_centres(position: &[Vec3], score: &[f32], threshold: f32, radius: f32) -> Vec<u32> {
    let mut order: Vec<u32> =
        (0..position.len() as u32).filter(|&i| score[i as usize] > threshold).collect();
    order.sort_by(|&a, &b| score[b as usize].total_cmp(&score[a as usize]).then(a.cmp(&b)));
    let candidates: Vec<Vec3> = order.iter().map(|&i| position[i as usize]).collect();
    let grid = PointGrid::new(&candidates, radius);
    let mut gone = vec![false; order.len()];
    let mut centres = Vec::new();
    for at in 0..order.len() {
        if gone[at] {
            continue;
        }
        centres.push(order[at]);
        grid.for_each_within(candidates[at], radius, |i, _, _| gone[i as usize] = true);
    }
    centres
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_groups_and_a_stray() {
        let position = vec![
            Vec3::ZERO,
            Vec3::X * 0.3,
            Vec3::X * 1.5,
            Vec3::X * 1.6,
            Vec3::X * 1.2,
            Vec3::X * 9.0,
        ];
        let mut embedding = vec![0.0; 6 * EMBEDDING];
        for (i, e) in [0.0, 0.1, 5.0, 5.1, 0.0, 0.0].into_iter().enumerate() {
            embedding[i * EMBEDDING] = e;
        }
        let prediction = Prediction {
            centre: vec![0.9, 0.8, 0.7, 0.9, 0.2, 0.3],
            embedding,
            ..Default::default()
        };
        let c = cluster(&position, &prediction, 0.6, 1.0);
        assert_eq!(c.centres, vec![0, 3]);
        // Point 4 looks like the first centre but lies beyond d_max of it: noise, though the second is near.
        assert_eq!(c.member, vec![Some(0), Some(0), Some(1), Some(1), None, None]);
    }

    #[test]
    fn nothing_above_the_threshold() {
        let prediction = Prediction {
            centre: vec![0.1; 3],
            embedding: vec![0.0; 3 * EMBEDDING],
            ..Default::default()
        };
        let c = cluster(&[Vec3::ZERO; 3], &prediction, 0.6, 1.0);
        assert!(c.centres.is_empty() && c.member.iter().all(Option::is_none));
    }
}
