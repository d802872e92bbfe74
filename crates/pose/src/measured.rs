//! The survey as the search sees it: thinned to an even spacing, with normals and directions to the sensor.
//!
//! Everything the search and the verification ask of the points goes through here, so that a survey of a million
//! points costs little more than one of a hundred thousand.

use crate::fit::FitPoint;
use crate::ground::{Bed, lowest_plane};
use crate::pile_facts::PileFacts;
use crate::sight::Sight;
use crate::viewpoint::Viewpoint;
use geom::{PointGrid, Thinned, Vec3, thin_from_lowest};
use scene::{SensorKind, Survey};

/// The working cloud.
pub struct Measured {
    /// Positions.
    pub position: Vec<Vec3>,
    /// Unit normals facing the sensor; zero where there is none.
    pub normal: Vec<Vec3>,
    /// From where it was measured, when no sensor position is known.
    pub viewpoint: Option<Viewpoint>,
    /// Unit directions to the sensor.
    pub to_sensor: Vec<Vec3>,
    /// Survey index of each working point, and working point of each survey point.
    pub thinned: Thinned,
    /// Who is near a place.
    pub grid: PointGrid,
    /// Area a working point stands for, m².
    pub point_area_m2: f32,
    /// Typical distance between working points, metres.
    pub spacing_m: f32,
    /// Typical distance between the survey's own points, metres.
    pub survey_spacing_m: f32,
    /// Standard deviation of a point, metres.
    pub noise_sd_m: f32,
    /// What each sensor saw first along its rays.
    pub sight: Sight,
    /// Smallest d_max of the blocks looked for, metres.
    pub smallest_d_max_m: f32,
    /// A plane through the lowest points, a first guess of where blocks need not be looked for.
    pub lowest: Option<Bed>,
    /// The bed as somebody stated it.
    pub stated_bed: Option<Bed>,
    /// What no block reaches into: floor and walls of a bin.
    pub solid: Vec<Bed>,
}

impl Measured {
    /// Prepares the survey for blocks of the given smallest d_max.
    pub fn new(
        survey: &Survey,
        cell_m: f32,
        d_max_m: f32,
        noise_sd_m: f32,
        stated_bed: Option<Bed>,
        facts: Option<&PileFacts>,
    ) -> Self {
        let all = &survey.cloud.position_m;
        let thinned = thin_from_lowest(all, cell_m);
        let position: Vec<Vec3> = thinned.kept.iter().map(|&i| all[i as usize]).collect();
        let grid = PointGrid::new(&position, cell_m * 2.0);
        let point_area_m2 =
            facts.map_or_else(|| point_area_of_m2(&position, &grid, cell_m), |f| f.point_area_m2);
        let spacing_m = point_area_m2.sqrt();
        let viewpoint = survey.sensor_positions.is_empty().then(|| {
            let known = facts.and_then(|f| f.viewpoint.clone());
            known.unwrap_or_else(|| Viewpoint::likeliest(&position, spacing_m, d_max_m))
        });
        let to_sensor = to_sensor(survey, viewpoint.as_ref(), &position, spacing_m, d_max_m);
        let radius_m = (2.6 * cell_m.max(spacing_m)).max(3.5 * noise_sd_m).min(0.3 * d_max_m);
        let normal = if survey.cloud.has_normals() {
            let given =
                thinned.kept.iter().map(|&i| survey.cloud.normal[i as usize].normalize_or_zero());
            facing(given.collect(), &to_sensor)
        } else {
            facing(geom::normals(&position, radius_m, &|_| Vec3::Z), &to_sensor)
        };
        let survey_spacing_m = facts.map_or_else(
            || point_area_of_m2(all, &PointGrid::new(all, cell_m * 2.0), cell_m).sqrt(),
            |f| f.survey_spacing_m,
        );
        let sight = match &viewpoint {
            Some(far) => Sight::from_afar(&position, &far.toward, spacing_m),
            None => Sight::new(&position, &survey.sensor_positions, spacing_m),
        };
        // A depth camera's floor has gone with the bin (`walls`): a plane through what it sees lowest may be the front of
        // the very parts looked for.
        let lowest = stated_bed.or_else(|| {
            (survey.sensor != SensorKind::DepthCamera)
                .then(|| lowest_plane(&position, d_max_m, noise_sd_m))
                .flatten()
        });
        let solid = survey.walls.iter().map(|&plane| Bed { plane, relief_m: 0.0 }).collect();
        Self {
            position,
            normal,
            viewpoint,
            to_sensor,
            thinned,
            grid,
            point_area_m2,
            spacing_m,
            survey_spacing_m,
            noise_sd_m,
            sight,
            smallest_d_max_m: d_max_m,
            lowest,
            stated_bed,
            solid,
        }
    }

    /// A working point as the fit wants it.
    pub fn fit_point(&self, i: u32) -> FitPoint {
        let i = i as usize;
        FitPoint {
            position: self.position[i],
            normal: self.normal[i],
            to_sensor: self.to_sensor[i],
        }
    }

    /// Working points of survey points, each once, ascending.
    pub fn working(&self, survey_points: &[u32]) -> Vec<u32> {
        let mut own: Vec<u32> = survey_points
            .iter()
            .map(|&i| self.thinned.cell_of_point[i as usize])
            .filter(|&o| o != u32::MAX)
            .collect();
        own.sort_unstable();
        own.dedup();
        own
    }
}

/// Unit direction from each point to the sensor that saw it.
pub fn to_sensor(
    survey: &Survey,
    viewpoint: Option<&Viewpoint>,
    points: &[Vec3],
    spacing_m: f32,
    d_max_m: f32,
) -> Vec<Vec3> {
    let near = |&p: &Vec3| toward_sensor(p, &survey.sensor_positions);
    viewpoint.map_or_else(
        || points.iter().map(near).collect(),
        |far| far.of_each(points, spacing_m, d_max_m),
    )
}

/// Normals turned to the sensors.
pub fn facing(mut normals: Vec<Vec3>, to_sensor: &[Vec3]) -> Vec<Vec3> {
    for (n, v) in normals.iter_mut().zip(to_sensor) {
        if n.dot(*v) < 0.0 {
            *n = -*n;
        }
    }
    normals
}

/// Unit direction from a point to the nearest sensor position; up when there is none.
pub fn toward_sensor(p: Vec3, sensors: &[Vec3]) -> Vec3 {
    let nearest = sensors
        .iter()
        .min_by(|a, b| (**a - p).length_squared().total_cmp(&(**b - p).length_squared()));
    nearest.and_then(|s| (*s - p).try_normalize()).unwrap_or(Vec3::Z)
}

/// Places whose scatter is looked at.
const SCATTER_PLACES: usize = 600;
/// Of the places' scatters this share is smaller than the noise: edges and curved faces scatter more.
const SCATTER_SHARE: f32 = 0.3;
/// Fewest neighbours of a place.
const SCATTER_FEWEST: usize = 8;
/// Only clearly more scatter than is usual for a sensor's kind counts.
const CLEARLY_NOISIER: f32 = 1.5;
/// Depth cameras differ more than parts do: their noise is what is measured, between these parts of d_max. Below, meshes and
/// the pixels of edges err more than the camera.
const LEAST_NOISE: f32 = 0.01;
const MOST_NOISE: f32 = 0.1;

/// Standard deviation of a point, metres: what is usual for the sensor's kind, or what points scatter about planes through
/// their neighbours where that is clearly more. Told 1 cm where it was 3 cm, not one of thirty blocks was sure enough.
/// Of a depth camera what is measured stands: told 5 mm where it was 0.5 mm, shafts 26 mm thick were out of reach.
pub fn noise_of_m(survey: &Survey, d_max_m: f32) -> f32 {
    let usual_m = survey.sensor.noise_sd_m(d_max_m);
    let points = &survey.cloud.position_m;
    let cell_m = d_max_m / 32.0;
    let grid = PointGrid::new(points, cell_m);
    let spacing_m = point_area_of_m2(points, &grid, cell_m).sqrt();
    let radius_m = (2.5 * spacing_m).max(0.05 * d_max_m).min(0.15 * d_max_m);
    let step = points.len().div_ceil(SCATTER_PLACES).max(1);
    let scatter = |&p: &Vec3| {
        let near: Vec<Vec3> =
            grid.within(p, radius_m).into_iter().map(|i| points[i as usize]).collect();
        let plane =
            (near.len() >= SCATTER_FEWEST).then(|| geom::Plane::through(&near)).flatten()?;
        let square: f32 = near.iter().map(|q| plane.distance_m(*q).powi(2)).sum();
        Some((square / (near.len() - 3) as f32).sqrt())
    };
    let mut found: Vec<f32> = points.iter().step_by(step).filter_map(scatter).collect();
    found.sort_by(f32::total_cmp);
    let noise_m = found.get((SCATTER_SHARE * found.len() as f32) as usize).copied();
    if survey.sensor == SensorKind::DepthCamera {
        return noise_m.unwrap_or(usual_m).clamp(LEAST_NOISE * d_max_m, MOST_NOISE * d_max_m);
    }
    noise_m
        .filter(|n| *n > CLEARLY_NOISIER * usual_m)
        .map_or(usual_m, |n| n.min(MOST_NOISE * d_max_m))
}

/// Median area of a point from the number of neighbours on a disc.
fn point_area_of_m2(position: &[Vec3], grid: &PointGrid, cell_m: f32) -> f32 {
    let step = position.len().div_ceil(500).max(1);
    let mut area: Vec<f32> = position
        .iter()
        .step_by(step)
        .map(|&p| {
            let (mut n, mut radius_m) = (0.0_f32, 3.0 * cell_m);
            // Sparse surveys need a wider disc.
            for _ in 0..4 {
                n = 0.0;
                grid.for_each_within(p, radius_m, |_, _, _| n += 1.0);
                if n >= 8.0 {
                    break;
                }
                radius_m *= 1.6;
            }
            std::f32::consts::PI * radius_m * radius_m / n.max(1.0)
        })
        .collect();
    area.sort_by(f32::total_cmp);
    area.get(area.len() / 2).copied().unwrap_or(cell_m * cell_m)
}

#[cfg(test)]
mod tests {
    use super::*;
    use geom::{Plane, PointCloud};
    use rand::RngExt;

    /// Of parts in bins 0.5 mm was once taken for 5 mm.
    #[test]
    fn the_noise_of_a_depth_camera_is_what_is_measured() {
        let mut rng = geom::SeedTree::new(3).rng();
        for (noise_m, low_m, high_m) in [(0.0, 0.0099, 0.0101), (0.03, 0.015, 0.036)] {
            let points = (0..6400).map(|i| {
                let off: f32 = (0..12).map(|_| rng.random::<f32>()).sum::<f32>() - 6.0;
                Vec3::new((i % 80) as f32 * 0.03, (i / 80) as f32 * 0.03, noise_m * off)
            });
            let survey = Survey {
                cloud: PointCloud::from_positions(points.collect()),
                sensor: SensorKind::DepthCamera,
                ..Survey::default()
            };
            let found_m = noise_of_m(&survey, 1.0);
            assert!((low_m..high_m).contains(&found_m), "{noise_m}: {found_m}");
        }
    }

    /// The back of a figure was once its own bed, so that every pose of the figure lay under the bed.
    #[test]
    fn a_depth_camera_has_no_bed_but_the_bin_it_was_told_of() {
        let flat = (0..900)
            .map(|i| Vec3::new((i % 30) as f32 * 0.1, (i / 30) as f32 * 0.1, 0.0))
            .collect();
        let survey = |sensor| Survey {
            cloud: PointCloud::from_positions(flat),
            sensor,
            ..Default::default()
        };
        let mut survey = survey(SensorKind::Uav);
        let measured = |survey: &Survey| Measured::new(survey, 0.05, 1.0, 0.01, None, None);
        assert!(measured(&survey).lowest.is_some());
        survey.sensor = SensorKind::DepthCamera;
        assert!(measured(&survey).lowest.is_none() && measured(&survey).solid.is_empty());
        survey.walls = vec![Plane { normal: Vec3::Z, offset_m: 0.0 }];
        assert_eq!(measured(&survey).solid.len(), 1);
    }
}
