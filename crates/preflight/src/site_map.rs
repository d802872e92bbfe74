//! A site from above on one coarse grid: what has been surveyed, what is designed, and where its alignment runs. For pages that
//! draw it; no figure of a run comes from it.

use crate::Preflight;
use scene::DesignSurface;
use serde::Serialize;

/// Cells along the longer side at most.
const SIDE: f64 = 400.0;
/// A cell holds so many points of the sample on average, so that a covered one is rarely empty.
const POINTS_A_CELL: f64 = 6.0;

/// Heights on square cells, row by row from the north-west corner; `None` where nothing is known.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct SiteMap {
    /// West edge, site coordinates, metres.
    pub west_m: f64,
    /// North edge.
    pub north_m: f64,
    /// Edge of a cell, metres.
    pub cell_m: f64,
    /// Cells from west to east.
    pub columns: usize,
    /// Cells from north to south.
    pub rows: usize,
    /// Highest surveyed point of each cell, metres.
    pub survey_m: Vec<Option<f32>>,
    /// Height of the design in the middle of each cell; empty without a design.
    pub design_m: Vec<Option<f32>>,
    /// Points of the design's alignment, site coordinates; empty when it has none.
    pub alignment: Vec<[f64; 2]>,
}

/// The map of what a check has looked at; `None` where no survey could be read.
pub fn site_map(found: &Preflight) -> Option<SiteMap> {
    let mut corners = found.surveys.iter().map(|s| (s.low, s.high));
    let (mut low, mut high) = corners.next()?;
    for (l, h) in corners {
        for k in 0..3 {
            (low[k], high[k]) = (low[k].min(l[k]), high[k].max(h[k]));
        }
    }
    let (wide_m, tall_m) = (high[0] - low[0], high[1] - low[1]);
    let cell_m = cell_m(found, wide_m.max(tall_m));
    let count = |length_m: f64| (length_m / cell_m).floor() as usize + 1;
    let mut map = SiteMap {
        west_m: low[0],
        north_m: high[1],
        cell_m,
        columns: count(wide_m),
        rows: count(tall_m),
        ..SiteMap::default()
    };
    map.survey_m = vec![None; map.columns * map.rows];
    for p in found.surveys.iter().flat_map(|s| &s.sample) {
        let Some(cell) = map.cell_of(p.x, p.y) else { continue };
        let here = &mut map.survey_m[cell];
        *here = Some(here.map_or(p.z as f32, |z| z.max(p.z as f32)));
    }
    if let Some(design) = &found.design {
        map.design_m = map.levels_of(design);
        if let DesignSurface::Section { alignment, .. } = design {
            map.alignment.clone_from(alignment);
        }
    }
    Some(map)
}

fn cell_m(found: &Preflight, longer_m: f64) -> f64 {
    let densest = |s: &crate::SurveyLook| {
        let share = s.sample.len() as f64 / s.points.max(1) as f64;
        (POINTS_A_CELL / (s.density_per_m2 * share).max(1e-9)).sqrt()
    };
    let wanted = found.surveys.iter().map(densest).fold(f64::INFINITY, f64::min);
    wanted.max(longer_m / SIDE).max(1e-4)
}

impl SiteMap {
    fn cell_of(&self, east: f64, north: f64) -> Option<usize> {
        let column = ((east - self.west_m) / self.cell_m).floor();
        let row = ((self.north_m - north) / self.cell_m).floor();
        let inside = column >= 0.0 && row >= 0.0;
        let (column, row) = (column as usize, row as usize);
        (inside && column < self.columns && row < self.rows).then(|| row * self.columns + column)
    }

    fn levels_of(&self, design: &DesignSurface) -> Vec<Option<f32>> {
        let middle = |i: usize| {
            let (row, column) = (i / self.columns, i % self.columns);
            let east = self.west_m + (column as f64 + 0.5) * self.cell_m;
            let north = self.north_m - (row as f64 + 0.5) * self.cell_m;
            design.level_at(east, north).map(|z| z as f32)
        };
        (0..self.columns * self.rows).map(middle).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::SurveyLook;
    use geom::DVec3;

    #[test]
    fn the_first_cell_is_the_north_west_one() {
        // A plane that rises towards the north-west, a point every half metre.
        let height = |e: f64, n: f64| n - e;
        let places = (0..40).flat_map(|i| (0..20).map(move |j| (i as f64 / 2.0, j as f64 / 2.0)));
        let sample: Vec<DVec3> =
            places.map(|(e, n)| DVec3::new(e + 0.1, n + 0.1, height(e, n))).collect();
        let survey = SurveyLook {
            points: 800,
            low: [0.1, 0.1, -20.0],
            high: [19.6, 9.6, 10.0],
            density_per_m2: 4.0,
            sample,
            ..SurveyLook::default()
        };
        let design = DesignSurface::Level {
            level_m: 3.0,
            boundary: vec![[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [0.0, 10.0]],
        };
        let found =
            Preflight { surveys: vec![survey], design: Some(design), ..Preflight::default() };
        let map = site_map(&found).unwrap();
        assert_eq!(map.survey_m.len(), map.columns * map.rows);
        let highest = map.survey_m.iter().flatten().copied().fold(f32::MIN, f32::max);
        assert_eq!(map.survey_m[0], Some(highest));
        assert_eq!(map.design_m[0], Some(3.0));
        assert_eq!(map.design_m[map.columns - 1], None, "no design in the east");
        let known = map.survey_m.iter().flatten().count();
        assert!(known * 10 >= map.survey_m.len() * 9, "{known} of {}", map.survey_m.len());
        assert!(site_map(&Preflight::default()).is_none());
    }
}
