//! How often a closed mesh winds about a place: 0 outside, 1 inside, 2 where two of its shells lie in each other.

use crate::{DVec3, TriMesh};

/// Places that are looked at; on larger meshes one on each of so many evenly chosen triangles.
const LOOKED_AT: usize = 400;

/// The winding number of the mesh about a point off its surface.
pub fn winding_number(mesh: &TriMesh, at: DVec3) -> i32 {
    let solid_angle = |t: usize| {
        let [a, b, c] = mesh.corners(t).map(|v| v.as_dvec3() - at);
        let (la, lb, lc) = (a.length(), b.length(), c.length());
        // Van Oosterom and Strackee 1983.
        let over = a.dot(b.cross(c));
        let under = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
        2.0 * over.atan2(under)
    };
    let total: f64 = (0..mesh.triangles.len()).map(solid_angle).sum();
    (total / (4.0 * std::f64::consts::PI)).round() as i32
}

/// Winding numbers behind and before a surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sides {
    /// Triangle, from 0.
    pub triangle: usize,
    /// On the side that its normal comes from.
    pub behind: i32,
    /// On the side that its normal points to.
    pub before: i32,
}

/// A triangle of a closed mesh that has not the inside on one side and the outside on the other: shells that lie in each other,
/// or one that is turned inside out. `None`: at the places looked at, each triangle bounds the solid.
pub fn shells_in_each_other(mesh: &TriMesh) -> Option<Sides> {
    let off_m = f64::from(mesh.bounds().size().max_element()) * 1e-5;
    let count = mesh.triangles.len();
    let step = count.div_ceil(LOOKED_AT).max(1);
    // Large triangles of a coarse mesh may lie in another shell with a corner alone.
    let places = (LOOKED_AT / count.max(1)).clamp(1, 40);
    (0..count).step_by(step).find_map(|triangle| {
        let [a, b, c] = mesh.corners(triangle).map(|v| v.as_dvec3());
        let off = (b - a).cross(c - a).try_normalize()? * off_m;
        (0..places).find_map(|k| {
            let (v, w) = spread(k);
            let at = a + (b - a) * v + (c - a) * w;
            let behind = winding_number(mesh, at - off);
            let before = winding_number(mesh, at + off);
            (behind != 1 || before != 0).then_some(Sides { triangle, behind, before })
        })
    })
}

/// Places spread evenly over a triangle, none on an edge.
fn spread(k: usize) -> (f64, f64) {
    // Roberts' two-dimensional sequence, folded into the triangle.
    let v = (0.5 + 0.754_877_666_2 * k as f64).fract();
    let w = (0.41 + 0.569_840_291_0 * k as f64).fract();
    if v + w > 1.0 { (1.0 - v, 1.0 - w) } else { (v, w) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Vec3;

    fn cube(at: Vec3, edge: f32) -> TriMesh {
        let corner = |i: usize| Vec3::new((i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2) as f32);
        let quads =
            [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        TriMesh {
            vertices: (0..8).map(|i| at + corner(i) * edge).collect(),
            triangles: quads
                .iter()
                .flat_map(|q| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]])
                .collect(),
        }
    }

    #[test]
    fn a_cube_winds_once_about_its_inside() {
        let mesh = cube(Vec3::ZERO, 2.0);
        assert_eq!(winding_number(&mesh, DVec3::splat(1.0)), 1);
        assert_eq!(winding_number(&mesh, DVec3::splat(3.0)), 0);
        assert_eq!(shells_in_each_other(&mesh), None);
    }

    #[test]
    fn shells_in_each_other_are_found() {
        let with = |other: TriMesh| {
            let mut mesh = cube(Vec3::ZERO, 2.0);
            mesh.append(&other);
            shells_in_each_other(&mesh)
        };
        assert!(with(cube(Vec3::ZERO, 2.0)).is_some_and(|s| s.behind == 2));
        assert!(with(cube(Vec3::splat(1.0), 2.0)).is_some());
        assert!(with(cube(Vec3::splat(0.5), 1.0)).is_some());
        // A hollow, and a second part beside the first, are solids.
        assert_eq!(with(cube(Vec3::splat(0.5), 1.0).flipped()), None);
        assert_eq!(with(cube(Vec3::splat(5.0), 1.0)), None);
        assert!(with(cube(Vec3::splat(5.0), 1.0).flipped()).is_some_and(|s| s.behind == 0));
    }
}
