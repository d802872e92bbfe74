//! A depth camera sees the bin too: its floor and walls, and what lies beyond them, go before the network.

use crate::camera_place::camera_place;
use geom::find_walls;
use geom::{Event, Observer, Plane, SeedTree, Stage, Vec3, Warning};
use scene::{Catalog, Segmentation, SensorKind, Survey};
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};

/// How far from a wall's plane points are still of the wall, in units of the smallest d_max.
const WALL_THICKNESS: f32 = 0.08;
/// A piece of wall is longer than this, in units of the largest d_box: flat sides of parts are not.
const PIECE_LENGTH: f32 = 1.25;
/// Of the points near a wall so many face the way it does. A plane that touches round parts has points that face anywhere.
const FACING_SHARE: f32 = 0.6;
/// Points face the way a wall does up to this cosine.
const FACING: f32 = 0.9;
/// Of the facing points so many lie in pieces longer than any part: parts that lie flat side by side make many short ones. Of floors
/// under many parts it was 0.24 and more, half of them above 0.8; parts that lay on nothing made one by gaps of a few points.
const LONG_SHARE: f32 = 0.3;
/// Points of one piece lie nearer than this, in units of their spacing and, at least and at most, of the largest d_box.
const GAP_SPACINGS: f32 = 3.0;
const LEAST_GAP: f32 = 0.05;
const MOST_GAP: f32 = 0.15;
/// The longest piece of a wall scatters about a smooth surface by this at most, in units of [`WALL_THICKNESS`], or by this many
/// times what neighbouring points scatter: of walls and floors it was 0.11 at most, tops of parts side by side lay 0.2 and more apart.
const SMOOTH: f32 = 0.15;
const SMOOTH_SCATTERS: f32 = 3.0;
/// Of walls that face one way within this cosine only the farthest back is one: the others are what lies on it.
const ONE_WAY: f32 = 0.95;
/// Normals are those of neighbours this near, in units of the smallest d_max.
const NORMAL_RADIUS: f32 = 0.12;
/// A wall has at most this share of the points behind it: what multiple reflections and edges put there.
const BEHIND: f32 = 0.02;
/// With less left than this share there would be nothing to recognise. Free choice: bins seen hold a fifth and more of the points.
const FEWEST_LEFT: f32 = 0.03;
/// What lies this far behind something is hidden by it, in units of the smallest d_max.
const HIDDEN: f32 = 0.1;
/// When a bin takes more than this share of the points, a person should know.
const MUCH: f32 = 0.3;

/// Whether a plane with nothing behind it is a surface of its own and not a plane that touches the parts.
fn is_wall(wall: &Plane, points: &[Vec3], normals: &[Vec3], thickness_m: f32, part_m: f32) -> bool {
    let near: Vec<usize> =
        (0..points.len()).filter(|&i| wall.distance_m(points[i]).abs() <= thickness_m).collect();
    let facing: Vec<Vec3> = near
        .iter()
        .filter(|&&i| normals[i].dot(wall.normal).abs() > FACING)
        .map(|&i| points[i])
        .collect();
    if (facing.len() as f32) < FACING_SHARE * near.len() as f32 {
        return false;
    }
    let gap_m = GAP_SPACINGS * spacing_m(&facing, thickness_m);
    let pieces = pieces(wall, &facing, gap_m.clamp(LEAST_GAP * part_m, MOST_GAP * part_m));
    let long: Vec<&Vec<Vec3>> =
        pieces.iter().filter(|piece| length_m(piece) > PIECE_LENGTH * part_m).collect();
    let on_long: usize = long.iter().map(|piece| piece.len()).sum();
    on_long as f32 > LONG_SHARE * facing.len() as f32
        && long.iter().max_by_key(|piece| piece.len()).is_some_and(|p| is_smooth(p, thickness_m))
}

/// Whether points lie on one smooth surface as neighbours do. Tops of parts lie side by side at heights of their own.
fn is_smooth(piece: &[Vec3], thickness_m: f32) -> bool {
    let Some(scatter_m) = geom::scatter_about_patch_m(piece) else { return false };
    if scatter_m <= SMOOTH * thickness_m {
        return true;
    }
    let spacing_m = spacing_m(piece, thickness_m);
    let near_m = geom::scatter(piece, spacing_m, f32::MAX).overall_m;
    near_m.is_some_and(|near_m| scatter_m <= SMOOTH_SCATTERS * near_m)
}

/// How far the points of a surface lie apart, metres: from the cubes of edge `cell_m` that they fill.
fn spacing_m(points: &[Vec3], cell_m: f32) -> f32 {
    let cell = |p: &Vec3| (*p / cell_m).floor().to_array().map(|x| x as i32);
    let cells = points.iter().map(cell).collect::<BTreeSet<_>>().len();
    cell_m * (cells as f32 / points.len().max(1) as f32).sqrt()
}

/// Of walls that face one way the one farthest back.
fn farthest_back(walls: &mut Vec<Plane>, middle: Vec3) {
    let all = walls.clone();
    let behind = |a: &Plane, b: &Plane| {
        a.normal.dot(b.normal) > ONE_WAY && b.distance_m(middle) > a.distance_m(middle)
    };
    walls.retain(|wall| !all.iter().any(|other| behind(wall, other)));
}

/// Points of a plane in connected pieces: cells of the plane that touch.
fn pieces(wall: &Plane, points: &[Vec3], cell_m: f32) -> Vec<Vec<Vec3>> {
    let along = wall.normal.any_orthonormal_vector();
    let across = wall.normal.cross(along);
    let mut cells: BTreeMap<(i32, i32), Vec<Vec3>> = BTreeMap::new();
    for &p in points {
        let cell = |axis: Vec3| (axis.dot(p) / cell_m).floor() as i32;
        cells.entry((cell(along), cell(across))).or_default().push(p);
    }
    let mut found = Vec::new();
    while let Some((first, own)) = cells.pop_first() {
        let (mut piece, mut open) = (own, vec![first]);
        while let Some((x, y)) = open.pop() {
            for (i, j) in (-1..=1).flat_map(|i| (-1..=1).map(move |j| (i, j))) {
                let next = (x + i, y + j);
                if let Some(own) = cells.remove(&next) {
                    piece.extend(own);
                    open.push(next);
                }
            }
        }
        found.push(piece);
    }
    found
}

/// How far points reach, metres: twice the distance from their middle that hardly any exceeds.
fn length_m(points: &[Vec3]) -> f32 {
    let middle = points.iter().copied().sum::<Vec3>() / points.len().max(1) as f32;
    let mut far: Vec<f32> = points.iter().map(|p| (*p - middle).length()).collect();
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
        let thickness_m = WALL_THICKNESS * smallest_m;
        let points = &survey.cloud.position_m;
        let largest_m = catalog.iter().map(|(_, m)| m.d_box_m).fold(0.0, f32::max);
        let mut walls = find_walls(points, thickness_m, seed);
        let radius_m = NORMAL_RADIUS * smallest_m;
        let normals = geom::normals(points, radius_m, &|_| Vec3::Z);
        walls.retain(|wall| is_wall(wall, points, &normals, thickness_m, largest_m));
        // Nothing is seen through a bin: a plane with points behind it is the parts' own.
        let behind = |wall: &Plane| {
            points.iter().filter(|&&p| wall.distance_m(p) < -3.0 * thickness_m).count() as f32
        };
        walls.retain(|wall| behind(wall) <= BEHIND * whole as f32);
        farthest_back(&mut walls, survey.cloud.bounds().centre());
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
            let survey = Survey {
                cloud: PointCloud::from_positions(points),
                sensor: SensorKind::DepthCamera,
                ..Default::default()
            };
            let config = BackgroundConfig::default();
            let found = Foreground::of(&survey, &catalog, &config, SeedTree::new(1), &Silent);
            found.survey.cloud.len() as f32 / survey.cloud.len() as f32
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
            let survey = Survey {
                cloud: PointCloud::from_positions(points),
                sensor: SensorKind::DepthCamera,
                ..Default::default()
            };
            let config = BackgroundConfig::default();
            Foreground::of(&survey, &catalog, &config, SeedTree::new(1), &Silent).survey.cloud.len()
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
