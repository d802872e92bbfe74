//! How a surveyor's file marks a point: its class and flags (LAS).

use serde::{Deserialize, Serialize};

/// A class by its number or a flag by its name, as `leave_out` and `keep` take them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(
    untagged,
    expecting = "expected a class number from 0 to 255, \"withheld\", \"synthetic\" or \"overlap\""
)]
pub enum PointMark {
    /// A class: 2 ground, 7 noise, 9 water, 18 high noise …
    Class(u8),
    /// A flag.
    Flag(PointFlag),
}

/// A flag of a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum PointFlag {
    /// Deleted without taking it out of the file.
    Withheld,
    /// Not measured but made.
    Synthetic,
    /// Measured twice, by neighbouring lines.
    Overlap,
}
