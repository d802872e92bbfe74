//! The size of the blocks from nothing but a survey and their shape.
//!
//! In: a survey, shapes (a catalogue whose sizes do not matter), the range of sizes. Out: proposals, best first: which shape,
//! how large, with its error. For sizes in steps of a fifth the survey is made so much smaller that the catalogue's block
//! would fit, a few places are searched for it, and what the poses found explain is counted. Where a peak of that share
//! lies, the scale is fitted with the poses and the search repeated at the fitted size until it stays.

use crate::acceptance::{Candidate, accept};
use crate::evidence::weigh;
use crate::leftovers;
use crate::measured::Measured;
use crate::search::{Task, propose};
use crate::size::{Scale, check_sizes};
use crate::template::{Template, templates};
use crate::{PoseConfig, PoseError};
use geom::{Bounds, Event, Observer, Pose, SeedTree, Stage, Vec3};
use rayon::prelude::*;
use scene::{Catalog, ModelId, Survey};

/// How a size is looked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SizeSearch {
    /// Smallest longest edge, metres.
    pub least_m: f32,
    /// Largest longest edge, metres.
    pub most_m: f32,
    /// Ratio of one size tried to the next.
    pub step: f32,
    /// Places searched for each size.
    pub places: usize,
    /// Peaks followed up for each shape.
    pub peaks: usize,
}

impl Default for SizeSearch {
    fn default() -> Self {
        Self { least_m: 0.3, most_m: 10.0, step: 1.15, places: 24, peaks: 3 }
    }
}

/// A size that fits.
#[derive(Clone, Debug, PartialEq)]
pub struct SizeProposal {
    /// The shape: entry of the catalogue.
    pub model: ModelId,
    /// Longest edge of the block, metres.
    pub longest_m: f32,
    /// Factor on the catalogue entry, with its error.
    pub scale: Scale,
    /// Share of the area looked at that blocks of this size explain, what speaks against them taken off.
    pub explained: f32,
    /// Blocks found in the places looked at.
    pub found: usize,
}

/// A block spans at least so many points, or nothing can be told of its size.
const POINTS_ACROSS: f32 = 8.0;
/// Two sizes of one shape within this ratio are one proposal.
const SAME_SIZE: f32 = 1.03;
/// A size wrong by half a step must show: points this far off, in d_max, are explained.
const COARSE_REACH: f32 = 0.035;
/// Rounds of searching at the fitted size.
const ROUNDS: usize = 4;
/// A proposal explains at least this share of what the best one explains.
const LEAST_SHARE: f32 = 0.5;

/// Proposes sizes; best first, empty when nothing fits. Errors: [`PoseError`] of the catalogue, or cancelled.
pub fn fit_block_size(
    survey: &Survey,
    catalog: &Catalog,
    noise_sd_m: f32,
    search: &SizeSearch,
    config: &PoseConfig,
    seed: SeedTree,
    observer: &dyn Observer,
) -> Result<Vec<SizeProposal>, PoseError> {
    let mut proposals: Vec<SizeProposal> = Vec::new();
    for (id, model) in catalog.iter() {
        let alone = Catalog::new(vec![model.clone()]);
        let look = Look {
            survey,
            catalog: &alone,
            templates: templates(&alone, config, seed.child("template", u64::from(id.0)))?,
            noise_sd_m,
            search,
            config,
            seed,
        };
        let mut seen = Vec::new();
        for factor in look.factors(model.d_box_m) {
            if observer.cancelled() {
                return Err(PoseError::Cancelled);
            }
            let trial = look.at(factor, COARSE_REACH);
            let message = format!(
                "`{}` of {:.2} m: {} blocks explain {:.1} %",
                model.name,
                factor * model.d_box_m,
                trial.blocks.len(),
                100.0 * trial.explained
            );
            observer.event(Event::Noted { stage: Stage::Size, message });
            seen.push((factor, trial));
        }
        for (factor, trial) in peaks(seen, search.peaks) {
            proposals.extend(look.follow(id, model.d_box_m, factor, trial)?);
        }
    }
    proposals.sort_by(|a, b| {
        b.explained.total_cmp(&a.explained).then(a.longest_m.total_cmp(&b.longest_m))
    });
    let mut kept: Vec<SizeProposal> = Vec::new();
    for p in proposals {
        let same = |k: &SizeProposal| {
            k.model == p.model && (k.longest_m / p.longest_m).ln().abs() < SAME_SIZE.ln()
        };
        if kept.first().is_none_or(|k| p.explained >= LEAST_SHARE * k.explained)
            && !kept.iter().any(same)
        {
            kept.push(p);
        }
    }
    Ok(kept)
}

/// What one size gave.
struct Trial {
    /// Poses in the survey as it was made smaller.
    blocks: Vec<(ModelId, Pose)>,
    explained: f32,
}

/// The sizes where more is explained than at both neighbours, the best first.
fn peaks(seen: Vec<(f32, Trial)>, most: usize) -> Vec<(f32, Trial)> {
    let share: Vec<f32> = seen.iter().map(|s| s.1.explained).collect();
    let mut peaks: Vec<(f32, Trial)> = seen
        .into_iter()
        .enumerate()
        .filter(|(i, _)| {
            let around = &share[i.saturating_sub(1)..(i + 2).min(share.len())];
            share[*i] > 0.0 && around.iter().all(|s| *s <= share[*i])
        })
        .map(|(_, s)| s)
        .collect();
    peaks.sort_by(|a, b| b.1.explained.total_cmp(&a.1.explained));
    peaks.truncate(most);
    peaks
}

struct Look<'a> {
    survey: &'a Survey,
    /// The one shape.
    catalog: &'a Catalog,
    templates: Vec<Template<'a>>,
    noise_sd_m: f32,
    search: &'a SizeSearch,
    config: &'a PoseConfig,
    seed: SeedTree,
}

impl Look<'_> {
    /// Factors on the catalogue's size that this survey could show.
    fn factors(&self, d_box_m: f32) -> Vec<f32> {
        let bounds = Bounds::of(self.survey.cloud.position_m.iter().copied());
        let size = bounds.size();
        let n = self.survey.cloud.len().max(1) as f32;
        let spacing_m = (size.x * size.y / n).sqrt();
        let least = self.search.least_m.max(POINTS_ACROSS * spacing_m);
        let most = self.search.most_m.min(1.5 * size.truncate().max_element());
        let steps = ((most / least).ln() / self.search.step.ln()).floor();
        if !steps.is_finite() || steps < 0.0 {
            return Vec::new();
        }
        (0..=steps as i32).map(|k| least * self.search.step.powi(k) / d_box_m).collect()
    }

    /// The survey made smaller by the factor, and searched; points within `reach` of a d_max are explained.
    fn at(&self, factor: f32, reach: f32) -> Trial {
        let smaller = self.smaller(factor);
        let template = &self.templates[0];
        let d_max = template.model.d_max_m;
        let cell_m = self.config.search.working_cell * d_max;
        let noise = self.noise_sd_m / factor;
        let measured = Measured::new(&smaller, cell_m, d_max, noise, None, None);
        let tasks = self.places(&measured, d_max);
        let mut config = self.config.clone();
        config.evidence.reach_sd = config.evidence.reach_sd.max(reach * d_max / noise);
        config.evidence.min_agreement = 0.5;
        let pool: Vec<Candidate> = tasks
            .par_iter()
            .enumerate()
            .flat_map_iter(|(t, task)| {
                let seed = self.seed.child("place", t as u64);
                propose(task, template, 0, &measured, &config.search, seed)
            })
            .map(|p| Candidate {
                template: 0,
                at: p.at,
                evidence: weigh(template, &p.at, &measured, &config.evidence),
            })
            .collect();
        let accepted = accept(&pool, &self.templates, &measured, None, &config.evidence);
        let gain: f32 = accepted.accepted.iter().map(|a| a.1 * pool[a.0].evidence.unit_m2).sum();
        let looked = looked_at(&measured, &tasks, d_max) as f32 * measured.point_area_m2;
        let blocks = accepted
            .accepted
            .iter()
            .map(|a| (ModelId(0), pool[a.0].at.pose(template.model.centre)))
            .collect();
        Trial { blocks, explained: gain / looked.max(f32::MIN_POSITIVE) }
    }

    fn smaller(&self, factor: f32) -> Survey {
        let mut smaller = self.survey.clone();
        smaller.cloud.position_m.iter_mut().for_each(|p| *p /= factor);
        smaller.sensor_positions.iter_mut().for_each(|p| *p /= factor);
        smaller.walls.iter_mut().for_each(|w| w.offset_m /= factor);
        smaller
    }

    /// Places to search: all, or so many as are asked for, spread evenly over the list.
    fn places(&self, measured: &Measured, d_max_m: f32) -> Vec<Task> {
        let all: Vec<u32> = (0..measured.position.len() as u32).collect();
        let mut tasks = leftovers::tasks(measured, &all, d_max_m);
        // High places first: what stands out is seen from most sides.
        tasks.sort_by(|a, b| b.centre.z.total_cmp(&a.centre.z));
        let stride = tasks.len().div_ceil(self.search.places.max(1)).max(1);
        tasks.into_iter().step_by(stride).collect()
    }

    /// Fits the scale and searches again at the fitted size until it stays.
    fn follow(
        &self,
        model: ModelId,
        d_box_m: f32,
        mut factor: f32,
        mut trial: Trial,
    ) -> Result<Option<SizeProposal>, PoseError> {
        let mut proposal = None;
        for round in 0..ROUNDS {
            let smaller = self.smaller(factor);
            let noise = self.noise_sd_m / factor;
            let sizes = check_sizes(&smaller, &trial.blocks, self.catalog, noise, self.seed)
                .map_err(|source| {
                    let name = self.templates[0].model.name.clone();
                    PoseError::Mesh { name, source }
                })?;
            let Some(&(_, told)) = sizes.first() else { break };
            let step = told.factor;
            factor *= step;
            let scale = Scale { factor, factor_sd: told.factor_sd * factor, ..told };
            trial = self.at(factor, if round == 0 { COARSE_REACH } else { 0.0 });
            proposal = Some(SizeProposal {
                model,
                longest_m: factor * d_box_m,
                scale,
                explained: trial.explained,
                found: trial.blocks.len(),
            });
            if trial.blocks.is_empty() || (round > 0 && (step - 1.0).abs() < 0.002) {
                break;
            }
        }
        Ok(proposal.filter(|p| p.found > 0))
    }
}

/// Working points within a block of any place searched.
fn looked_at(measured: &Measured, tasks: &[Task], d_max_m: f32) -> usize {
    let mut seen = vec![false; measured.position.len()];
    for task in tasks {
        let mid = task.points.iter().map(|&i| measured.position[i as usize]).sum::<Vec3>()
            / task.points.len().max(1) as f32;
        measured.grid.for_each_within(mid, d_max_m, |i, _, _| seen[i as usize] = true);
    }
    seen.iter().filter(|s| **s).count()
}

#[cfg(test)]
mod tests {
    use super::*;
    use geom::{PointCloud, Quat, Silent};
    use rand::RngExt;
    use scene::Shape;

    /// A few blocks beside each other, seen from above.
    fn pile(model: &scene::BlockModel, seed: u64) -> Survey {
        let mut rng = SeedTree::new(seed).rng();
        let query = geom::MeshQuery::new(&model.mesh).unwrap();
        let mut points = Vec::new();
        for k in 0..6 {
            let mut q = || rng.random::<f32>() - 0.5;
            let turn = Quat::from_array([q(), q(), q(), q()]).normalize();
            let step = 1.1 * model.d_box_m;
            let at = Vec3::new(step * (k % 3) as f32, step * (k / 3) as f32, 0.0);
            let pose = Pose::from_parts(at, turn);
            let up = turn.inverse() * Vec3::Z;
            for (p, n) in model.mesh.sample_surface(2500, &mut rng) {
                if (turn * n).z > 0.1 && query.cast_ray(p + n * 1e-3, up, 10.0).is_none() {
                    points.push(pose * p);
                }
            }
        }
        Survey { cloud: PointCloud::from_positions(points), ..Survey::default() }
    }

    #[test]
    fn the_size_is_found_from_nothing() {
        let shape = Shape::Tetrapod { size: 1.0 };
        let unit = blocks::shape_model("tetrapod", shape, 2300.0).unwrap();
        let catalog = Catalog::new(vec![unit.clone()]);
        let survey = pile(&unit.scaled(1.7), 21);
        let search = SizeSearch { least_m: 1.0, most_m: 4.0, places: 10, ..SizeSearch::default() };
        let found = fit_block_size(
            &survey,
            &catalog,
            0.005,
            &search,
            &PoseConfig::default(),
            SeedTree::new(1),
            &Silent,
        )
        .unwrap();
        assert!((found[0].scale.factor / 1.7 - 1.0).abs() < 0.01, "{found:?}");
    }

    #[test]
    fn an_empty_survey_has_no_size() {
        let cube = blocks::shape_model("c", Shape::Cube { size: 1.0 }, 2300.0).unwrap();
        let found = fit_block_size(
            &Survey::default(),
            &Catalog::new(vec![cube]),
            0.01,
            &SizeSearch::default(),
            &PoseConfig::default(),
            SeedTree::new(1),
            &Silent,
        );
        assert_eq!(found.unwrap(), Vec::new());
    }
}
