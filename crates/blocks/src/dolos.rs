//! The dolos: a shank between two flukes that stand crosswise, all octagonal.
//!
//! Waist (shank width over fluke length) 0.32, volume 0.16 C³. The flukes are as wide as the shank where they
//! meet it and taper to their tips; the tip width is the one that gives the published volume (0.178 C;
//! drawings show about 0.20 C with another taper, and fillets, which are left out here).

use crate::rotation_group::closure;
use geom::{ConvexSolid, Quat, TriMesh, Vec3};
use scene::ConvexPart;

/// Width of the shank over the fluke length C.
const WAIST: f32 = 0.32;
/// Volume over C³.
pub const VOLUME: f32 = 0.16;
/// Area of an octagon of width 1 across flats.
const OCTAGON: f32 = 0.828_427_1;

/// Width of a fluke's tip over C, from the volume: shank between the flukes + two flukes, each a straight
/// middle of length `WAIST` with the corners the shank fills beside it, and two tapers.
fn tip_width() -> f32 {
    let shank = OCTAGON * WAIST * WAIST * (1.0 - 2.0 * WAIST);
    let middle = OCTAGON * WAIST.powi(3);
    let chamfer = 1.0 - 0.5_f32.sqrt();
    let joint = chamfer * chamfer * (1.0 - chamfer * 4.0 / 3.0) * WAIST.powi(3);
    let taper = (VOLUME - shank) / 2.0 - middle - joint;
    // taper = (C − A) · octagon · (A² + A·B + B²) / 3, solved for B.
    let sum = 3.0 * taper / (OCTAGON * (1.0 - WAIST));
    (-WAIST + (4.0 * sum - 3.0 * WAIST * WAIST).sqrt()) / 2.0
}

/// An octagon of width `width` across flats, in the plane `u`, `v` through `centre`.
fn octagon(centre: Vec3, u: Vec3, v: Vec3, width: f32) -> impl Iterator<Item = Vec3> {
    let (h, c) = (width / 2.0, width / 2.0 * (2.0_f32.sqrt() - 1.0));
    [[h, -c], [h, c], [c, h], [-c, h], [-h, c], [-h, -c], [-c, -h], [c, -h]]
        .into_iter()
        .map(move |[a, b]| centre + u * a + v * b)
}

/// Surface and convex parts (shank, two flukes) of a dolos of fluke length `length_m`: shank along x, centre
/// of mass at the origin, one fluke upright.
pub fn dolos(length_m: f32) -> (TriMesh, Vec<ConvexPart>) {
    let axis = 0.5 - WAIST / 2.0;
    let tip = tip_width();
    let mut shank: Vec<Vec3> = octagon(Vec3::NEG_X * axis, Vec3::Y, Vec3::Z, WAIST).collect();
    shank.extend(octagon(Vec3::X * axis, Vec3::Y, Vec3::Z, WAIST));
    let fluke = |centre: Vec3, along: Vec3, across: Vec3| -> Vec<Vec3> {
        [(-0.5, tip), (-WAIST / 2.0, WAIST), (WAIST / 2.0, WAIST), (0.5, tip)]
            .into_iter()
            .flat_map(|(t, width)| octagon(centre + along * t, Vec3::X, across, width))
            .collect()
    };
    let corners = [
        shank,
        fluke(Vec3::NEG_X * axis, Vec3::Z, Vec3::Y),
        fluke(Vec3::X * axis, Vec3::Y, Vec3::Z),
    ];
    let parts: Vec<ConvexPart> = corners
        .into_iter()
        .map(|c| ConvexPart { corners: c.into_iter().map(|p| p * length_m).collect() })
        .collect();
    let solids: Vec<ConvexSolid> = parts
        .iter()
        .map(|p| {
            ConvexSolid::from_corners(&p.corners)
                .expect("octagonal prisms and frustums have volume")
        })
        .collect();
    (geom::union(&solids), parts)
}

/// The four rotations: half a turn about the shank, and about each diagonal between the flukes, which swaps them.
pub fn rotations() -> Vec<Quat> {
    let half = std::f32::consts::PI;
    closure(
        &[
            Quat::from_rotation_x(half),
            Quat::from_axis_angle((Vec3::Y + Vec3::Z).normalize(), half),
        ],
        4,
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn volume_as_published() {
        let (mesh, parts) = dolos(3.0);
        assert_eq!(mesh.check_solid(), Ok(()));
        let moments = mesh.moments();
        assert!(
            (moments.volume_m3 / 27.0 / VOLUME - 1.0).abs() < 0.01,
            "{}",
            moments.volume_m3 / 27.0
        );
        assert!(moments.centroid.length() < 1e-4);
        assert!((mesh.bounds().size() - Vec3::splat(3.0)).length() < 1e-4);
        assert_eq!(parts.len(), 3);
    }
}
