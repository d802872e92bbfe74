//! Quantities by section, as port works are measured and paid.

use serde::{Deserialize, Serialize};

/// Areas of one cross-section, m², and volumes up to it from the section before by average end area, m³.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SectionQuantity {
    /// Distance along the works, metres.
    pub chainage_m: f64,
    /// Distance from the section before; 0 at the first.
    pub length_m: f64,
    /// Between the survey and the design above it.
    pub missing: AreaVolume,
    /// Between the survey and the surface with the plan.
    pub planned: AreaVolume,
    /// Between the surface with the plan and the design above it.
    pub still_missing: AreaVolume,
    /// Between the design and the surface with the plan above it.
    pub above: AreaVolume,
}

/// One quantity of a section.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct AreaVolume {
    /// In this section, m².
    pub area_m2: f64,
    /// From the section before to this one: mean of the two areas times the distance, m³.
    pub volume_m3: f64,
}
