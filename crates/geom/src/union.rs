//! The surface of a union of convex solids as one watertight triangle mesh.
//!
//! Each face is cut along the other solids' planes and the pieces inside another solid are dropped; what is
//! left is welded, vertices lying on a neighbour's edge are put into it (no T-junctions) and triangulated.

use crate::convex::{ConvexSolid, FLATNESS, HalfSpace};
use crate::{DVec3, TriMesh};

/// The boundary of the union. Solids that touch in a face are joined through it; solids that touch only in an
/// edge or a corner stay apart.
pub fn union(solids: &[ConvexSolid]) -> TriMesh {
    let size = solids.iter().map(|s| s.size_m).fold(0.0, f64::max);
    let flat = size * FLATNESS;
    let mut pieces: Vec<Vec<DVec3>> = Vec::new();
    for (i, solid) in solids.iter().enumerate() {
        for (plane, face) in solid.planes.iter().zip(&solid.faces) {
            let mut outside = vec![face.clone()];
            for (j, other) in solids.iter().enumerate().filter(|(j, _)| *j != i) {
                outside = outside
                    .into_iter()
                    .flat_map(|piece| subtract(piece, plane, other, i < j, flat))
                    .collect();
            }
            pieces.extend(outside);
        }
    }
    stitch(pieces, flat * 4.0)
}

/// The parts of a polygon outside a solid. Where the polygon lies in one of the solid's faces, of two faces
/// looking the same way the `first` stays, and two looking at each other both go.
fn subtract(
    piece: Vec<DVec3>,
    plane: &HalfSpace,
    solid: &ConvexSolid,
    first: bool,
    flat: f64,
) -> Vec<Vec<DVec3>> {
    let in_plane = |p: &&HalfSpace| piece.iter().all(|c| p.distance_m(*c).abs() <= 4.0 * flat);
    let shared = solid.planes.iter().find(in_plane);
    if shared.is_some_and(|s| s.normal.dot(plane.normal) > 0.0) && first {
        return vec![piece];
    }
    let mut rest = piece.clone();
    let mut outside = Vec::new();
    for cut in solid.planes.iter().filter(|p| shared.is_none_or(|s| *p != s)) {
        let (inner, outer) = split(&rest, cut, flat);
        outside.extend(outer);
        match inner {
            Some(inner) => rest = inner,
            // Nothing was inside: the polygon stays whole rather than in shards.
            None => return vec![piece],
        }
    }
    outside
}

/// A convex polygon on either side of a plane: (inside, outside). Within `flat` of the plane is inside,
/// so that no piece is thinner than the tolerance.
fn split(
    polygon: &[DVec3],
    plane: &HalfSpace,
    flat: f64,
) -> (Option<Vec<DVec3>>, Option<Vec<DVec3>>) {
    let distance: Vec<f64> = polygon.iter().map(|p| plane.distance_m(*p)).collect();
    if distance.iter().all(|d| *d <= flat) {
        // On the plane from outside counts as outside only if nothing reaches within.
        let within = distance.iter().any(|d| *d < -flat);
        return if within {
            (Some(polygon.to_vec()), None)
        } else {
            (None, Some(polygon.to_vec()))
        };
    }
    if distance.iter().all(|d| *d >= -flat) {
        return (None, Some(polygon.to_vec()));
    }
    let (mut inner, mut outer) = (Vec::new(), Vec::new());
    for (k, &p) in polygon.iter().enumerate() {
        let next = (k + 1) % polygon.len();
        let (d, e) = (distance[k], distance[next]);
        if d <= flat {
            inner.push(p);
        }
        if d >= -flat {
            outer.push(p);
        }
        if (d < -flat && e > flat) || (d > flat && e < -flat) {
            // Always from the inner end, so that the two faces at this edge find the same point.
            let (a, b, da, db) =
                if d < e { (p, polygon[next], d, e) } else { (polygon[next], p, e, d) };
            let crossing = a + (b - a) * (da / (da - db));
            inner.push(crossing);
            outer.push(crossing);
        }
    }
    let polygon_of = |v: Vec<DVec3>| (v.len() >= 3).then_some(v);
    (polygon_of(inner), polygon_of(outer))
}

/// Polygons to a mesh: one vertex per place, every vertex on an edge part of both its sides.
fn stitch(pieces: Vec<Vec<DVec3>>, tolerance_m: f64) -> TriMesh {
    let mut vertices: Vec<DVec3> = Vec::new();
    // A few hundred vertices: the plain search is simpler than a grid and independent of cell borders.
    let mut index_of = |p: DVec3| -> u32 {
        let near = vertices.iter().position(|v| (*v - p).length() <= tolerance_m);
        near.unwrap_or_else(|| {
            vertices.push(p);
            vertices.len() - 1
        }) as u32
    };
    let rings: Vec<Vec<u32>> = pieces
        .iter()
        .map(|piece| {
            let mut ring: Vec<u32> = piece.iter().map(|p| index_of(*p)).collect();
            ring.dedup();
            if ring.len() > 1 && ring.first() == ring.last() {
                ring.pop();
            }
            ring
        })
        .filter(|ring| ring.len() >= 3)
        .collect();

    let mut mesh = TriMesh::default();
    let mut middles = Vec::new();
    for ring in &rings {
        let full = with_points_on_edges(ring, &vertices, tolerance_m);
        if full.len() == 3 {
            mesh.triangles.push([full[0], full[1], full[2]]);
        } else if full.len() == ring.len() && is_strictly_convex(&full, &vertices, tolerance_m) {
            mesh.triangles.extend((2..full.len()).map(|i| [full[0], full[i - 1], full[i]]));
        } else {
            // A fan from a corner would be flat along an edge with extra points; from the middle it is not.
            let middle =
                full.iter().map(|i| vertices[*i as usize]).sum::<DVec3>() / full.len() as f64;
            let m = (vertices.len() + middles.len()) as u32;
            middles.push(middle);
            mesh.triangles
                .extend((0..full.len()).map(|i| [m, full[i], full[(i + 1) % full.len()]]));
        }
    }
    mesh.vertices = vertices.iter().chain(&middles).map(|v| v.as_vec3()).collect();
    mesh.without_loose_vertices()
}

/// The ring with every vertex that lies on one of its edges.
fn with_points_on_edges(ring: &[u32], vertices: &[DVec3], tolerance_m: f64) -> Vec<u32> {
    let mut full = Vec::with_capacity(ring.len());
    for (k, &i) in ring.iter().enumerate() {
        let j = ring[(k + 1) % ring.len()];
        full.push(i);
        let (a, b) = (vertices[i as usize], vertices[j as usize]);
        let length = (b - a).length();
        let along = (b - a) / length;
        let mut between: Vec<(f64, u32)> = vertices
            .iter()
            .enumerate()
            .filter(|(v, _)| *v as u32 != i && *v as u32 != j)
            .filter_map(|(v, p)| {
                let t = along.dot(*p - a);
                let off = (*p - a - along * t).length();
                (off <= tolerance_m && t > tolerance_m && t < length - tolerance_m)
                    .then_some((t, v as u32))
            })
            .collect();
        between.sort_by(|x, y| x.0.total_cmp(&y.0));
        full.extend(between.into_iter().map(|(_, v)| v));
    }
    full
}

fn is_strictly_convex(ring: &[u32], vertices: &[DVec3], tolerance_m: f64) -> bool {
    (0..ring.len()).all(|k| {
        let at = |o: usize| vertices[ring[(k + o) % ring.len()] as usize];
        let (a, b, c) = (at(0), at(1), at(2));
        let along = (c - a).normalize_or_zero();
        (b - a - along * along.dot(b - a)).length() > 2.0 * tolerance_m
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Vec3;

    fn cuboid(low: [f32; 3], high: [f32; 3]) -> ConvexSolid {
        let pick = |i: usize, axis: usize| if i >> axis & 1 == 1 { high[axis] } else { low[axis] };
        let corners: Vec<Vec3> =
            (0..8).map(|i| Vec3::new(pick(i, 0), pick(i, 1), pick(i, 2))).collect();
        ConvexSolid::from_corners(&corners).unwrap()
    }

    fn check(solids: &[ConvexSolid], volume_m3: f32) -> TriMesh {
        let mesh = union(solids);
        assert_eq!(mesh.check_solid(), Ok(()));
        assert!(
            (mesh.moments().volume_m3 / volume_m3 - 1.0).abs() < 1e-4,
            "{}",
            mesh.moments().volume_m3
        );
        mesh
    }

    #[test]
    fn crossing_bars() {
        check(
            &[
                cuboid([-2.0, -0.5, -0.5], [2.0, 0.5, 0.5]),
                cuboid([-0.4, -3.0, -0.3], [0.4, 3.0, 0.8]),
            ],
            8.64,
        );
    }

    #[test]
    fn bars_with_flush_sides() {
        check(
            &[
                cuboid([-2.0, -0.5, -0.5], [2.0, 0.5, 0.5]),
                cuboid([-0.5, -3.0, -0.5], [0.5, 3.0, 0.5]),
            ],
            9.0,
        );
    }

    #[test]
    fn cubes_joined_through_a_face() {
        let mesh =
            check(&[cuboid([0.0; 3], [1.0; 3]), cuboid([1.0, 0.2, 0.3], [2.0, 0.8, 0.9])], 1.36);
        assert!((mesh.area_m2() - (6.0 + 4.0 * 0.6)).abs() < 1e-4);
    }

    #[test]
    fn one_inside_the_other_vanishes() {
        assert_eq!(
            check(&[cuboid([0.0; 3], [1.0; 3]), cuboid([0.2; 3], [0.8; 3])], 1.0).triangles.len(),
            12
        );
    }
}
