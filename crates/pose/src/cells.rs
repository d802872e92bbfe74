//! A gridded survey on its way into recognition, and labels on their way back.
//!
//! In: a survey as it was delivered. Out: what recognition works on. The cells of a grid become points of the surface they were made
//! of, so that blocks meet them as they meet any other points; what is found of those points becomes what is found of the cells.
//! A survey that is no grid stays as it is.

use crate::PoseConfig;
use crate::gridded::Gridded;
use crate::survey_facts::SurveyFacts;
use geom::Lattice;
use scene::{Catalog, Segmentation, Survey};

/// A survey as recognition works on it.
pub struct Cells<'s> {
    given: &'s Survey,
    gridded: Option<Gridded>,
}

impl<'s> Cells<'s> {
    /// Looks whether the survey is a grid.
    pub fn of(survey: &'s Survey) -> Self {
        let lattice = Lattice::of(&survey.cloud.position_m);
        Self { given: survey, gridded: lattice.map(|lattice| Gridded::new(survey, &lattice)) }
    }

    /// Points on surfaces.
    pub fn survey(&self) -> &Survey {
        self.gridded.as_ref().map_or(self.given, |gridded| &gridded.survey)
    }

    /// Standard deviation of a point with what the grid adds, metres, for blocks of this size; `None` for a survey that is no grid.
    fn noise_sd_m(&self, d_max_m: f32) -> Option<f32> {
        self.gridded.as_ref()?;
        // The scatter of a grid is that of its cells about the surface: what a cell may be off is in it.
        let facts = SurveyFacts::of(self.given, d_max_m);
        Some(facts.noise_sd_m(self.given, d_max_m))
    }

    /// Settings that know how far its points may be off.
    pub fn settings(&self, catalog: &Catalog, config: &PoseConfig) -> PoseConfig {
        let smallest_m = catalog.iter().map(|(_, m)| m.d_max_m).fold(f32::INFINITY, f32::min);
        let mut config = config.clone();
        config.noise_sd_m = config.noise_sd_m.or_else(|| self.noise_sd_m(smallest_m));
        config
    }

    /// Indices of points as indices of the survey as it was delivered.
    pub fn whole_points(&self, points: &mut [u32]) {
        self.gridded.iter().for_each(|gridded| gridded.whole(points));
    }

    /// Labels and indices as those of the survey as it was delivered; cells across an edge belong to no block.
    pub fn whole_segmentation(&self, mut found: Segmentation) -> Segmentation {
        let Some(gridded) = &self.gridded else { return found };
        found.hypotheses.iter_mut().for_each(|h| gridded.whole(&mut h.points));
        let cells = self.given.cloud.len();
        let (mut instance, mut confidence) = (vec![0; cells], vec![0.0; cells]);
        for (part, &whole) in gridded.index.iter().enumerate() {
            instance[whole as usize] = found.instance[part];
            confidence[whole as usize] = found.confidence[part];
        }
        Segmentation { instance, confidence, ..found }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use geom::{PointCloud, Vec3};
    use scene::CentreHypothesis;

    /// Two levels with one column of cells between them, 20 cm apart.
    fn grid() -> Survey {
        let cell = |i: usize| {
            let z = [0.0, 0.4, 1.0][usize::from(i % 30 > 14) + usize::from(i % 30 > 15)];
            Vec3::new((i % 30) as f32 * 0.2, (i / 30) as f32 * 0.2, z)
        };
        let points = (0..1800).map(cell).collect();
        Survey { cloud: PointCloud::from_positions(points), ..Survey::default() }
    }

    #[test]
    fn labels_of_a_grid_come_back_to_its_cells() {
        let survey = grid();
        let cells = Cells::of(&survey);
        let part = cells.survey().cloud.len();
        assert_eq!(part, 60 * 29);
        let last = part as u32 - 1;
        let found = Segmentation {
            instance: vec![1; part],
            confidence: vec![0.5; part],
            hypotheses: vec![CentreHypothesis {
                centre: Vec3::ZERO,
                score: 1.0,
                points: vec![last],
            }],
            instances: 1,
        };
        let whole = cells.whole_segmentation(found);
        assert_eq!((whole.instance.len(), whole.instance[15], whole.instance[16]), (1800, 0, 1));
        assert_eq!(whole.hypotheses[0].points, [1799]);
        assert!(cells.noise_sd_m(1.2).is_some_and(|sd| sd < 0.05));
    }

    #[test]
    fn a_cloud_stays_as_it_is() {
        let points = (0..500).map(|i| Vec3::new((i as f32).sin(), (i as f32).cos(), 0.0));
        let survey =
            Survey { cloud: PointCloud::from_positions(points.collect()), ..Survey::default() };
        let cells = Cells::of(&survey);
        assert_eq!(cells.survey().cloud.position_m, survey.cloud.position_m);
        assert_eq!(cells.noise_sd_m(1.2), None);
    }
}
