//! From accepted candidates to the statement: points re-labelled, poses refined on all of them, uncertainty, occlusion.

use crate::acceptance::Candidate;
use crate::confidence::{Features, among, speaks, type_confidence};
use crate::evidence::reach_m;
use crate::fattening::{Fattening, residuals};
use crate::features::Context;
use crate::fit::{CentredPose, FitPoint, covariance, fit};
use crate::measured::Measured;
use crate::pile_facts::PileFacts;
use crate::template::Template;
use crate::types::decide;
use crate::{EvidenceConfig, Method, PoseConfig};
use geom::{PointGrid, Vec3};
use rayon::prelude::*;
use scene::{
    Covariance, Fit, Guess, InstanceId, PoseLimits, Recognised, SensorKind, Survey, Verdict,
};

/// An accepted block on its way to the statement.
pub struct Accepted {
    /// Entry in the list of templates.
    pub template: usize,
    /// The pose.
    pub at: CentredPose,
    /// What it added when it was accepted, in halves of its surface.
    pub gain: f32,
    /// Best candidate of another type at this place.
    pub other_type: Option<(usize, CentredPose)>,
    /// By how many nats the type beats the next; infinite with one type.
    pub type_margin: f32,
}

/// Fewest blocks that show how a sounder errs.
const FEWEST_BLOCKS: usize = 5;
/// Points a refinement uses at most.
const MOST_POINTS: usize = 4000;

/// Labels every survey point with the accepted block nearest to it, within reach; entry + 1, 0 = none.
pub fn label(
    points: &[Vec3],
    grid: &PointGrid,
    blocks: &[Accepted],
    templates: &[Template],
    measured: &Measured,
    config: &PoseConfig,
) -> Vec<u32> {
    let mut nearest: Vec<(f32, u32)> = vec![(f32::INFINITY, 0); points.len()];
    for (entry, block) in blocks.iter().enumerate() {
        let template = &templates[block.template];
        let reach = reach_m(measured, template, &config.evidence);
        let block_from_site = block.at.pose(template.model.centre).inverse();
        grid.for_each_within(block.at.centre, template.model.d_max_m + reach, |i, p, _| {
            let d = template.field.distance_m(block_from_site * p).abs();
            if d < reach && d < nearest[i as usize].0 {
                nearest[i as usize] = (d, entry as u32 + 1);
            }
        });
    }
    nearest.into_iter().map(|n| n.1).collect()
}

/// Points of each label from 1, ascending.
pub fn members(labels: &[u32], blocks: usize) -> Vec<Vec<u32>> {
    let mut members = vec![Vec::new(); blocks];
    for (i, &label) in labels.iter().enumerate() {
        if label > 0 {
            members[label as usize - 1].push(i as u32);
        }
    }
    members
}

/// The survey points of a list, or an even part of a long one, as the fit wants them.
pub fn fit_points(survey: &Survey, measured: &Measured, index: &[u32]) -> Vec<FitPoint> {
    let stride = index.len().div_ceil(MOST_POINTS).max(1);
    let working = |i: u32| measured.thinned.cell_of_point[i as usize] as usize;
    index
        .iter()
        .step_by(stride)
        .map(|&i| FitPoint {
            position: survey.cloud.position_m[i as usize],
            normal: measured.normal[working(i)],
            to_sensor: measured.to_sensor[working(i)],
        })
        .collect()
}

/// Refines all blocks on their own points, twice, because better poses make better labels; returns the points, and how a sounder
/// was seen to err.
pub fn refine(
    survey: &Survey,
    blocks: &mut [Accepted],
    pool: &[Candidate],
    templates: &[Template],
    measured: &Measured,
    config: &PoseConfig,
    facts: Option<&PileFacts>,
) -> (Vec<Vec<u32>>, Option<Fattening>) {
    let points = &survey.cloud.position_m;
    let cell = templates.iter().map(|t| t.model.d_max_m).fold(f32::INFINITY, f32::min) * 0.2;
    let grid = PointGrid::new(points, cell.max(f32::MIN_POSITIVE));
    // The thesis' way ends with ICP.
    let rounds = if config.method == Method::Ppf && !config.verification { 0 } else { 2 };
    let many = facts.map_or(blocks.len() >= FEWEST_BLOCKS, |f| f.fattening.is_some());
    let sounder = survey.sensor == SensorKind::Mbes && many;
    let rounds = if sounder { rounds * 2 } else { rounds };
    let mut fattening: Option<Fattening> = None;
    for round in 0..rounds {
        if round == 1 && config.verification {
            decide(survey, &grid, blocks, pool, templates, measured);
        }
        let own = members(&label(points, &grid, blocks, templates, measured, config), blocks.len());
        let samples: Vec<Vec<FitPoint>> =
            own.par_iter().map(|own| fit_points(survey, measured, own)).collect();
        if sounder && round > 0 {
            let shown = blocks.iter().zip(&samples).flat_map(|(block, sample)| {
                residuals(sample, &templates[block.template], &block.at)
            });
            let known = facts.and_then(|f| f.fattening.clone());
            fattening = Some(known.unwrap_or_else(|| Fattening::of(shown)));
        }
        blocks.par_iter_mut().zip(samples).for_each(|(block, mut sample)| {
            let template = &templates[block.template];
            let wide = reach_m(measured, template, &config.evidence);
            let sd = measured.noise_sd_m.max(0.3 * template.field.cell_m());
            if let Some(fattening) = &fattening {
                fattening.take_out(&mut sample, template, &block.at);
            }
            if sample.len() >= crate::search::FEWEST_POINTS {
                block.at = fit(
                    &template.fit_model(),
                    &sample,
                    block.at,
                    &[wide, 2.0 * sd, 2.0 * sd, 2.0 * sd],
                )
                .0;
            }
        });
    }
    (members(&label(points, &grid, blocks, templates, measured, config), blocks.len()), fattening)
}

/// The statement on one accepted block before it is judged, and the features it is judged by.
pub fn statement(
    survey: &Survey,
    (entry, block): (usize, &Accepted),
    points: Vec<u32>,
    context: &Context,
    templates: &[Template],
    measured: &Measured,
    config: &EvidenceConfig,
) -> (Recognised, Features) {
    let template = &templates[block.template];
    let model = template.model;
    let sample = fit_points(survey, measured, &points);
    let distance = |template: &Template, at: &CentredPose| distance_m(template, at, &sample);
    let held = covariance(&template.fit_model(), &sample, &block.at, measured.noise_sd_m);
    let features =
        context.features(entry, &points, distance(template, &block.at), held.as_ref(), config);
    // A survey's own shift is in every place it gives.
    let common = survey.sensor.noise_sd_m(model.d_max_m).powi(2);
    let covariance = held.map(|mut held| {
        (0..3).for_each(|axis| held[axis * 7] += common);
        Covariance::new(held)
    });
    let fit = Fit {
        model: template.id,
        site_from_block: model.symmetry.canonical(&block.at.pose(model.centre)),
        type_judged: false,
        confidence: None,
        fitness_m: Some(distance(template, &block.at)),
        runner_up: block.other_type.map(|(t, at)| (templates[t].id, distance(&templates[t], &at))),
        occlusion: Some(1.0 - visible_share(template, &block.at, measured)),
        covariance,
        legs: None,
    };
    let verdict = Verdict::NotJudged(Guess::Fit(fit));
    (Recognised { block: InstanceId(0), points, verdict }, features)
}

/// Another pose that explains a block's points this well beside the stated one makes it a toss-up, which nobody is more sure of
/// than this. Of 1,404 blocks of the fit's scenes that are .7 sure and more 2 lie beyond, both right.
const TOSS_UP: f32 = 0.985;
const EVEN_CHANCE: f32 = 0.5;

/// Gives all statements of a pile their confidence; blocks within `around_m` say something of each other.
pub fn judge(
    statements: &mut [(Recognised, Option<Features>)],
    around_m: f32,
    config: &EvidenceConfig,
) {
    let among = among_others(statements, around_m);
    for ((block, features), among) in statements.iter_mut().zip(among) {
        let (Some(features), Some(mut fit)) = (features, block.fit().cloned()) else { continue };
        let type_confidence = type_confidence(features);
        fit.type_judged = type_confidence >= config.min_type_confidence;
        // What is not stated cannot be wrong: the type counts where it is judged.
        let confidence = among * if fit.type_judged { type_confidence } else { 1.0 };
        // What nothing holds may be anywhere.
        let held =
            features.shift_sd.is_finite() && block.points.len() >= crate::search::FEWEST_POINTS;
        let confidence =
            if features.rival > TOSS_UP { confidence.min(EVEN_CHANCE) } else { confidence };
        fit.confidence = Some(if held { confidence } else { 0.0 });
        block.verdict = Verdict::NotJudged(Guess::Fit(fit));
    }
}

/// How sure each statement is by its own features and the mean of those around it.
fn among_others(statements: &[(Recognised, Option<Features>)], around_m: f32) -> Vec<f32> {
    let alone: Vec<f32> =
        statements.iter().map(|(_, f)| f.as_ref().map_or(0.0, Features::confidence)).collect();
    let places: Vec<Vec3> = statements
        .iter()
        .map(|(block, _)| block.fit().map_or(Vec3::NAN, |fit| fit.site_from_block.translation))
        .collect();
    let grid = PointGrid::new(&places, around_m);
    let of = |i: usize| {
        let flat = statements[i].1.as_ref().is_some_and(|f| f.flat_faces);
        if !places[i].is_finite() {
            return alone[i];
        }
        let near = grid.within(places[i], around_m).into_iter().map(|k| k as usize);
        let others: Vec<f32> =
            near.filter(|&k| k != i && speaks(alone[k], flat)).map(|k| alone[k]).collect();
        let mean = others.iter().sum::<f32>() / others.len().max(1) as f32;
        among(alone[i], (!others.is_empty()).then_some(mean), flat)
    };
    (0..statements.len()).map(of).collect()
}

/// Blocks of a significantly wrong size, or mirrored, are this sure at most.
const WRONG_SHAPE_CONFIDENCE: f32 = 0.4;

/// Decides which statements stand; none does where size or hand is wrong.
pub fn state(
    statements: &mut [(Recognised, Option<Features>)],
    wrong_shape: bool,
    config: &EvidenceConfig,
) {
    let most = if wrong_shape { WRONG_SHAPE_CONFIDENCE } else { 1.0 };
    for (block, _) in statements {
        let Some(mut fit) = block.fit().cloned() else { continue };
        let confidence = fit.confidence.unwrap_or(0.0).min(most);
        fit.confidence = Some(confidence);
        block.verdict = if confidence >= config.min_confidence {
            Verdict::Stated(fit)
        } else {
            Verdict::NotJudged(Guess::Fit(fit))
        };
    }
}

/// Largest standard deviations of a pose's place and turn over a true positive's limits.
pub fn largest_sd(covariance: &[f32; 36], model: &scene::BlockModel) -> (f32, f32) {
    let right = PoseLimits::right(model);
    let sd = |k: std::ops::Range<usize>| {
        k.map(|i| covariance[i * 7].max(0.0).sqrt()).fold(0.0, f32::max)
    };
    (sd(0..3) / right.displacement_m, sd(3..6) / right.rotation_rad)
}

/// Mean distance of the points from the block's surface, metres.
pub fn distance_m(template: &Template, at: &CentredPose, points: &[FitPoint]) -> f32 {
    let block_from_site = at.pose(template.model.centre).inverse();
    let sum: f64 = points
        .iter()
        .map(|p| f64::from(template.field.distance_m(block_from_site * p.position).abs()))
        .sum();
    (sum / points.len().max(1) as f64) as f32
}

/// Share of the model's surface samples with a working point close by (Eq. 3.14 from the measured side).
fn visible_share(template: &Template, at: &CentredPose, measured: &Measured) -> f32 {
    let site_from_block = at.pose(template.model.centre);
    let radius = (1.5 * measured.spacing_m).max(2.5 * measured.noise_sd_m);
    let near = template
        .surface
        .iter()
        .filter(|(p, n)| {
            let normal = site_from_block.rotation * *n;
            measured.grid.nearest_within(site_from_block * *p, radius).is_some_and(|(i, _)| {
                let i = i as usize;
                measured.normal[i] == Vec3::ZERO || measured.normal[i].dot(normal) > 0.3
            })
        })
        .count();
    near as f32 / template.surface.len().max(1) as f32
}

/// The best candidate of another type at an accepted block's place.
pub fn other_type(
    winner: &Candidate,
    candidates: &[Candidate],
    templates: &[Template],
) -> Option<(usize, CentredPose)> {
    let near_m = 0.7 * templates[winner.template].model.d_max_m;
    let mut best: Option<(f32, usize, CentredPose)> = None;
    for c in candidates.iter().filter(|c| c.template != winner.template) {
        // An area, so that a large block's small share compares.
        let score_m2 = c.evidence.score() * c.evidence.unit_m2;
        if (c.at.centre - winner.at.centre).length() <= near_m
            && best.is_none_or(|b| score_m2 > b.0)
        {
            best = Some((score_m2, c.template, c.at));
        }
    }
    best.map(|b| (b.1, b.2))
}
