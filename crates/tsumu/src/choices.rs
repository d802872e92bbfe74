//! Three plans of the same works to choose from: the table, and the placements of each.

use crate::run_folder::RunFolder;
use crate::written::Written;
use crate::{Result, Site};
use io::choices_csv::{self, ChoiceRow};
use io::placements_csv::{self, PlacementRow};
use plan::Aim;
use scene::{Placement, Plan};

/// One of them.
#[derive(Clone, Debug)]
pub struct PlanChoice {
    /// What it is made for.
    pub aim: Aim,
    /// The plan.
    pub plan: Plan,
    /// Cost of its blocks in place, in the currency of the settings; a block of a plan of one type costs 1.
    pub cost: f64,
}

impl PlanChoice {
    /// Blocks and ground that a block touches, on average.
    pub fn mean_contacts(&self) -> f64 {
        let list = &self.plan.placements;
        let sum: u32 = list.iter().map(|p| p.contacts).sum();
        f64::from(sum) / list.len().max(1) as f64
    }

    pub(crate) fn of(site: &Site, (aim, plan): (Aim, Plan)) -> Self {
        let blocks = &site.config.plan.blocks;
        let of = |p: &Placement| {
            let name = &site.catalog.get(p.model).name;
            blocks.iter().find(|b| b.name == *name).map_or(1.0, |b| f64::from(b.cost))
        };
        let cost = plan.placements.iter().filter(|p| p.is_new()).map(of).sum();
        Self { aim, plan, cost }
    }
}

/// Writes `plan/choices.csv` and a table of placements for each; they can be planned on from with `--from`.
pub(crate) fn write(
    run: &RunFolder,
    site: &Site,
    choices: &[PlanChoice],
    written: &Written,
) -> Result<()> {
    let mut rows = Vec::new();
    for choice in choices {
        let file = format!("choices/{}.csv", choice.aim.word());
        let placed = choice.plan.placements.iter();
        let table: Vec<PlacementRow> =
            placed.map(|p| PlacementRow::of(p, &site.catalog, &site.survey.frame)).collect();
        let path = run.root().join("plan").join(&file);
        written.put(&path, |p| placements_csv::write(p, &table))?;
        let s = &choice.plan.summary;
        rows.push(ChoiceRow {
            aim: choice.aim.word().into(),
            blocks: s.blocks,
            void_filled_m3: f64::from(s.void_before_m3 - s.void_after_m3),
            void_left_m3: f64::from(s.void_after_m3),
            protruding: s.protruding,
            mean_contacts: choice.mean_contacts(),
            porosity: f64::from(s.porosity),
            concrete_m3: f64::from(s.concrete_m3),
            cost: choice.cost,
            file,
        });
    }
    written.put(&run.root().join("plan/choices.csv"), |p| choices_csv::write(p, &rows))
}
