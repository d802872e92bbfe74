//! The chains that one word chooses: ours, and the thesis' by the letter.

use crate::Config;
use plan::PlanConfig;
use pose::PoseConfig;
use segment::SegmentConfig;
use serde::{Deserialize, Serialize};

/// Which method's values stand where nothing else is said.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// Votes, distance-field search with verification, placements searched and tried in physics.
    #[default]
    Ours,
    /// The thesis' chain: embedding and Algorithm 1, point pair features with point-to-point ICP and the type of least fitness,
    /// random drops.
    Thesis,
}

impl Method {
    /// Whether it is the one that needs no word.
    pub fn is_default(&self) -> bool {
        *self == Self::default()
    }
}

impl Config {
    /// All settings of a method.
    pub fn of(method: Method) -> Self {
        match method {
            Method::Ours => Self::default(),
            Method::Thesis => Self {
                method,
                segment: SegmentConfig::thesis(),
                pose: PoseConfig::thesis(),
                plan: PlanConfig::thesis(),
                ..Self::default()
            },
        }
    }
}
