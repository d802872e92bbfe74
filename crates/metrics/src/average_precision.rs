//! Average precision of scored instances in ScanNet's manner (METHOD §5).
//!
//! Over all scenes the predictions are ordered by score; precision and recall after each distinct score give a
//! curve whose area, with half steps on both sides of a node, is the AP — ScanNet's `evaluate_semantic_instance`
//! for one class without void points. A second prediction on the same truth is a false positive with the lower
//! score of the two. AP is the mean over IoU .50, .55 … .90; AP50 and AP25 take one limit.

use crate::MetricsError;
use crate::instances::{InstanceScene, iou_pairs};
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};

/// A scene and the score of each predicted instance (`score[n − 1]` for label `n`).
#[derive(Clone, Copy, Debug)]
pub struct ScoredScene<'a> {
    /// Labels.
    pub labels: InstanceScene<'a>,
    /// Scores by instance number.
    pub score: &'a [f32],
}

/// The three usual figures; `None` when there is neither a truth nor a prediction.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct AveragePrecision {
    /// Mean over the IoU limits .50 to .90 in steps of .05.
    pub ap: Option<f64>,
    /// At IoU .5.
    pub ap50: Option<f64>,
    /// At IoU .25.
    pub ap25: Option<f64>,
}

/// AP, AP50 and AP25 over the scenes.
pub fn average_precision(scenes: &[ScoredScene]) -> Result<AveragePrecision, MetricsError> {
    let limits: Vec<f64> = (0..9).map(|i| 0.5 + 0.05 * f64::from(i)).collect();
    let each = limits.iter().map(|&l| at_iou(scenes, l)).collect::<Result<Vec<_>, _>>()?;
    let known: Vec<f64> = each.iter().flatten().copied().collect();
    let ap = (!known.is_empty()).then(|| known.iter().sum::<f64>() / known.len() as f64);
    Ok(AveragePrecision { ap, ap50: at_iou(scenes, 0.5)?, ap25: at_iou(scenes, 0.25)? })
}

/// Area under the precision-recall curve at one IoU limit.
fn at_iou(scenes: &[ScoredScene], min_iou: f64) -> Result<Option<f64>, MetricsError> {
    let mut detections: Vec<(f32, bool)> = Vec::new();
    let mut missed = 0;
    let mut truths = 0;
    for (number, scene) in scenes.iter().enumerate() {
        let overlaps = iou_pairs(&scene.labels, number)?;
        let score_of = |instance: u32| {
            let missing =
                MetricsError::NoScore { scene: number, instance, scores: scene.score.len() };
            scene.score.get(instance as usize - 1).copied().ok_or(missing)
        };
        truths += overlaps.truth.len();
        let mut meets: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
        for (&(p, t), _) in overlaps.iou.iter().filter(|(_, iou)| **iou > min_iou) {
            meets.entry(t).or_default().push(p);
        }
        let mut matched = BTreeSet::new();
        for t in overlaps.truth.keys() {
            let mut best: Option<f32> = None;
            for &p in meets.get(t).into_iter().flatten() {
                matched.insert(p);
                let score = score_of(p)?;
                match best {
                    None => best = Some(score),
                    Some(other) => {
                        detections.push((score.min(other), false));
                        best = Some(score.max(other));
                    }
                }
            }
            match best {
                Some(score) => detections.push((score, true)),
                None => missed += 1,
            }
        }
        for &p in overlaps.predicted.keys().filter(|p| !matched.contains(p)) {
            detections.push((score_of(p)?, false));
        }
    }
    if truths == 0 {
        return Ok((!detections.is_empty()).then_some(0.0));
    }
    if detections.is_empty() {
        return Ok(Some(0.0));
    }
    Ok(Some(area(&mut detections, missed)))
}

/// ScanNet's integral: nodes at each distinct score, recall steps halved to both sides.
fn area(detections: &mut [(f32, bool)], missed: usize) -> f64 {
    detections.sort_by(|a, b| a.0.total_cmp(&b.0));
    let total_true = detections.iter().filter(|d| d.1).count();
    let mut nodes = Vec::new();
    let mut below_true = 0;
    let mut i = 0;
    while i < detections.len() {
        // Everything from here up is predicted when the limit is this score.
        let tp = total_true - below_true;
        let fp = detections.len() - i - tp;
        let fn_ = below_true + missed;
        nodes.push((tp as f64 / (tp + fp) as f64, tp as f64 / (tp + fn_) as f64));
        let score = detections[i].0;
        while i < detections.len() && detections[i].0 == score {
            below_true += usize::from(detections[i].1);
            i += 1;
        }
    }
    nodes.push((1.0, 0.0));
    let recall = |k: isize| {
        if k < 0 { nodes[0].1 } else { nodes.get(k as usize).map_or(0.0, |n| n.1) }
    };
    nodes
        .iter()
        .enumerate()
        .map(|(k, n)| n.0 * 0.5 * (recall(k as isize - 1) - recall(k as isize + 1)))
        .sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Values of `tools/oracle/average_precision.py` (NumPy, ScanNet's formula written independently).
    #[test]
    fn agrees_with_the_oracle() {
        let truth: Vec<u32> = (0..60).map(|i| i / 10).collect(); // 0..5, ten points each
        let mut predicted = truth.clone();
        predicted[10] = 0; // 1: IoU .9
        predicted[20..24].fill(0); // 2: .6
        predicted[30..37].fill(0); // 3: .3
        predicted[40] = 5; // 4: .9, 5: 10/11
        predicted[0..4].fill(6); // on nothing
        let score = [0.9, 0.8, 0.7, 0.6, 0.6, 0.95];
        let scene = ScoredScene {
            labels: InstanceScene { predicted: &predicted, truth: &truth },
            score: &score,
        };
        let got = average_precision(&[scene]).unwrap();
        let close = |a: Option<f64>, b: f64| (a.unwrap() - b).abs() < 1e-9;
        assert!(
            close(got.ap50, GOLDEN[0]) && close(got.ap25, GOLDEN[1]) && close(got.ap, GOLDEN[2]),
            "{got:?}"
        );
    }

    const GOLDEN: [f64; 3] = [0.4, 0.625, 0.224_074_074_074_074_06];

    #[test]
    fn a_missing_score_is_named() {
        let labels = InstanceScene { predicted: &[2, 2], truth: &[1, 1] };
        let error = average_precision(&[ScoredScene { labels, score: &[0.5] }]).unwrap_err();
        assert_eq!(error, MetricsError::NoScore { scene: 0, instance: 2, scores: 1 });
    }
}
