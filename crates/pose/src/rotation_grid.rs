//! Rotations spread evenly over SO(3), each physical orientation of a symmetric block once.
//!
//! Super-Fibonacci spirals (Alexa 2022) give any number of even samples without a table. Of all rotations that
//! look the same under the block's group only the one nearest the identity is kept, so that a tetrapod needs a
//! twelfth and a cube a twenty-fourth of the starts.

use geom::{DQuat, Quat};
use scene::SymmetryGroup;

/// Solution of ψ⁴ = ψ + 4.
const PSI: f64 = 1.533_751_168_755_204_3;

/// About `8π²/spacing³` even rotations modulo the group, at most `limit` of them.
pub fn rotation_grid(group: &SymmetryGroup, spacing_rad: f32, limit: usize) -> Vec<Quat> {
    let volume = 8.0 * std::f64::consts::PI.powi(2);
    let wanted = volume / f64::from(spacing_rad).powi(3);
    let count = wanted.min((limit * group.order()) as f64).max(1.0) as usize;
    (0..count)
        .map(|i| super_fibonacci(i, count))
        .filter(|q| group.rotations().iter().all(|&g| (*q * g).w.abs() <= q.w.abs()))
        .collect()
}

fn super_fibonacci(i: usize, count: usize) -> Quat {
    let s = i as f64 + 0.5;
    let t = s / count as f64;
    let tau = std::f64::consts::TAU;
    let (r, big_r) = (t.sqrt(), (1.0 - t).sqrt());
    let (alpha, beta) = (tau * s / std::f64::consts::SQRT_2, tau * s / PSI);
    DQuat::from_xyzw(r * alpha.sin(), r * alpha.cos(), big_r * beta.sin(), big_r * beta.cos())
        .as_quat()
        .normalize()
}

#[cfg(test)]
mod tests {
    use super::*;
    use geom::Vec3;
    use proptest::prelude::*;

    fn third_turns() -> SymmetryGroup {
        let turns =
            (0..3).map(|k| Quat::from_rotation_z(k as f32 * std::f32::consts::TAU / 3.0)).collect();
        SymmetryGroup::new(Vec3::ZERO, turns)
    }

    #[test]
    fn symmetry_divides_the_number_of_starts() {
        let all = rotation_grid(&SymmetryGroup::trivial(Vec3::ZERO), 0.4, usize::MAX >> 8).len();
        let third = rotation_grid(&third_turns(), 0.4, usize::MAX >> 8).len();
        assert!((third as f32 / all as f32 - 1.0 / 3.0).abs() < 0.05, "{third} of {all}");
        assert!(rotation_grid(&third_turns(), 0.2, 50).len() <= 60);
    }

    proptest! {
        /// No orientation is farther from the grid than about its spacing.
        #[test]
        fn covers_every_orientation(axis in prop::array::uniform3(-1.0_f32..1.0), angle in 0.0_f32..3.1) {
            let q = Quat::from_axis_angle(Vec3::from_array(axis).try_normalize().unwrap_or(Vec3::X), angle);
            let group = third_turns();
            let grid = rotation_grid(&group, 0.4, 100_000);
            let nearest = grid.iter().map(|&g| group.rotation_error_rad(g, q)).fold(f32::INFINITY, f32::min);
            prop_assert!(nearest < 0.42, "{}", nearest);
        }
    }
}
