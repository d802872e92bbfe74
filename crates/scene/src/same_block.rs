//! Whether two poses are one block: how far apart they are modulo the block's own rotations, and how far they may be.

use crate::BlockModel;
use geom::Pose;
use serde::{Deserialize, Serialize};

/// A block type in a pose.
#[derive(Clone, Copy, Debug)]
pub struct PosedModel<'a> {
    /// Type.
    pub model: &'a BlockModel,
    /// Pose: block to local frame.
    pub pose: Pose,
}

/// Displacement and rotation of one pose against another.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PoseError {
    /// E_d: distance of the two centres of mass, metres (Eq. 3.12).
    pub displacement_m: f32,
    /// E_R: smallest rotation between the two over the group, radians (Eq. 3.13, estimate against R̄G).
    pub rotation_rad: f32,
}

/// How far two poses may be apart and still be one block.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoseLimits {
    /// Distance of the centres, metres.
    pub displacement_m: f32,
    /// Rotation over the group, radians; infinite: the place alone decides.
    pub rotation_rad: f32,
}

impl PoseLimits {
    /// A right pose of this type: a tenth of the longest edge of its box and 5°.
    pub fn right(truth: &BlockModel) -> Self {
        Self { displacement_m: 0.1 * truth.d_box_m, rotation_rad: 5.0_f32.to_radians() }
    }

    /// The same place for a block of this type: a quarter of the longest edge, turned at will. Two blocks are never so near.
    pub fn same_place(truth: &BlockModel) -> Self {
        Self { displacement_m: 0.25 * truth.d_box_m, rotation_rad: f32::INFINITY }
    }

    /// Whether an error is within the limits.
    pub fn hold(&self, error: PoseError) -> bool {
        error.displacement_m <= self.displacement_m && error.rotation_rad <= self.rotation_rad
    }
}

impl<'a> PosedModel<'a> {
    /// A type in a pose.
    pub fn new(model: &'a BlockModel, pose: Pose) -> Self {
        Self { model, pose }
    }

    /// How far this is from `truth`, judged with the group of the true type. Displacement is that of the centres of mass: the
    /// origins of two poses equal under the group differ.
    pub fn error(&self, truth: &Self) -> PoseError {
        let centre = |b: &Self| b.pose * b.model.centre;
        PoseError {
            displacement_m: (centre(self) - centre(truth)).length(),
            rotation_rad: truth
                .model
                .symmetry
                .rotation_error_rad(self.pose.rotation, truth.pose.rotation),
        }
    }
}

/// Whether a pose is within `limits` of `truth`, modulo the true type's rotations onto itself. Types may differ.
pub fn same_block(estimate: &PosedModel, truth: &PosedModel, limits: PoseLimits) -> bool {
    limits.hold(estimate.error(truth))
}

/// Whether a pose is right: within a tenth of the block's longest edge and 5° of the true one.
pub fn is_right(estimate: &PosedModel, truth: &PosedModel) -> bool {
    same_block(estimate, truth, PoseLimits::right(truth.model))
}
