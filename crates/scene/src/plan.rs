//! A stacking plan: which block goes where, in which order.

use crate::{InstanceId, ModelId};
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
    /// How it gets there, where that is not a new block straight down.
    #[serde(default)]
    pub handling: Handling,
}

impl Placement {
    /// Whether a new block is placed; if not, one of the pile is set elsewhere.
    pub fn is_new(&self) -> bool {
        self.handling.reset.is_none()
    }
}

/// How a block gets to its place; the default is a new block that is lowered straight down.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Handling {
    /// Poses, local frame, through which the crane carries the block: straight down to the first, from each to the next on a
    /// straight line and in an even turn, from the last to the pose in which it is let go. Empty: straight down.
    pub path: Vec<Pose>,
    /// The block of the pile that it is.
    pub reset: Option<Reset>,
    /// Its node in the pattern.
    pub node: Option<PatternNode>,
}

/// A block of the pile that is lifted and set elsewhere.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Reset {
    /// Its number as recognised.
    pub block: InstanceId,
    /// Where it stands, local frame.
    pub from: Pose,
}

/// A node of a placing pattern.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct PatternNode {
    /// Layer, from 1 at the bottom.
    pub layer: u32,
    /// Row, from 1 at the pattern's origin; below it 0 and less.
    pub row: i32,
    /// Place in the row, counted likewise.
    pub column: i32,
}

impl std::fmt::Display for PatternNode {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "L{} R{} C{}", self.layer, self.row, self.column)
    }
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
    /// Windows in which nothing could be lowered straight down when blocks began to be guided.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub shut: u32,
    /// Those of them that got a block.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub opened: u32,
    /// Blocks kept that are carried along a path.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub guided: u32,
    /// Blocks of the pile that are lifted and set elsewhere.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub reset: u32,
}

fn is_zero(count: &u32) -> bool {
    *count == 0
}
