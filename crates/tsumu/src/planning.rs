//! The second half: from blocks to a plan.

use crate::choices::PlanChoice;
use crate::error::OrBadInput;
use crate::recognition::Recognition;
use crate::resume::Parts;
use crate::summary::{CountRange, PlannedSummary, TypeCount};
use crate::{Error, Job, Result, Site, unfilled, weights};
use anyhow::anyhow;
use geom::{JobPart, SeedTree};
use io::manifest::Entry;
use io::placements_csv::PlacementRow;
use pipeline::Works;
use placement::PlacementModel;
use plan::{Lift, Proposer, Unfilled};
use scene::{
    Catalog, DesignSurface, Placement, PlacementState, Plan, Recognised, Scene, SiteFrame,
};
use std::path::{Path, PathBuf};

/// What planning may be told beside the site's settings.
#[derive(Clone, Debug, Default)]
pub struct PlanOptions {
    /// A placement network of one's own, for policy `network`: a training's folder or its file.
    pub proposer: Option<PathBuf>,
    /// A plan to go on from: what still holds of it is kept.
    pub previous: Option<Plan>,
    /// Whether to make three plans to choose from as well.
    pub choices: bool,
}

/// A plan and what it stands on.
#[derive(Clone, Debug)]
pub struct Planned {
    /// The pile it starts from.
    pub pile: Scene,
    /// The plan.
    pub plan: Plan,
    /// How far its count depends on chance; `None` when that was not asked for.
    pub range: Option<CountRange>,
    /// What it takes of each type, where it may use several.
    pub types: Vec<TypeCount>,
    /// Places that stay below the design, and why.
    pub unfilled: Vec<Unfilled>,
    /// How the crane works it off.
    pub lifts: Vec<Lift>,
    /// Plans to choose from, where they were asked for.
    pub choices: Vec<PlanChoice>,
    /// The user's placement network.
    pub proposer: Option<Entry>,
}

impl Planned {
    /// The figures, as `plan/summary.json` has them.
    pub fn summary(&self) -> PlannedSummary {
        PlannedSummary {
            plan: self.plan.summary,
            count_range: self.range.clone(),
            types: self.types.clone(),
            days: self.lifts.last().and_then(|l| l.start).map(|(day, _)| day),
            unfilled: unfilled::by_reason(&self.unfilled),
        }
    }
}

impl Site {
    /// Plans how many blocks to add, where and in which order. Errors: the site has no design.
    pub fn plan(
        &self,
        recognition: &Recognition,
        options: &PlanOptions,
        job: &Job,
    ) -> Result<Planned> {
        let proposer = self.proposer(options, job)?;
        let previous = options.previous.as_ref();
        job.install(|| {
            let parts = Parts::none(job);
            let planned = self.plan_in_parts(recognition, proposer.as_ref(), previous, &parts)?;
            let choices = match options.choices {
                true => self.choices(recognition, &planned.pile, job)?,
                false => Vec::new(),
            };
            Ok(Planned { choices, ..planned })
        })
    }

    /// Three plans of the same works.
    fn choices(
        &self,
        recognition: &Recognition,
        pile: &Scene,
        job: &Job,
    ) -> Result<Vec<PlanChoice>> {
        let works = self.works(&recognition.blocks, self.needed_design()?);
        let seed = SeedTree::new(self.seed);
        let found = pipeline::plan_choices(&works, pile, &self.config, seed, job)?;
        Ok(found.into_iter().map(|choice| PlanChoice::of(self, choice)).collect())
    }

    /// The same in parts that an interrupted run keeps.
    pub(crate) fn plan_in_parts(
        &self,
        recognition: &Recognition,
        proposer: Option<&ChosenProposer>,
        previous: Option<&Plan>,
        parts: &Parts,
    ) -> Result<Planned> {
        let (seed, job) = (SeedTree::new(self.seed), parts.job());
        // What the reviewer struck out of the earlier plan is planned anew; what was locked stays.
        let reviewed = self.review.as_ref().zip(previous);
        let reviewed = reviewed.map(|(r, earlier)| r.reviewed_plan(earlier, &self.survey.frame));
        let works = Works {
            previous: reviewed.as_ref().or(previous),
            proposer: proposer.map(|p| &p.model as &dyn Proposer),
            ..self.works(&recognition.blocks, self.needed_design()?)
        };
        let (pile, plan) =
            parts.part(JobPart::Plan, || pipeline::plan_works(&works, &self.config, seed, job))?;
        let range = parts.part(JobPart::Range, || match self.config.plan.uncertainty.seeds {
            0 => Ok(None),
            _ => pipeline::count_range(&works, &pile, &self.config, seed, job)
                .map(|found| Some(CountRange::of(&found, &self.config.plan.uncertainty))),
        })?;
        let unfilled = self.unfilled(&works, &pile, &plan)?;
        let proposer = proposer.and_then(|p| p.file.clone());
        let types = TypeCount::of(&plan, &self.config.plan.blocks, &self.catalog);
        let (lifts, choices) = (self.lifts(&plan)?, Vec::new());
        Ok(Planned { pile, plan, range, types, unfilled, lifts, choices, proposer })
    }

    /// Places that stay below the design on the surveyed surface.
    pub(crate) fn unfilled(
        &self,
        works: &Works,
        pile: &Scene,
        plan: &Plan,
    ) -> Result<Vec<Unfilled>> {
        let surfaces = pipeline::planned_surfaces(works, pile, plan);
        Ok(pipeline::unfilled(works, pile, plan, &surfaces, &self.config)?)
    }

    /// The network of policy `network`.
    pub(crate) fn proposer(
        &self,
        options: &PlanOptions,
        job: &Job,
    ) -> Result<Option<ChosenProposer>> {
        let path = options.proposer.as_deref();
        let model = weights::proposer(path, &self.config.plan, &self.catalog, job)?;
        let file = weights::proposer_file(path)?;
        Ok(model.map(|model| ChosenProposer { model, file }))
    }

    pub(crate) fn works<'a>(
        &'a self,
        blocks: &'a [Recognised],
        design: &'a DesignSurface,
    ) -> Works<'a> {
        Works {
            survey: &self.survey,
            catalog: &self.catalog,
            blocks,
            placed: &[],
            previous: None,
            proposer: None,
            design,
            ground: self.ground.clone(),
        }
    }

    /// Writes rows of placements into a file, which is none of the site's inputs.
    pub fn write_placements(&self, file: &Path, rows: &[PlacementRow]) -> Result<()> {
        self.refuse_input(file)?;
        Ok(io::placements_csv::write(file, rows)?)
    }

    /// Reads `placements.csv` (or the folder of a plan) as a plan of this site; its figures are not in the file.
    pub fn read_plan(&self, from: &Path) -> Result<Plan> {
        read_placements(from, &self.catalog, &self.survey.frame)
    }
}

/// The same for any frame.
pub(crate) fn read_placements(from: &Path, catalog: &Catalog, frame: &SiteFrame) -> Result<Plan> {
    let inside = from.join("plan/placements.csv");
    let file = if inside.is_file() { inside.as_path() } else { from };
    let mut plan = Plan::default();
    for row in io::placements_csv::read(file).or_bad_input()? {
        let model = catalog.find(&row.model).ok_or_else(|| {
            let message = format!("{}: `{}` is not in the catalogue", file.display(), row.model);
            Error::bad_input(anyhow!(message))
        })?;
        let placement = Placement {
            order: row.order,
            round: row.round,
            model,
            drop: row.drop.local(frame),
            rest: row.rest.local(frame),
            filled_m3: row.filled_m3 as f32,
            contacts: row.contacts,
            state: row.state,
            handling: row.handling.local(frame),
        };
        match row.state {
            PlacementState::Kept => plan.placements.push(placement),
            _ => plan.removed.push(placement),
        }
    }
    Ok(plan)
}

/// A placement network and its file.
pub(crate) struct ChosenProposer {
    model: PlacementModel,
    file: Option<Entry>,
}

impl ChosenProposer {
    /// Size and hash of the user's file.
    pub(crate) fn file(&self) -> Option<&Entry> {
        self.file.as_ref()
    }
}

/// What became of an earlier plan: how many of its blocks are still to place as it says.
pub fn kept_of(previous: &Plan, plan: &Plan) -> usize {
    let earlier =
        |p: &&Placement| previous.placements.iter().any(|q| q.drop == p.drop && q.rest == p.rest);
    plan.placements.iter().filter(earlier).count()
}
