//! The survey as the search sees it: thinned to an even spacing, with normals, directions to the sensor, a bed.
//!
//! Everything the search and the verification ask of the points goes through here, so that a survey of a million
//! points costs little more than one of a hundred thousand.

use crate::fit::FitPoint;
use crate::sight::Sight;
use geom::{Thinned, thin_from_lowest};
use geom::{Bounds, Plane, PointGrid, SeedTree, Vec3, find_plane};
use scene::{SensorKind, Survey};

/// The working cloud.
pub struct Measured {
    /// Positions.
    pub position: Vec<Vec3>,
    /// Unit normals facing the sensor; zero where there is none.
    pub normal: Vec<Vec3>,
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
    /// The bed under the pile, where there is one.
    pub bed: Option<Bed>,
    /// What no block reaches into: the bed, and the floor and walls of a bin.
    pub solid: Vec<Bed>,
}

/// A bed: stones stand out of its plane and gaps reach below.
#[derive(Clone, Copy, Debug)]
pub struct Bed {
    /// Its middle.
    pub plane: Plane,
    /// How far it reaches above and below the plane, metres.
    pub relief_m: f32,
}

impl Measured {
    /// Prepares the survey for blocks of the given smallest d_max.
    pub fn new(
        survey: &Survey,
        cell_m: f32,
        d_max_m: f32,
        noise_sd_m: f32,
        seed: SeedTree,
    ) -> Self {
        let all = &survey.cloud.position_m;
        let thinned = thin_from_lowest(all, cell_m);
        let position: Vec<Vec3> = thinned.kept.iter().map(|&i| all[i as usize]).collect();
        let grid = PointGrid::new(&position, cell_m * 2.0);
        let to_sensor: Vec<Vec3> =
            position.iter().map(|&p| toward_sensor(p, &survey.sensor_positions)).collect();
        let point_area_m2 = point_area_of_m2(&position, &grid, cell_m);
        let spacing_m = point_area_m2.sqrt();
        let radius_m = (2.6 * cell_m.max(spacing_m)).max(3.5 * noise_sd_m).min(0.3 * d_max_m);
        let normal = if survey.cloud.has_normals() {
            let given =
                thinned.kept.iter().map(|&i| survey.cloud.normal[i as usize].normalize_or_zero());
            given.zip(&to_sensor).map(|(n, v)| if n.dot(*v) < 0.0 { -n } else { n }).collect()
        } else {
            let direction = |p: Vec3| toward_sensor(p, &survey.sensor_positions);
            geom::normals(&position, radius_m, &direction)
        };
        let everything = PointGrid::new(all, cell_m * 2.0);
        let survey_spacing_m = point_area_of_m2(all, &everything, cell_m).sqrt();
        let sight = Sight::new(&position, &survey.sensor_positions, spacing_m);
        // A depth camera's floor has gone with the bin (`walls`): a plane through what it sees lowest may be the front of
        // the very parts looked for, and all of them would lie under it.
        let bed = (survey.sensor != SensorKind::DepthCamera)
            .then(|| bed(&position, d_max_m, noise_sd_m, seed))
            .flatten();
        let walls = survey.walls.iter().map(|&plane| Bed { plane, relief_m: 0.0 });
        let solid = bed.into_iter().chain(walls).collect();
        Self {
            position,
            normal,
            to_sensor,
            thinned,
            grid,
            point_area_m2,
            spacing_m,
            survey_spacing_m,
            noise_sd_m,
            sight,
            bed,
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

/// Unit direction from a point to the nearest sensor position; straight up when none is known.
pub fn toward_sensor(p: Vec3, sensors: &[Vec3]) -> Vec3 {
    let nearest = sensors
        .iter()
        .min_by(|a, b| (**a - p).length_squared().total_cmp(&(**b - p).length_squared()));
    nearest.and_then(|s| (*s - p).try_normalize()).unwrap_or(Vec3::Z)
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

/// The plane the lowest points lie on, if they do: a bed or a floor has nothing but outliers below it. Rubble of
/// stones up to a quarter of a block still counts as a plane with relief.
fn bed(position: &[Vec3], d_max_m: f32, noise_sd_m: f32, seed: SeedTree) -> Option<Bed> {
    let bounds = Bounds::of(position.iter().copied());
    if bounds.is_empty() {
        return None;
    }
    // Low points: near the lowest of their column one block wide.
    let cell = 0.75 * d_max_m;
    let nx = (bounds.size().x / cell) as usize + 1;
    let ny = (bounds.size().y / cell) as usize + 1;
    let column = |p: Vec3| {
        let at = (p - bounds.min) / cell;
        (at.y as usize).min(ny - 1) * nx + (at.x as usize).min(nx - 1)
    };
    let mut lowest = vec![f32::INFINITY; nx * ny];
    for &p in position {
        let low = &mut lowest[column(p)];
        *low = low.min(p.z);
    }
    let thickness_m = (3.0 * noise_sd_m).max(0.08 * d_max_m);
    let low: Vec<Vec3> =
        position.iter().copied().filter(|&p| p.z < lowest[column(p)] + 3.0 * thickness_m).collect();
    let (plane, inliers) = find_plane(&low, thickness_m, Some(0.6), seed)?;
    let below = position.iter().filter(|&&p| plane.distance_m(p) < -3.0 * thickness_m).count();
    if inliers * 10 < low.len() || below * 50 > position.len() {
        return None;
    }
    let square: f32 = low
        .iter()
        .map(|&p| plane.distance_m(p))
        .filter(|d| d.abs() <= thickness_m)
        .map(|d| d * d)
        .sum();
    Some(Bed { plane, relief_m: 2.0 * (square / inliers as f32).sqrt() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use geom::PointCloud;

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
        let measured = |survey: &Survey| Measured::new(survey, 0.05, 1.0, 0.01, SeedTree::new(1));
        assert!(measured(&survey).bed.is_some());
        survey.sensor = SensorKind::DepthCamera;
        assert!(measured(&survey).solid.is_empty());
        survey.walls = vec![Plane { normal: Vec3::Z, offset_m: 0.0 }];
        assert_eq!(measured(&survey).solid.len(), 1);
    }
}
