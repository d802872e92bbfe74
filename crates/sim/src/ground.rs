//! A [`Ground`] as a collider: a thick slab for planes, a height field for grids.
//!
//! Slabs, not half-spaces: against a half-space parry 0.31 tests four corners of the nearest hull face only, and
//! a tetrapod's round tip sinks in by its radius.

use geom::{Bounds, Pose, Quat, Vec3};
use rapier3d::parry::utils::Array2;
use rapier3d::prelude::{ColliderBuilder, HeightField, HeightFieldFlags, SharedShape};
use scene::Ground;

/// How far below the lowest node a grid is backed by a solid floor, in units.
const FLOOR_DEPTH: f32 = 2.0;
/// Thickness of floors and walls, in units.
const THICKNESS: f32 = 20.0;
/// How far a floor reaches past the bounds, in units.
const MARGIN: f32 = 20.0;
/// How far a wall reaches to each side of its point, in units.
const WALL_REACH: f32 = 250.0;

/// The colliders of the ground inside `bounds` (used for grids: outside them no height field is built), in engine units.
pub(crate) fn colliders(ground: &Ground, bounds: &Bounds, unit_m: f32) -> Vec<ColliderBuilder> {
    let bounds = &Bounds { min: bounds.min / unit_m, max: bounds.max / unit_m };
    match ground {
        Ground::Level { z_m } => vec![floor(bounds, Vec3::Z * (z_m / unit_m), Vec3::Z)],
        Ground::Plane { point, normal } => vec![floor(bounds, *point / unit_m, *normal)],
        Ground::Grid { origin, cell_m, nx, z_m } => {
            let (origin, cell) = (origin.map(|o| o / unit_m), cell_m / unit_m);
            let z: Vec<f32> = z_m.iter().map(|z| z / unit_m).collect();
            let window = Window::around(bounds, origin, cell, *nx, z.len() / nx);
            let lowest = window.heights(&z, *nx).fold(f32::INFINITY, f32::min);
            vec![
                window.height_field(&z, *nx, origin, cell),
                floor(bounds, Vec3::Z * (lowest - FLOOR_DEPTH), Vec3::Z),
            ]
        }
    }
}

/// A slab under the middle of `bounds` that reaches well past them.
fn floor(bounds: &Bounds, point: Vec3, normal: Vec3) -> ColliderBuilder {
    let normal = normal.normalize();
    let middle = bounds.centre();
    let below = middle - normal * normal.dot(middle - point);
    let reach = 0.5 * bounds.size().max_element() + MARGIN;
    slab(below, normal, reach)
}

/// A wall through `point` (engine units); what lies behind it, against the normal, is solid.
pub(crate) fn wall(point: Vec3, inward_normal: Vec3) -> ColliderBuilder {
    slab(point, inward_normal.normalize(), WALL_REACH)
}

fn slab(surface: Vec3, normal: Vec3, reach: f32) -> ColliderBuilder {
    let pose = Pose::from_parts(
        surface - normal * (THICKNESS / 2.0),
        Quat::from_rotation_arc(Vec3::Z, normal),
    );
    ColliderBuilder::cuboid(reach, reach, THICKNESS / 2.0).position(pose)
}

/// A rectangle of grid nodes, at least 2 × 2, half-open.
struct Window {
    x: [usize; 2],
    y: [usize; 2],
}

impl Window {
    fn around(bounds: &Bounds, origin: [f32; 2], cell: f32, nx: usize, ny: usize) -> Self {
        let axis = |low: f32, high: f32, start: f32, count: usize| {
            let last = count.saturating_sub(2) as f32;
            let first = ((low - start) / cell).floor().clamp(0.0, last) as usize;
            let end = ((high - start) / cell).ceil().clamp(first as f32 + 1.0, (count - 1) as f32)
                as usize;
            [first, end + 1]
        };
        Self {
            x: axis(bounds.min.x, bounds.max.x, origin[0], nx),
            y: axis(bounds.min.y, bounds.max.y, origin[1], ny),
        }
    }

    /// Heights column by column, each from the last row to the first: the order of the height field.
    fn heights<'a>(&'a self, z: &'a [f32], nx: usize) -> impl Iterator<Item = f32> + 'a {
        (self.x[0]..self.x[1])
            .flat_map(move |ix| (self.y[0]..self.y[1]).rev().map(move |iy| z[iy * nx + ix]))
    }

    fn height_field(&self, z: &[f32], nx: usize, origin: [f32; 2], cell: f32) -> ColliderBuilder {
        let (columns, rows) = (self.x[1] - self.x[0], self.y[1] - self.y[0]);
        let heights = Array2::new(rows, columns, self.heights(z, nx).collect());
        let size = Vec3::new((columns - 1) as f32 * cell, 1.0, (rows - 1) as f32 * cell);
        // One-sided with smoothed internal edges: blocks neither trip over cell borders nor sink through them.
        let field = HeightField::with_flags(heights, size, HeightFieldFlags::FIX_INTERNAL_EDGES);
        let middle =
            |range: [usize; 2], start: f32| start + 0.5 * (range[0] + range[1] - 1) as f32 * cell;
        // The field's height is y and its rows run along z; turned so that y becomes z, rows run along −y.
        let turn = Quat::from_rotation_x(std::f32::consts::FRAC_PI_2);
        let place = Vec3::new(middle(self.x, origin[0]), middle(self.y, origin[1]), 0.0);
        ColliderBuilder::new(SharedShape::new(field)).position(Pose::from_parts(place, turn))
    }
}
