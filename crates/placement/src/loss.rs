//! The loss: distance of the centres plus geodesic distance modulo symmetry (METHOD §6, Eqs. 4.4–4.6), for several modes.
//!
//! Every good drop of a window teaches the mode nearest to it (and all others a little, so that none is never taught);
//! the sureness is taught which modes were nearest to how much of them. With one mode and one target that is the
//! thesis' loss.

use crate::network::Output;
use geom::{Quat, Vec3};
use net::floats;
use net::prelude::{Device, Tensor, TensorData, log_softmax};
use scene::SymmetryGroup;

/// Share of a target's weight that all modes get. Free choice: enough that no mode is never taught.
const SPREAD: f32 = 0.05;
/// Weight of a block length of displacement against a radian.
const PLACE_WEIGHT: f32 = 2.0;
/// Weight of the sureness.
const SURENESS_WEIGHT: f32 = 0.3;
/// A cosine nearer to 1 has no slope that f32 can tell.
const FLATTEST: f32 = 1.0 - 1e-5;

/// A window's target: poses with weights that sum to 1.
#[derive(Clone, Debug, Default)]
pub(crate) struct Target {
    pub poses: Vec<(Vec3, Quat, f32)>,
}

/// Losses of a step, means over its windows.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct LossReport {
    pub total: f32,
    /// Radians and block lengths of the nearest modes, weighted as taught.
    pub pose: f32,
    pub sureness: f32,
}

/// The loss of a batch and what it is made of.
pub(crate) fn loss(
    output: Output,
    targets: &[Target],
    symmetry: &SymmetryGroup,
    device: &Device,
) -> (Tensor<1>, LossReport) {
    let b = targets.len();
    let k = output.centre.dims()[1];
    let g = targets.iter().map(|l| l.poses.len()).max().unwrap_or(0).max(1);
    let s = symmetry.order();
    let (mut centre, mut rotation, mut weight) = (Vec::new(), Vec::new(), Vec::new());
    for target in targets {
        for i in 0..g {
            // Padding weighs nothing.
            let (c, q, w) =
                target.poses.get(i).copied().unwrap_or((Vec3::ZERO, Quat::IDENTITY, 0.0));
            centre.extend(c.to_array());
            weight.push(w);
            for &turn in symmetry.rotations() {
                rotation.extend(crate::rotation::columns(q * turn));
            }
        }
    }
    let centre = Tensor::<4>::from_data(TensorData::new(centre, [b, 1, g, 3]), device);
    let rotation = Tensor::<3>::from_data(TensorData::new(rotation, [b, g * s, 9]), device);
    let weights = Tensor::<2>::from_data(TensorData::new(weight.clone(), [b, g]), device);

    let away = output.centre.reshape([b, k, 1, 3]) - centre; // [b, k, g, 3]
    let away = (away.clone() * away).sum_dim(3).add_scalar(1e-8).sqrt().reshape([b, k, g]);
    // The trace of Rᵀ·R' is the sum of their products.
    let trace = output
        .rotation
        .matmul(rotation.swap_dims(1, 2))
        .reshape([b, k, g, s])
        .max_dim(3)
        .reshape([b, k, g]);
    let cosine = trace.sub_scalar(1.0).mul_scalar(0.5).clamp(-FLATTEST, FLATTEST);
    let cost = away.mul_scalar(PLACE_WEIGHT) + cosine.acos(); // [b, k, g]

    let nearest = nearest_modes(&floats(cost.clone()), &weight, [b, k, g]);
    let taught = Tensor::<2>::from_data(TensorData::new(nearest, [b, k]), device);
    let sureness = -(log_softmax(output.sureness, 1) * taught).sum().div_scalar(b as f32);
    let best =
        (cost.clone().min_dim(1).reshape([b, g]) * weights.clone()).sum().div_scalar(b as f32);
    let all = (cost.mean_dim(1).reshape([b, g]) * weights).sum().div_scalar(b as f32);
    let total = best.clone().mul_scalar(1.0 - SPREAD)
        + all.mul_scalar(SPREAD)
        + sureness.clone().mul_scalar(SURENESS_WEIGHT);
    let number = |t: &Tensor<1>| floats(t.clone())[0];
    let report =
        LossReport { total: number(&total), pose: number(&best), sureness: number(&sureness) };
    (total, report)
}

/// How much of each window's target is nearest to each mode, `[b, k]`.
fn nearest_modes(cost: &[f32], weight: &[f32], [b, k, g]: [usize; 3]) -> Vec<f32> {
    let mut share = vec![0.0; b * k];
    for w in 0..b {
        for t in 0..g {
            let of = |mode: usize| cost[(w * k + mode) * g + t];
            let nearest = (0..k).min_by(|&x, &y| of(x).total_cmp(&of(y))).unwrap_or(0);
            share[w * k + nearest] += weight[w * g + t];
        }
    }
    share
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tensor<const D: usize>(values: &[f32], shape: [usize; D]) -> Tensor<D> {
        Tensor::from_data(TensorData::new(values.to_vec(), shape), &Device::flex())
    }

    #[test]
    fn a_pose_turned_by_a_symmetry_costs_nothing_and_the_nearest_mode_counts() {
        let shape = scene::Shape::Tetrapod { size: 2.0 };
        let block = blocks::shape_model("t", shape, 2300.0).unwrap();
        let (right, wrong) = (Quat::from_rotation_x(0.4), Quat::from_rotation_x(0.9));
        let turned = right * block.symmetry.rotations()[3];
        let target = Target { poses: vec![(Vec3::new(0.1, 0.2, -0.3), right, 1.0)] };
        let rotations =
            [crate::rotation::columns(wrong), crate::rotation::columns(turned)].concat();
        let output = |centre: [f32; 6]| Output {
            centre: tensor(&centre, [1, 2, 3]),
            rotation: tensor(&rotations, [1, 2, 9]),
            sureness: tensor(&[0.0, 0.0], [1, 2]),
        };
        let device = Device::flex();
        let report = |centre| {
            loss(output(centre), std::slice::from_ref(&target), &block.symmetry, &device).1
        };
        let exact = report([0.1, 0.2, -0.3, 0.1, 0.2, -0.3]);
        assert!(exact.pose < 0.01, "{exact:?}");
        assert!((exact.sureness - 2.0_f32.ln()).abs() < 1e-4);
        let off = report([9.0, 9.0, 9.0, 0.1, 0.2, 0.2]);
        assert!((off.pose - PLACE_WEIGHT * 0.5).abs() < 0.01, "{off:?}");
    }

    #[test]
    fn one_mode_pays_the_angle_between_attitudes() {
        let none = SymmetryGroup::trivial(Vec3::ZERO);
        let target = Target { poses: vec![(Vec3::ZERO, Quat::from_rotation_y(0.7), 1.0)] };
        let output = Output {
            centre: tensor(&[0.0; 3], [1, 1, 3]),
            rotation: tensor(&crate::rotation::columns(Quat::IDENTITY), [1, 1, 9]),
            sureness: tensor(&[0.0], [1, 1]),
        };
        let (_, report) = loss(output, &[target], &none, &Device::flex());
        assert!((report.pose - 0.7).abs() < 1e-3, "{report:?}");
    }
}
