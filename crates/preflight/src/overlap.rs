//! Steps between surveys where they overlap: another datum, a wrong offset, a settled base.

use crate::look::SurveyLook;
use geom::DVec3;
use std::collections::HashMap;

/// Cells that both surveys must cover.
const LEAST_CELLS: usize = 20;

/// Median height of the second survey above the first in the cells both cover, metres; `None` when they hardly overlap.
pub(crate) fn height_step_m(a: &SurveyLook, b: &SurveyLook, cell_m: f64) -> Option<f64> {
    let (tops, others) = (tops(&a.sample, cell_m), tops(&b.sample, cell_m));
    let mut steps: Vec<f64> =
        tops.iter().filter_map(|(cell, z)| Some(others.get(cell)? - z)).collect();
    if steps.len() < LEAST_CELLS {
        return None;
    }
    steps.sort_by(f64::total_cmp);
    Some(steps[steps.len() / 2])
}

/// Highest point of each cell.
fn tops(points: &[DVec3], cell_m: f64) -> HashMap<[i64; 2], f64> {
    let mut out = HashMap::new();
    for p in points {
        let key = [(p.x / cell_m).floor() as i64, (p.y / cell_m).floor() as i64];
        let top = out.entry(key).or_insert(p.z);
        *top = p.z.max(*top);
    }
    out
}
