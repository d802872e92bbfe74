//! The transform between the frames of two epochs, and how well it is known.

use crate::dense::{Matrix, carried, zeros};
use geom::{DMat3, DQuat, DVec3};
use serde::Serialize;

/// Parameters of a motion: shift (3), turn (3), relative scale.
pub(crate) const PARAMETERS: usize = 7;

/// Takes a point of the later survey to the earlier survey's frame: `pivot + (1 + scale)·R·(p − pivot) + shift`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Motion {
    /// Point about which it turns, earlier epoch's local frame.
    pub pivot_m: [f64; 3],
    /// East, north, up.
    pub shift_m: [f64; 3],
    /// Rotation vector: tilt about east, tilt about north, turn about the vertical.
    pub turn_rad: [f64; 3],
    /// 0 = none; 1e-6 is one part in a million.
    pub scale: f64,
}

impl Motion {
    /// No motion, about a pivot.
    pub fn none(pivot: DVec3) -> Self {
        Self { pivot_m: pivot.to_array(), shift_m: [0.0; 3], turn_rad: [0.0; 3], scale: 0.0 }
    }

    /// The pivot.
    pub fn pivot(&self) -> DVec3 {
        DVec3::from_array(self.pivot_m)
    }

    /// The shift at the pivot.
    pub fn shift(&self) -> DVec3 {
        DVec3::from_array(self.shift_m)
    }

    /// The rotation.
    pub fn rotation(&self) -> DQuat {
        DQuat::from_scaled_axis(DVec3::from_array(self.turn_rad))
    }

    /// The point moved.
    pub fn apply(&self, p: DVec3) -> DVec3 {
        self.pivot() + self.rotation() * (p - self.pivot()) * (1.0 + self.scale) + self.shift()
    }

    /// The inverse: takes a point of the earlier frame to where the later survey shows it.
    pub fn undo(&self, p: DVec3) -> DVec3 {
        self.pivot()
            + self.rotation().inverse() * (p - self.pivot() - self.shift()) / (1.0 + self.scale)
    }

    /// This motion followed by a small one about the same pivot.
    pub(crate) fn then(&self, step: &[f64; PARAMETERS]) -> Self {
        let turn = DQuat::from_scaled_axis(DVec3::new(step[3], step[4], step[5]));
        let shift = DVec3::new(step[0], step[1], step[2]);
        Self {
            pivot_m: self.pivot_m,
            shift_m: (turn * self.shift() * (1.0 + step[6]) + shift).to_array(),
            turn_rad: (turn * self.rotation()).to_scaled_axis().to_array(),
            scale: (1.0 + self.scale) * (1.0 + step[6]) - 1.0,
        }
    }

    /// The parameters as one vector.
    pub(crate) fn parameters(&self) -> [f64; PARAMETERS] {
        let [x, y, z] = self.shift_m;
        let [a, b, c] = self.turn_rad;
        [x, y, z, a, b, c, self.scale]
    }
}

/// How a block's shift and turn at `p` depend on the parameters.
pub(crate) fn jacobian(pivot: DVec3, p: DVec3) -> [[f64; PARAMETERS]; 6] {
    let r = p - pivot;
    // ω × r = −[r]× ω
    let cross = DMat3::from_cols(
        DVec3::new(0.0, -r.z, r.y),
        DVec3::new(r.z, 0.0, -r.x),
        DVec3::new(-r.y, r.x, 0.0),
    );
    let mut j = [[0.0; PARAMETERS]; 6];
    for i in 0..3 {
        j[i][i] = 1.0;
        j[i + 3][i + 3] = 1.0;
        for k in 0..3 {
            j[i][3 + k] = cross.col(k)[i];
        }
        j[i][6] = r[i];
    }
    j
}

/// Covariance of a block's shift and turn at `p` from that of the motion.
pub(crate) fn covariance_at(pivot: DVec3, p: DVec3, covariance: &Matrix<PARAMETERS>) -> Matrix<6> {
    carried(&jacobian(pivot, p), covariance)
}

/// A motion that is known exactly.
pub(crate) fn exact() -> Matrix<PARAMETERS> {
    zeros::<PARAMETERS>()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_jacobian_is_the_derivative_and_undo_undoes() {
        let pivot = DVec3::new(3.0, -2.0, 1.0);
        let p = DVec3::new(10.0, 5.0, 4.0);
        let motion = Motion::none(pivot);
        let j = jacobian(pivot, p);
        for k in 0..PARAMETERS {
            let mut step = [0.0; PARAMETERS];
            step[k] = 1e-6;
            let moved = (motion.then(&step).apply(p) - p) / 1e-6;
            for i in 0..3 {
                assert!((moved[i] - j[i][k]).abs() < 1e-4, "{i} {k}: {} {}", moved[i], j[i][k]);
            }
        }
        let some = motion.then(&[0.1, -0.2, 0.05, 0.01, -0.02, 0.03, 1e-3]);
        assert!((some.undo(some.apply(p)) - p).length() < 1e-12);
    }
}
