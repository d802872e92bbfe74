//! Who touches whom, and how deep. Measured exactly on the hulls: the engine's own contact list may lag behind the poses.

use crate::world::{Body, BodyId, Touched, World, touched};
use geom::{Pose, Vec3};
use rapier3d::parry::bounding_volume::{Aabb, BoundingVolume};
use rapier3d::parry::query;
use rapier3d::prelude::{Shape, SharedShape};

/// One place where two convex hulls meet. Two blocks may have several.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// What is touched.
    pub other: Touched,
    /// Where, local frame, on the surface of the other.
    pub point: Vec3,
    /// Unit normal of the other's surface, pointing at the asked block.
    pub normal: Vec3,
    /// Overlap; negative when there is a gap within the contact margin.
    pub depth_m: f32,
}

/// A gap below this many length units counts as contact.
const MARGIN: f32 = 0.01;

impl World {
    /// Contacts of a block with everything else, gaps below 1 % of the length unit included; other blocks in order, then ground and walls.
    pub fn contacts(&self, id: BodyId) -> Vec<Contact> {
        let Some(body) = self.body(id) else { return Vec::new() };
        let unit_m = self.config.length_unit_m;
        let mut contacts = Vec::new();
        for other in self.ids().filter(|o| *o != id) {
            let neighbour = self.body(other).expect("ids lists bodies that are there");
            self.between(body, neighbour, MARGIN, |point, normal, depth| {
                let (point, depth_m) = (point * unit_m, depth * unit_m);
                contacts.push(Contact { other: Touched::Block(other), point, normal, depth_m });
            });
        }
        for (what, shape, place) in self.statics() {
            self.against_static(body, shape, &place, MARGIN, |point, normal, depth| {
                let (point, depth_m) = (point * unit_m, depth * unit_m);
                contacts.push(Contact { other: what, point, normal, depth_m });
            });
        }
        contacts
    }

    /// Deepest overlap of a block that was ever free to move with anything else, metres; 0 without overlap.
    pub fn deepest_overlap_m(&self) -> f32 {
        let mut deepest = 0.0_f32;
        let ids: Vec<BodyId> = self.ids().collect();
        for (i, &a) in ids.iter().enumerate() {
            let first = self.body(a).expect("ids lists bodies that are there");
            for &b in &ids[i + 1..] {
                let second = self.body(b).expect("ids lists bodies that are there");
                if first.placed || second.placed {
                    self.between(first, second, 0.0, |_, _, depth| deepest = deepest.max(depth));
                }
            }
            if first.placed {
                for (_, shape, place) in self.statics() {
                    self.against_static(first, shape, &place, 0.0, |_, _, depth| {
                        deepest = deepest.max(depth)
                    });
                }
            }
        }
        deepest * self.config.length_unit_m
    }

    fn place(&self, body: &Body) -> Pose {
        self.physics.bodies.get(body.handle).map_or(Pose::IDENTITY, |b| *b.position())
    }

    pub(crate) fn statics(&self) -> impl Iterator<Item = (Touched, &SharedShape, Pose)> {
        self.physics
            .colliders
            .iter()
            .filter(|(_, c)| c.parent().is_none())
            .map(|(_, c)| (touched(c.user_data), c.shared_shape(), *c.position()))
    }

    fn between(&self, a: &Body, b: &Body, margin: f32, mut found: impl FnMut(Vec3, Vec3, f32)) {
        let (at_a, at_b) = (self.place(a), self.place(b));
        if (at_a * a.centre).distance(at_b * b.centre) > a.reach + b.reach + margin {
            return;
        }
        let boxes: Vec<Aabb> =
            b.hulls.iter().map(|h| h.compute_aabb(&at_b).loosened(margin)).collect();
        for hull_a in a.hulls.iter() {
            let box_a = hull_a.compute_aabb(&at_a);
            for (hull_b, box_b) in b.hulls.iter().zip(&boxes) {
                if box_a.intersects(box_b) {
                    measure(&at_a, hull_a.0.as_ref(), &at_b, hull_b.0.as_ref(), margin, &mut found);
                }
            }
        }
    }

    fn against_static(
        &self,
        body: &Body,
        shape: &SharedShape,
        place: &Pose,
        margin: f32,
        mut found: impl FnMut(Vec3, Vec3, f32),
    ) {
        let at = self.place(body);
        for hull in body.hulls.iter() {
            if let Some(slab) = shape.as_cuboid() {
                let normal = place.rotation * Vec3::Z;
                let surface = place.transform_point(Vec3::Z * slab.half_extents.z);
                lowest(&at, hull, surface, normal, margin, &mut found);
                continue;
            }
            let Some(field) = shape.as_heightfield() else {
                continue;
            };
            let local = hull.compute_aabb(&place.inv_mul(&at)).loosened(margin);
            field.map_elements_in_local_aabb(&local, &mut |_, triangle| {
                measure(&at, hull.0.as_ref(), place, triangle, margin, &mut found);
            });
        }
    }
}

/// The hull's corner deepest under a plane. Slabs are much larger than blocks: the general query loses touching contacts there.
pub(crate) fn lowest(
    at: &Pose,
    hull: &SharedShape,
    surface: Vec3,
    normal: Vec3,
    margin: f32,
    found: &mut impl FnMut(Vec3, Vec3, f32),
) {
    let Some(polyhedron) = hull.as_convex_polyhedron() else { return };
    let height = |p: Vec3| normal.dot(p - surface);
    let corners = polyhedron.points().iter().map(|p| at.transform_point(*p));
    if let Some(deepest) = corners.min_by(|a, b| height(*a).total_cmp(&height(*b)))
        && height(deepest) <= margin
    {
        found(deepest - normal * height(deepest), normal, -height(deepest));
    }
}

fn measure(
    at_a: &Pose,
    a: &dyn Shape,
    at_b: &Pose,
    b: &dyn Shape,
    margin: f32,
    found: &mut impl FnMut(Vec3, Vec3, f32),
) {
    // An unsupported pair cannot come up: hulls meet hulls and triangles only.
    if let Ok(Some(contact)) = query::contact(at_a, a, at_b, b, margin) {
        found(contact.point2, contact.normal2, -contact.dist);
    }
}
