//! What a bundle of rays sees: for every cell of a regular grid of rays the first surface hit.
//!
//! Triangles are projected to find the cells they may cover; in each cell the ray is intersected exactly. That is
//! ray casting with the loops swapped: a view of 16 000 triangles costs milliseconds instead of seconds. A
//! [`Projection`] decides the bundle: a camera's pinhole or an echo sounder's fan swept along its track.

use crate::targets::Targets;
use geom::Vec3;

/// A regular grid of rays.
pub(crate) trait Projection {
    /// Columns and rows.
    fn size(&self) -> [usize; 2];
    /// Column, row (continuous; cell centres at ½) and ray parameter of a point; `None` where the bundle cannot look.
    fn project(&self, point: Vec3) -> Option<[f32; 3]>;
    /// Origin and direction of the ray through a cell's centre; a point at parameter t is origin + t·direction.
    fn ray(&self, column: usize, row: usize) -> (Vec3, Vec3);
}

/// First hits of all rays.
pub(crate) struct RangeMap<P> {
    pub projection: P,
    /// Ray parameter, infinite where nothing is hit.
    pub range: Vec<f32>,
    /// Index of the triangle hit, `u32::MAX` for none.
    pub triangle: Vec<u32>,
}

/// A point counts as hidden when the first hit lies this much of its distance in front of it.
const TOLERANCE: f32 = 2e-4;

impl<P: Projection> RangeMap<P> {
    /// Casts all rays.
    pub fn render(projection: P, targets: &Targets) -> Self {
        let [columns, rows] = projection.size();
        let mut range = vec![f32::INFINITY; columns * rows];
        let mut triangle = vec![u32::MAX; columns * rows];
        for (t, corners) in targets.corners.iter().enumerate() {
            let n = targets.normal[t];
            let (a, b, c) =
                (projection.project(corners[0]), projection.project(corners[1]), projection.project(corners[2]));
            let (Some(a), Some(b), Some(c)) = (a, b, c) else { continue };
            let span = |axis: usize, size: usize| {
                let low = a[axis].min(b[axis]).min(c[axis]) - 0.5;
                let high = a[axis].max(b[axis]).max(c[axis]) - 0.5;
                (low.ceil().max(0.0) as usize, (high.floor() + 1.0).clamp(0.0, size as f32) as usize)
            };
            let ((u0, u1), (v0, v1)) = (span(0, columns), span(1, rows));
            let edge = |i: usize| n.cross(corners[(i + 1) % 3] - corners[i]);
            let edges = [edge(0), edge(1), edge(2)];
            // A hair outside counts as inside, so that neighbouring triangles leave no crack.
            let slack = [0, 1, 2].map(|i| -1e-5 * edges[i].length_squared());
            for row in v0..v1 {
                for column in u0..u1 {
                    let (origin, direction) = projection.ray(column, row);
                    let facing = n.dot(direction);
                    if facing >= 0.0 {
                        continue;
                    }
                    let t_hit = n.dot(corners[0] - origin) / facing;
                    let cell = row * columns + column;
                    if t_hit <= 0.0 || t_hit >= range[cell] {
                        continue;
                    }
                    let p = origin + direction * t_hit;
                    if (0..3).all(|i| edges[i].dot(p - corners[i]) >= slack[i]) {
                        range[cell] = t_hit;
                        triangle[cell] = t as u32;
                    }
                }
            }
        }
        Self { projection, range, triangle }
    }

    /// Whether a surface point with the normal is seen: its tangent plane is the first thing on at least two of the
    /// four rays around it. Wrong only within one cell of an outline.
    pub fn sees(&self, point: Vec3, normal: Vec3) -> bool {
        let Some([u, v, _]) = self.projection.project(point) else { return false };
        let [columns, rows] = self.projection.size();
        let (u, v) = (u - 0.5, v - 0.5);
        if !(0.0..(columns - 1) as f32).contains(&u) || !(0.0..(rows - 1) as f32).contains(&v) {
            return false;
        }
        let (u, v) = (u as usize, v as usize);
        let clear = [(u, v), (u + 1, v), (u, v + 1), (u + 1, v + 1)].into_iter().filter(|&(u, v)| {
            let (origin, direction) = self.projection.ray(u, v);
            let facing = normal.dot(direction);
            facing < 0.0 && {
                let t = normal.dot(point - origin) / facing;
                t > 0.0 && t <= self.range[v * columns + u] * (1.0 + TOLERANCE)
            }
        });
        clear.count() >= 2
    }
}
