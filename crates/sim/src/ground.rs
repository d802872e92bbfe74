//! A [`Ground`] as a collider: a thick slab for planes, a height field for grids.
//!
//! Slabs, not half-spaces: against a half-space parry 0.31 tests four corners of the nearest hull face only, and
//! a tetrapod's round tip sinks in by its radius.

use geom::{Bounds, Pose, Quat, Vec3};
use rapier3d::parry::utils::Array2;
use rapier3d::prelude::{ColliderBuilder, HeightField, HeightFieldFlags, SharedShape};
use scene::Ground;

/// How far below the lowest node a grid is backed by a solid floor, in lengths of the unit block.
const FLOOR_DEPTH: f32 = 2.0;
/// Thickness of floors and walls, in lengths of the unit block.
const THICKNESS: f32 = 20.0;
/// How far a floor reaches past the bounds, in lengths of the unit block.
const MARGIN: f32 = 20.0;
/// How far a wall reaches to each side of its point, in lengths of the unit block.
const WALL_REACH: f32 = 250.0;

/// The colliders of the ground inside `bounds` (used for grids: outside them no height field is built).
pub(crate) fn colliders(ground: &Ground, bounds: &Bounds, unit_m: f32) -> Vec<ColliderBuilder> {
    match ground {
        Ground::Level { z_m } => vec![floor(bounds, Vec3::Z * *z_m, Vec3::Z, unit_m)],
        Ground::Plane { point, normal } => vec![floor(bounds, *point, *normal, unit_m)],
        Ground::Grid { origin, cell_m, nx, z_m } => {
            let window = Window::around(bounds, *origin, *cell_m, *nx, z_m.len() / nx);
            let lowest = window.heights(z_m, *nx).fold(f32::INFINITY, f32::min);
            vec![
                window.height_field(z_m, *nx, *origin, *cell_m),
                floor(bounds, Vec3::Z * (lowest - FLOOR_DEPTH * unit_m), Vec3::Z, unit_m),
            ]
        }
    }
}

/// A slab under the middle of `bounds` that reaches well past them.
fn floor(bounds: &Bounds, point: Vec3, normal: Vec3, unit_m: f32) -> ColliderBuilder {
    let normal = normal.normalize();
    let middle = bounds.centre();
    let below = middle - normal * normal.dot(middle - point);
    let reach = 0.5 * bounds.size().max_element() + MARGIN * unit_m;
    slab(below, normal, reach, unit_m)
}

/// A wall through `point`; what lies behind it, against the normal, is solid.
pub(crate) fn wall(point: Vec3, inward_normal: Vec3, unit_m: f32) -> ColliderBuilder {
    slab(point, inward_normal.normalize(), WALL_REACH * unit_m, unit_m)
}

fn slab(surface: Vec3, normal: Vec3, reach_m: f32, unit_m: f32) -> ColliderBuilder {
    let thickness = THICKNESS * unit_m;
    let pose = Pose::from_parts(surface - normal * (thickness / 2.0), Quat::from_rotation_arc(Vec3::Z, normal));
    ColliderBuilder::cuboid(reach_m, reach_m, thickness / 2.0).position(pose)
}

/// A rectangle of grid nodes, at least 2 × 2, half-open.
struct Window {
    x: [usize; 2],
    y: [usize; 2],
}

impl Window {
    fn around(bounds: &Bounds, origin: [f32; 2], cell_m: f32, nx: usize, ny: usize) -> Self {
        let axis = |low: f32, high: f32, start: f32, count: usize| {
            let last = count.saturating_sub(2) as f32;
            let first = ((low - start) / cell_m).floor().clamp(0.0, last) as usize;
            let end = ((high - start) / cell_m).ceil().clamp(first as f32 + 1.0, (count - 1) as f32) as usize;
            [first, end + 1]
        };
        Self { x: axis(bounds.min.x, bounds.max.x, origin[0], nx), y: axis(bounds.min.y, bounds.max.y, origin[1], ny) }
    }

    /// Heights column by column, each from the last row to the first: the order of the height field.
    fn heights<'a>(&'a self, z_m: &'a [f32], nx: usize) -> impl Iterator<Item = f32> + 'a {
        (self.x[0]..self.x[1]).flat_map(move |ix| (self.y[0]..self.y[1]).rev().map(move |iy| z_m[iy * nx + ix]))
    }

    fn height_field(&self, z_m: &[f32], nx: usize, origin: [f32; 2], cell_m: f32) -> ColliderBuilder {
        let (columns, rows) = (self.x[1] - self.x[0], self.y[1] - self.y[0]);
        let heights = Array2::new(rows, columns, self.heights(z_m, nx).collect());
        let size = Vec3::new((columns - 1) as f32 * cell_m, 1.0, (rows - 1) as f32 * cell_m);
        // One-sided with smoothed internal edges: blocks neither trip over cell borders nor sink through them.
        let field = HeightField::with_flags(heights, size, HeightFieldFlags::FIX_INTERNAL_EDGES);
        let middle = |range: [usize; 2], start: f32| start + 0.5 * (range[0] + range[1] - 1) as f32 * cell_m;
        // The field's height is y and its rows run along z; turned so that y becomes z, rows run along −y.
        let turn = Quat::from_rotation_x(std::f32::consts::FRAC_PI_2);
        let place = Vec3::new(middle(self.x, origin[0]), middle(self.y, origin[1]), 0.0);
        ColliderBuilder::new(SharedShape::new(field)).position(Pose::from_parts(place, turn))
    }
}
