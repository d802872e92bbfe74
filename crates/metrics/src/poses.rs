//! Recognised blocks against true blocks (METHOD §5).
//!
//! A true positive is an estimate whose centre is displaced by at most 0.1·d_box and whose rotation errs by at most
//! 5° modulo symmetry. Each estimate and each truth is used once, the smallest displacement first. Truths with
//! occlusion of 80 % or more are not missed when absent, and an estimate that meets one counts neither way.
//! Blocks reported as *not judged* are no statement and are left out.

use crate::DetectionCounts;
use geom::Vec3;
use scene::{BlockModel, Catalog, Fit, PlacedBlock, PoseError, PoseLimits, Recognised};
use serde::{Deserialize, Serialize};

/// The limits of a true positive; `Default` is the thesis'.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PoseCriteria {
    /// Largest displacement over d_box.
    pub max_displacement_ratio: f32,
    /// Largest rotation error, degrees.
    pub max_rotation_deg: f32,
    /// Truths at or above this occlusion are not scored.
    pub occlusion_limit: f32,
}

impl Default for PoseCriteria {
    fn default() -> Self {
        Self { max_displacement_ratio: 0.1, max_rotation_deg: 5.0, occlusion_limit: 0.8 }
    }
}

impl PoseCriteria {
    /// How far an estimate of a block of this type may be off.
    pub fn limits(&self, truth: &BlockModel) -> PoseLimits {
        PoseLimits {
            displacement_m: self.max_displacement_ratio * truth.d_box_m,
            rotation_rad: self.max_rotation_deg.to_radians(),
        }
    }
}

/// A true block and how much of it nobody could see (Eq. 3.14).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrueBlock {
    /// Type and pose.
    pub placed: PlacedBlock,
    /// Occlusion in [0, 1].
    pub occlusion: f32,
}

/// The verdict on one scene, or on several through [`PoseScore::plus`].
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PoseScore {
    /// True and false positives, misses.
    pub counts: DetectionCounts,
    /// Estimates that met a truth too occluded to be scored.
    pub ignored: usize,
    /// Error of each true positive, in the order of the estimates.
    pub errors: Vec<PoseError>,
    /// Displacement of each true positive about the mean displacement of its scene, metres: what is left of E_d when
    /// the survey's own shift is taken out, which no recognition can see.
    pub about_shift_m: Vec<f32>,
    /// True positives whose type is judged and right.
    pub types_right: usize,
    /// True positives whose type is not judged.
    pub types_open: usize,
    /// Confidence of each stated, not ignored estimate that has one, and whether what it states is right: the pose, and the type
    /// where that is judged.
    pub confidence: Vec<(f32, bool)>,
}

impl PoseScore {
    /// E_d: mean displacement of the true positives, metres.
    pub fn mean_displacement_m(&self) -> Option<f64> {
        mean(self.errors.iter().map(|e| f64::from(e.displacement_m)))
    }

    /// Mean displacement of the true positives about their survey's shift, metres.
    pub fn mean_about_shift_m(&self) -> Option<f64> {
        mean(self.about_shift_m.iter().map(|&d| f64::from(d)))
    }

    /// E_R: mean rotation error of the true positives, radians.
    pub fn mean_rotation_rad(&self) -> Option<f64> {
        mean(self.errors.iter().map(|e| f64::from(e.rotation_rad)))
    }

    /// Of the true positives whose type is judged, the share that have the right one.
    pub fn type_accuracy(&self) -> Option<f64> {
        let all = self.counts.true_positives - self.types_open;
        (all > 0).then(|| self.types_right as f64 / all as f64)
    }

    /// Both scenes pooled.
    pub fn plus(&self, other: &Self) -> Self {
        Self {
            counts: self.counts.plus(&other.counts),
            ignored: self.ignored + other.ignored,
            errors: [self.errors.as_slice(), &other.errors].concat(),
            about_shift_m: [self.about_shift_m.as_slice(), &other.about_shift_m].concat(),
            types_right: self.types_right + other.types_right,
            types_open: self.types_open + other.types_open,
            confidence: [self.confidence.as_slice(), &other.confidence].concat(),
        }
    }
}

fn mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (sum, n) = values.fold((0.0, 0_usize), |(s, n), v| (s + v, n + 1));
    (n > 0).then(|| sum / n as f64)
}

/// Judges the estimates of one scene.
pub fn score_poses(
    estimates: &[Recognised],
    truths: &[TrueBlock],
    catalog: &Catalog,
    criteria: &PoseCriteria,
) -> PoseScore {
    let stated: Vec<&Fit> = scene::stated(estimates).map(|(_, fit)| fit).collect();
    let mut pairs = Vec::new();
    for (e, estimate) in stated.iter().enumerate() {
        let estimate = estimate.posed(catalog);
        for (t, truth) in truths.iter().enumerate() {
            let truth = truth.placed.posed(catalog);
            let error = estimate.error(&truth);
            if criteria.limits(truth.model).hold(error) {
                pairs.push((error, e, t));
            }
        }
    }
    pairs.sort_by(|a, b| {
        a.0.displacement_m.total_cmp(&b.0.displacement_m).then((a.1, a.2).cmp(&(b.1, b.2)))
    });
    let mut of_estimate: Vec<Option<(usize, PoseError)>> = vec![None; stated.len()];
    let mut taken = vec![false; truths.len()];
    for (error, e, t) in pairs {
        if of_estimate[e].is_none() && !taken[t] {
            of_estimate[e] = Some((t, error));
            taken[t] = true;
        }
    }
    let wanted = |t: usize| truths[t].occlusion < criteria.occlusion_limit;
    let mut score = PoseScore::default();
    let mut displaced = Vec::new();
    for (e, estimate) in stated.iter().enumerate() {
        match of_estimate[e] {
            Some((t, error)) if wanted(t) => {
                let right = estimate.model == truths[t].placed.model;
                score.counts.true_positives += 1;
                score.types_right += usize::from(right && estimate.type_judged);
                score.types_open += usize::from(!estimate.type_judged);
                score.errors.push(error);
                let truth = truths[t].placed.posed(catalog);
                displaced.push(
                    estimate.centre(catalog.get(estimate.model)) - truth.pose * truth.model.centre,
                );
                let holds = right || !estimate.type_judged;
                score.confidence.extend(estimate.confidence.map(|c| (c, holds)));
            }
            Some(_) => score.ignored += 1,
            None => {
                score.counts.false_positives += 1;
                score.confidence.extend(estimate.confidence.map(|c| (c, false)));
            }
        }
    }
    let shift = displaced.iter().copied().sum::<Vec3>() / displaced.len().max(1) as f32;
    score.about_shift_m = displaced.iter().map(|d| (*d - shift).length()).collect();
    score.counts.false_negatives = (0..truths.len()).filter(|&t| wanted(t) && !taken[t]).count();
    score
}
