//! The next blocks of a plan, from a list of what was really placed.

use crate::error::OrBadInput;
use crate::{Error, Job, Recognition, Result, Site};
use anyhow::anyhow;
use geom::{DVec3, Event, Observer, Pose, Quat, SeedTree, Stage, Warning};
use io::as_placed_csv::{self, AsPlacedRow};
use io::placements_csv::PlacementRow;
use plan::{Attitude, Next};
use scene::{InstanceId, PlacedBlock, Placement, Plan};
use serde::Serialize;
use std::collections::BTreeSet;
use std::path::Path;

/// A placed block farther from its plan than this, in block lengths, is told: it may be another one. Free choice.
const FAR: f64 = 1.0;

/// What to do about one block of a plan.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct NextLift {
    /// Its number in the plan.
    pub order: u32,
    /// `as-planned`, `moved`, or `given-up` when it comes to rest there in no pose any more.
    pub what: &'static str,
    /// Type.
    pub model: String,
    /// Centre of mass at rest: east, north, level; not there for one that is given up.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub centre_m: Option<[f64; 3]>,
    /// How far that is from the plan, m.
    pub moved_m: f64,
    /// Highest leg from the vertical, where it leans to, where the second points; degrees, clockwise from north.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub attitude_deg: Option<[f32; 3]>,
}

impl Site {
    /// The next `count` blocks of a plan when those of `as_placed` stand as listed there. Errors: a number the plan has not.
    pub fn next(
        &self,
        recognition: &Recognition,
        plan: &Plan,
        as_placed: &Path,
        count: usize,
        job: &Job,
    ) -> Result<(Vec<NextLift>, Vec<PlacementRow>)> {
        let rows = as_placed_csv::read(as_placed).or_bad_input()?;
        let placed = rows
            .iter()
            .map(|row| self.placed(plan, row, as_placed, job))
            .collect::<Result<Vec<_>>>()?;
        let done: BTreeSet<u32> = rows.iter().map(|r| r.order).collect();
        let mut works = self.works(&recognition.blocks, self.needed_design()?);
        works.placed = &placed;
        let asked = (&done, count);
        let found = pipeline::next_blocks(
            &works,
            &self.config,
            plan,
            asked,
            SeedTree::new(self.seed),
            job,
        )?;
        let table = found.iter().filter_map(|next| match next {
            Next::AsPlanned(p) | Next::Moved(p) => {
                Some(PlacementRow::of(p, &self.catalog, &self.survey.frame))
            }
            Next::GivenUp(_) => None,
        });
        Ok((found.iter().map(|next| self.lift(plan, next)).collect(), table.collect()))
    }

    /// A block as it stands.
    fn placed(
        &self,
        plan: &Plan,
        row: &AsPlacedRow,
        file: &Path,
        observer: &dyn Observer,
    ) -> Result<PlacedBlock> {
        let planned = plan.placements.iter().find(|p| p.order == row.order).ok_or_else(|| {
            Error::bad_input(anyhow!(
                "{}: block {} is not in the plan, which has 1 to {}",
                file.display(),
                row.order,
                plan.placements.len()
            ))
        })?;
        let block = self.catalog.get(planned.model);
        let rotation = row.rotation_wxyz.map_or(planned.rest.rotation, |q| {
            let [w, x, y, z] = q.map(|v| v as f32);
            Quat::from_xyzw(x, y, z, w)
        });
        let centre = self.survey.frame.local_from_site(DVec3::from_array(row.centre_m));
        let off_m = f64::from((centre - planned.rest * block.centre).length());
        if off_m > FAR * f64::from(block.d_box_m) {
            let message = format!(
                "{}: block {} stands {off_m:.2} m from its place in the plan; is it that block?",
                file.display(),
                row.order
            );
            observer.event(Event::Warned(Warning { stage: Stage::Next, message }));
        }
        let site_from_block = Pose::from_parts(centre - rotation * block.centre, rotation);
        Ok(PlacedBlock { block: InstanceId(row.order), model: planned.model, site_from_block })
    }

    fn lift(&self, plan: &Plan, next: &Next) -> NextLift {
        let (what, order, placed) = match next {
            Next::AsPlanned(p) => ("as-planned", p.order, Some(p)),
            Next::Moved(p) => ("moved", p.order, Some(p)),
            Next::GivenUp(order) => ("given-up", *order, None),
        };
        let planned = plan.placements.iter().find(|p| p.order == order);
        let model = placed.or(planned).map(|p| p.model);
        let name = model.map_or(String::new(), |m| self.catalog.get(m).name.clone());
        let centre = |p: &Placement| p.rest * self.catalog.get(p.model).centre;
        let moved_m = placed.zip(planned).map_or(0.0, |(a, b)| (centre(a) - centre(b)).length());
        let degrees = |p: &Placement| {
            let Attitude { tilt_deg, bearing_deg, second_bearing_deg, .. } =
                plan::attitude(self.catalog.get(p.model), &p.rest);
            [tilt_deg, bearing_deg, second_bearing_deg]
        };
        NextLift {
            order,
            what,
            model: name,
            centre_m: placed.map(|p| self.survey.frame.site_from_local(centre(p)).to_array()),
            moved_m: f64::from(moved_m),
            attitude_deg: placed.map(degrees),
        }
    }
}
