//! A depth camera sees the bin too: its floor and walls, and what lies beyond them, go before the network.

use crate::camera_place::camera_place;
use crate::walls::Walls;
use geom::{Event, Observer, Plane, SeedTree, Stage, Vec3, Warning};
use scene::{Catalog, Segmentation, SensorKind, Survey};
use serde::{Deserialize, Serialize};
use std::borrow::Cow;

/// With less left than this share there would be nothing to recognise. Free choice: bins seen hold a fifth and more of the points.
const FEWEST_LEFT: f32 = 0.03;
/// What lies this far behind something is hidden by it, in units of the smallest d_max.
const HIDDEN: f32 = 0.1;
/// When a bin takes more than this share of the points, a person should know.
const MUCH: f32 = 0.3;

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
pub struct Foreground<'a> {
    /// That part alone.
    pub survey: Cow<'a, Survey>,
    /// Index in the whole survey of each of its points; `None`: it is the whole survey.
    index: Option<Vec<u32>>,
    whole: usize,
}

impl<'a> Foreground<'a> {
    /// Removes the bin from a depth camera's cloud; other surveys stay whole, their bed matters.
    pub fn of(
        survey: &'a Survey,
        catalog: &Catalog,
        config: &BackgroundConfig,
        seed: SeedTree,
        observer: &dyn Observer,
    ) -> Self {
        let whole = survey.cloud.len();
        let untouched = Self { survey: Cow::Borrowed(survey), index: None, whole };
        if survey.sensor != SensorKind::DepthCamera || catalog.is_empty() {
            return untouched;
        }
        let smallest_m = catalog.iter().map(|(_, m)| m.d_max_m).fold(f32::INFINITY, f32::min);
        let survey = located(survey, smallest_m, observer);
        let everything = || Self { survey: survey.clone(), index: None, whole };
        if !config.bin {
            return everything();
        }
        let points = &survey.cloud.position_m;
        let largest_m = catalog.iter().map(|(_, m)| m.d_box_m).fold(0.0, f32::max);
        let Walls { planes: walls, thickness_m } = Walls::of(points, smallest_m, largest_m, seed);
        if walls.is_empty() {
            return everything();
        }
        let inside = |p: Vec3| walls.iter().all(|wall| wall.distance_m(p) > thickness_m);
        let index: Vec<u32> = (0..whole as u32).filter(|&i| inside(points[i as usize])).collect();
        if (index.len() as f32) < FEWEST_LEFT * whole as f32 {
            // A scan of an empty bin is no scan: what all points lie on are the parts.
            return everything();
        }
        observer.event(Event::Noted {
            stage: Stage::Segment,
            message: format!(
                "floor and walls of the bin removed: {} planes, {} of {whole} points left",
                walls.len(),
                index.len()
            ),
        });
        if ((whole - index.len()) as f32) > MUCH * whole as f32 {
            let message = format!(
                "the bin took {:.0} % of the points; where no bin was measured, say `[background] bin = false`",
                100.0 * (whole - index.len()) as f32 / whole as f32
            );
            observer.event(Event::Warned(Warning { stage: Stage::Segment, message }));
        }
        let part = part(&survey, &index, walls);
        Self { survey: Cow::Owned(part), index: Some(index), whole }
    }

    /// Indices of the part as indices of the whole survey.
    pub fn whole_points(&self, points: &mut [u32]) {
        if let Some(index) = &self.index {
            points.iter_mut().for_each(|p| *p = index[*p as usize]);
        }
    }

    /// Labels and indices of the part as labels and indices of the whole survey.
    pub fn whole_segmentation(&self, mut segmentation: Segmentation) -> Segmentation {
        let Some(index) = &self.index else { return segmentation };
        segmentation.hypotheses.iter_mut().for_each(|h| self.whole_points(&mut h.points));
        let mut instance = vec![0; self.whole];
        let mut confidence = vec![0.0; self.whole];
        for (part, &whole) in index.iter().enumerate() {
            instance[whole as usize] = segmentation.instance[part];
            confidence[whole as usize] = segmentation.confidence[part];
        }
        Segmentation { instance, confidence, ..segmentation }
    }
}

/// The points of a survey that `index` names, before these walls.
fn part(survey: &Survey, index: &[u32], walls: Vec<Plane>) -> Survey {
    let select: Vec<usize> = index.iter().map(|&i| i as usize).collect();
    let line = match survey.line.as_slice() {
        [] => Vec::new(),
        line => select.iter().map(|&i| line[i]).collect(),
    };
    Survey { cloud: survey.cloud.select(&select), line, walls, ..survey.clone() }
}

/// The survey with the place its camera looked from, asked of its points where nobody stated it.
fn located<'a>(survey: &'a Survey, d_max_m: f32, observer: &dyn Observer) -> Cow<'a, Survey> {
    if !survey.sensor_positions.is_empty() {
        return Cow::Borrowed(survey);
    }
    let points = &survey.cloud.position_m;
    let Some(place) = camera_place(points, HIDDEN * d_max_m) else { return Cow::Borrowed(survey) };
    let away = place - survey.cloud.bounds().centre();
    let tilt_deg = away.angle_between(Vec3::Z).to_degrees();
    let message = format!(
        "camera position unknown: taken as {:.2} m from the middle of the cloud, {tilt_deg:.0}° from straight above",
        away.length()
    );
    observer.event(Event::Noted { stage: Stage::Segment, message });
    Cow::Owned(Survey { sensor_positions: vec![place], ..survey.clone() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use geom::{PointCloud, Silent};
    use scene::Shape;

    /// Points that are left of what a depth camera saw.
    fn left_of(points: Vec<Vec3>, catalog: &Catalog) -> usize {
        let survey = Survey {
            cloud: PointCloud::from_positions(points),
            sensor: SensorKind::DepthCamera,
            ..Default::default()
        };
        let config = BackgroundConfig::default();
        Foreground::of(&survey, catalog, &config, SeedTree::new(1), &Silent).survey.cloud.len()
    }

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
            left_of(points, &catalog)
        };
        assert_eq!(left(0.8), 4000);
        assert_eq!(left(4.0), 400);
    }

    #[test]
    fn a_camera_whose_place_nobody_stated_is_looked_for_and_others_are_left_alone() {
        let cube = blocks::shape_model("part", Shape::Cube { size: 0.5 }, 2300.0).unwrap();
        let catalog = Catalog::new(vec![cube]);
        let positions = |sensor, stated: &[Vec3]| {
            let survey = Survey {
                cloud: PointCloud::from_positions(plate(4.0)),
                sensor,
                sensor_positions: stated.to_vec(),
                ..Default::default()
            };
            let config = BackgroundConfig { bin: false };
            let found = Foreground::of(&survey, &catalog, &config, SeedTree::new(1), &Silent);
            found.survey.sensor_positions.clone()
        };
        assert_eq!(positions(SensorKind::DepthCamera, &[]).len(), 1);
        assert_eq!(positions(SensorKind::DepthCamera, &[Vec3::Z]), [Vec3::Z]);
        assert!(positions(SensorKind::Uav, &[]).is_empty());
    }

    /// Gear shafts on a table nobody measured once lost nine tenths of their points to planes that touched them.
    #[test]
    fn planes_that_touch_round_or_flat_parts_are_no_walls() {
        let part = blocks::shape_model("part", Shape::Cube { size: 0.5 }, 2300.0).unwrap();
        let catalog = Catalog::new(vec![part]);
        let r = |i: usize, k: f64| ((i + 1) as f64 * k).fract() as f32;
        // Lying cylinders, then plates of one thickness: seen from above, some apart, some turned.
        let scene = |round: bool, bin: bool| {
            let mut points = Vec::new();
            for k in 0..36 {
                let place = Vec3::new((k % 6) as f32 * 0.62, (k / 6) as f32 * 0.62, 0.0);
                let turn = geom::Quat::from_rotation_z(k as f32);
                for i in 0..500 {
                    let (u, v) = (r(i, 0.754_877) - 0.5, r(i, 0.569_840) - 0.5);
                    let p = if round {
                        let a = 3.0 * v;
                        Vec3::new(0.5 * u, 0.15 * a.sin(), 0.15 * (1.0 + a.cos()))
                    } else {
                        Vec3::new(0.5 * u, 0.4 * v, 0.2)
                    };
                    points.push(turn * p + place);
                }
            }
            if bin {
                points.extend((0..30_000).map(|i| {
                    Vec3::new(4.6 * r(i, 0.754_877) - 0.7, 4.6 * r(i, 0.569_840) - 0.7, -0.02)
                }));
            }
            let all = points.len();
            left_of(points, &catalog) as f32 / all as f32
        };
        for round in [true, false] {
            assert_eq!(scene(round, false), 1.0, "round {round}");
            assert!(scene(round, true) < 0.6, "round {round}");
        }
    }

    /// Plates that lie side by side without a gap, each at a height of its own, were once taken for a floor; floors may be
    /// bent, and badly measured.
    #[test]
    fn tops_side_by_side_are_no_floor_and_bent_or_noisy_floors_are() {
        let part = blocks::shape_model("part", Shape::Cube { size: 0.5 }, 2300.0).unwrap();
        let catalog = Catalog::new(vec![part]);
        let r = |i: usize, k: f64| ((i + 1) as f64 * k).fract() as f32;
        let left = |height: &dyn Fn(usize, Vec3) -> f32| {
            let mut points: Vec<Vec3> = (0..20_000)
                .map(|i| Vec3::new(3.0 * r(i, 0.754_877), 3.0 * r(i, 0.569_840), 0.0))
                .enumerate()
                .map(|(i, p)| p.with_z(height(i, p)))
                .filter(|p| p.is_finite())
                .collect();
            points.extend((0..4000).map(|i| {
                Vec3::new(1.0 + r(i, 0.819_172), 1.0 + r(i, 0.671_043), 0.3 + 0.3 * r(i, 0.549_700))
            }));
            left_of(points, &catalog)
        };
        let plate = |p: Vec3| r(((p.x / 0.3) as usize) * 10 + (p.y / 0.3) as usize, 0.618_034);
        assert_eq!(left(&|_, p| 0.06 * plate(p)), 24_000, "tops");
        // Plates of one height with gaps wider than what lies between two points: on a table nobody measured.
        let apart = |p: Vec3| (p / 0.6).fract().truncate().min_element() < 0.3;
        assert!(left(&|_, p| if apart(p) { f32::NAN } else { 0.0 }) > 12_000, "apart");
        assert_eq!(left(&|_, _| 0.0), 4000, "flat");
        assert_eq!(left(&|_, p| 0.02 * (p.x - 1.5).powi(2)), 4000, "bent");
        assert_eq!(left(&|i, _| 0.03 * (r(i, 0.411_978) - 0.5)), 4000, "noisy");
    }
}
