//! The rays of an echo sounder along one straight pass: a fan across the track, swept along it.

use crate::range_map::Projection;
use geom::Vec3;

/// A pass over the scene. Columns run along the track, rows across, from the left edge of the fan to the right.
#[derive(Clone, Debug)]
pub(crate) struct Swath {
    /// Where the track starts; rays leave from the track.
    pub start: Vec3,
    /// Unit direction of travel, horizontal.
    pub along: Vec3,
    /// Unit direction to the right of travel, horizontal.
    pub across: Vec3,
    /// Spacing of the fans, metres.
    pub step_m: f32,
    /// Angle of the first row's edge, from straight down towards `across`.
    pub first_rad: f32,
    /// Angle between rows.
    pub step_rad: f32,
    columns: usize,
    /// Direction of each row.
    directions: Vec<Vec3>,
}

impl Swath {
    /// A pass of `length_m` with rays from `first_rad` to `last_rad` off the vertical.
    pub fn new(
        start: Vec3,
        along: Vec3,
        length_m: f32,
        step_m: f32,
        fan_rad: [f32; 2],
        step_rad: f32,
    ) -> Self {
        let across = along.cross(Vec3::Z);
        let columns = (length_m / step_m).ceil() as usize + 1;
        let rows = ((fan_rad[1] - fan_rad[0]) / step_rad).ceil() as usize + 1;
        let direction = |row: usize| {
            let (sin, cos) = (fan_rad[0] + (row as f32 + 0.5) * step_rad).sin_cos();
            across * sin - Vec3::Z * cos
        };
        let directions = (0..rows).map(direction).collect();
        Self { start, along, across, step_m, first_rad: fan_rad[0], step_rad, columns, directions }
    }

    /// Length of the track.
    pub fn length_m(&self) -> f32 {
        (self.columns - 1) as f32 * self.step_m
    }

    /// Places on the track, `every_m` apart.
    pub fn track(&self, every_m: f32) -> impl Iterator<Item = Vec3> + '_ {
        let count = (self.length_m() / every_m) as usize + 1;
        (0..count).map(move |i| self.start + self.along * (i as f32 * every_m))
    }

    /// The cell whose ray is nearest to an angle from a place of the track.
    pub fn cell(&self, along_m: f32, angle_rad: f32) -> Option<usize> {
        let (u, v) = (along_m / self.step_m, (angle_rad - self.first_rad) / self.step_rad);
        let inside =
            u >= 0.0 && v >= 0.0 && u < self.columns as f32 && v < self.directions.len() as f32;
        inside.then(|| v as usize * self.columns + u as usize)
    }

    /// Origin and direction of the ray at an angle from a place of the track.
    pub fn exact_ray(&self, along_m: f32, angle_rad: f32) -> (Vec3, Vec3) {
        let (sin, cos) = angle_rad.sin_cos();
        (self.start + self.along * along_m, self.across * sin - Vec3::Z * cos)
    }

    /// The point at a range on the ray with the angle, from the place `along_m` of the track.
    pub fn point(&self, along_m: f32, angle_rad: f32, range_m: f32) -> Vec3 {
        let (sin, cos) = angle_rad.sin_cos();
        self.start + self.along * along_m + self.across * (range_m * sin)
            - Vec3::Z * (range_m * cos)
    }
}

impl Projection for Swath {
    fn size(&self) -> [usize; 2] {
        [self.columns, self.directions.len()]
    }

    fn project(&self, point: Vec3) -> Option<[f32; 3]> {
        let d = point - self.start;
        let (side, down) = (d.dot(self.across), -d.z);
        if down <= 0.0 {
            return None;
        }
        let angle = side.atan2(down);
        Some([
            d.dot(self.along) / self.step_m,
            (angle - self.first_rad) / self.step_rad,
            side.hypot(down),
        ])
    }

    fn faces(&self, point: Vec3, normal: Vec3) -> bool {
        let d = point - self.start;
        normal.dot(d - self.along * d.dot(self.along)) < 0.0
    }

    fn row_plane(&self, row: usize) -> (Vec3, f32) {
        let normal = self.directions[row].cross(self.along);
        (normal, normal.dot(self.start))
    }

    fn ray(&self, column: usize, row: usize) -> (Vec3, Vec3) {
        (self.start + self.along * ((column as f32 + 0.5) * self.step_m), self.directions[row])
    }
}
