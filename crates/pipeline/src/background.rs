//! A depth camera sees the bin too: its floor and walls, and what lies beyond them, go before the network.

use geom::find_walls;
use geom::{Event, Observer, Plane, SeedTree, Vec3};
use scene::{Catalog, Recognised, Segmentation, SensorKind, Survey};
use serde::{Deserialize, Serialize};

/// How far from a wall's plane points are still of the wall, in units of the smallest d_max.
const WALL_THICKNESS: f32 = 0.08;

/// A plane shorter than this, in units of the largest d_box, may be the side of a part: statues lying side by side have
/// backs that look like walls.
const WALL_LENGTH: f32 = 1.25;

/// How far the points of a wall reach, metres: twice the distance from their middle that hardly any exceeds.
fn length_m(wall: &Plane, points: &[Vec3], thickness_m: f32) -> f32 {
    let on: Vec<Vec3> =
        points.iter().copied().filter(|&p| wall.distance_m(p).abs() <= thickness_m).collect();
    let middle = on.iter().copied().sum::<Vec3>() / on.len().max(1) as f32;
    let mut far: Vec<f32> = on.iter().map(|p| (*p - middle).length()).collect();
    far.sort_by(f32::total_cmp);
    2.0 * far.get(far.len() * 98 / 100).copied().unwrap_or(0.0)
}

/// What goes before the network.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct BackgroundConfig {
    /// Floor and walls of a bin go from a depth camera's cloud. Off for parts on no bin, whose flat backs look like walls.
    pub bin: bool,
}

impl Default for BackgroundConfig {
    fn default() -> Self {
        Self { bin: true }
    }
}

/// The part of a survey that can hold blocks.
pub struct Foreground {
    /// That part alone.
    pub survey: Survey,
    /// Index in the whole survey of each of its points; `None`: it is the whole survey.
    index: Option<Vec<u32>>,
    whole: usize,
}

impl Foreground {
    /// Removes the bin from a depth camera's cloud; other surveys stay whole, their bed matters.
    pub fn of(
        survey: &Survey,
        catalog: &Catalog,
        config: &BackgroundConfig,
        seed: SeedTree,
        observer: &dyn Observer,
    ) -> Self {
        let whole = survey.cloud.len();
        let smallest_m = catalog.iter().map(|(_, m)| m.d_max_m).fold(f32::INFINITY, f32::min);
        let everything = || Self { survey: survey.clone(), index: None, whole };
        if !config.bin || survey.sensor != SensorKind::DepthCamera || catalog.is_empty() {
            return everything();
        }
        let thickness_m = WALL_THICKNESS * smallest_m;
        let points = &survey.cloud.position_m;
        let largest_m = catalog.iter().map(|(_, m)| m.d_box_m).fold(0.0, f32::max);
        let mut walls = find_walls(points, thickness_m, seed);
        walls.retain(|wall| length_m(wall, points, thickness_m) > WALL_LENGTH * largest_m);
        if walls.is_empty() {
            return everything();
        }
        let inside = |p: Vec3| walls.iter().all(|wall| wall.distance_m(p) > thickness_m);
        let index: Vec<u32> = (0..whole as u32).filter(|&i| inside(points[i as usize])).collect();
        observer.event(Event::Noted {
            stage: "segment",
            message: format!(
                "floor and walls of the bin removed: {} planes, {} of {whole} points left",
                walls.len(),
                index.len()
            ),
        });
        let select: Vec<usize> = index.iter().map(|&i| i as usize).collect();
        let line = if survey.line.is_empty() {
            Vec::new()
        } else {
            select.iter().map(|&i| survey.line[i]).collect()
        };
        let part = Survey { cloud: survey.cloud.select(&select), line, walls, ..survey.clone() };
        Self { survey: part, index: Some(index), whole }
    }

    /// Labels and indices of the part, as labels and indices of the whole survey.
    pub fn whole(
        &self,
        mut segmentation: Segmentation,
        mut blocks: Vec<Recognised>,
    ) -> crate::Recognition {
        if let Some(index) = &self.index {
            let up =
                |points: &mut Vec<u32>| points.iter_mut().for_each(|p| *p = index[*p as usize]);
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

#[cfg(test)]
mod tests {
    use super::*;
    use geom::{PointCloud, Silent};
    use scene::Shape;

    fn plate(edge_m: f32) -> Vec<Vec3> {
        let at = |i: usize| (i as f32 + 0.5) / 60.0 * edge_m;
        (0..3600).map(|i| Vec3::new(at(i % 60), at(i / 60), 0.0)).collect()
    }

    /// Four fifths of a scene of figures were once taken for the floor and walls of a bin that was not there.
    #[test]
    fn a_plane_no_longer_than_a_part_is_no_wall() {
        let cube = blocks::shape_model("part", Shape::Cube { size: 1.0 }, 2300.0).unwrap();
        let catalog = Catalog::new(vec![cube]);
        let left = |edge_m: f32| {
            let mut points = plate(edge_m);
            points.extend((0..400).map(|i| Vec3::new(0.3, 0.3, 0.5 + 0.001 * i as f32)));
            let survey = Survey {
                cloud: PointCloud::from_positions(points),
                sensor: SensorKind::DepthCamera,
                ..Default::default()
            };
            let config = BackgroundConfig::default();
            Foreground::of(&survey, &catalog, &config, SeedTree::new(1), &Silent).survey.cloud.len()
        };
        assert_eq!(left(0.8), 4000);
        assert_eq!(left(4.0), 400);
    }
}
