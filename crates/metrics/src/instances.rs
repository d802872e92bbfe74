//! Instances against true instances: overlap of label columns, precision and recall by block (METHOD §5).
//!
//! A predicted instance is right when its IoU with a true one reaches the limit; above one half that pairing is
//! unique by itself. Counts are pooled over scenes before the ratio is taken. Label 0 is *none*.

use crate::MetricsError;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};

/// Label columns of one scene, one label a point, 0 = none.
#[derive(Clone, Copy, Debug)]
pub struct InstanceScene<'a> {
    /// What the program says.
    pub predicted: &'a [u32],
    /// What is so.
    pub truth: &'a [u32],
}

/// Right and wrong detections; ratios follow from them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct DetectionCounts {
    /// Predictions that meet a truth.
    pub true_positives: usize,
    /// Predictions that meet none.
    pub false_positives: usize,
    /// Truths that nothing meets.
    pub false_negatives: usize,
}

impl DetectionCounts {
    /// Share of predictions that are right; `None` without predictions.
    pub fn precision(&self) -> Option<f64> {
        ratio(self.true_positives, self.true_positives + self.false_positives)
    }

    /// Share of truths that were found; `None` without truths.
    pub fn recall(&self) -> Option<f64> {
        ratio(self.true_positives, self.true_positives + self.false_negatives)
    }

    /// Both counts together.
    pub fn plus(&self, other: &Self) -> Self {
        Self {
            true_positives: self.true_positives + other.true_positives,
            false_positives: self.false_positives + other.false_positives,
            false_negatives: self.false_negatives + other.false_negatives,
        }
    }
}

fn ratio(part: usize, whole: usize) -> Option<f64> {
    (whole > 0).then(|| part as f64 / whole as f64)
}

/// Overlap of every pair (predicted, true) that shares a point, ascending; and the sizes of both sides' instances.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Overlaps {
    /// (predicted, true) → IoU.
    pub iou: BTreeMap<(u32, u32), f64>,
    /// Predicted instance → points.
    pub predicted: BTreeMap<u32, usize>,
    /// True instance → points.
    pub truth: BTreeMap<u32, usize>,
}

/// Overlaps of one scene. Error: [`MetricsError::LabelCount`].
pub fn iou_pairs(scene: &InstanceScene, number: usize) -> Result<Overlaps, MetricsError> {
    if scene.predicted.len() != scene.truth.len() {
        return Err(MetricsError::LabelCount {
            scene: number,
            predicted: scene.predicted.len(),
            truth: scene.truth.len(),
        });
    }
    let mut overlaps = Overlaps::default();
    let mut shared: BTreeMap<(u32, u32), usize> = BTreeMap::new();
    for (&p, &t) in scene.predicted.iter().zip(scene.truth) {
        if p != 0 {
            *overlaps.predicted.entry(p).or_default() += 1;
        }
        if t != 0 {
            *overlaps.truth.entry(t).or_default() += 1;
        }
        if p != 0 && t != 0 {
            *shared.entry((p, t)).or_default() += 1;
        }
    }
    for ((p, t), n) in shared {
        let union = overlaps.predicted[&p] + overlaps.truth[&t] - n;
        overlaps.iou.insert((p, t), n as f64 / union as f64);
    }
    Ok(overlaps)
}

/// Block-wise counts at `min_iou`, pooled over the scenes. Each prediction and each truth is used once,
/// the largest overlap first.
pub fn precision_recall(
    scenes: &[InstanceScene],
    min_iou: f64,
) -> Result<DetectionCounts, MetricsError> {
    let mut counts = DetectionCounts::default();
    for (number, scene) in scenes.iter().enumerate() {
        let overlaps = iou_pairs(scene, number)?;
        let mut pairs: Vec<_> = overlaps.iou.iter().filter(|(_, iou)| **iou >= min_iou).collect();
        pairs.sort_by(|a, b| b.1.total_cmp(a.1).then(a.0.cmp(b.0)));
        let (mut used_p, mut used_t) = (BTreeSet::new(), BTreeSet::new());
        for ((p, t), _) in pairs {
            if !used_p.contains(p) && !used_t.contains(t) {
                used_p.insert(*p);
                used_t.insert(*t);
            }
        }
        let hits = used_p.len();
        counts = counts.plus(&DetectionCounts {
            true_positives: hits,
            false_positives: overlaps.predicted.len() - hits,
            false_negatives: overlaps.truth.len() - hits,
        });
    }
    Ok(counts)
}

/// Label columns without what does not count: points of hidden blocks (`hidden[n − 1]` for block `n`) are left out, and
/// an instance that has most of its points on them is none. Both columns are as long as each other, as before.
pub fn without_hidden(predicted: &[u32], truth: &[u32], hidden: &[bool]) -> (Vec<u32>, Vec<u32>) {
    let is_hidden =
        |label: u32| label > 0 && hidden.get(label as usize - 1).copied().unwrap_or(false);
    let mut points: BTreeMap<u32, (usize, usize)> = BTreeMap::new();
    for (&p, &t) in predicted.iter().zip(truth) {
        let count = points.entry(p).or_default();
        count.0 += 1;
        count.1 += usize::from(is_hidden(t));
    }
    let kept = predicted.iter().zip(truth).filter(|(_, t)| !is_hidden(**t));
    kept.map(|(&p, &t)| (if points[&p].1 * 2 > points[&p].0 { 0 } else { p }, t)).unzip()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn counts_by_hand() {
        // Instance 1 meets truth 1 with 3/4; instance 2 meets truth 2 with 1/3; truth 3 is missed.
        let predicted = [1, 1, 1, 0, 2, 2, 0, 0];
        let truth = [1, 1, 1, 1, 2, 0, 2, 3];
        let counts =
            precision_recall(&[InstanceScene { predicted: &predicted, truth: &truth }], 0.5)
                .unwrap();
        assert_eq!(
            counts,
            DetectionCounts { true_positives: 1, false_positives: 1, false_negatives: 2 }
        );
        assert_eq!(counts.precision(), Some(0.5));
        assert_eq!(counts.recall(), Some(1.0 / 3.0));
    }

    #[test]
    fn hidden_blocks_and_what_lies_on_them_are_left_out() {
        // Block 2 is hidden; instance 7 lies on it with two of three points, instance 8 with one of three.
        let (predicted, truth) =
            without_hidden(&[7, 7, 7, 8, 8, 8, 0], &[2, 2, 1, 1, 1, 2, 0], &[false, true]);
        assert_eq!(predicted, [0, 8, 8, 0]);
        assert_eq!(truth, [1, 1, 1, 0]);
    }

    #[test]
    fn unequal_columns_are_named() {
        let scene = InstanceScene { predicted: &[1], truth: &[1, 2] };
        let error = precision_recall(&[scene], 0.5).unwrap_err();
        assert_eq!(error, MetricsError::LabelCount { scene: 0, predicted: 1, truth: 2 });
    }

    proptest! {
        #[test]
        fn renaming_instances_changes_nothing(labels in prop::collection::vec((0_u32..6, 0_u32..6), 1..200)) {
            let predicted: Vec<u32> = labels.iter().map(|l| l.0).collect();
            let truth: Vec<u32> = labels.iter().map(|l| l.1).collect();
            let renamed: Vec<u32> = predicted.iter().map(|&p| if p == 0 { 0 } else { 17 - p }).collect();
            let count = |p: &[u32]| precision_recall(&[InstanceScene { predicted: p, truth: &truth }], 0.5).unwrap();
            prop_assert_eq!(count(&predicted), count(&renamed));
        }

        #[test]
        fn the_truth_is_perfect(truth in prop::collection::vec(0_u32..6, 1..200)) {
            let counts = precision_recall(&[InstanceScene { predicted: &truth, truth: &truth }], 1.0).unwrap();
            prop_assert_eq!(counts.false_positives + counts.false_negatives, 0);
        }
    }
}
