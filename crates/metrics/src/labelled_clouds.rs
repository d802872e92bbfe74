//! A labelled cloud against any other labelled cloud of the same scene, in whatever order and numbering.
//!
//! In: positions and instance numbers of both, a tolerance. Out: a pair of label columns over the true points, which the
//! figures of [`crate::instances`] and [`crate::average_precision()`] take, and how many points of either side found no partner.
//! Every true point takes the label of the nearest point of the result within the tolerance; a true point without one has
//! no label there. Points of the result that the truth knows nothing of do not enter an overlap; an instance that has most
//! of its points there is not judged.

use crate::MetricsError;
use crate::average_precision::{AveragePrecision, ScoredScene, average_precision};
use crate::instances::{DetectionCounts, InstanceScene, iou_pairs, precision_recall};
use geom::{DVec3, PointGrid, Vec3};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Points with the instance of each; numbers below 1 mean none.
#[derive(Clone, Copy, Debug)]
pub struct Labelled<'a> {
    /// Coordinates, both clouds in the same frame.
    pub position: &'a [DVec3],
    /// Instance of each point.
    pub instance: &'a [i64],
    /// Confidence of each point's label, if the result has one.
    pub confidence: Option<&'a [f32]>,
}

/// Whether 0 is an instance or means none.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Zero {
    /// 0 and below mean none.
    #[default]
    None,
    /// Instances are numbered from 0; only numbers below mean none.
    Instance,
}

/// One scene, ready to be pooled.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MatchedLabels {
    /// Result's instance of each true point, from 1; 0 for none.
    pub predicted: Vec<u32>,
    /// True instance of each true point, from 1; 0 for none.
    pub truth: Vec<u32>,
    /// Score of each instance of the result: the mean confidence of its points, 1 where it states none.
    pub score: Vec<f32>,
    /// True points with no point of the result within the tolerance.
    pub unmatched_truth: usize,
    /// Points of the result with no true point within the tolerance.
    pub unmatched_predicted: usize,
    /// Instances of the result that lie mostly where the truth has no points.
    pub not_judged: usize,
}

/// Figures over all scenes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LabelFigures {
    /// True and false positives and misses at the limit asked for.
    pub counts: DetectionCounts,
    /// ScanNet's three figures.
    pub average_precision: AveragePrecision,
    /// Mean over the true instances of the largest overlap any result has with it.
    pub coverage: Option<f64>,
    /// The same, instances weighted by their points.
    pub weighted_coverage: Option<f64>,
    /// True points.
    pub true_points: usize,
    /// True points without a partner.
    pub unmatched_truth: usize,
    /// Points of the results without a partner.
    pub unmatched_predicted: usize,
    /// Instances of the results outside the truth.
    pub not_judged: usize,
}

/// A tolerance that cannot join two points of a block of this size by mistake and joins what a rounded file has moved: a
/// hundredth of d_max.
pub fn tolerance_m(d_max_m: f32) -> f64 {
    f64::from(d_max_m) * 0.01
}

/// Joins the points of a truth and a result; `zero` says of each side whether 0 is an instance. Errors: a column that is not as long as its cloud, a tolerance that is none.
pub fn match_labels(
    truth: Labelled<'_>,
    result: Labelled<'_>,
    tolerance_m: f64,
    [zero_of_truth, zero_of_result]: [Zero; 2],
) -> Result<MatchedLabels, MetricsError> {
    for (side, cloud) in [("truth", &truth), ("result", &result)] {
        if cloud.instance.len() != cloud.position.len() {
            return Err(MetricsError::LabelColumn {
                side,
                labels: cloud.instance.len(),
                points: cloud.position.len(),
            });
        }
    }
    if !(tolerance_m > 0.0 && tolerance_m.is_finite()) {
        return Err(MetricsError::Tolerance { metres: tolerance_m });
    }
    let (truth_label, _) = dense(truth.instance, zero_of_truth);
    let (result_label, numbers) = dense(result.instance, zero_of_result);
    let partner = partners(truth.position, result.position, tolerance_m);
    let mut matched = MatchedLabels { truth: truth_label, ..Default::default() };
    for p in &partner {
        matched.predicted.push(p.map_or(0, |i| result_label[i as usize]));
        matched.unmatched_truth += usize::from(p.is_none());
    }
    let known = partners(result.position, truth.position, tolerance_m);
    let mut size = vec![(0_usize, 0_usize); numbers + 1];
    let mut confidence = vec![0.0_f64; numbers + 1];
    for (i, k) in known.iter().enumerate() {
        let label = result_label[i] as usize;
        size[label].0 += 1;
        size[label].1 += usize::from(k.is_none());
        matched.unmatched_predicted += usize::from(k.is_none());
        confidence[label] += result.confidence.map_or(1.0, |c| f64::from(c[i]));
    }
    let outside: Vec<bool> = size.iter().map(|&(all, unknown)| 2 * unknown > all).collect();
    matched.not_judged = (1..=numbers).filter(|&n| outside[n]).count();
    for p in matched.predicted.iter_mut().filter(|p| outside[**p as usize]) {
        *p = 0;
    }
    matched.score =
        (1..=numbers).map(|n| (confidence[n] / size[n].0.max(1) as f64) as f32).collect();
    Ok(matched)
}

/// Instance numbers from 1 in the order of their size as numbers, and how many there are.
fn dense(instance: &[i64], zero: Zero) -> (Vec<u32>, usize) {
    let least = if zero == Zero::Instance { 0 } else { 1 };
    let mut number: BTreeMap<i64, u32> =
        instance.iter().filter(|i| **i >= least).map(|i| (*i, 0)).collect();
    for (n, (_, v)) in (1..).zip(number.iter_mut()) {
        *v = n;
    }
    (instance.iter().map(|i| number.get(i).copied().unwrap_or(0)).collect(), number.len())
}

/// For every point of `of` the nearest of `among` within the tolerance.
fn partners(of: &[DVec3], among: &[DVec3], tolerance_m: f64) -> Vec<Option<u32>> {
    // f32 from a corner of the scene: half a micron at ten metres.
    let origin = among.first().copied().unwrap_or_default();
    let local = |points: &[DVec3]| -> Vec<Vec3> {
        points.iter().map(|p| (*p - origin).as_vec3()).collect()
    };
    let grid = PointGrid::new(&local(among), tolerance_m as f32);
    local(of).into_iter().map(|p| grid.nearest_within(p, tolerance_m as f32).map(|n| n.0)).collect()
}

/// Pools scenes; precision and recall at `min_iou`. Error: a limit outside (0, 1].
pub fn label_figures(scenes: &[MatchedLabels], min_iou: f64) -> Result<LabelFigures, MetricsError> {
    if !(min_iou > 0.0 && min_iou <= 1.0) {
        return Err(MetricsError::IouLimit { value: min_iou });
    }
    fn labels(m: &MatchedLabels) -> InstanceScene<'_> {
        InstanceScene { predicted: &m.predicted, truth: &m.truth }
    }
    let plain: Vec<InstanceScene> = scenes.iter().map(labels).collect();
    let scored: Vec<ScoredScene> =
        scenes.iter().map(|m| ScoredScene { labels: labels(m), score: &m.score }).collect();
    let (mut sum, mut count, mut weighted, mut weight) = (0.0, 0_usize, 0.0, 0_usize);
    for (number, scene) in plain.iter().enumerate() {
        let overlaps = iou_pairs(scene, number)?;
        let mut best_of: BTreeMap<u32, f64> = BTreeMap::new();
        for ((_, t), iou) in &overlaps.iou {
            let best = best_of.entry(*t).or_default();
            *best = best.max(*iou);
        }
        for (t, &points) in &overlaps.truth {
            let best = best_of.get(t).copied().unwrap_or_default();
            sum += best;
            count += 1;
            weighted += best * points as f64;
            weight += points;
        }
    }
    let total = |f: fn(&MatchedLabels) -> usize| scenes.iter().map(f).sum();
    Ok(LabelFigures {
        counts: precision_recall(&plain, min_iou)?,
        average_precision: average_precision(&scored)?,
        coverage: (count > 0).then(|| sum / count as f64),
        weighted_coverage: (weight > 0).then(|| weighted / weight as f64),
        true_points: total(|m| m.truth.len()),
        unmatched_truth: total(|m| m.unmatched_truth),
        unmatched_predicted: total(|m| m.unmatched_predicted),
        not_judged: total(|m| m.not_judged),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(n: usize) -> Vec<DVec3> {
        (0..n).map(|i| DVec3::new(5e5 + i as f64 * 0.01, 4e6, 1.0)).collect()
    }

    fn cloud<'a>(position: &'a [DVec3], instance: &'a [i64]) -> Labelled<'a> {
        Labelled { position, instance, confidence: None }
    }

    #[test]
    fn neither_order_nor_numbering_matters() {
        let points = line(40);
        let truth: Vec<i64> = (0..40).map(|i| [7_000_000_000, -1, 3, 0][i / 10]).collect();
        let mut turned: Vec<(DVec3, i64)> =
            points.iter().zip(&truth).map(|(p, t)| (*p + DVec3::splat(1e-4), -*t + 8)).collect();
        turned.reverse();
        let (position, instance): (Vec<DVec3>, Vec<i64>) = turned.into_iter().unzip();
        let instance: Vec<i64> = instance
            .into_iter()
            .map(|i| if i == 9 || i == 8 { -1 } else { i + 9_000_000_000 })
            .collect();
        let m = match_labels(
            cloud(&points, &truth),
            cloud(&position, &instance),
            1e-3,
            [Zero::None; 2],
        )
        .unwrap();
        let figures = label_figures(&[m], 0.5).unwrap();
        assert_eq!(figures.counts.true_positives, 2);
        assert_eq!((figures.counts.false_positives, figures.counts.false_negatives), (0, 0));
        assert_eq!(figures.average_precision.ap, Some(1.0));
        assert_eq!((figures.coverage, figures.weighted_coverage), (Some(1.0), Some(1.0)));
        assert_eq!((figures.unmatched_truth, figures.unmatched_predicted), (0, 0));
    }

    #[test]
    fn points_without_a_partner_are_counted_and_foreign_instances_are_not_held_against_it() {
        let (points, longer) = (line(20), line(50));
        let truth = vec![1; 20];
        let result: Vec<i64> = (0..50)
            .map(|i| {
                if i < 15 {
                    4
                } else if i < 30 {
                    0
                } else {
                    5
                }
            })
            .collect();
        let m =
            match_labels(cloud(&points, &truth), cloud(&longer, &result), 1e-3, [Zero::None; 2])
                .unwrap();
        assert_eq!((m.unmatched_truth, m.unmatched_predicted, m.not_judged), (0, 30, 1));
        let figures = label_figures(&[m], 0.5).unwrap();
        assert_eq!((figures.counts.true_positives, figures.counts.false_positives), (1, 0));
        assert_eq!(figures.coverage, Some(0.75));
        let none =
            match_labels(cloud(&points, &truth), cloud(&[], &[]), 1e-3, [Zero::None; 2]).unwrap();
        assert_eq!(none.unmatched_truth, 20);
        assert_eq!(label_figures(&[none], 0.5).unwrap().counts.false_negatives, 1);
    }

    #[test]
    fn instances_may_be_numbered_from_nought() {
        let points = line(10);
        let labels: Vec<i64> = (0..10).map(|i| i / 5).collect();
        let count = |zero| {
            let m = match_labels(cloud(&points, &labels), cloud(&points, &labels), 1e-3, [zero; 2]);
            label_figures(&[m.unwrap()], 0.5).unwrap().counts.true_positives
        };
        assert_eq!((count(Zero::None), count(Zero::Instance)), (1, 2));
    }

    #[test]
    fn what_does_not_belong_together_is_refused() {
        let points = line(3);
        let wrong =
            match_labels(cloud(&points, &[1]), cloud(&points, &[1, 1, 1]), 1.0, [Zero::None; 2]);
        assert!(wrong.unwrap_err().to_string().contains("1 labels for 3 points"));
        let wrong = match_labels(cloud(&[], &[]), cloud(&[], &[]), 0.0, [Zero::None; 2]);
        assert!(wrong.unwrap_err().to_string().contains("tolerance"));
        assert!(label_figures(&[], 1.5).is_err());
    }
}
