//! A depth camera sees the bin too: its floor and what lies below or outside go before the network.

use geom::plane::find_plane;
use geom::{Event, Observer, SeedTree, Vec3};
use scene::{Catalog, Recognised, Segmentation, SensorKind, Survey};

/// A floor thicker than this part of the smallest d_max would eat into the parts.
const FLOOR_THICKNESS: f32 = 0.08;
/// The floor must hold this share of the points, or there is none in view.
const LEAST_SHARE: f32 = 0.05;

/// The part of a survey that can hold blocks.
pub struct Foreground {
    /// That part alone.
    pub survey: Survey,
    /// Index in the whole survey of each of its points; `None`: it is the whole survey.
    index: Option<Vec<u32>>,
    whole: usize,
}

impl Foreground {
    /// Removes the bin's floor from a depth camera's cloud; other surveys stay whole, their bed matters.
    pub fn of(survey: &Survey, catalog: &Catalog, seed: SeedTree, observer: &dyn Observer) -> Self {
        let whole = survey.cloud.len();
        let smallest_m = catalog.iter().map(|(_, m)| m.d_max_m).fold(f32::INFINITY, f32::min);
        let everything = || Self { survey: survey.clone(), index: None, whole };
        if survey.sensor != SensorKind::DepthCamera || catalog.is_empty() {
            return everything();
        }
        let thickness_m = FLOOR_THICKNESS * smallest_m;
        let points = &survey.cloud.position_m;
        let Some((plane, count)) = find_plane(points, thickness_m, None, seed) else { return everything() };
        if (count as f32) < LEAST_SHARE * whole as f32 {
            return everything();
        }
        let eye = survey.sensor_positions.first().copied().unwrap_or_else(|| survey.cloud.bounds().max + Vec3::Z);
        let centre = survey.cloud.bounds().centre();
        let plane = plane.facing(eye - centre);
        let index: Vec<u32> =
            (0..whole as u32).filter(|&i| plane.distance_m(points[i as usize]) > thickness_m).collect();
        observer.event(Event::Noted {
            stage: "segment",
            message: format!(
                "bin floor removed: {} of {whole} points left (plane normal {:.2} {:.2} {:.2})",
                index.len(),
                plane.normal.x,
                plane.normal.y,
                plane.normal.z
            ),
        });
        let select: Vec<usize> = index.iter().map(|&i| i as usize).collect();
        let part = Survey { cloud: survey.cloud.select(&select), ..survey.clone() };
        Self { survey: part, index: Some(index), whole }
    }

    /// Labels and indices of the part, as labels and indices of the whole survey.
    pub fn whole(&self, mut segmentation: Segmentation, mut blocks: Vec<Recognised>) -> crate::Recognition {
        if let Some(index) = &self.index {
            let up = |points: &mut Vec<u32>| points.iter_mut().for_each(|p| *p = index[*p as usize]);
            segmentation.hypotheses.iter_mut().for_each(|h| up(&mut h.points));
            blocks.iter_mut().for_each(|b| up(&mut b.points));
            let mut instance = vec![0; self.whole];
            let mut confidence = vec![0.0; self.whole];
            for (part, &whole) in index.iter().enumerate() {
                instance[whole as usize] = segmentation.instance[part];
                confidence[whole as usize] = segmentation.confidence[part];
            }
            segmentation.instance = instance;
            segmentation.confidence = confidence;
        }
        crate::Recognition { segmentation, blocks }
    }
}
