//! Bin parts that are hard to tell apart in a heap, for measurements: their middle is empty, or they hook into each other.

use crate::BlockError;
use crate::model::assemble;
use crate::rotation_group::cyclic_z;
use geom::{ConvexSolid, Quat, Vec3};
use scene::{BlockModel, ConvexPart, SymmetryGroup};
use std::f32::consts::TAU;

/// Density of the parts, kg/m³: concrete, so that they compare with armour units.
const DENSITY: f32 = 2300.0;
/// Segments of a ring.
const SEGMENTS: usize = 12;

/// A flat ring of twelve segments: outer diameter `size_m`, a third of it the width of the hole's wall, a fifth thick.
pub fn ring(size_m: f32) -> Result<BlockModel, BlockError> {
    let (outer, inner, half) = (0.5 * size_m, 0.32 * size_m, 0.1 * size_m);
    let parts = (0..SEGMENTS)
        .map(|i| {
            let angle = |k: usize| k as f32 / SEGMENTS as f32 * TAU;
            let corner =
                |k: usize, r: f32, z: f32| Quat::from_rotation_z(angle(k)) * Vec3::new(r, 0.0, z);
            [(i, outer), (i, inner), (i + 1, outer), (i + 1, inner)]
                .into_iter()
                .flat_map(|(k, r)| [corner(k, r, half), corner(k, r, -half)])
                .collect()
        })
        .collect();
    // Turning it over about an axis through a segment's corner changes nothing either.
    let about_axis = cyclic_z(SEGMENTS as u32);
    let over = Quat::from_rotation_x(std::f32::consts::PI);
    let rotations =
        about_axis.iter().copied().chain(about_axis.iter().map(|q| *q * over)).collect();
    part("ring", size_m, parts, rotations)
}

/// A plate with two square holes and a post on one end, which falls into the holes of others: length `size_m`.
pub fn holed_plate(size_m: f32) -> Result<BlockModel, BlockError> {
    let block = |x: [f32; 2], y: [f32; 2], z: [f32; 2]| -> Vec<Vec3> {
        (0..8).map(|i| Vec3::new(x[i & 1], y[i >> 1 & 1], z[i >> 2]) * size_m).collect()
    };
    let z = [-0.06, 0.06];
    let parts = vec![
        block([-0.5, 0.5], [0.12, 0.2], z),
        block([-0.5, 0.5], [-0.2, -0.12], z),
        block([-0.5, -0.38], [-0.12, 0.12], z),
        block([-0.06, 0.06], [-0.12, 0.12], z),
        block([0.38, 0.5], [-0.12, 0.12], z),
        block([0.4, 0.48], [-0.05, 0.05], [0.06, 0.36]),
    ];
    part("holed plate", size_m, parts, vec![Quat::IDENTITY])
}

fn part(
    name: &str,
    size_m: f32,
    parts: Vec<Vec<Vec3>>,
    rotations: Vec<Quat>,
) -> Result<BlockModel, BlockError> {
    if !(size_m > 0.0 && size_m.is_finite()) {
        return Err(BlockError::BadSize { name: name.into(), size: size_m });
    }
    let solids: Vec<ConvexSolid> = parts
        .iter()
        .map(|c| ConvexSolid::from_corners(c).expect("the corners above span a solid of any size"))
        .collect();
    let mesh = geom::union(&solids);
    let centre = mesh.moments().centroid;
    let parts = parts.into_iter().map(|corners| ConvexPart { corners }).collect();
    assemble(name, mesh, parts, 1.0, SymmetryGroup::new(centre, rotations), DENSITY)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn they_are_solids_with_the_volume_of_their_parts() {
        let ring = ring(2.0).unwrap();
        let area = |r: f32| 0.5 * SEGMENTS as f32 * r * r * (TAU / SEGMENTS as f32).sin();
        let want = (area(1.0) - area(0.64)) * 0.4;
        assert!((ring.volume_m3 / want - 1.0).abs() < 1e-3, "{} {want}", ring.volume_m3);
        assert_eq!(ring.symmetry.order(), 2 * SEGMENTS);
        let plate = holed_plate(1.0).unwrap();
        let want = 0.12 * (2.0 * 0.08 + 3.0 * 0.12 * 0.24) + 0.08 * 0.1 * 0.3;
        assert!((plate.volume_m3 / want - 1.0).abs() < 1e-3, "{} {want}", plate.volume_m3);
    }

    #[test]
    fn the_middle_of_the_ring_is_empty() {
        let ring = ring(2.0).unwrap();
        assert!(ring.mesh.vertices.iter().all(|v| (*v - ring.centre).truncate().length() > 0.6));
    }

    #[test]
    fn a_size_of_nothing_is_refused() {
        assert!(matches!(super::ring(0.0), Err(BlockError::BadSize { .. })));
        assert!(matches!(holed_plate(f32::NAN), Err(BlockError::BadSize { .. })));
    }
}
