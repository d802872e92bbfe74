//! The points of a part of a cut survey, as the survey it is a part of would have them.

use super::cell_points::CellFiles;
use super::grid::{Cell, Core, around};
use crate::Result;
use geom::{DVec2, DVec3, PointCloud};
use scene::{SensorKind, SiteFrame, Survey};
use std::collections::BTreeMap;

/// Reads parts.
pub(crate) struct PartReader<'a> {
    pub files: CellFiles,
    /// Points of each cell's file.
    pub cells: &'a BTreeMap<Cell, u64>,
    pub frame: &'a SiteFrame,
    pub sensor: SensorKind,
    pub sensor_positions: &'a [[f64; 3]],
    /// Numbers of points that are left out, ascending.
    pub strays: &'a [u32],
    /// Lines that tell nothing apart.
    pub silent_lines: &'a [(u16, u16)],
}

/// A part: points in the survey's order, and the number of each.
pub(crate) struct PartSurvey {
    pub survey: Survey,
    pub number: Vec<u32>,
}

impl PartReader<'_> {
    /// The points in these boxes (site coordinates), each box being about a core.
    pub fn read(&self, of: &[(Core, [DVec2; 2])]) -> Result<PartSurvey> {
        let mut found = Vec::new();
        for &(core, [low, high]) in of {
            for (&cell, &points) in around(self.cells, core) {
                let own = self.files.read(cell, points)?;
                found.extend(own.into_iter().filter(|p| {
                    let plan = p.position.truncate();
                    plan.cmpge(low).all()
                        && plan.cmplt(high).all()
                        && self.strays.binary_search(&p.number).is_err()
                }));
            }
        }
        found.sort_unstable_by_key(|p| p.number);
        found.dedup_by_key(|p| p.number);
        let mut survey = Survey {
            frame: self.frame.clone(),
            sensor: self.sensor,
            sensor_positions: self.sensor_positions(),
            ..Survey::default()
        };
        let local = |p: DVec3| self.frame.local_from_site(p);
        survey.cloud =
            PointCloud::from_positions(found.iter().map(|p| local(p.position)).collect());
        let silent = |line: u16| self.silent_lines.iter().any(|l| (l.0..=l.1).contains(&line));
        let line = |line: u16| if silent(line) { 0 } else { line };
        if found.iter().any(|p| line(p.line) > 0) {
            survey.line = found.iter().map(|p| line(p.line)).collect();
        }
        Ok(PartSurvey { survey, number: found.into_iter().map(|p| p.number).collect() })
    }

    fn sensor_positions(&self) -> Vec<geom::Vec3> {
        let local = |p: &[f64; 3]| self.frame.local_from_site(DVec3::from_array(*p));
        self.sensor_positions.iter().map(local).collect()
    }
}
