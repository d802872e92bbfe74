//! What a reviewer decided about recognised blocks: the content of `review.json`.

use serde::{Deserialize, Serialize};

/// The whole file.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Review {
    /// Version of the format, 1.
    pub format: u32,
    /// Who decided; kept in the manifest.
    #[serde(default)]
    pub reviewer: String,
    /// Decisions, one a block.
    pub blocks: Vec<ReviewedBlock>,
}

/// One decision. The place is stated, not only the number: numbers change from run to run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ReviewedBlock {
    /// Number in the run that was reviewed.
    pub block_id: u32,
    /// The decision.
    #[serde(rename = "verdict")]
    pub decision: Decision,
    /// Type, as corrected.
    pub model: String,
    /// Pose as in `blocks.csv`: mesh file (metres) to site coordinates, as corrected.
    pub x_m: f64,
    /// See `x_m`.
    pub y_m: f64,
    /// See `x_m`.
    pub z_m: f64,
    /// Rotation.
    pub qw: f64,
    /// Rotation.
    pub qx: f64,
    /// Rotation.
    pub qy: f64,
    /// Rotation.
    pub qz: f64,
    /// Fit in the reviewed run, metres, where it had one.
    #[serde(default)]
    pub fitness_m: Option<f32>,
    /// Occlusion in the reviewed run, where it had one.
    #[serde(default)]
    pub occlusion: Option<f32>,
    /// Why, in the reviewer's words.
    #[serde(default)]
    pub note: String,
}

/// What was decided.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Decision {
    /// The block is there as stated.
    Accepted,
    /// There is no such block.
    Rejected,
    /// There is a block, of the type and in the pose the review states.
    Corrected,
}
