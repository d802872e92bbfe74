//! What makes one plan better than another: five figures a user understands, each with a weight.

use crate::{
    PlanError,
    site::{Site, TypeToPlace},
    stack::Stack,
};
use scene::Placement;
use serde::{Deserialize, Serialize};

/// Contacts beyond the fewest allowed from which a block stands no firmer.
const ENOUGH: u32 = 3;

/// Weights of a plan's figures. One unit of each is about one block's worth.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ObjectiveConfig {
    /// Void filled below the design, in volumes of one block.
    pub void: f32,
    /// Blocks; below 0 fewer blocks are better.
    pub count: f32,
    /// Against blocks that stand above the design by more than the overflow threshold.
    pub protrusion: f32,
    /// For contacts beyond the fewest allowed: 0 for a block with none, 1 for one with three or more.
    pub stability: f32,
    /// Against cost, in costs of one block of the largest type.
    pub cost: f32,
}

impl Default for ObjectiveConfig {
    fn default() -> Self {
        Self { void: 1.0, count: 0.0, protrusion: 1.0, stability: 0.0, cost: 0.0 }
    }
}

impl ObjectiveConfig {
    /// Fewest blocks that reach the design: a block that fills less than half its volume is left out.
    pub fn fewest() -> Self {
        Self { count: -0.5, ..Self::default() }
    }

    /// As much void filled as can be.
    pub fn fullest() -> Self {
        Self { protrusion: 0.25, ..Self::default() }
    }

    /// Blocks that touch many others.
    pub fn most_stable() -> Self {
        Self { stability: 1.0, ..Self::default() }
    }

    pub(crate) fn check(&self) -> Result<(), PlanError> {
        let weights = [
            ("objective.void", self.void),
            ("objective.count", self.count),
            ("objective.protrusion", self.protrusion),
            ("objective.stability", self.stability),
            ("objective.cost", self.cost),
        ];
        match weights.into_iter().find(|(_, value)| !value.is_finite()) {
            Some((key, value)) => {
                Err(PlanError::BadSetting { key, value, why: "it must be a number" })
            }
            None => Ok(()),
        }
    }

    /// Worth of one placement but for the void it fills.
    pub(crate) fn of_block(&self, site: &Site, stack: &Stack, p: &Placement) -> f32 {
        let kind = site.of_model(p.model).unwrap_or(site.main());
        self.of_one(kind, stack, p) - self.cost * kind.cost / site.main().cost
    }

    /// Worth of one placement but for void and cost.
    fn of_one(&self, kind: &TypeToPlace, stack: &Stack, p: &Placement) -> f32 {
        let spare = p.contacts.saturating_sub(kind.settings.minimum_supports).min(ENOUGH);
        self.count + self.stability * spare as f32 / ENOUGH as f32
            - self.protrusion * f32::from(u8::from(stands_out(kind, stack, p)))
    }

    /// Worth of one placement among others of its type.
    pub(crate) fn among(&self, kind: &TypeToPlace, stack: &Stack, p: &Placement) -> f32 {
        let volume_m3 = stack.catalog.get(p.model).volume_m3;
        self.void * p.filled_m3 / volume_m3 + self.of_one(kind, stack, p)
    }

    /// Worth of void filled.
    pub(crate) fn of_void(&self, site: &Site, stack: &Stack, filled_m3: f32) -> f32 {
        self.void * filled_m3 / stack.catalog.get(site.main().model).volume_m3
    }
}

/// Whether a corner stands above the design by more than the overflow threshold.
pub(crate) fn protrudes(site: &Site, stack: &Stack, p: &Placement) -> bool {
    stands_out(site.of_model(p.model).unwrap_or(site.main()), stack, p)
}

fn stands_out(kind: &TypeToPlace, stack: &Stack, p: &Placement) -> bool {
    let limit_m = kind.settings.overflow_m.max(0.0);
    let above_m = |v: geom::Vec3| {
        let at = p.rest * v;
        at.z - stack.design_level_m(at.x, at.y)
    };
    stack.catalog.get(p.model).mesh.vertices.iter().any(|&v| above_m(v) > limit_m)
}
