//! How far an estimated pose is from the true one, modulo the block's proper rotations (Eqs. 3.11–3.13).
//!
//! Eq. 3.13 as printed compares the truth with itself; here the *estimate* is compared with R̄G. Displacement is that
//! of the block's centre, not of the mesh file's origin: the origin of two poses equivalent under the group differs.

use geom::Pose;
use scene::BlockModel;
use serde::{Deserialize, Serialize};

/// Displacement and rotation of one estimate against one truth.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PoseError {
    /// E_d, metres (Eq. 3.12).
    pub displacement_m: f32,
    /// E_R, radians (Eq. 3.13, corrected).
    pub rotation_rad: f32,
}

/// Error of `estimate` of block type `estimated`, judged with the centre and the group of the true type.
pub fn pose_error(
    estimated: &BlockModel,
    estimate: &Pose,
    true_model: &BlockModel,
    truth: &Pose,
) -> PoseError {
    let displacement = (*estimate * estimated.centre) - (*truth * true_model.centre);
    PoseError {
        displacement_m: displacement.length(),
        rotation_rad: true_model.symmetry.rotation_error_rad(estimate.rotation, truth.rotation),
    }
}
