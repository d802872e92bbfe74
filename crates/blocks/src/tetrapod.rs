//! The tetrapod: four equal tapered legs on the corners of a tetrahedron (Shore Protection Manual ratios).
//!
//! A point of the union belongs to the leg whose axis is nearest in angle, so the solid falls apart into
//! four convex cells — leg ∩ three half-spaces through the centre — which serve physics exactly, and the
//! surface into four ruled strips that meet on the planes between the axes.

use geom::{TriMesh, Vec3};
use scene::ConvexPart;

/// Leg radius at the tip, over the height.
const TIP_RADIUS: f32 = 0.151;
/// Leg radius near the root, over the height.
const ROOT_RADIUS: f32 = 0.235;
/// Where the root radius is measured, from the centre, over the height.
const ROOT_AT: f32 = 0.167;
/// Where the leg ends, from the centre, over the height.
const TIP_AT: f32 = 0.644;
/// Corners of a leg's cross-section; a multiple of 6 so that neighbouring legs share their rim points.
const SIDES: usize = 24;

/// Unit axes of the four legs; the first points up.
pub fn leg_axes() -> [Vec3; 4] {
    let (z, r) = (-1.0 / 3.0, (8.0_f32 / 9.0).sqrt());
    let down = |k: f32| {
        let (sin, cos) = (k * std::f32::consts::TAU / 3.0).sin_cos();
        Vec3::new(r * cos, r * sin, z)
    };
    [Vec3::Z, down(0.0), down(1.0), down(2.0)]
}

/// Surface and convex parts of a tetrapod of height `height_m`, centre of mass at the origin, one leg up.
pub fn tetrapod(height_m: f32) -> (TriMesh, Vec<ConvexPart>) {
    // A polygon of the circle's area, so that the volume is that of round legs.
    let step = std::f32::consts::TAU / SIDES as f32;
    let widen = (step / step.sin()).sqrt();
    let slope = (TIP_RADIUS - ROOT_RADIUS) / (TIP_AT - ROOT_AT);
    let radius = |t: f32| (ROOT_RADIUS + (t - ROOT_AT) * slope) * widen;

    let axes = leg_axes();
    let mut mesh = TriMesh::default();
    let mut parts = Vec::new();
    for (k, &axis) in axes.iter().enumerate() {
        let toward = axes[(k + 1) % 4];
        let u = (toward - axis * toward.dot(axis)).normalize();
        let v = axis.cross(u);
        let mut tip = Vec::with_capacity(SIDES);
        let mut root = Vec::with_capacity(SIDES);
        for i in 0..SIDES {
            let (sin, cos) = (i as f32 * step).sin_cos();
            let out = u * cos + v * sin;
            // The ruled line axis·t + out·r(t) leaves the cell where it is as near to another axis.
            let t = axes
                .iter()
                .enumerate()
                .filter(|(other, _)| *other != k)
                .map(|(_, &b)| {
                    let n = axis - b;
                    // n·(axis t + out (r0 + slope' t)) = 0
                    let r0 = radius(0.0);
                    let grow = radius(1.0) - r0;
                    -n.dot(out) * r0 / (n.dot(axis) + n.dot(out) * grow)
                })
                .fold(0.0_f32, f32::max);
            tip.push((axis * TIP_AT + out * radius(TIP_AT)) * height_m);
            root.push((axis * t + out * radius(t)) * height_m);
        }
        let mut leg = TriMesh { vertices: vec![axis * (TIP_AT * height_m)], triangles: Vec::new() };
        leg.vertices.extend(&tip);
        leg.vertices.extend(&root);
        for i in 0..SIDES as u32 {
            let j = (i + 1) % SIDES as u32;
            let (ti, tj, ri, rj) = (1 + i, 1 + j, 1 + SIDES as u32 + i, 1 + SIDES as u32 + j);
            leg.triangles.push([0, ti, tj]);
            leg.triangles.push([ti, ri, rj]);
            leg.triangles.push([ti, rj, tj]);
        }
        mesh.append(&leg);
        let mut corners = vec![Vec3::ZERO];
        corners.extend(tip);
        corners.extend(root);
        parts.push(ConvexPart { corners });
    }
    (mesh.welded(1e-4 * height_m), parts)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn volume_and_height_match_the_manual() {
        let (mesh, parts) = tetrapod(2.0);
        assert_eq!(mesh.check_solid(), Ok(()));
        let moments = mesh.moments();
        let ratio = moments.volume_m3 / 8.0;
        assert!((ratio / 0.280 - 1.0).abs() < 0.01, "V/h³ = {ratio}");
        assert!(moments.centroid.length() < 1e-4);
        assert!((mesh.bounds().size().z / 2.0 - 1.0).abs() < 0.01);
        assert_eq!(parts.len(), 4);
    }
}
