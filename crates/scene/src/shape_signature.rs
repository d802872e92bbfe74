//! What tells a block's shape from another whatever its size: which weights know a block.

use crate::BlockModel;
use serde::{Deserialize, Serialize};

/// What tells a shape from another whatever its size.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ShapeSignature {
    /// Volume over d_max³.
    pub volume: f32,
    /// Order of the rotation group.
    pub symmetry: u32,
}

impl ShapeSignature {
    /// Of a block.
    pub fn of(block: &BlockModel) -> Self {
        Self {
            volume: block.volume_m3 / block.d_max_m.powi(3),
            symmetry: block.symmetry.order() as u32,
        }
    }

    /// The same rotations and a volume within 10 %.
    pub fn matches(&self, other: &Self) -> bool {
        self.symmetry == other.symmetry && (self.volume / other.volume - 1.0).abs() < 0.1
    }
}
