//! The outline of a solid seen from straight above, holes and all.

use crate::{Pose, TriMesh, Vec2};
use i_overlay::core::fill_rule::FillRule;
use i_overlay::float::simplify::SimplifyShape;

/// Corners that turn the outline less than this share of the solid's size aside are left out.
const FLATNESS: f64 = 1e-3;

/// Closed rings of the posed solid's shadow under vertical light: outer rings run counter-clockwise, holes clockwise;
/// the last corner is not the first. Exact but for corners that stand out less than a thousandth of its size.
pub fn silhouette(mesh: &TriMesh, map_from_mesh: &Pose) -> Vec<Vec<Vec2>> {
    let flat: Vec<[f64; 2]> = mesh
        .vertices
        .iter()
        .map(|v| {
            let p = map_from_mesh.transform_point(*v);
            [f64::from(p.x), f64::from(p.y)]
        })
        .collect();
    // What faces up covers all that the closed surface covers.
    let faces: Vec<Vec<[f64; 2]>> = mesh
        .triangles
        .iter()
        .map(|t| t.map(|i| flat[i as usize]).to_vec())
        .filter(|t| twice_area(t) > 0.0)
        .collect();
    if faces.is_empty() {
        return Vec::new();
    }
    let size = mesh.bounds().size().max_element();
    let shapes = faces.simplify_shape(FillRule::NonZero);
    shapes
        .into_iter()
        .flatten()
        .map(|ring| {
            let ring = straightened(ring, FLATNESS * f64::from(size));
            ring.into_iter().map(|[x, y]| Vec2::new(x as f32, y as f32)).collect::<Vec<_>>()
        })
        .filter(|ring| ring.len() > 2)
        .collect()
}

fn twice_area(ring: &[[f64; 2]]) -> f64 {
    let next = ring.iter().cycle().skip(1);
    ring.iter().zip(next).map(|(a, b)| a[0] * b[1] - a[1] * b[0]).sum()
}

/// Without corners that lie on the line between their neighbours.
fn straightened(ring: Vec<[f64; 2]>, tolerance: f64) -> Vec<[f64; 2]> {
    let n = ring.len();
    let mut kept: Vec<[f64; 2]> = Vec::with_capacity(n);
    for (i, p) in ring.iter().enumerate() {
        let a = kept.last().copied().unwrap_or(ring[n - 1]);
        let b = ring[(i + 1) % n];
        let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
        let long = dx.hypot(dy);
        let off = ((p[0] - a[0]) * dy - (p[1] - a[1]) * dx).abs();
        if long == 0.0 || off > tolerance * long {
            kept.push(*p);
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Quat, Vec3};

    fn cube(at: Vec3) -> TriMesh {
        let corner =
            |i: usize| Vec3::new((i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2) as f32) + at;
        let quads =
            [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let triangles =
            quads.iter().flat_map(|q| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]]).collect();
        TriMesh { vertices: (0..8).map(corner).collect(), triangles }
    }

    fn area(rings: &[Vec<Vec2>]) -> f64 {
        let one = |r: &Vec<Vec2>| {
            twice_area(&r.iter().map(|p| [f64::from(p.x), f64::from(p.y)]).collect::<Vec<_>>())
                / 2.0
        };
        rings.iter().map(one).sum()
    }

    #[test]
    fn a_cube_on_its_corner_is_a_hexagon() {
        let mesh = cube(Vec3::splat(-0.5));
        let flat = silhouette(&mesh, &Pose::IDENTITY);
        assert_eq!((flat.len(), flat[0].len()), (1, 4));
        let up = Quat::from_rotation_arc(Vec3::ONE.normalize(), Vec3::Z);
        let rings = silhouette(&mesh, &Pose::from_parts(Vec3::new(4.0, -3.0, 9.0), up));
        assert_eq!((rings.len(), rings[0].len()), (1, 6));
        // The shadow of a unit cube along its diagonal.
        assert!((area(&rings) - 3.0_f64.sqrt()).abs() < 1e-5, "{}", area(&rings));
    }

    #[test]
    fn a_ring_of_cubes_keeps_its_hole() {
        let mut mesh = TriMesh::default();
        for (x, y) in [(0, 0), (1, 0), (2, 0), (0, 1), (2, 1), (0, 2), (1, 2), (2, 2)] {
            mesh.append(&cube(Vec3::new(x as f32, y as f32, 0.0)));
        }
        let rings = silhouette(&mesh, &Pose::IDENTITY);
        assert_eq!(rings.len(), 2);
        assert!((area(&rings) - 8.0).abs() < 1e-5, "holes run the other way: {}", area(&rings));
    }
}
