//! The stage: hypotheses in, judged blocks out.
//!
//! Search every hypothesis with every type; let all poses compete for the points; search what is left; repeat until
//! nothing is gained; refine and state.

use crate::acceptance::{Acceptance, Candidate, accept};
use crate::canonical::Canonical;
use crate::confidence::Features;
use crate::evidence::{reach_m, weigh};
use crate::features::Context;
use crate::finish::{Accepted, judge, other_type, refine, statement};
use crate::ground::{Bed, Ground};
use crate::levelling::level;
use crate::limbs::{Limb, judge_limbs};
use crate::measured::{Measured, noise_of_m};
use crate::search::{Proposal, Task, propose};
use crate::template::{Template, templates};
use crate::unjudged::{LEAST_CONFIDENCE, may_hold_a_block};
use crate::verdict::{PileVerdict, is_wrong};
use crate::{
    EvidenceConfig, Method, Places, PoseConfig, PoseError, finish, ground, leftovers, thesis,
};
use geom::{Event, Observer, SeedTree, Vec3, Warning};
use rayon::prelude::*;
use scene::{Catalog, Fit, Guess, InstanceId, Recognised, Segmentation, Survey, Verdict};
use std::sync::atomic::{AtomicU64, Ordering};

const STAGE: &str = "pose";
/// Blocks at least so sure tell the common size.
const LIKELY: f32 = 0.3;

/// Recognises the blocks of a survey from its segmentation. The same points and blocks give the same result in whatever
/// order points, lines, hypotheses and catalogue entries come, and whatever the seed, of which only callers' signatures
/// remember the use. Blocks come in the order in which they were
/// accepted, the best supported first, numbered from 1; segments without a verdict follow as *not judged*.
/// Errors: [`PoseError`]; a place where nothing is found is not an error.
pub fn recognise(
    survey: &Survey,
    segmentation: &Segmentation,
    catalog: &Catalog,
    config: &PoseConfig,
    seed: SeedTree,
    observer: &dyn Observer,
) -> Result<Vec<Recognised>, PoseError> {
    let found = recognise_with_features(survey, segmentation, catalog, config, seed, observer)?;
    Ok(found.into_iter().map(|f| f.0).collect())
}

/// [`recognise`] with the features each confidence was made of (`None` for segments without a verdict), for fitting them.
pub fn recognise_with_features(
    survey: &Survey,
    segmentation: &Segmentation,
    catalog: &Catalog,
    config: &PoseConfig,
    _seed: SeedTree,
    observer: &dyn Observer,
) -> Result<Vec<(Recognised, Option<Features>)>, PoseError> {
    Ok(recognise_pile(survey, segmentation, catalog, config, observer)?.blocks)
}

/// Blocks and what is said of the survey as a whole.
#[derive(Clone, Debug, Default)]
pub struct Outcome {
    /// Blocks as [`recognise`] gives them, with the features each confidence was made of.
    pub blocks: Vec<(Recognised, Option<Features>)>,
    /// What is said of the survey as a whole.
    pub pile: PileVerdict,
    /// The legs of the stated blocks that have any, with the number of the block.
    pub limbs: Vec<(InstanceId, Vec<Limb>)>,
}

/// Block types made ready once, for many surveys: distance fields, samples of surfaces, rotations.
pub struct Templates<'a> {
    catalog: &'a Catalog,
    config: PoseConfig,
    all: Vec<Template<'a>>,
}

impl<'a> Templates<'a> {
    /// Makes all types of a catalogue ready. Errors: settings that make no sense, a mesh that is no solid.
    pub fn new(catalog: &'a Catalog, config: &PoseConfig) -> Result<Self, PoseError> {
        config.check()?;
        Ok(Self { catalog, config: config.clone(), all: templates(catalog, config, stage_seed())? })
    }
}

/// Chance has no say in what is found: the same draws whatever the user's seed.
fn stage_seed() -> SeedTree {
    SeedTree::new(0).child("pose", 0)
}

/// [`recognise`] with everything it knows. What a person should be told also goes to the observer.
pub fn recognise_pile(
    survey: &Survey,
    segmentation: &Segmentation,
    catalog: &Catalog,
    config: &PoseConfig,
    observer: &dyn Observer,
) -> Result<Outcome, PoseError> {
    config.check()?;
    check_input(survey, segmentation, catalog)?;
    recognise_with(survey, segmentation, &Templates::new(catalog, config)?, observer)
}

/// The same with block types that are ready already.
pub fn recognise_with(
    survey: &Survey,
    segmentation: &Segmentation,
    ready: &Templates,
    observer: &dyn Observer,
) -> Result<Outcome, PoseError> {
    let (catalog, config, templates, seed) =
        (ready.catalog, &ready.config, &ready.all, stage_seed());
    check_input(survey, segmentation, catalog)?;
    if survey.cloud.is_empty() {
        return Ok(Outcome::default());
    }
    let canonical = Canonical::new(survey, segmentation);
    let (survey, segmentation) = (&canonical.survey, &canonical.segmentation);
    let levelled =
        config.levelling.then(|| levelled(survey, templates, config, observer)).flatten();
    let (survey, noise_sd_m) =
        levelled.as_ref().map_or((survey, None), |(survey, noise)| (survey, Some(*noise)));
    let measured = measure(survey, templates, config, noise_sd_m)?;
    let tasks = match config.places {
        Places::Segments => tasks(segmentation, &measured, catalog.d_max_m()),
        Places::Windows => {
            let largest_m = catalog.iter().map(|(_, m)| m.d_box_m).fold(0.0, f32::max);
            thesis::windows(&measured, config.ppf.window * largest_m)
        }
    };
    // Without verification nothing chooses between hypotheses: the instances alone are asked.
    let tasks: Vec<Task> = if config.verification || config.places == Places::Windows {
        tasks
    } else {
        tasks.into_iter().filter(|t| t.is_segment).collect()
    };
    let mut stage = Stage { templates, measured: &measured, config, seed, observer };

    let mut candidates = stage.candidates(&tasks, 0)?;
    let mut found = if config.verification {
        let (chosen, bed) = stage.chosen(&mut candidates)?;
        stage.state(survey, chosen, &tasks, &candidates, bed.as_ref())
    } else {
        let mut chosen = stage.best_per_task(&tasks, &candidates);
        if config.places == Places::Windows {
            stage.one_a_place(&mut chosen, &candidates);
        }
        stage.state(survey, chosen, &tasks, &candidates, None)
    };
    found.blocks.iter_mut().for_each(|(block, _)| canonical.given(&mut block.points));
    for message in found.pile.warnings() {
        observer.event(Event::Warned(Warning { stage: STAGE, message }));
    }
    for message in found.pile.notes() {
        observer.event(Event::Noted { stage: STAGE, message });
    }
    Ok(found)
}

/// What an acceptance is worth.
fn total(acceptance: &Acceptance) -> f32 {
    acceptance.accepted.iter().map(|a| a.1).sum()
}

/// A candidate and the task it comes from (`None`: leftovers).
type Origin = (Option<usize>, Candidate);

/// Accepted entries with what each adds, and the bed they leave.
type Chosen = (Vec<(usize, f32)>, Option<Ground>);

struct Stage<'a> {
    templates: &'a [Template<'a>],
    measured: &'a Measured,
    config: &'a PoseConfig,
    seed: SeedTree,
    observer: &'a dyn Observer,
}

impl Stage<'_> {
    /// Searches every task with every type; proposals with their cases, in the order of the tasks.
    fn candidates(&mut self, tasks: &[Task], round: u64) -> Result<Vec<Origin>, PoseError> {
        let total = tasks.len() as u64;
        self.observer.event(Event::Started { stage: STAGE, total });
        let done = AtomicU64::new(0);
        let seed = self.seed.child("search", round);
        let found: Vec<Vec<Origin>> = tasks
            .par_iter()
            .enumerate()
            .map(|(t, task)| {
                if self.observer.cancelled() {
                    return Vec::new();
                }
                let found = self.search(task, seed.child("task", t as u64));
                let done = done.fetch_add(1, Ordering::Relaxed) + 1;
                self.observer.event(Event::Advanced { stage: STAGE, done });
                found.into_iter().map(|c| ((round == 0).then_some(t), c)).collect()
            })
            .collect();
        if self.observer.cancelled() {
            return Err(PoseError::Cancelled);
        }
        self.observer.event(Event::Finished { stage: STAGE });
        Ok(found.into_iter().flatten().collect())
    }

    fn search(&self, task: &Task, seed: SeedTree) -> Vec<Candidate> {
        let config = self.config;
        let mut proposals: Vec<Proposal> = Vec::new();
        for (entry, template) in self.templates.iter().enumerate() {
            if config.method == Method::SdfSearch {
                proposals.extend(propose(
                    task,
                    template,
                    entry,
                    self.measured,
                    &config.search,
                    seed,
                ));
            }
            if config.method == Method::Ppf || config.ppf_hypotheses {
                proposals.extend(thesis::propose(
                    task,
                    template,
                    entry,
                    self.measured,
                    &config.ppf,
                ));
            }
        }
        proposals
            .into_iter()
            .map(|p| Candidate {
                template: p.template,
                at: p.at,
                evidence: weigh(
                    &self.templates[p.template],
                    &p.at,
                    self.measured,
                    &config.evidence,
                ),
            })
            .collect()
    }

    /// The blocks that hold together, after points nobody explains were searched again; what the searches find joins the
    /// `candidates`. First with a plane through the lowest points as a guess of where not to look, then with the bed that
    /// the blocks found leave.
    fn chosen(&mut self, candidates: &mut Vec<Origin>) -> Result<Chosen, PoseError> {
        let (measured, templates, config) = (self.measured, self.templates, self.config);
        let reach = reach_m(measured, &templates[0], &config.evidence);
        let mut bed = measured.lowest.map(|bed| ground::guess(bed, measured, reach));
        let mut searched = Vec::new();
        let mut round = 1;
        let mut pool: Vec<Candidate> = candidates.iter().map(|c| c.1.clone()).collect();
        let mut acceptance = accept(&pool, templates, measured, None, &config.evidence);
        for known in [false, true] {
            if known {
                bed = ground::after_recognition(
                    measured,
                    &pool,
                    &acceptance,
                    templates,
                    &config.evidence,
                );
                acceptance = accept(&pool, templates, measured, bed.as_ref(), &config.evidence);
            }
            let competes = bed.as_ref().filter(|_| known);
            for _ in 0..if config.re_search { config.rounds } else { 0 } {
                let more = self.leftover_candidates(
                    &pool,
                    &acceptance,
                    bed.as_ref(),
                    &mut searched,
                    round,
                )?;
                round += 1;
                if more.is_empty() {
                    break;
                }
                let before = total(&acceptance);
                candidates.extend(more.iter().cloned());
                pool.extend(more.into_iter().map(|c| c.1));
                acceptance = accept(&pool, templates, measured, competes, &config.evidence);
                if total(&acceptance) <= before + 0.5 * config.evidence.min_score {
                    break;
                }
            }
        }
        Ok((acceptance.accepted, bed))
    }

    /// Candidates from the points nobody explains.
    fn leftover_candidates(
        &mut self,
        pool: &[Candidate],
        acceptance: &Acceptance,
        bed: Option<&Ground>,
        searched: &mut Vec<Vec3>,
        round: u64,
    ) -> Result<Vec<Origin>, PoseError> {
        let accepted: Vec<&Candidate> = acceptance.accepted.iter().map(|a| &pool[a.0]).collect();
        let open = leftovers::unexplained(
            self.measured,
            &acceptance.taken,
            &accepted,
            self.templates,
            bed,
            &self.config.evidence,
        );
        let mut tasks: Vec<Task> = Vec::new();
        let mut sizes: Vec<f32> = self.templates.iter().map(|t| t.model.d_max_m).collect();
        sizes.sort_by(f32::total_cmp);
        let sizes_m = sizes[0];
        // Sizes within a third of each other share their neighbourhoods.
        sizes.dedup_by(|a, b| *a < *b * 1.33);
        for d_max_m in sizes {
            tasks.extend(leftovers::tasks(self.measured, &open, d_max_m));
        }
        // The same points searched again would give the same poses.
        tasks.retain(|t| !searched.iter().any(|s| (*s - t.centre).length() < 0.1 * sizes_m));
        searched.extend(tasks.iter().map(|t| t.centre));
        self.note(format!(
            "round {round}: {} accepted, {} places left to search",
            accepted.len(),
            tasks.len()
        ));
        self.candidates(&tasks, round)
    }

    fn note(&self, message: String) {
        self.observer.event(Event::Noted { stage: STAGE, message });
    }

    /// Without verification: the type of smallest fitness for each segment (METHOD §4), its best pose.
    fn best_per_task(&self, tasks: &[Task], candidates: &[Origin]) -> Vec<(usize, f32)> {
        (0..tasks.len())
            .filter_map(|t| {
                let own = candidates.iter().enumerate().filter(|(_, c)| c.0 == Some(t));
                let fitness = |c: &Candidate| {
                    thesis::fitness_m(
                        &tasks[t].points,
                        &self.templates[c.template],
                        &c.at,
                        self.measured,
                    )
                };
                let best = own.min_by(|a, b| fitness(&a.1.1).total_cmp(&fitness(&b.1.1)))?;
                Some((best.0, best.1.1.evidence.score()))
            })
            .collect()
    }

    /// Windows overlap, so that a block is found several times: the best explained of near poses stays.
    fn one_a_place(&self, chosen: &mut Vec<(usize, f32)>, candidates: &[Origin]) {
        chosen.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        let mut kept: Vec<(usize, f32)> = Vec::new();
        for &(i, score) in chosen.iter() {
            let c = &candidates[i].1;
            let apart_m = 0.5 * self.templates[c.template].model.d_max_m;
            if kept.iter().all(|k| (candidates[k.0].1.at.centre - c.at.centre).length() > apart_m) {
                kept.push((i, score));
            }
        }
        *chosen = kept;
    }

    /// Refines the chosen candidates and states them, then the segments without a verdict.
    fn state(
        &self,
        survey: &Survey,
        chosen: Vec<(usize, f32)>,
        tasks: &[Task],
        candidates: &[Origin],
        ground: Option<&Ground>,
    ) -> Outcome {
        let pool: Vec<Candidate> = candidates.iter().map(|c| c.1.clone()).collect();
        let mut blocks: Vec<Accepted> = chosen
            .iter()
            .map(|&(i, gain)| {
                let winner = &pool[i];
                Accepted {
                    template: winner.template,
                    at: winner.at,
                    gain,
                    other_type: other_type(winner, &pool, self.templates),
                    type_margin: f32::INFINITY,
                }
            })
            .collect();
        let points = refine(survey, &mut blocks, &pool, self.templates, self.measured, self.config);
        let config = &self.config.evidence;
        let (templates, measured) = (self.templates, self.measured);
        let context =
            Context::new(survey, &blocks, &points, &pool, templates, measured, ground, config);
        let state = |(block, points)| {
            let (block, features) =
                statement(survey, block, points, &context, templates, measured, config);
            (block, Some(features))
        };
        let mut found: Vec<(Recognised, Option<Features>)> =
            blocks.par_iter().enumerate().zip(points).map(state).collect();
        judge(&mut found, config);
        // Of the blocks that are likely to be some: junk has any size.
        let confidence = |entry: usize| found[entry].0.fit().and_then(|f| f.confidence);
        let size = context.size_of(|entry| confidence(entry).is_some_and(|c| c >= LIKELY));
        finish::state(&mut found, size.as_ref().is_some_and(is_wrong), config);
        let mut pile = PileVerdict {
            explained: context.explained_by(|entry| found[entry].0.is_stated()),
            stated: found.iter().filter(|f| f.0.is_stated()).count(),
            size,
            not_a_block: 0,
            viewpoint: measured.viewpoint,
        };
        let limbs_of = |entry: usize| {
            let block = &blocks[entry];
            let template = &templates[block.template];
            judge_limbs(block, template, measured, reach_m(measured, template, config))
        };
        let stated = (0..found.len()).filter(|&entry| found[entry].0.is_stated());
        let mut limbs: Vec<(usize, Vec<Limb>)> =
            stated.map(|entry| (entry, limbs_of(entry))).collect();
        limbs.retain(|(_, limbs)| !limbs.is_empty());
        let (open, closed) = self.not_judged(survey, tasks, candidates, &found, ground);
        let accepted = found.len();
        let kept: Vec<bool> = found.iter().map(|(block, _)| may_be_one(block, config)).collect();
        // Stated blocks are kept, so that those before one decide its number.
        let number = |entry: usize| kept[..=entry].iter().filter(|k| **k).count() as u32;
        let limbs = limbs.into_iter().map(|(entry, l)| (InstanceId(number(entry)), l)).collect();
        found.retain(|(block, _)| may_be_one(block, config));
        pile.not_a_block = closed + accepted - found.len();
        found.extend(open.into_iter().map(|block| (block, None)));
        for (n, (block, _)) in found.iter_mut().enumerate() {
            block.block = InstanceId(n as u32 + 1);
        }
        Outcome { blocks: found, pile, limbs }
    }

    /// Segments most of whose points no block explains and that may hold one, and how many others there are.
    fn not_judged(
        &self,
        survey: &Survey,
        tasks: &[Task],
        candidates: &[Origin],
        found: &[(Recognised, Option<Features>)],
        ground: Option<&Ground>,
    ) -> (Vec<Recognised>, usize) {
        let mut taken = vec![false; survey.cloud.len()];
        for (block, _) in found {
            for &i in &block.points {
                taken[i as usize] = true;
            }
        }
        let open = |task: &Task| {
            let survey_point = |&w: &u32| self.measured.thinned.kept[w as usize];
            let free: Vec<u32> =
                task.points.iter().map(survey_point).filter(|&i| !taken[i as usize]).collect();
            (free.len() * 2 > task.points.len() && !free.is_empty()).then_some(free)
        };
        let (mut blocks, mut closed) = (Vec::new(), 0);
        for (t, task) in tasks.iter().enumerate().filter(|(_, t)| t.is_segment) {
            let Some(points) = open(task) else { continue };
            let own = candidates.iter().filter(|c| c.0 == Some(t)).map(|c| &c.1);
            let best = own.max_by(|a, b| a.evidence.score().total_cmp(&b.evidence.score()));
            // Without verification every segment gets its answer.
            if !self.config.verification || may_hold_a_block(task, best, ground, self.measured) {
                blocks.push(self.without_verdict(task, best, points));
            } else {
                closed += 1;
            }
        }
        (blocks, closed)
    }

    fn without_verdict(
        &self,
        task: &Task,
        best: Option<&Candidate>,
        points: Vec<u32>,
    ) -> Recognised {
        let guess = best.map_or(Guess::Place(task.centre), |best| {
            let (template, at) = (&self.templates[best.template], best.at);
            let (model, pose) = (template.model, at.pose(template.model.centre));
            let fitness_m = thesis::fitness_m(&task.points, template, &at, self.measured);
            Guess::Fit(Fit {
                type_judged: self.templates.len() == 1,
                fitness_m: Some(fitness_m),
                ..Fit::of_pose(template.id, model.symmetry.canonical(&pose))
            })
        });
        Recognised { block: InstanceId(0), points, verdict: Verdict::NotJudged(guess) }
    }
}

/// Whether a person should look at an accepted block: it is stated or likely enough.
fn may_be_one(block: &Recognised, config: &EvidenceConfig) -> bool {
    let least = LEAST_CONFIDENCE.min(config.min_confidence);
    block.is_stated() || block.fit().and_then(|f| f.confidence).is_none_or(|c| c >= least)
}

fn check_input(
    survey: &Survey,
    segmentation: &Segmentation,
    catalog: &Catalog,
) -> Result<(), PoseError> {
    let points = survey.cloud.len();
    if catalog.is_empty() {
        return Err(PoseError::NoModels);
    }
    if segmentation.instance.len() != points {
        return Err(PoseError::LabelCount { labels: segmentation.instance.len(), points });
    }
    if let Some(point) = survey.cloud.position_m.iter().position(|p| !p.is_finite()) {
        return Err(PoseError::NotFinite { point });
    }
    for (hypothesis, h) in segmentation.hypotheses.iter().enumerate() {
        if let Some(&point) = h.points.iter().find(|&&i| i as usize >= points) {
            return Err(PoseError::BadPoint { hypothesis, point, points });
        }
    }
    Ok(())
}

/// The survey with its lines laid onto each other, and the noise left; `None` when its file tells no lines apart.
fn levelled(
    survey: &Survey,
    templates: &[Template],
    config: &PoseConfig,
    observer: &dyn Observer,
) -> Option<(Survey, f32)> {
    let d_max_m = templates.iter().map(|t| t.model.d_max_m).fold(f32::INFINITY, f32::min);
    let noise_sd_m = config.noise_sd_m.unwrap_or_else(|| survey.sensor.noise_sd_m(d_max_m));
    let levelled = level(&survey.cloud.position_m, &survey.line, d_max_m, noise_sd_m)?;
    let message = format!(
        "{} survey lines laid onto each other, {:.0} mm off before; points scatter by {:.0} mm about each",
        levelled.lines,
        1e3 * levelled.shift_m,
        1e3 * levelled.scatter_m
    );
    observer.event(Event::Noted { stage: STAGE, message });
    let mut part = survey.clone();
    part.cloud.position_m = levelled.position;
    Some((part, levelled.scatter_m))
}

/// The working cloud. Error: [`PoseError::WrongScale`] when points are farther apart than a block is long.
fn measure(
    survey: &Survey,
    templates: &[Template],
    config: &PoseConfig,
    scatter_m: Option<f32>,
) -> Result<Measured, PoseError> {
    let smallest = templates.iter().min_by(|a, b| a.model.d_max_m.total_cmp(&b.model.d_max_m));
    let model = smallest.expect("templates are made of a catalogue that is not empty").model;
    let noise_sd_m =
        config.noise_sd_m.or(scatter_m).unwrap_or_else(|| noise_of_m(survey, model.d_max_m));
    let cell_m = config.search.working_cell * model.d_max_m;
    let survey_m = survey.cloud.bounds().size().max_element();
    let wrong =
        || PoseError::WrongScale { name: model.name.clone(), d_box_m: model.d_box_m, survey_m };
    if model.d_box_m > 10.0 * survey_m || model.d_box_m * 1e4 < survey_m {
        return Err(wrong());
    }
    let stated = config.bed.map(|plane| Bed { plane: plane.into(), relief_m: 0.1 * model.d_max_m });
    Ok(Measured::new(survey, cell_m, model.d_max_m, noise_sd_m, stated))
}

/// One task a hypothesis; without hypotheses one a label, its centre guessed.
fn tasks(segmentation: &Segmentation, measured: &Measured, d_max_m: f32) -> Vec<Task> {
    if !segmentation.hypotheses.is_empty() {
        let given = segmentation.hypotheses.iter().enumerate();
        return given
            .map(|(n, h)| Task {
                centre: h.centre,
                points: measured.working(&h.points),
                centre_sd_m: 0.25 * d_max_m,
                is_segment: n < segmentation.instances,
            })
            .collect();
    }
    let count = segmentation.instance.iter().copied().max().unwrap_or(0) as usize;
    if count > segmentation.instance.len() {
        return Vec::new();
    }
    crate::finish::members(&segmentation.instance, count)
        .into_iter()
        .filter(|m| !m.is_empty())
        .map(|m| {
            let points = measured.working(&m);
            let centre = leftovers::behind(measured, &points, d_max_m);
            Task { centre, points, centre_sd_m: 0.4 * d_max_m, is_segment: true }
        })
        .collect()
}
