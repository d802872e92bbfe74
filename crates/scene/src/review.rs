//! What a reviewer decided about recognised blocks: the content of `review.json`.

use crate::{Placement, Plan, SiteFrame};
use geom::DVec3;
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
    /// Decisions about planned blocks, for the plan that is made next.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub placements: Vec<ReviewedPlacement>,
}

/// What was decided about one planned block. The pose says which one: the order changes from plan to plan.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ReviewedPlacement {
    /// Position in the placing order of the plan that was reviewed.
    pub order: u32,
    /// The decision.
    pub verdict: PlacementDecision,
    /// Its type.
    pub model: String,
    /// Pose at rest as in `placements.csv`: mesh file (metres) to site coordinates.
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
}

/// What a reviewer decides about a planned block.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum PlacementDecision {
    /// Left out of the next plan.
    Struck,
    /// Kept by the next plan.
    Locked,
}

/// How far a planned block may lie from where it was reviewed and still be the same, metres: files keep millimetres.
const SAME_PLACE_M: f64 = 0.01;

impl Review {
    /// The plan that planning goes on from after this review: locked blocks alone where any is locked, else all that
    /// are not struck out.
    pub fn reviewed_plan(&self, plan: &Plan, frame: &SiteFrame) -> Plan {
        let decision = |p: &Placement| {
            let at = frame.site_from_local(p.rest.translation);
            let same = |r: &&ReviewedPlacement| {
                (at - DVec3::new(r.x_m, r.y_m, r.z_m)).length() < SAME_PLACE_M
            };
            self.placements.iter().find(same).map(|r| r.verdict)
        };
        let any_locked =
            plan.placements.iter().any(|p| decision(p) == Some(PlacementDecision::Locked));
        let stays = |p: &&Placement| match decision(p) {
            Some(PlacementDecision::Locked) => true,
            Some(PlacementDecision::Struck) => false,
            None => !any_locked,
        };
        let placements = plan.placements.iter().filter(stays).cloned().collect();
        Plan { placements, ..plan.clone() }
    }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ModelId, PlacementState};
    use geom::{Pose, Vec3};

    #[test]
    fn struck_blocks_go_and_locked_ones_stay_alone() {
        let frame = SiteFrame { origin: [1000.0, 2000.0, 3.0], ..SiteFrame::default() };
        let at = |x: f32| Pose::from_translation(Vec3::new(x, 1.0, 0.5));
        let placement = |order: u32| Placement {
            order,
            round: 1,
            model: ModelId(0),
            drop: at(order as f32),
            rest: at(order as f32),
            filled_m3: 1.0,
            contacts: 3,
            state: PlacementState::Kept,
            handling: crate::Handling::default(),
        };
        let plan = Plan { placements: (1..=3).map(placement).collect(), ..Plan::default() };
        // Numbers of another plan; the place counts, to the millimetres of a file.
        let reviewed = |x: f64, verdict| ReviewedPlacement {
            order: 77,
            verdict,
            model: "a".into(),
            x_m: 1000.0004 + x,
            y_m: 2001.0,
            z_m: 3.5,
            qw: 1.0,
            qx: 0.0,
            qy: 0.0,
            qz: 0.0,
        };
        let left = |placements| {
            let review = Review { format: 1, placements, ..Review::default() };
            let plan = review.reviewed_plan(&plan, &frame);
            plan.placements.iter().map(|p| p.order).collect::<Vec<_>>()
        };
        use PlacementDecision::{Locked, Struck};
        assert_eq!(left(vec![]), [1, 2, 3]);
        assert_eq!(left(vec![reviewed(2.0, Struck), reviewed(9.0, Struck)]), [1, 3]);
        assert_eq!(left(vec![reviewed(3.0, Locked)]), [3]);
        assert_eq!(left(vec![reviewed(3.0, Locked), reviewed(2.0, Struck)]), [3]);
    }
}
