//! Whether a block has room in a pose, asked many thousand times of the same surroundings.
//!
//! In: a [`World`] and the block that is carried through it. Out: yes or no for any pose. Measured exactly on the hulls.

use crate::contacts::lowest;
use crate::{BlockShape, World};
use geom::{Pose, Vec3};
use rapier3d::parry::bounding_volume::{Aabb, BoundingVolume};
use rapier3d::parry::query;
use rapier3d::prelude::SharedShape;
use std::sync::Arc;

/// The surroundings as they stand, and the hulls of the block that is carried.
pub struct Passage {
    unit_m: f32,
    hulls: Arc<[SharedShape]>,
    /// Hulls of the other blocks in their places.
    others: Vec<(Aabb, Pose, SharedShape)>,
    /// Ground and walls.
    statics: Vec<(SharedShape, Pose)>,
}

impl World {
    /// Everything that is in it now, for carrying `shape` through.
    pub fn passage(&self, shape: &BlockShape) -> Passage {
        let unit_m = self.config.length_unit_m;
        let mut others = Vec::new();
        for id in self.ids() {
            let body = self.body(id).expect("ids lists bodies that are there");
            let at = self.physics.bodies.get(body.handle).map_or(Pose::IDENTITY, |b| *b.position());
            others.extend(body.hulls.iter().map(|h| (h.compute_aabb(&at), at, h.clone())));
        }
        let statics = self.statics().map(|(_, shape, at)| (shape.clone(), at)).collect();
        Passage { unit_m, hulls: shape.hulls_in(unit_m), others, statics }
    }
}

impl Passage {
    /// Whether everything is farther than `gap_m` (0 or more) from the block in this pose.
    pub fn is_clear(&self, site_from_block: &Pose, gap_m: f32) -> bool {
        let (gap, unit_m) = (gap_m / self.unit_m, self.unit_m);
        let at = Pose::from_parts(site_from_block.translation / unit_m, site_from_block.rotation);
        self.hulls.iter().all(|hull| {
            let near = hull.compute_aabb(&at).loosened(gap);
            let meets = |(edges, place, other): &(Aabb, Pose, SharedShape)| {
                near.intersects(edges) && touches(&at, hull, place, other, gap)
            };
            !self.others.iter().any(meets)
                && !self
                    .statics
                    .iter()
                    .any(|(shape, place)| on_static(&at, hull, place, shape, gap))
        })
    }
}

fn touches(at_a: &Pose, a: &SharedShape, at_b: &Pose, b: &SharedShape, gap: f32) -> bool {
    // An unsupported pair cannot come up: hulls meet hulls and triangles only.
    query::contact(at_a, a.0.as_ref(), at_b, b.0.as_ref(), gap).is_ok_and(|c| c.is_some())
}

fn on_static(at: &Pose, hull: &SharedShape, place: &Pose, shape: &SharedShape, gap: f32) -> bool {
    let mut met = false;
    if let Some(slab) = shape.as_cuboid() {
        let normal = place.rotation * Vec3::Z;
        let surface = place.transform_point(Vec3::Z * slab.half_extents.z);
        lowest(at, hull, surface, normal, gap, &mut |_, _, _| met = true);
    } else if let Some(field) = shape.as_heightfield() {
        let local = hull.compute_aabb(&place.inv_mul(at)).loosened(gap);
        field.map_elements_in_local_aabb(&local, &mut |_, triangle| {
            met |= query::contact(at, hull.0.as_ref(), place, triangle, gap)
                .is_ok_and(|c| c.is_some());
        });
    }
    met
}
