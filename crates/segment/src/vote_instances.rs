//! From the votes of all passes to instances.
//!
//! In: what the network says of every pass's points. Out: at one size of block, the modes of the votes with their
//! confidence, which of them are instances, and the label of every point of the survey.

use crate::SegmentConfig;
use crate::all_scales::{AtScale, Hypothesis};
use crate::calibration::PeakFeatures;
use crate::infer::Prediction;
use crate::model::ModelDescription;
use crate::vote_peaks::{Peak, Vote, peaks, suppressed, weight};
use geom::{PointGrid, Thinned, Vec3};
use rayon::prelude::*;

/// Points a thread labels at a time.
const JUDGED_TOGETHER: usize = 8192;

/// A thinning with what the network says of it.
pub(crate) struct Pass {
    pub thinned: Thinned,
    pub prediction: Prediction,
    pub position: Vec<Vec3>,
}

impl Pass {
    fn votes(&self, share: f32) -> impl Iterator<Item = Vote> + '_ {
        let p = &self.prediction;
        (0..p.vote.len())
            .map(move |i| Vote { at: p.vote[i], weight: share * weight(p.block[i], p.error[i]) })
    }
}

/// The modes of all passes' votes under a kernel of this width, densest first.
pub(crate) fn modes(runs: &[Pass], width: f32) -> Vec<(Peak, PeakFeatures)> {
    let share = 1.0 / runs.len() as f32;
    let votes: Vec<Vote> = runs.iter().flat_map(|r| r.votes(share)).collect();
    let grids: Vec<PointGrid> = runs.iter().map(|r| PointGrid::new(&r.position, 1.0)).collect();
    let around = |peak: &Peak| {
        let mut count = 0_u32;
        for grid in &grids {
            grid.for_each_within(peak.at, 1.0, |_, _, _| count += 1);
        }
        share * count as f32
    };
    let found = peaks(&votes, width);
    found
        .par_iter()
        .map(|peak| (*peak, PeakFeatures { density: peak.density, around: around(peak) }))
        .collect()
}

/// What the votes give at one size: hypotheses, and the label of every point.
pub(crate) fn by_votes(
    runs: &[Pass],
    points: usize,
    unit_m: f32,
    weights: &ModelDescription,
    config: &SegmentConfig,
) -> AtScale {
    let scored: Vec<(Peak, f32)> = modes(runs, weights.vote_width)
        .into_iter()
        .map(|(peak, features)| (peak, weights.confidence.of(&features)))
        .filter(|(_, score)| *score >= config.least_score)
        .collect();
    let apart = suppressed(scored.iter().map(|s| s.0).collect(), config.instance_spacing);
    let least = weights.least_instance_score(config.least_instance_score);
    let mut hypotheses: Vec<Hypothesis> = scored
        .iter()
        .map(|&(peak, score)| Hypothesis {
            centre: peak.at * unit_m,
            score,
            instance: score >= least && apart.contains(&peak),
            points: Vec::new(),
        })
        .collect();
    let centres: Vec<Vec3> = scored.iter().map(|s| s.0.at).collect();
    let label = labels(runs, points, &centres, &mut hypotheses, config);
    AtScale { hypotheses, label }
}

/// The instance each point belongs to and how surely; fills in the points of hypotheses that are no instance.
fn labels(
    runs: &[Pass],
    points: usize,
    centres: &[Vec3],
    hypotheses: &mut [Hypothesis],
    config: &SegmentConfig,
) -> Vec<Option<(u32, f32)>> {
    let grid = PointGrid::new(centres, config.reach);
    let is_instance: Vec<bool> = hypotheses.iter().map(|h| h.instance).collect();
    // Every pass says which hypotheses a point could belong to, through the vote of the point that stood for it.
    let judge = |i: usize, members: &mut Vec<(u32, u32)>| {
        let mut support: Vec<(u32, f32)> = Vec::new();
        let mut total = 0.0;
        for run in runs {
            let at = run.thinned.cell_of_point[i] as usize;
            let p = &run.prediction;
            let w = weight(p.block[at], p.error[at]).max(1e-6);
            total += w;
            if p.block[at] < config.least_block {
                continue;
            }
            let (mut nearest, mut nearest_instance) =
                ((f32::INFINITY, u32::MAX), (f32::INFINITY, u32::MAX));
            grid.for_each_within(p.vote[at], config.reach, |h, _, d2| {
                if (d2, h) < nearest {
                    nearest = (d2, h);
                }
                if (d2, h) < nearest_instance && is_instance[h as usize] {
                    nearest_instance = (d2, h);
                }
            });
            if nearest_instance.1 != u32::MAX {
                match support.iter_mut().find(|s| s.0 == nearest_instance.1) {
                    Some(s) => s.1 += w,
                    None => support.push((nearest_instance.1, w)),
                }
            }
            if nearest.1 != u32::MAX && !is_instance[nearest.1 as usize] {
                members.push((nearest.1, i as u32));
            }
        }
        // The most supported; of equals the better hypothesis.
        let best = support.into_iter().max_by(|a, b| a.1.total_cmp(&b.1).then(b.0.cmp(&a.0)));
        best.map(|(h, w)| (h, w / total))
    };
    let mut label = vec![None; points];
    let found: Vec<Vec<(u32, u32)>> = label
        .par_chunks_mut(JUDGED_TOGETHER)
        .enumerate()
        .map(|(chunk, label)| {
            let mut members = Vec::new();
            for (slot, label) in label.iter_mut().enumerate() {
                *label = judge(chunk * JUDGED_TOGETHER + slot, &mut members);
            }
            members
        })
        .collect();
    let mut members: Vec<Vec<u32>> = vec![Vec::new(); hypotheses.len()];
    for (h, i) in found.into_iter().flatten() {
        members[h as usize].push(i);
    }
    for (h, points) in hypotheses.iter_mut().zip(members) {
        h.points = points;
        h.points.dedup();
    }
    label
}
