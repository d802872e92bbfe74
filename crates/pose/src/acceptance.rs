//! All candidates compete for the points; the best set of blocks is taken greedily.
//!
//! A set is worth the points its blocks explain, each counted for the block that explains it best, less what speaks
//! against each block and their overlap. The candidate that adds most is accepted first; what is left for the others
//! is worth less after it. This is how two hypotheses of one block become one, and a wrong pose that borrows the
//! neighbours' points ends with nothing of its own.

use crate::EvidenceConfig;
use crate::evidence::{Evidence, overlap_m2, shared_inside};
use crate::fit::CentredPose;
use crate::ground::Ground;
use crate::measured::Measured;
use crate::template::Template;

/// A pose with its case.
#[derive(Clone, Debug)]
pub struct Candidate {
    /// Entry in the list of templates.
    pub template: usize,
    /// The pose.
    pub at: CentredPose,
    /// What speaks for and against it.
    pub evidence: Evidence,
}

/// The accepted candidates (entries of the list, in the order of acceptance) and how well each working point is
/// explained.
#[derive(Clone, Debug, Default)]
pub struct Acceptance {
    /// Accepted entries and what each added when it was accepted.
    pub accepted: Vec<(usize, f32)>,
    /// Best weight of any accepted block at each working point.
    pub taken: Vec<f32>,
}

/// Accepts greedily until nothing adds enough. The points of the `ground` are explained from the start, as well as it
/// explains them.
pub fn accept(
    candidates: &[Candidate],
    templates: &[Template],
    measured: &Measured,
    ground: Option<&Ground>,
    config: &EvidenceConfig,
) -> Acceptance {
    accept_of(&|_| true, candidates, templates, measured, ground, config)
}

/// [`accept`] among some of the candidates.
pub fn accept_of(
    may: &dyn Fn(usize) -> bool,
    candidates: &[Candidate],
    templates: &[Template],
    measured: &Measured,
    ground: Option<&Ground>,
    config: &EvidenceConfig,
) -> Acceptance {
    let mut taken = explained_by(ground, measured);
    let mut accepted: Vec<(usize, f32)> = Vec::new();
    // Lost to overlap with accepted blocks, in halves of the surface.
    let mut lost = vec![0.0_f32; candidates.len()];
    let eligible = |(i, c): (usize, &Candidate)| {
        let may = may(i) && c.evidence.agreement >= config.min_agreement;
        if may { c.evidence.gain(&taken) } else { f32::NEG_INFINITY }
    };
    let mut gain: Vec<f32> = candidates.iter().enumerate().map(eligible).collect();
    loop {
        // The first of equals: the order of the hypotheses decides, never the order of threads.
        let best = (0..gain.len()).fold(None, |b: Option<usize>, i| match b {
            Some(j) if gain[j] >= gain[i] => b,
            _ => Some(i),
        });
        let Some(best) = best.filter(|&i| gain[i] >= config.min_score) else { break };
        let winner = &candidates[best];
        accepted.push((best, gain[best]));
        for &(i, w) in &winner.evidence.explained {
            taken[i as usize] = taken[i as usize].max(w);
        }
        let reach = templates[winner.template].model.d_max_m;
        for (i, c) in candidates.iter().enumerate() {
            let other = &templates[c.template];
            if gain[i] < config.min_score
                || (c.at.centre - winner.at.centre).length() > reach + other.model.d_max_m
            {
                continue;
            }
            let Some(charge) = charge(c, winner, templates, measured, config) else {
                gain[i] = f32::NEG_INFINITY;
                continue;
            };
            lost[i] += charge;
            gain[i] = c.evidence.gain(&taken) - lost[i];
        }
        gain[best] = f32::NEG_INFINITY;
    }
    Acceptance { accepted, taken }
}

/// How well each working point is explained before any block is.
pub fn explained_by(ground: Option<&Ground>, measured: &Measured) -> Vec<f32> {
    ground.map_or_else(|| vec![0.0_f32; measured.position.len()], |g| g.explained.clone())
}

/// What a candidate loses to its overlap with an accepted one, in halves of its surface; `None`: both cannot be.
pub fn charge(
    candidate: &Candidate,
    accepted: &Candidate,
    templates: &[Template],
    measured: &Measured,
    config: &EvidenceConfig,
) -> Option<f32> {
    let other = &templates[candidate.template];
    let tolerance = overlap_tolerance_m(measured, other);
    let first = (&templates[accepted.template], &accepted.at);
    let second = (other, &candidate.at);
    let reach = first.0.model.d_max_m;
    // Two poses of one place: what the second adds is the first one's error.
    let same = candidate.template == accepted.template
        && other.same(second.1, first.1, SAME_PLACE * reach, SAME_TURN_RAD);
    if same || shared_inside(first, second, tolerance) > config.max_shared {
        return None;
    }
    let overlap = overlap_m2(first, second, tolerance);
    Some(config.overlap_weight * overlap / candidate.evidence.unit_m2)
}

/// Poses of one type are one block within this part of d_max and this turn.
const SAME_PLACE: f32 = 0.3;
const SAME_TURN_RAD: f32 = 0.5;

/// How far two measured blocks may reach into each other: errors of both poses and of the model.
pub fn overlap_tolerance_m(measured: &Measured, template: &Template) -> f32 {
    (1.5 * measured.noise_sd_m).max(0.03 * template.model.d_max_m)
}
