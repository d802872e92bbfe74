//! The Antifer cube: a block tapered from bottom to top with a groove along the middle of each side.
//!
//! Proportions as published with the block (bottom edge A = 1.086 H, top edge B = 1.005 H, V = 1.0247 H³).
//! The depth of the grooves follows from the volume: half-hexagons
//! that take out what the plain frustum has too much.

use geom::{TriMesh, Vec3};
use scene::ConvexPart;

/// Bottom edge over the height.
const BOTTOM: f32 = 1.086;
/// Top edge over the height.
const TOP: f32 = 1.005;
/// Published volume over the height cubed.
pub const VOLUME: f32 = 1.0247;

/// Half the width of a groove's mouth over the edge; its floor is half as wide, √3/2 of this deep.
fn groove_radius() -> f32 {
    let frustum = (BOTTOM * BOTTOM + BOTTOM * TOP + TOP * TOP) / 3.0;
    // Four half-hexagons of area 3√3/4 r² each take (1 − V/frustum) of the unit square.
    ((1.0 - VOLUME / frustum) / (3.0 * 3.0_f32.sqrt())).sqrt()
}

/// Surface and convex parts (core and four corners) of an Antifer cube of height `height_m`, its middle height
/// at the origin, the wide side down.
pub fn antifer(height_m: f32) -> (TriMesh, Vec<ConvexPart>) {
    let (s, r) = (0.5, groove_radius());
    let floor = s - r * 3.0_f32.sqrt() / 2.0;
    // One quarter of the section, counter-clockwise: groove floor, mouth, corner, mouth, groove floor.
    let quarter = [[floor, r / 2.0], [s, r], [s, s], [r, s], [r / 2.0, floor]];
    let turn = |[x, y]: [f32; 2], k: usize| [[x, y], [-y, x], [-x, -y], [y, -x]][k];
    let outline: Vec<[f32; 2]> = (0..4).flat_map(|k| quarter.map(|p| turn(p, k))).collect();

    let n = outline.len();
    let level = |edge: f32, z: f32| {
        outline
            .iter()
            .map(move |[x, y]| Vec3::new(x * edge, y * edge, z) * height_m)
            .collect::<Vec<_>>()
    };
    let mut vertices = level(BOTTOM, -0.5);
    vertices.extend(level(TOP, 0.5));

    let corners: Vec<Vec<usize>> = (0..4).map(|k| (5 * k..5 * k + 5).collect()).collect();
    let core: Vec<usize> = (0..4).flat_map(|k| [5 * k, 5 * k + 4]).collect();
    let mut triangles = Vec::new();
    for cell in corners.iter().chain([&core]) {
        for i in 2..cell.len() {
            let [a, b, c] = [cell[0], cell[i - 1], cell[i]].map(|v| v as u32);
            triangles.push([a, c, b]);
            triangles.push([a + n as u32, b + n as u32, c + n as u32]);
        }
    }
    for i in 0..n as u32 {
        let j = (i + 1) % n as u32;
        let up = n as u32;
        triangles.push([i, j, j + up]);
        triangles.push([i, j + up, i + up]);
    }
    let part = |cell: &Vec<usize>| ConvexPart {
        corners: cell.iter().flat_map(|&i| [vertices[i], vertices[i + n]]).collect(),
    };
    let parts = [&core].into_iter().chain(&corners).map(part).collect();
    (TriMesh { vertices, triangles }, parts)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn volume_as_published() {
        let (mesh, parts) = antifer(2.0);
        assert_eq!(mesh.check_solid(), Ok(()));
        assert!((mesh.moments().volume_m3 / 8.0 / VOLUME - 1.0).abs() < 0.01);
        assert_eq!(parts.len(), 5);
        assert!((mesh.bounds().size() - Vec3::new(2.172, 2.172, 2.0)).length() < 1e-5);
    }
}
