//! Five parts as they lie in bins, of our own design, for bin picking: an eye bolt, a gear shaft, a dished plate with
//! holes, a lobed plate that hooks into its neighbours, and a bracket.
//!
//! In: the largest length, metres. Out: surface and convex parts, like every built-in shape. They stand for the kinds of
//! part on which bin picking is usually measured: an empty middle (eye bolt), a long body (gear shaft), a flat round one (holed
//! plate), one whose visible middle says little and that interlocks (hook plate), and one of thin walls (bracket).

use crate::rotation_group::cyclic_z;
use geom::{ConvexSolid, Quat, TriMesh, Vec3};
use scene::ConvexPart;
use std::f32::consts::TAU;

/// Corners of round bodies.
const SIDES: usize = 12;

type Corners = Vec<Vec3>;

/// Surface, convex parts and proper rotations of a part.
pub type Ingredients = (TriMesh, Vec<ConvexPart>, Vec<Quat>);

/// An eye bolt of length `size_m`: a ring (0.66 long, 0.13 thick) on a collar with a shank along −z. Two rotations.
pub fn eye_bolt(size_m: f32) -> Ingredients {
    let (middle, thick) = (0.17, 0.065);
    let radius = 0.26;
    // A hexagonal section, swept in twelve straight pieces about the ring's axis y.
    let section = |angle: f32| -> Corners {
        let out = Vec3::new(angle.sin(), 0.0, angle.cos());
        (0..6)
            .map(|k| {
                let (s, c) = ((k as f32 + 0.5) * TAU / 6.0).sin_cos();
                Vec3::Z * middle + out * (radius + thick * c) + Vec3::Y * (thick * s)
            })
            .collect()
    };
    let at = |k: usize| section((k as f32 + 0.5) * TAU / SIDES as f32);
    let mut parts: Vec<Corners> = (0..SIDES).map(|k| [at(k), at(k + 1)].concat()).collect();
    parts.push(prism(0.12, [-0.22, -0.13]));
    parts.push(prism(0.055, [-0.5, -0.21]));
    ingredients(size_m, parts, cyclic_z(2))
}

/// A gear shaft of length `size_m`: a stepped shaft along z with a wheel of twelve teeth nearer to its lower end.
pub fn gear_shaft(size_m: f32) -> Ingredients {
    let mut parts = vec![
        prism(0.035, [-0.5, -0.18]),
        prism(0.078, [-0.18, 0.02]),
        prism(0.052, [0.02, 0.3]),
        prism(0.03, [0.3, 0.5]),
    ];
    let tooth = |k: usize| -> Corners {
        let turn = Quat::from_rotation_z((k as f32 + 0.5) * TAU / SIDES as f32);
        let flank = [(0.07, 0.014), (0.112, 0.008)];
        let corner = |(r, half): (f32, f32)| {
            [-half, half].map(|y| [-0.15, -0.01].map(|z| turn * Vec3::new(r, y, z)))
        };
        flank.into_iter().flat_map(corner).flatten().collect()
    };
    parts.extend((0..SIDES).map(tooth));
    ingredients(size_m, parts, cyclic_z(SIDES as u32))
}

/// A dished plate of diameter `size_m`: rim, boss and six spokes with holes between them. Six rotations.
pub fn holed_plate(size_m: f32) -> Ingredients {
    let mut parts: Vec<Corners> =
        (0..SIDES).map(|k| ring_piece(k, SIDES, [0.41, 0.5], [-0.15, 0.15])).collect();
    parts.push(prism(0.2, [0.02, 0.1]));
    parts.push(prism(0.09, [-0.15, 0.15]));
    let spoke = |k: usize| {
        let turn = Quat::from_rotation_z(k as f32 * TAU / 6.0);
        cuboid([0.15, 0.43], [-0.055, 0.055], [0.02, 0.1]).into_iter().map(|c| turn * c).collect()
    };
    parts.extend((0..6).map(spoke));
    ingredients(size_m, parts, cyclic_z(6))
}

/// A lobed plate about `size_m` long: a broad ring with a bar across, three unlike lugs, and pegs below them that
/// catch in the holes of others. No symmetry.
pub fn hook_plate(size_m: f32) -> Ingredients {
    let z = [-0.035, 0.035];
    let mut parts: Vec<Corners> = (0..10).map(|k| ring_piece(k, 10, [0.19, 0.37], z)).collect();
    parts.push(cuboid([-0.25, 0.25], [-0.13, -0.06], z));
    for (turn, reach, half) in [(0.1, 0.6, 0.07), (2.2, 0.5, 0.055), (3.9, 0.46, 0.05)] {
        let turn = Quat::from_rotation_z(turn);
        let turned = |c: Corners| -> Corners { c.into_iter().map(|p| turn * p).collect() };
        parts.push(turned(cuboid([0.31, reach], [-half, half], z)));
        let peg = 0.6 * half;
        parts.push(turned(cuboid([reach - 0.1, reach - 0.02], [-peg, peg], [-0.12, -0.03])));
    }
    ingredients(size_m, parts, vec![Quat::IDENTITY])
}

/// A sheet bracket `size_m` long: a base with a window, two unlike upright walls and three lugs. No symmetry.
pub fn bracket(size_m: f32) -> Ingredients {
    let t = 0.07;
    let base = [-0.19, -0.19 + t];
    let parts = vec![
        cuboid([-0.36, -0.14], [-0.33, 0.33], base),
        cuboid([0.14, 0.36], [-0.33, 0.33], base),
        cuboid([-0.15, 0.15], [-0.33, -0.16], base),
        cuboid([-0.15, 0.15], [0.16, 0.33], base),
        cuboid([-0.36, 0.36], [0.33 - t, 0.33], [-0.19, 0.19]),
        cuboid([-0.36, -0.02], [-0.33, -0.33 + t], [-0.19, 0.13]),
        cuboid([0.35, 0.5], [0.1, 0.27], base),
        cuboid([0.35, 0.5], [-0.3, -0.13], base),
        cuboid([-0.5, -0.35], [-0.02, 0.15], base),
    ];
    ingredients(size_m, parts, vec![Quat::IDENTITY])
}

/// A round body about z.
fn prism(radius: f32, z: [f32; 2]) -> Corners {
    let corner = |k: usize| {
        let (s, c) = (k as f32 * TAU / SIDES as f32).sin_cos();
        z.map(|z| Vec3::new(radius * c, radius * s, z))
    };
    (0..SIDES).flat_map(corner).collect()
}

/// Piece `k` of `of` of a flat ring about z; neighbours meet in a face.
fn ring_piece(k: usize, of: usize, radii: [f32; 2], z: [f32; 2]) -> Corners {
    let corner = |k: usize| {
        let (s, c) = (k as f32 * TAU / of as f32).sin_cos();
        radii.map(|r| z.map(|z| Vec3::new(r * c, r * s, z)))
    };
    [k, (k + 1) % of].into_iter().flat_map(corner).flatten().collect()
}

fn cuboid(x: [f32; 2], y: [f32; 2], z: [f32; 2]) -> Corners {
    (0..8).map(|i| Vec3::new(x[i & 1], y[i >> 1 & 1], z[i >> 2])).collect()
}

fn ingredients(size_m: f32, parts: Vec<Corners>, rotations: Vec<Quat>) -> Ingredients {
    let solid = |c: &Corners| {
        ConvexSolid::from_corners(c).expect("the corners above span a solid of any size")
    };
    // At unit size, so that the union's welding is the same for every size.
    let mesh = geom::union(&parts.iter().map(solid).collect::<Vec<_>>());
    let centre = mesh.moments().centroid;
    let place = |v: Vec3| (v - centre) * size_m;
    let parts = parts
        .into_iter()
        .map(|c| ConvexPart { corners: c.into_iter().map(place).collect() })
        .collect();
    (mesh.map(place), parts, rotations)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::symmetry::{SymmetryConfig, find_symmetry};
    use geom::union_volume_m3;

    type Make = fn(f32) -> Ingredients;
    const PARTS: [(&str, Make); 5] = [
        ("eye bolt", eye_bolt),
        ("gear shaft", gear_shaft),
        ("holed plate", holed_plate),
        ("hook plate", hook_plate),
        ("bracket", bracket),
    ];

    #[test]
    fn they_are_solids_of_the_volume_of_their_parts_about_their_centre() {
        for (name, make) in PARTS {
            for size_m in [0.03, 0.15] {
                let (mesh, parts, _) = make(size_m);
                assert_eq!(mesh.check_solid(), Ok(()), "{name}");
                let solids: Vec<ConvexSolid> =
                    parts.iter().map(|p| ConvexSolid::from_corners(&p.corners).unwrap()).collect();
                let ratio = union_volume_m3(&solids, 200) / f64::from(mesh.moments().volume_m3);
                assert!((ratio - 1.0).abs() < 0.01, "{name}: {ratio}");
                let centre = mesh.moments().centroid.length();
                assert!(centre < 1e-3 * size_m, "{name}: {centre}");
                let longest = mesh.bounds().size().max_element() / size_m;
                assert!((0.9..1.1).contains(&longest), "{name}: {longest}");
            }
        }
    }

    #[test]
    fn the_rotations_stated_are_those_of_the_surface() {
        for (name, make) in PARTS {
            let (mesh, _, rotations) = make(1.0);
            let found = find_symmetry(&mesh, &SymmetryConfig::default()).unwrap();
            assert_eq!(found.order(), rotations.len(), "{name}");
        }
    }

    #[test]
    fn the_middle_of_the_eye_is_empty() {
        let (mesh, ..) = eye_bolt(1.0);
        let top = mesh.bounds().max.z;
        let eye = Vec3::Z * (top - 0.325);
        let nearest = mesh.vertices.iter().map(|v| (*v - eye).length()).fold(f32::MAX, f32::min);
        assert!(nearest > 0.15, "{nearest}");
    }
}
