//! Whether a surface goes on where the block ends.
//!
//! A flat face looks alike all along it: what tells where a cube lies is its edges. Where a measured surface goes on in the
//! plane of a face, beyond the edge that the pose gives it, the block does not end there: the pose is slid, the block is
//! another one, or it is a step of a stair and no block at all.

use crate::fit::CentredPose;
use crate::measured::Measured;
use crate::template::Template;
use geom::{DistanceField, Pose, Quat, SeedTree, Vec3};
use scene::BlockModel;
use std::f32::consts::TAU;

/// A face and what goes on beside it point the same way to this cosine …
const SAME_PLANE: f32 = 0.85;
/// … and the edge between them is turned away from both.
const ACROSS: f32 = 0.55;
/// Surface beyond an edge is looked at within this part of d_max.
const STRIP: f32 = 0.03;
/// Of an evenly sampled surface this share has the same normal as any of its points when it is made of few flat faces.
const FLAT: f32 = 0.08;
/// Cosine up to which two normals are the same.
const SAME_NORMAL: f32 = 0.99;

/// Width of the strip beyond an edge that is looked at, metres.
pub fn strip_m(template: &Template) -> f32 {
    STRIP * template.model.d_max_m
}

/// Whether most of a surface is a few flat faces, of which a pose can slide along each.
pub fn has_flat_faces(surface: &[(Vec3, Vec3)]) -> bool {
    let alike = surface
        .iter()
        .map(|a| surface.iter().filter(|b| a.1.dot(b.1) > SAME_NORMAL).count())
        .sum::<usize>();
    alike as f32 > FLAT * (surface.len() * surface.len()) as f32
}

/// Whether the surface measured with `normal` at `point`, which the block's field sees at distance `off_m` with
/// `gradient` (block coordinates), is a face of the block that goes on beyond its edge; within `near_m` of the plane.
pub fn goes_on(
    template: &Template,
    point: Vec3,
    normal: Vec3,
    (off_m, gradient): (f32, Vec3),
    near_m: f32,
) -> bool {
    if normal == Vec3::ZERO || gradient.dot(normal).abs() > ACROSS {
        return false;
    }
    // As far inside of the edge as the point is outside.
    let across = (gradient - normal * gradient.dot(normal)).normalize_or_zero();
    let opposite = point - across * (2.0 * off_m + 0.5 * strip_m(template));
    let (d, face) = template.field.at(opposite);
    d.abs() < near_m && face.dot(normal) > SAME_PLANE
}

/// Samples of a surface that are asked whether they lie at an edge, and ways along the face that are tried from each.
const EDGE_SAMPLES: usize = 4000;
const WAYS: usize = 8;
/// Share of a cube's surface within half a strip of an edge.
const EDGES_OF_A_CUBE: f32 = 0.052;

/// Share of a surface that lies within half a strip of an edge at which its face ends.
pub fn edge_share(model: &BlockModel, field: &DistanceField, seed: SeedTree) -> f32 {
    let strip = STRIP * model.d_max_m;
    let samples = model.mesh.sample_surface(EDGE_SAMPLES, &mut seed.rng());
    let at_an_edge = |(p, n): &&(Vec3, Vec3)| {
        let along = n.any_orthonormal_vector();
        (0..WAYS).any(|k| {
            let turn = Quat::from_axis_angle(*n, k as f32 / WAYS as f32 * TAU);
            field.distance_m(*p + turn * along * strip) > 0.5 * strip
        })
    };
    samples.iter().filter(at_an_edge).count() as f32 / samples.len().max(1) as f32
}

/// What the count of points beyond edges is worth of a shape with this share of edges: flying pixels and blurred edges lie
/// along every edge, and a thin plate has several times the edges of a cube for its surface.
pub fn worth_of_edges(edge_share: f32) -> f32 {
    (EDGES_OF_A_CUBE / edge_share.max(f32::MIN_POSITIVE)).min(1.0)
}

/// Working points beyond the edges of a pose where its faces go on, for which `counts` holds.
pub fn points_beyond(
    template: &Template,
    at: &CentredPose,
    measured: &Measured,
    reach_m: f32,
    counts: impl Fn(u32) -> bool,
) -> usize {
    let block_from_site: Pose = at.pose(template.model.centre).inverse();
    let strip = strip_m(template);
    let mut beyond = 0;
    measured.grid.for_each_within(at.centre, template.model.d_max_m + strip, |i, p, _| {
        let p = block_from_site * p;
        let seen = template.field.at(p);
        if seen.0 > 0.0 && seen.0 < strip {
            let normal = block_from_site.rotation * measured.normal[i as usize];
            beyond += usize::from(goes_on(template, p, normal, seen, reach_m) && counts(i));
        }
    });
    beyond
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{PoseConfig, template::templates};
    use geom::SeedTree;
    use scene::{Catalog, Shape};

    #[test]
    fn points_at_the_edges_of_a_thin_plate_are_worth_less_than_at_those_of_a_cube() {
        let of = |name: &str, shape| blocks::shape_model(name, shape, 2300.0).unwrap();
        let plate = of("plate", Shape::HookPlate { size: 0.15 });
        let bracket = of("bracket", Shape::Bracket { size: 0.09 });
        let catalog = Catalog::new(vec![plate, bracket]);
        let templates = templates(&catalog, &PoseConfig::default(), SeedTree::new(1)).unwrap();
        for t in &templates {
            let worth = worth_of_edges(t.edge_share);
            assert!((0.1..0.8).contains(&worth), "{} {worth}", t.model.name);
        }
    }

    #[test]
    fn a_face_goes_on_in_its_plane_and_not_around_the_edge() {
        let cube = blocks::shape_model("cube", Shape::Cube { size: 1.0 }, 2300.0).unwrap();
        let tetrapod = blocks::shape_model("t", Shape::Tetrapod { size: 2.0 }, 2300.0).unwrap();
        let catalog = Catalog::new(vec![cube, tetrapod]);
        let templates = templates(&catalog, &PoseConfig::default(), SeedTree::new(1)).unwrap();
        let cube = templates.iter().find(|t| t.model.name == "cube").unwrap();
        let on = |p: Vec3, normal: Vec3| goes_on(cube, p, normal, cube.field.at(p), 0.02);
        assert!(on(Vec3::new(0.52, 0.1, 0.5), Vec3::Z));
        // The next cube's side, a lower surface, the cube's own face.
        assert!(!on(Vec3::new(0.52, 0.1, 0.3), Vec3::NEG_X));
        assert!(!on(Vec3::new(0.52, 0.1, 0.42), Vec3::Z));
        assert!(!on(Vec3::new(0.2, 0.1, 0.51), Vec3::Z));
        assert!(has_flat_faces(&cube.surface));
        assert!((cube.edge_share / EDGES_OF_A_CUBE - 1.0).abs() < 0.2, "{}", cube.edge_share);
        assert_eq!(worth_of_edges(0.5 * EDGES_OF_A_CUBE), 1.0);
        assert!(!has_flat_faces(&templates.iter().find(|t| t.model.name == "t").unwrap().surface));
    }
}
