//! A gridded survey as points on surfaces: what recognition works on instead of the middles of cells.
//!
//! In: a survey, its lattice. Out: the survey with each height where the surface is that it was made of — the highest of a
//! cell at its uphill corner, a mean at its middle — and without the cells across an edge, whose heights are of no surface.

use geom::Lattice;
use scene::Survey;

/// A gridded survey made ready.
#[derive(Clone, Debug)]
pub struct Gridded {
    /// The points that hold, moved to the surface.
    pub survey: Survey,
    /// Index of each in the survey as it came, ascending.
    pub index: Vec<u32>,
    /// How far each may be off, metres, beside the sensor's own noise.
    pub error_m: Vec<f32>,
}

impl Gridded {
    /// From a survey and the lattice it lies on.
    pub fn new(survey: &Survey, lattice: &Lattice) -> Self {
        let surface = lattice.surface(&survey.cloud.position_m);
        let index: Vec<u32> =
            (0..surface.len() as u32).filter(|&i| surface[i as usize].holds).collect();
        let select: Vec<usize> = index.iter().map(|&i| i as usize).collect();
        let mut cloud = survey.cloud.select(&select);
        for (p, &i) in cloud.position_m.iter_mut().zip(&select) {
            *p = surface[i].position;
        }
        let line = if survey.line.is_empty() {
            Vec::new()
        } else {
            select.iter().map(|&i| survey.line[i]).collect()
        };
        let error_m = select.iter().map(|&i| surface[i].error_m).collect();
        Self { survey: Survey { cloud, line, ..survey.clone() }, index, error_m }
    }

    /// Root mean square of the errors, metres: what the grid adds to the noise of a point.
    pub fn error_rms_m(&self) -> f32 {
        let n = self.error_m.len().max(1) as f32;
        (self.error_m.iter().map(|e| e * e).sum::<f32>() / n).sqrt()
    }

    /// Indices of points of this survey as indices of the survey as it came.
    pub fn whole(&self, points: &mut [u32]) {
        points.iter_mut().for_each(|p| *p = self.index[*p as usize]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use geom::{CellRule, PointCloud, Vec3};

    #[test]
    fn cells_across_an_edge_go_and_indices_come_back() {
        // Two levels a metre apart, one column of cells between them at less than half the height.
        let mut points = Vec::new();
        for j in 0..60 {
            for i in 0..30 {
                let z = if i < 15 {
                    0.0
                } else if i == 15 {
                    0.4
                } else {
                    1.0
                };
                points.push(Vec3::new(i as f32 * 0.2, j as f32 * 0.2, z));
            }
        }
        let survey = Survey { cloud: PointCloud::from_positions(points), ..Survey::default() };
        let lattice = Lattice::of(&survey.cloud.position_m).unwrap();
        assert_eq!(lattice.rule, Some(CellRule::Mean));
        let gridded = Gridded::new(&survey, &lattice);
        assert_eq!(gridded.index.len(), 60 * 29);
        let mut last = vec![gridded.index.len() as u32 - 1];
        gridded.whole(&mut last);
        assert_eq!(last, [1799]);
        assert!(gridded.error_rms_m() < 0.02);
    }
}
