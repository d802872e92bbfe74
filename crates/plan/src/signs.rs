//! The signs by which a place for a block is ranked, as numbers without unit, and their weights.
//!
//! In: a resting block and the pile before it came. Out: how far it stands above the design, what void it traps, what protrudes,
//! how loose it is, how wedged, how far from the crane: all the worse the larger. Today's weights are those of policy `search`.

use crate::{
    PlanConfig, PlanError, PlanInput, SearchConfig,
    acceptance::{self, Impact},
    reset,
    site::{self, TypeToPlace},
    stack::Stack,
};
use geom::{SeedTree, Silent};
use scene::{InstanceId, PlacedBlock, Placement, Plan, SIGNS};
use serde::{Deserialize, Serialize};

/// Contacts from which a block counts as held on all sides. Free choice.
const HELD: f32 = 5.0;

/// One number for each of [`SIGNS`].
pub type Signs = [f32; SIGNS.len()];

/// Weights of the signs. They rank places that all keep the rules of stability; none can make a rule weaker.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SignWeights {
    /// Of the height above the design, in block lengths.
    pub above: f32,
    /// Of the volume between old and new surface, void trapped below included.
    pub raised: f32,
    /// Of the volume above the design.
    pub protruding: f32,
    /// Of missing contacts.
    pub loose: f32,
    /// Of the share under other blocks.
    pub wedged: f32,
    /// Of the distance from the crane, as part of its reach.
    pub far: f32,
}

impl SignWeights {
    /// Those of policy `search` without any learning.
    pub fn today(search: &SearchConfig) -> Self {
        search.weights.unwrap_or(Self {
            above: 1.0,
            raised: search.trapped_weight,
            protruding: search.protrusion_weight,
            loose: 0.0,
            wedged: 0.0,
            far: 0.0,
        })
    }

    /// In the order of [`SIGNS`].
    pub fn to_array(self) -> Signs {
        [self.above, self.raised, self.protruding, self.loose, self.wedged, self.far]
    }

    /// From the order of [`SIGNS`].
    pub fn of_array([above, raised, protruding, loose, wedged, far]: Signs) -> Self {
        Self { above, raised, protruding, loose, wedged, far }
    }

    /// What speaks against a place.
    pub fn cost(&self, signs: &Signs) -> f32 {
        self.to_array().iter().zip(signs).map(|(w, s)| w * s).sum()
    }

    pub(crate) fn check(&self) -> Result<(), PlanError> {
        match self.to_array().into_iter().find(|w| !(*w >= 0.0 && w.is_finite())) {
            Some(value) => Err(PlanError::BadSetting {
                key: "search.weights",
                value,
                why: "no weight may be negative",
            }),
            None => Ok(()),
        }
    }
}

/// The signs of a block at rest on the pile as it was before it came.
pub(crate) fn signs_of(kind: &TypeToPlace, stack: &Stack, p: &Placement, impact: &Impact) -> Signs {
    let block = stack.catalog.get(p.model);
    let centre = p.rest * block.centre;
    let area = block.volume_m3.powf(2.0 / 3.0);
    let length_m = block.d_box_m;
    let reach = kind.allowed.reach.as_ref();
    [
        acceptance::above_design_m(stack, centre) / length_m,
        impact.raised_m3 / area / length_m,
        impact.protruding_m3 / area / length_m,
        (1.0 - p.contacts as f32 / HELD).max(0.0),
        impact.wedged,
        reach.map_or(0.0, |r| (r.distance_m(centre.truncate()) / r.radius_m()).min(1.0)),
    ]
}

/// The signs of every block of a plan, in its order, each on the pile with the blocks before it.
pub fn signs_of_plan(
    input: &PlanInput,
    config: &PlanConfig,
    plan: &Plan,
) -> Result<Vec<Signs>, PlanError> {
    let mut site = site::prepare(input, config, SeedTree::new(0), &Silent)?;
    site.lifted = reset::lifted(input, &plan.placements);
    let mut stack = site.stack(input);
    let mut list = Vec::with_capacity(plan.placements.len());
    for p in &plan.placements {
        let kind = site.of_model(p.model).unwrap_or(site.main());
        let impact = acceptance::impact(&stack, p.model, &p.rest);
        list.push(signs_of(kind, &stack, p, &impact));
        let block = InstanceId(stack.blocks.len() as u32 + 1);
        stack.add(PlacedBlock { block, model: p.model, site_from_block: p.rest }, 1);
    }
    Ok(list)
}
