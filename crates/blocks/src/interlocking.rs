//! Interlocking single-layer units *in the manner of* well-known ones: crossed octagonal spindles after the public drawings' overall
//! proportions; widths solved for the stated volume coefficient. Fillets and chamfers are left out, so that their names end in
//! `-like`.
//!
//! Volume coefficients: core-loc-like 0.2236 C³, xbloc-like D³/3, accropode-like 0.34 H³. The six-leg unit and the hollow tetrahedron
//! have proportions of our own.

use crate::rotation_group::{closure, octahedral, tetrahedral};
use crate::tetrapod::leg_axes;
use geom::{ConvexSolid, Quat, TriMesh, Vec3};
use scene::ConvexPart;
use std::f32::consts::PI;

/// Corners of one part over the size.
type Part = Vec<Vec3>;

/// An octagon of width `width` across flats, in the plane `u`, `v` through `centre`.
fn octagon(centre: Vec3, u: Vec3, v: Vec3, width: f32) -> impl Iterator<Item = Vec3> {
    let (h, c) = (width / 2.0, width / 2.0 * (2.0_f32.sqrt() - 1.0));
    [[h, -c], [h, c], [c, h], [-c, h], [-h, c], [-h, -c], [-c, -h], [c, -h]]
        .into_iter()
        .map(move |[a, b]| centre + u * a + v * b)
}

/// A bar of this length with a straight middle as long as it is wide, tapered to its tips.
fn spindle(centre: Vec3, axes: [Vec3; 3], length: f32, middle: f32, tip: f32) -> Part {
    let [along, u, v] = axes;
    [(-length / 2.0, tip), (-middle / 2.0, middle), (middle / 2.0, middle), (length / 2.0, tip)]
        .into_iter()
        .flat_map(|(t, width)| octagon(centre + along * t, u, v, width))
        .collect()
}

/// A straight bar between two points.
fn bar(from: Vec3, to: Vec3, u: Vec3, v: Vec3, width: f32) -> Part {
    octagon(from, u, v, width).chain(octagon(to, u, v, width)).collect()
}

fn block(parts: Vec<Part>, size_m: f32) -> (TriMesh, Vec<ConvexPart>) {
    let parts: Vec<ConvexPart> = parts
        .into_iter()
        .map(|c| ConvexPart { corners: c.into_iter().map(|p| p * size_m).collect() })
        .collect();
    let solids: Vec<ConvexSolid> = parts
        .iter()
        .map(|p| ConvexSolid::from_corners(&p.corners).expect("octagonal bars have volume"))
        .collect();
    (geom::union(&solids), parts)
}

/// Two parallel outer flukes, a central one across them, and a shank: size is C.
pub fn core_loc_like(size_m: f32) -> (TriMesh, Vec<ConvexPart>, Vec<Quat>) {
    const WIDTH: f32 = 0.333_28;
    const TIP: f32 = 0.62 * WIDTH;
    let at = Vec3::X * (0.5 - WIDTH / 2.0);
    let outer = |centre| spindle(centre, [Vec3::Z, Vec3::X, Vec3::Y], 1.0, WIDTH, TIP);
    let parts = vec![
        outer(-at),
        outer(at),
        spindle(Vec3::ZERO, [Vec3::Y, Vec3::X, Vec3::Z], 1.0, WIDTH, TIP),
        bar(-at, at, Vec3::Y, Vec3::Z, WIDTH),
    ];
    let (mesh, parts) = block(parts, size_m);
    (mesh, parts, closure(&[Quat::from_rotation_x(PI), Quat::from_rotation_y(PI)], 4))
}

/// Four legs in a plane, crosswise, and two noses: size is D.
pub fn xbloc_like(size_m: f32) -> (TriMesh, Vec<ConvexPart>, Vec<Quat>) {
    const WIDTH: f32 = 0.47;
    const TIP: f32 = 0.7 * WIDTH;
    let half = 0.5_f32.sqrt();
    let (a, b) = (Vec3::new(half, half, 0.0), Vec3::new(half, -half, 0.0));
    // The tips touch the corners of the square of edge D.
    let length = 2.0 * (half - TIP / 2.0);
    let parts = vec![
        spindle(Vec3::ZERO, [a, b, Vec3::Z], length, WIDTH, TIP),
        spindle(Vec3::ZERO, [b, a, Vec3::Z], length, WIDTH, TIP),
        spindle(Vec3::ZERO, [Vec3::Z, Vec3::X, Vec3::Y], 1.0, WIDTH, TIP),
    ];
    let (mesh, parts) = block(parts, size_m);
    (mesh, parts, closure(&[Quat::from_rotation_z(PI / 2.0), Quat::from_rotation_x(PI)], 8))
}

/// Two crossed flukes one above the other, joined by a core: size is H.
pub fn accropode_like(size_m: f32) -> (TriMesh, Vec<ConvexPart>, Vec<Quat>) {
    const WIDTH: f32 = 0.472_4;
    const TIP: f32 = 0.6 * WIDTH;
    let at = Vec3::Z * (0.5 - WIDTH / 2.0);
    let parts = vec![
        spindle(-at, [Vec3::X, Vec3::Y, Vec3::Z], 1.0, WIDTH, TIP),
        spindle(at, [Vec3::Y, Vec3::X, Vec3::Z], 1.0, WIDTH, TIP),
        bar(-at, at, Vec3::X, Vec3::Y, 1.15 * WIDTH),
    ];
    let (mesh, parts) = block(parts, size_m);
    let swap = Quat::from_axis_angle((Vec3::X + Vec3::Y).normalize(), PI);
    (mesh, parts, closure(&[Quat::from_rotation_z(PI), swap], 4))
}

/// Three bars through one point: size is the length of a bar.
pub fn six_leg_like(size_m: f32) -> (TriMesh, Vec<ConvexPart>, Vec<Quat>) {
    const WIDTH: f32 = 0.34;
    const TIP: f32 = 0.7 * WIDTH;
    let axes =
        [[Vec3::X, Vec3::Y, Vec3::Z], [Vec3::Y, Vec3::Z, Vec3::X], [Vec3::Z, Vec3::X, Vec3::Y]];
    let parts = axes.into_iter().map(|a| spindle(Vec3::ZERO, a, 1.0, WIDTH, TIP)).collect();
    let (mesh, parts) = block(parts, size_m);
    (mesh, parts, octahedral())
}

/// A frame along the edges of a regular tetrahedron, its corners cut: size is its height on one face. Proportions of our own.
pub fn hollow_tetrahedron_like(size_m: f32) -> (TriMesh, Vec<ConvexPart>, Vec<Quat>) {
    /// Width of a bar and the cut of a corner, over the distance of a corner from the centre.
    const WIDTH: f32 = 0.42;
    const CUT: f32 = 0.34;
    /// Bars reach into the corners a little, so that no two parts share a face.
    const INTO: f32 = 0.05;
    let corners = leg_axes();
    let mut parts = Vec::new();
    let section = |from: Vec3, to: Vec3, at: f32| {
        let along = (to - from).normalize();
        let out = ((from + to) / 2.0).normalize();
        octagon(from + along * at, out, along.cross(out), WIDTH)
    };
    for (i, &a) in corners.iter().enumerate() {
        let others = corners.iter().filter(|b| **b != a);
        parts.push(others.flat_map(|&b| section(a, b, CUT)).collect());
        for &b in &corners[i + 1..] {
            parts.push(section(a, b, CUT - INTO).chain(section(b, a, CUT - INTO)).collect());
        }
    }
    let heights = || parts.iter().flatten().map(|p: &Vec3| p.z);
    let (low, high) =
        (heights().fold(f32::INFINITY, f32::min), heights().fold(f32::NEG_INFINITY, f32::max));
    let (mesh, parts) = block(parts, size_m / (high - low));
    (mesh, parts, tetrahedral(&corners))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn boxes_and_volumes_are_the_stated_ones() {
        type Make = fn(f32) -> (TriMesh, Vec<ConvexPart>, Vec<Quat>);
        let all: [(&str, Make, f32, usize); 4] = [
            ("core-loc-like", core_loc_like, 0.2236, 4),
            ("xbloc-like", xbloc_like, 1.0 / 3.0, 8),
            ("accropode-like", accropode_like, 0.34, 4),
            ("six-leg-like", six_leg_like, scene::SIX_LEG_VOLUME, 24),
        ];
        for (name, make, volume, order) in all {
            let (mesh, _, rotations) = make(2.0);
            assert_eq!(mesh.check_solid(), Ok(()), "{name}");
            assert_eq!(geom::shells_in_each_other(&mesh), None, "{name}");
            let moments = mesh.moments();
            let ratio = moments.volume_m3 / 8.0;
            assert!((ratio / volume - 1.0).abs() < 0.01, "{name}: {ratio} {volume}");
            assert!(moments.centroid.length() < 1e-3, "{name}");
            assert!((mesh.bounds().size() - Vec3::splat(2.0)).length() < 1e-3, "{name}");
            assert_eq!(rotations.len(), order, "{name}");
        }
    }

    #[test]
    fn a_hollow_tetrahedron_is_a_frame_as_high_as_stated() {
        let (mesh, parts, rotations) = hollow_tetrahedron_like(2.0);
        assert_eq!(mesh.check_solid(), Ok(()));
        assert_eq!(geom::shells_in_each_other(&mesh), None);
        assert_eq!((parts.len(), rotations.len()), (10, 12));
        assert!((mesh.bounds().size().z - 2.0).abs() < 1e-3);
        let moments = mesh.moments();
        let ratio = moments.volume_m3 / 8.0;
        assert!((ratio / scene::HOLLOW_TETRAHEDRON_VOLUME - 1.0).abs() < 0.01, "{ratio}");
        assert!(moments.centroid.length() < 1e-3);
        // One can look through it: a ray along an axis through the middle of a face meets nothing at the centre.
        let query = geom::MeshQuery::new(&mesh).expect("the mesh is closed");
        assert!(query.cast_ray(Vec3::ZERO, Vec3::NEG_Z, 10.0).is_none());
    }
}
