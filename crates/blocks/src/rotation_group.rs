//! Finite rotation groups from generators.

use geom::{Quat, Vec3};

/// All products of the generators, identity first. `limit` stops a set that does not close.
pub fn closure(generators: &[Quat], limit: usize) -> Vec<Quat> {
    let same = |a: Quat, b: Quat| a.dot(b).abs() > 1.0 - 1e-5;
    let mut group = vec![Quat::IDENTITY];
    let mut next = 0;
    while next < group.len() && group.len() <= limit {
        for &g in generators {
            let product = (group[next] * g).normalize();
            if !group.iter().any(|&q| same(q, product)) {
                group.push(product);
            }
        }
        next += 1;
    }
    group
}

/// The 12 rotations of a tetrahedron whose four corners point along `legs`.
pub fn tetrahedral(legs: &[Vec3; 4]) -> Vec<Quat> {
    let third = std::f32::consts::TAU / 3.0;
    closure(&legs.map(|axis| Quat::from_axis_angle(axis.normalize(), third)), 12)
}

/// The 24 rotations of a cube with edges along the axes.
pub fn octahedral() -> Vec<Quat> {
    let quarter = std::f32::consts::FRAC_PI_2;
    closure(&[Quat::from_rotation_x(quarter), Quat::from_rotation_z(quarter)], 24)
}

/// The `n` rotations about z.
pub fn cyclic_z(n: u32) -> Vec<Quat> {
    closure(&[Quat::from_rotation_z(std::f32::consts::TAU / n as f32)], n as usize)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn orders() {
        assert_eq!(tetrahedral(&crate::tetrapod::leg_axes()).len(), 12);
        assert_eq!(octahedral().len(), 24);
        assert_eq!(cyclic_z(4).len(), 4);
    }
}
