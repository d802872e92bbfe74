//! How well the place of a built block is known against its plan.
//!
//! In: the built block, both surveys' registration, the sensor of the survey the plan was made on. Out: the covariance of its
//! offset in true coordinates. A plan stands where its survey shows the pile. What that survey as a whole is off by (a drone's
//! drift, a sounder's position and heave) is in every offset alike and shows in neither survey, so it is part of the level.

use crate::body::Body;
use crate::common_error::CommonError;
use crate::compare::Comparison;
use crate::dense::{Matrix, along, part, sum};
use crate::detection::LEVEL;
use crate::motion::covariance_at;
use geom::DVec3;

/// Of shifts against a plan.
pub(crate) struct BuiltLevel<'a> {
    pub comparison: &'a Comparison,
    /// What the sensor of the plan's survey does.
    pub of_plan: CommonError,
}

impl BuiltLevel<'_> {
    /// Covariance of the offset of a built block.
    pub fn covariance(&self, found: &Body) -> Matrix<3> {
        let r = &self.comparison.reference;
        let of_motion = covariance_at(r.motion.pivot(), found.centre, &r.covariance);
        let between = self.comparison.common_error.covariance();
        let all = [between, of_motion, self.of_plan.covariance()];
        part(&all.iter().fold(found.covariance, |a, b| sum(&a, b)), 0)
    }
}

/// 1.96 standard deviations along the direction of an offset, and along each axis.
pub(crate) fn levels_m(covariance: &Matrix<3>, off: DVec3) -> (f64, [f64; 3]) {
    let direction = off.try_normalize().unwrap_or(DVec3::Z);
    let sd = |d: DVec3| LEVEL * along(covariance, d.to_array()).max(0.0).sqrt();
    (sd(direction), [DVec3::X, DVec3::Y, DVec3::Z].map(sd))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_level_follows_the_direction() {
        let covariance = [[4e-4, 0.0, 0.0], [0.0, 1e-4, 0.0], [0.0, 0.0, 9e-4]];
        let (along_z, axes) = levels_m(&covariance, DVec3::new(0.0, 0.0, -0.4));
        assert!((along_z - 1.96 * 0.03).abs() < 1e-12);
        assert!((axes[0] - 1.96 * 0.02).abs() < 1e-12 && (axes[1] - 1.96 * 0.01).abs() < 1e-12);
        assert_eq!(levels_m(&covariance, DVec3::ZERO).0, axes[2]);
    }
}
