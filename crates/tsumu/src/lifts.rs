//! The plan as the crane works it off: `plan/lifts.csv`.

use crate::{Result, Site};
use geom::{DVec3, Pose};
use io::lifts_csv::{self, LiftRow};
use pipeline::PipelineError;
use plan::Lift;
use scene::{Placement, Plan};
use std::path::Path;

/// Writes the lifts of a plan.
pub(crate) fn write(path: &Path, site: &Site, plan: &Plan, lifts: &[Lift]) -> Result<()> {
    let row = |(p, lift): (&Placement, &Lift)| {
        let block = site.catalog.get(p.model);
        let at = |pose: &Pose| site.survey.frame.site_from_local(*pose * block.centre);
        let a = lift.attitude;
        LiftRow {
            order: lift.order,
            start: lift.start,
            model: block.name.clone(),
            mass_t: f64::from(block.mass_kg()) / 1000.0,
            rest_m: at(&p.rest).to_array(),
            drop_level_m: at(&p.drop).z,
            stand: lift.stand,
            legs: a.legs,
            attitude_deg: [a.tilt_deg, a.bearing_deg, a.second_bearing_deg],
            node: p.handling.node,
            reset_block: p.handling.reset.map(|r| r.block.0),
            segments: segments(p, &at),
        }
    };
    let rows: Vec<LiftRow> = plan.placements.iter().zip(lifts).map(row).collect();
    Ok(lifts_csv::write(path, &rows)?)
}

/// The ways of a path: metres sideways, degrees clockwise from north, degrees turned, level of the centre at the end.
fn segments(p: &Placement, at: &dyn Fn(&Pose) -> DVec3) -> Vec<[f64; 4]> {
    let path = &p.handling.path;
    let segment = |(from, to): (&Pose, &Pose)| {
        let way = at(to) - at(from);
        let bearing = way.x.atan2(way.y).to_degrees().rem_euclid(360.0);
        let turned = f64::from(from.rotation.angle_between(to.rotation)).to_degrees();
        [way.truncate().length(), bearing, turned, at(to).z]
    };
    path.iter().zip(path.iter().skip(1).chain([&p.drop])).map(segment).collect()
}

impl Site {
    /// Stand, day, hour and attitude of every block of a plan. Errors: working hours, rates or tides that cannot be.
    pub(crate) fn lifts(&self, plan: &Plan) -> Result<Vec<Lift>> {
        let config = &self.config.plan;
        let (crane, works) = (config.crane.as_ref(), config.works.as_ref());
        let found = plan::lifts(plan, &self.catalog, &self.survey.frame, crane, works);
        Ok(found.map_err(PipelineError::from)?)
    }
}
