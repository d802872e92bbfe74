//! Attitudes to try: rotations spread evenly over SO(3) modulo the block's symmetry, and one drawn at random.

use geom::{Pose, Quat};
use rand::Rng;
use rand_distr::{Distribution, StandardNormal};
use scene::SymmetryGroup;

/// About `count` rotations that no symmetry maps onto each other, evenly spread (super-Fibonacci spiral:
/// M. Alexa, "Super-Fibonacci Spirals", CVPR 2022, formula only).
pub(crate) fn spread(count: usize, symmetry: &SymmetryGroup) -> Vec<Quat> {
    let all = count * symmetry.order();
    let (phi, psi) = (2.0_f64.sqrt(), 1.533_751_168_755_204_3_f64);
    (0..all)
        .filter_map(|i| {
            let s = i as f64 + 0.5;
            let (t, tau) = (s / all as f64, std::f64::consts::TAU);
            let (r, big_r) = (t.sqrt(), (1.0 - t).sqrt());
            let (alpha, beta) = (tau * s / phi, tau * s / psi);
            let q = Quat::from_xyzw(
                (r * alpha.sin()) as f32,
                (r * alpha.cos()) as f32,
                (big_r * beta.sin()) as f32,
                (big_r * beta.cos()) as f32,
            )
            .normalize();
            let canonical = symmetry.canonical(&Pose::from_parts(geom::Vec3::ZERO, q)).rotation;
            (canonical.dot(q).abs() > 1.0 - 1e-5).then_some(q)
        })
        .collect()
}

/// A rotation drawn uniformly.
pub(crate) fn random(rng: &mut impl Rng) -> Quat {
    loop {
        let mut draw = || -> f32 { StandardNormal.sample(rng) };
        let q = Quat::from_xyzw(draw(), draw(), draw(), draw());
        if q.length() > 1e-3 {
            return q.normalize();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use geom::SeedTree;

    #[test]
    fn attitudes_cover_every_rotation_modulo_symmetry() {
        let spec = scene::Shape::Tetrapod { size: 2.0 };
        let model = blocks::shape_model("t", spec, 2300.0).unwrap();
        let set = spread(256, &model.symmetry);
        assert!((200..=320).contains(&set.len()), "{}", set.len());
        let mut rng = SeedTree::new(1).rng();
        let far = (0..500)
            .map(|_| random(&mut rng))
            .map(|q| {
                set.iter()
                    .map(|&s| model.symmetry.rotation_error_rad(s, q))
                    .fold(f32::INFINITY, f32::min)
            })
            .fold(0.0, f32::max);
        assert!(far < 25.0_f32.to_radians(), "farthest rotation {:.1}°", far.to_degrees());
    }
}
