//! From hypotheses to the blocks that hold together.
//!
//! Search every hypothesis with every type; let all poses compete for the points; search what is left; repeat until
//! nothing is gained; refine what was accepted on all its points.

use crate::acceptance::{Acceptance, Candidate, accept};
use crate::beside::Rows;
use crate::evidence::{reach_m, weigh};
use crate::exchange::exchange;
use crate::fattening::Fattening;
use crate::finish::{Accepted, other_type, refine};
use crate::ground::Ground;
use crate::measured::Measured;
use crate::prepare::Prepared;
use crate::search::{Proposal, Task, propose};
use crate::template::Template;
use crate::twins::Families;
use crate::{Method, Places, PoseConfig, PoseError, ground, leftovers, thesis};
use geom::{Event, Observer, SeedTree, Vec3};
use rayon::prelude::*;
use scene::Segmentation;
use std::sync::atomic::{AtomicU64, Ordering};

/// The blocks of a survey, found and refined, not yet compared with each other.
pub struct Found {
    pub(crate) tasks: Vec<Task>,
    pub(crate) candidates: Vec<Origin>,
    pub(crate) blocks: Vec<Accepted>,
    /// Survey points of each block.
    pub(crate) points: Vec<Vec<u32>>,
    /// The bed the blocks leave.
    pub(crate) bed: Option<Ground>,
    /// How a sounder was seen to err.
    pub(crate) fattening: Option<Fattening>,
}

impl Prepared<'_> {
    /// Finds the blocks. Error: [`PoseError::Cancelled`] when the observer says stop.
    pub fn recognise(&self, observer: &dyn Observer) -> Result<Found, PoseError> {
        let (config, measured) = (self.config, &self.measured);
        let tasks = self.tasks();
        let mut stage = Stage {
            templates: &self.templates,
            measured,
            config,
            seed: self.seed,
            observer,
            rows: Rows::default(),
            families: Families::default(),
        };
        let mut candidates = stage.candidates(&tasks, 0)?;
        let (chosen, bed) = if config.verification {
            stage.chosen(&mut candidates)?
        } else {
            let mut chosen = stage.best_per_task(&tasks, &candidates);
            if config.places == Places::Windows {
                stage.one_a_place(&mut chosen, &candidates);
            }
            (chosen, None)
        };
        let (blocks, points, fattening) = self.refined(&chosen, &candidates);
        Ok(Found { tasks, candidates, blocks, points, bed, fattening })
    }

    /// Where blocks are looked for.
    fn tasks(&self) -> Vec<Task> {
        let (config, measured) = (self.config, &self.measured);
        let sizes_m = self.templates.iter().map(|t| (t.model.d_max_m, t.model.d_box_m));
        let (d_max_m, d_box_m) =
            sizes_m.fold((0.0_f32, 0.0_f32), |a, b| (a.0.max(b.0), a.1.max(b.1)));
        let tasks = match config.places {
            Places::Segments => tasks(&self.canonical.segmentation, measured, d_max_m),
            Places::Windows => thesis::windows(measured, config.ppf.window * d_box_m),
        };
        // Without verification nothing chooses between hypotheses: the instances alone are asked.
        if config.verification || config.places == Places::Windows {
            tasks
        } else {
            tasks.into_iter().filter(|t| t.is_segment).collect()
        }
    }

    /// The chosen candidates, refined on all their points.
    fn refined(
        &self,
        chosen: &[(usize, f32)],
        candidates: &[Origin],
    ) -> (Vec<Accepted>, Vec<Vec<u32>>, Option<Fattening>) {
        let pool: Vec<Candidate> = candidates.iter().map(|c| c.1.clone()).collect();
        let accepted = |&(i, gain): &(usize, f32)| {
            let winner: &Candidate = &pool[i];
            Accepted {
                template: winner.template,
                at: winner.at,
                gain,
                other_type: other_type(winner, &pool, &self.templates),
                type_margin: f32::INFINITY,
            }
        };
        let mut blocks: Vec<Accepted> = chosen.iter().map(accepted).collect();
        let (templates, measured) = (&self.templates, &self.measured);
        let (config, facts) = (self.config, self.facts);
        let (points, fattening) =
            refine(self.survey(), &mut blocks, &pool, templates, measured, config, facts);
        (blocks, points, fattening)
    }
}

/// What an acceptance is worth.
fn total(acceptance: &Acceptance) -> f32 {
    acceptance.accepted.iter().map(|a| a.1).sum()
}

/// A candidate and the task it comes from (`None`: leftovers).
pub(crate) type Origin = (Option<usize>, Candidate);

/// Accepted entries with what each adds, and the bed they leave.
type Chosen = (Vec<(usize, f32)>, Option<Ground>);

struct Stage<'a> {
    templates: &'a [Template<'a>],
    measured: &'a Measured,
    config: &'a PoseConfig,
    seed: SeedTree,
    observer: &'a dyn Observer,
    rows: Rows,
    families: Families,
}

impl Stage<'_> {
    /// Searches every task with every type; proposals with their cases, in the order of the tasks.
    fn candidates(&mut self, tasks: &[Task], round: u64) -> Result<Vec<Origin>, PoseError> {
        let total = tasks.len() as u64;
        self.observer.event(Event::Started { stage: geom::Stage::Pose, total });
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
                self.observer.event(Event::Advanced { stage: geom::Stage::Pose, done });
                found.into_iter().map(|c| ((round == 0).then_some(t), c)).collect()
            })
            .collect();
        if self.observer.cancelled() {
            return Err(PoseError::Cancelled);
        }
        self.observer.event(Event::Finished { stage: geom::Stage::Pose });
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
        let acceptance =
            exchange(acceptance, &pool, templates, measured, bed.as_ref(), &config.evidence);
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
        let mut found = self.candidates(&tasks, round)?;
        let config = &self.config.evidence;
        let beside = self.rows.go_on(&accepted, self.templates, self.measured, config);
        found.extend(beside.into_iter().map(|c| (None, c)));
        let alike = self.families.of(&accepted, self.templates, self.measured, config);
        found.extend(alike.into_iter().map(|c| (None, c)));
        Ok(found)
    }

    fn note(&self, message: String) {
        self.observer.event(Event::Noted { stage: geom::Stage::Pose, message });
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
