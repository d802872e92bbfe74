//! Whether a block may still lie near its old place without being seen.
//!
//! In: the later survey's upper surface and the blocks recognised in it. Asked of a block that was not recognised again: is there a pose
//! within the reach of a pair in which it neither stands out of that surface nor inside another block, nor lower than
//! anything about it stood? If so, nobody can say that it is gone, however clearly its old place is empty.

use crate::body::Body;
use crate::single::Solids;
use geom::{DistanceField, HeightMap, PointGrid, Pose, Quat, Vec2, Vec3};
use scene::{Catalog, ModelId};

/// The later epoch as it is asked for room.
pub(crate) struct Room<'a> {
    catalog: &'a Catalog,
    solids: &'a Solids,
    later: &'a [Body],
    centres: PointGrid,
    top: HeightMap,
    /// Points of the survey this much above a place do not yet show that it is free.
    near_m: f32,
    /// Lowest heights of the earlier blocks, by their centres.
    lowest: PointGrid,
    lowest_m: Vec<f32>,
    reach_blocks: f32,
}

/// Cell of the surface, in block lengths.
const CELL_BLOCKS: f32 = 0.06;
/// Places inside a block that are asked about, about.
const PLACES: usize = 90;
/// Distance of the poses tried, in block lengths, and their turns, radians.
const STEP_BLOCKS: f32 = 0.125;
const TURN_RAD: f32 = 0.35;
/// A hidden block went hardly up, in block lengths.
const UP_BLOCKS: f32 = 0.15;
/// Another block's inside begins this deep, in block lengths: poses have errors.
const DEEP_BLOCKS: f32 = 0.04;
/// A block stands at most so much lower than anything about it stood, in block lengths.
const LOWER_BLOCKS: f32 = 0.08;

impl<'a> Room<'a> {
    /// Of blocks and points (frame of the comparison); points within `near_m` lie on the surface.
    pub fn new(
        catalog: &'a Catalog,
        solids: &'a Solids,
        bodies: [&[Body]; 2],
        later: &'a [Body],
        points: &[Vec3],
        near_m: f32,
        reach_blocks: f32,
    ) -> Self {
        let size_m = catalog.iter().map(|(_, m)| m.d_box_m).fold(1e-3, f32::max);
        let mut low = Vec2::splat(f32::INFINITY);
        let mut high = Vec2::splat(f32::NEG_INFINITY);
        for body in bodies.into_iter().flatten() {
            low = low.min(body.centre.as_vec3().truncate() - 2.0 * size_m);
            high = high.max(body.centre.as_vec3().truncate() + 2.0 * size_m);
        }
        if !(low.x <= high.x) {
            (low, high) = (Vec2::ZERO, Vec2::ZERO);
        }
        let mut top = HeightMap::empty(low, high, CELL_BLOCKS * size_m);
        top.raise_points(points);
        let centres: Vec<Vec3> = later.iter().map(|b| b.centre.as_vec3()).collect();
        let earlier: Vec<Vec3> = bodies[0].iter().map(|b| b.centre.as_vec3()).collect();
        let lowest_m = bodies[0].iter().map(|b| lowest_m(b, catalog)).collect();
        Self {
            catalog,
            solids,
            later,
            centres: PointGrid::new(&centres, size_m),
            top,
            near_m,
            lowest: PointGrid::new(&earlier, 1.5 * size_m),
            lowest_m,
            reach_blocks,
        }
    }

    /// The least share of the block that contradicts the later survey, over all poses within reach: 0: it may well lie there unseen.
    pub fn least_contradiction(&self, body: &Body) -> f64 {
        let model = self.catalog.get(body.model);
        let size_m = model.d_box_m;
        let Some(field) = self.solid(body.model) else { return 0.0 };
        let inside = inside(field);
        let place = body.centre.as_vec3();
        let mut floor_m = lowest_m(body, self.catalog);
        self.lowest.for_each_within(place, 1.5 * size_m, |i, _, _| {
            floor_m = floor_m.min(self.lowest_m[i as usize]);
        });
        floor_m -= LOWER_BLOCKS * size_m;
        let mut near = Vec::new();
        self.centres.for_each_within(
            place,
            self.reach_blocks * size_m + 2.0 * model.d_max_m,
            |i, _, _| near.push(&self.later[i as usize]),
        );
        let near: Vec<(Pose, &DistanceField)> = near
            .into_iter()
            .filter_map(|b| Some((b.pose(self.catalog.get(b.model)), self.solid(b.model)?)))
            .collect();
        let mut least = inside.len();
        let steps = (self.reach_blocks / STEP_BLOCKS).floor() as i32;
        let limit2 = (self.reach_blocks / STEP_BLOCKS).powi(2);
        let rotation = body.rotation.as_quat();
        for turn in turns() {
            let rotation = turn * rotation;
            let vertices = || model.mesh.vertices.iter();
            let under_m = vertices()
                .map(|v| (rotation * (*v - model.centre)).z)
                .fold(f32::INFINITY, f32::min);
            for (x, y, z) in lattice(steps) {
                let step = Vec3::new(x as f32, y as f32, z as f32);
                if step.length_squared() > limit2 || step.z * STEP_BLOCKS > UP_BLOCKS {
                    continue;
                }
                let centre = place + step * STEP_BLOCKS * size_m;
                if centre.z + under_m < floor_m {
                    continue;
                }
                let pose = Pose::from_parts(centre - rotation * model.centre, rotation);
                least = least.min(self.contradicting(&inside, &pose, &near, size_m, least));
                if least == 0 {
                    return 0.0;
                }
            }
        }
        least as f64 / inside.len().max(1) as f64
    }

    /// Places of the block that cannot be inside one there; stops counting at `enough`.
    fn contradicting(
        &self,
        inside: &[Vec3],
        pose: &Pose,
        near: &[(Pose, &DistanceField)],
        size_m: f32,
        enough: usize,
    ) -> usize {
        let mut count = 0;
        for p in inside {
            let q = pose.transform_point(*p);
            let stands_out = self
                .top
                .cell_of(q.x, q.y)
                .is_some_and(|(x, y)| q.z > self.top.at(x, y) + self.near_m);
            let taken = || {
                near.iter().any(|(other, solid)| {
                    solid.distance_m(other.inverse_transform_point(q)) < -DEEP_BLOCKS * size_m
                })
            };
            if stands_out || taken() {
                count += 1;
                if count >= enough {
                    break;
                }
            }
        }
        count
    }

    fn solid(&self, model: ModelId) -> Option<&DistanceField> {
        crate::single::solid(self.solids, self.catalog, model)
    }
}

fn lowest_m(body: &Body, catalog: &Catalog) -> f32 {
    let model = catalog.get(body.model);
    let pose = body.pose(model);
    let heights = model.mesh.vertices.iter().map(|v| pose.transform_point(*v).z);
    heights.fold(f32::INFINITY, f32::min)
}

/// Places inside a solid on a lattice, block coordinates.
fn inside(field: &DistanceField) -> Vec<Vec3> {
    let bounds = field.bounds();
    let size = bounds.size();
    // A tetrapod fills a sixth of its box; a lattice of so many places holds about `PLACES` inside.
    let step = (size.x * size.y * size.z / (6 * PLACES) as f32).cbrt().max(1e-6);
    let count = |v: f32| (v / step) as i32;
    let mut out = Vec::new();
    for x in 0..=count(size.x) {
        for y in 0..=count(size.y) {
            for z in 0..=count(size.z) {
                let p = bounds.min + (Vec3::new(x as f32, y as f32, z as f32) + 0.5) * step;
                if field.distance_m(p) < 0.0 {
                    out.push(p);
                }
            }
        }
    }
    out
}

/// No turn and one either way about each axis and each diagonal.
fn turns() -> Vec<Quat> {
    let axes = [
        Vec3::X,
        Vec3::Y,
        Vec3::Z,
        Vec3::new(1.0, 1.0, 0.0),
        Vec3::new(1.0, -1.0, 0.0),
        Vec3::new(0.0, 1.0, 1.0),
        Vec3::new(1.0, 0.0, 1.0),
    ];
    let about = |a: Vec3, angle: f32| Quat::from_axis_angle(a.normalize(), angle);
    let both = axes.into_iter().flat_map(|a| [about(a, TURN_RAD), about(a, -TURN_RAD)]);
    std::iter::once(Quat::IDENTITY).chain(both).collect()
}

fn lattice(steps: i32) -> impl Iterator<Item = (i32, i32, i32)> {
    let axis = move || -steps..=steps;
    axis().flat_map(move |x| axis().flat_map(move |y| axis().map(move |z| (x, y, z))))
}
