//! How a network writes a rotation: numbers in, rotation matrices out, differentiable.
//!
//! Six numbers made orthonormal (Zhou et al., CVPR 2019) are continuous; the thesis' Euler angles jump where they wrap
//! and are kept to show what that costs (Table 4.1). Matrices are nine numbers, column after column.

use geom::{Mat3, Quat};
use net::prelude::Tensor;
use serde::{Deserialize, Serialize};

/// The way a rotation is written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum RotationCode {
    /// The first two columns, made orthonormal.
    #[default]
    SixNumbers,
    /// Angles about x, then y, then z (the thesis).
    Euler,
}

impl RotationCode {
    /// Numbers a rotation takes.
    pub fn numbers(self) -> usize {
        match self {
            Self::SixNumbers => 6,
            Self::Euler => 3,
        }
    }

    /// `[b, k, numbers]` to matrices `[b, k, 9]`.
    pub fn matrices(self, code: Tensor<3>) -> Tensor<3> {
        match self {
            Self::SixNumbers => six_numbers(code),
            Self::Euler => euler(code),
        }
    }
}

fn six_numbers(code: Tensor<3>) -> Tensor<3> {
    let x = unit(code.clone().narrow(2, 0, 3));
    let y = code.narrow(2, 3, 3);
    let y = unit(y.clone() - x.clone() * (x.clone() * y).sum_dim(2));
    let z = cross(&x, &y);
    Tensor::cat(vec![x, y, z], 2)
}

fn unit(v: Tensor<3>) -> Tensor<3> {
    let length = (v.clone() * v.clone()).sum_dim(2).add_scalar(1e-8).sqrt();
    v / length
}

fn cross(a: &Tensor<3>, b: &Tensor<3>) -> Tensor<3> {
    let of = |t: &Tensor<3>, i| t.clone().narrow(2, i, 1);
    let part = |i: usize, j: usize| of(a, i) * of(b, j) - of(a, j) * of(b, i);
    Tensor::cat(vec![part(1, 2), part(2, 0), part(0, 1)], 2)
}

fn euler(code: Tensor<3>) -> Tensor<3> {
    let angle = |i| code.clone().narrow(2, i, 1);
    let (sx, cx) = (angle(0).sin(), angle(0).cos());
    let (sy, cy) = (angle(1).sin(), angle(1).cos());
    let (sz, cz) = (angle(2).sin(), angle(2).cos());
    let m = |t: &[&Tensor<3>]| t[1..].iter().fold(t[0].clone(), |a, &b| a * b.clone());
    Tensor::cat(
        vec![
            m(&[&cz, &cy]),
            m(&[&sz, &cy]),
            -sy.clone(),
            m(&[&cz, &sy, &sx]) - m(&[&sz, &cx]),
            m(&[&sz, &sy, &sx]) + m(&[&cz, &cx]),
            m(&[&cy, &sx]),
            m(&[&cz, &sy, &cx]) + m(&[&sz, &sx]),
            m(&[&sz, &sy, &cx]) - m(&[&cz, &sx]),
            m(&[&cy, &cx]),
        ],
        2,
    )
}

/// A rotation's matrix, column after column.
pub(crate) fn columns(q: Quat) -> [f32; 9] {
    Mat3::from_quat(q).to_cols_array()
}

/// The rotation of nine such numbers.
pub(crate) fn quat(m: &[f32]) -> Quat {
    let m: [f32; 9] = std::array::from_fn(|i| m[i]);
    Quat::from_mat3(&Mat3::from_cols_array(&m)).normalize()
}

#[cfg(test)]
mod tests {
    use super::*;
    use net::floats;
    use net::prelude::{Device, TensorData};
    use proptest::prelude::*;

    fn matrix(code: RotationCode, numbers: &[f32]) -> Vec<f32> {
        let data = TensorData::new(numbers.to_vec(), [1, 1, numbers.len()]);
        floats(code.matrices(Tensor::from_data(data, &Device::flex())))
    }

    proptest! {
        #[test]
        fn any_numbers_give_a_rotation(numbers in prop::collection::vec(-3.0f32..3.0, 6)) {
            let m = matrix(RotationCode::SixNumbers, &numbers);
            let rows = Mat3::from_cols_array(&std::array::from_fn(|i| m[i]));
            let (a, b) = (geom::Vec3::from_slice(&numbers[..3]), geom::Vec3::from_slice(&numbers[3..]));
            // Two numbers that say nothing about a direction have no rotation.
            prop_assume!(a.length() > 0.05 && b.length() > 0.05 && a.cross(b).length() > 0.05 * a.length() * b.length());
            prop_assert!((rows.determinant() - 1.0).abs() < 1e-3);
            prop_assert!((columns(quat(&m)).iter().zip(&m).all(|(x, y)| (x - y).abs() < 1e-3)));
        }

        #[test]
        fn euler_angles_turn_about_x_then_y_then_z(x in -3.0f32..3.0, y in -3.0f32..3.0, z in -3.0f32..3.0) {
            let want = Quat::from_rotation_z(z) * Quat::from_rotation_y(y) * Quat::from_rotation_x(x);
            let m = matrix(RotationCode::Euler, &[x, y, z]);
            prop_assert!(columns(want).iter().zip(&m).all(|(a, b)| (a - b).abs() < 1e-4));
        }
    }
}
