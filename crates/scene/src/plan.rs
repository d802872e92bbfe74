//! A stacking plan: which block goes where, in which order.

use crate::ModelId;
use geom::Pose;
use serde::{Deserialize, Deserializer, Serialize};

/// What became of a planned block.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum PlacementState {
    /// Stays in the plan.
    Kept,
    /// Settled, then stood too far above the design surface.
    Overflow,
    /// Never came to rest within the time limit.
    Unsettled,
    /// Left the boundary.
    Outside,
    /// Came to rest on too little support, or moved others.
    Unstable,
}

impl PlacementState {
    /// The word in `placements.csv`.
    pub fn word(self) -> &'static str {
        match self {
            Self::Kept => "kept",
            Self::Overflow => "overflow",
            Self::Unsettled => "unsettled",
            Self::Outside => "outside",
            Self::Unstable => "unstable",
        }
    }

    /// The state that `placements.csv` calls `word`.
    pub fn of_word(word: &str) -> Option<Self> {
        [Self::Kept, Self::Overflow, Self::Unsettled, Self::Outside, Self::Unstable]
            .into_iter()
            .find(|s| s.word() == word)
    }
}

/// One block to place.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Placement {
    /// Position in the placing order, from 1.
    pub order: u32,
    /// Planning round, from 1.
    pub round: u32,
    /// Type.
    pub model: ModelId,
    /// Pose at which the crane lets go, local frame.
    pub drop: Pose,
    /// Pose at rest, local frame.
    pub rest: Pose,
    /// Void below the design surface this block fills, m³.
    pub filled_m3: f32,
    /// Blocks (and 1 for the ground) it touches at rest.
    pub contacts: u32,
    /// Kept, or why not.
    pub state: PlacementState,
}

/// The result of planning.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Plan {
    /// Blocks that stay, in placing order.
    pub placements: Vec<Placement>,
    /// Blocks tried and removed, with the reason.
    pub removed: Vec<Placement>,
    /// The figures.
    pub summary: PlanSummary,
}

/// JSON has no NaN: a figure of nothing, say the porosity of a layer of no blocks, is written as null.
fn nan_if_null<'de, D: Deserializer<'de>, T: Deserialize<'de> + From<f32>>(
    from: D,
) -> Result<T, D::Error> {
    Ok(Option::<T>::deserialize(from)?.unwrap_or_else(|| T::from(f32::NAN)))
}

/// Figures of a plan. Distances are between the planned surface and the design surface, positive below it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PlanSummary {
    /// Rounds run.
    pub rounds: u32,
    /// Blocks kept.
    pub blocks: u32,
    /// Void below the design before planning, m³.
    #[serde(deserialize_with = "nan_if_null")]
    pub void_before_m3: f32,
    /// The same after.
    #[serde(deserialize_with = "nan_if_null")]
    pub void_after_m3: f32,
    /// Mean |distance| to the design after planning, m.
    #[serde(deserialize_with = "nan_if_null")]
    pub mean_distance_m: f32,
    /// Largest |distance|, m.
    #[serde(deserialize_with = "nan_if_null")]
    pub max_distance_m: f32,
    /// Blocks standing above the design by more than the overflow threshold.
    pub protruding: u32,
    /// Concrete, m³.
    #[serde(deserialize_with = "nan_if_null")]
    pub concrete_m3: f32,
    /// Mass, kg.
    #[serde(deserialize_with = "nan_if_null")]
    pub mass_kg: f64,
    /// Area of the works in plan, m².
    #[serde(deserialize_with = "nan_if_null")]
    pub area_m2: f32,
    /// 1 − concrete / volume between the surface before and after: pores of the new layer, in [0, 1].
    #[serde(deserialize_with = "nan_if_null")]
    pub porosity: f32,
    /// The same with the concrete measured by raster columns through the posed meshes, overlaps counted once: a check.
    #[serde(deserialize_with = "nan_if_null")]
    pub porosity_rasterised: f32,
    /// Blocks tried and removed because they stood too high.
    pub overflowed: u32,
    /// Blocks tried that never came to rest.
    pub unsettled: u32,
    /// Blocks tried that rolled away, had too little support or moved under a shake.
    pub unstable: u32,
    /// Blocks tried that ended outside the boundary or the crane's reach.
    pub outside: u32,
}
