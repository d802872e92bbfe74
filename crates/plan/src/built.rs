//! One way the works may go: every block is let go where the crane's errors put it, and what then stands is planned on from.
//!
//! In: a plan and the errors. Out: how many blocks stand when no window is left. A plan knows its blocks where it wants
//! them; a real one lies a hand's breadth beside, leaves gaps that take another block and closes others. The count of the plan
//! alone is therefore not what the works will need.

use crate::site::Site;
use crate::stack::Stack;
use crate::trial::Drop;
use crate::{PlanConfig, PlanError, PlanInput, replan, site};
use geom::{Observer, Pose, Quat, SeedTree, Silent, Vec3};
use rand::Rng;
use rand_distr::{Distribution, StandardNormal};
use scene::{InstanceId, ModelId, PlacedBlock, Plan};
use serde::{Deserialize, Serialize};

/// How exactly blocks are placed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct BuildingConfig {
    /// Standard deviation of the place of release along each horizontal axis, metres; left out: 0.15 m, of blocks smaller than
    /// 2 m the same part of their size.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shift_sd_m: Option<f32>,
    /// Standard deviation of the attitude about each axis, degrees.
    pub turn_sd_deg: f32,
    /// After how many shifts, each surveyed and planned anew, the works end at the latest; 0: the count of the plans alone.
    pub shifts: u32,
}

impl Default for BuildingConfig {
    fn default() -> Self {
        Self { shift_sd_m: None, turn_sd_deg: 10.0, shifts: 4 }
    }
}

/// Part of a block's size that a crane is off by, and the most, metres.
const SHIFT_SD: (f32, f32) = (0.075, 0.15);
/// More shifts than any works have.
const MOST_SHIFTS: u32 = 100;

impl BuildingConfig {
    /// Errors: a value out of range, by its key.
    pub(crate) fn check(&self) -> Result<(), PlanError> {
        let values = [
            ("uncertainty.building.shift_sd_m", self.shift_sd_m.unwrap_or(0.0)),
            ("uncertainty.building.turn_sd_deg", self.turn_sd_deg),
        ];
        if let Some((key, value)) = values.into_iter().find(|(_, v)| !(*v >= 0.0 && v.is_finite()))
        {
            return Err(PlanError::BadSetting { key, value, why: "it must not be negative" });
        }
        match self.shifts {
            0..=MOST_SHIFTS => Ok(()),
            value => Err(PlanError::TooMuch {
                key: "uncertainty.building.shifts",
                value,
                most: MOST_SHIFTS,
            }),
        }
    }
}

/// Blocks that stand when `first` has been built with errors and planned on from until nothing is left to place.
pub(crate) fn built_blocks(
    input: &PlanInput,
    config: &PlanConfig,
    first: &Plan,
    errors: &BuildingConfig,
    seed: SeedTree,
    observer: &dyn Observer,
) -> Result<u32, PlanError> {
    let mut placed: Vec<PlacedBlock> = input.placed.to_vec();
    let mut plan = first.clone();
    for shift in 0..errors.shifts {
        if plan.placements.is_empty() {
            break;
        }
        if observer.cancelled() {
            return Err(PlanError::Cancelled);
        }
        let seed = seed.child("shift", shift.into());
        let standing = placed.clone();
        let now = PlanInput { placed: &standing, ..*input };
        let site = site::prepare(&now, config, seed, &Silent)?;
        let mut stack = site.stack(&now);
        let mut rng = seed.child("crane", 0).rng();
        for p in plan.placements.iter().filter(|p| p.is_new()) {
            let drop = missed(&stack, p.model, &p.drop, errors, &mut rng);
            let Some(rest) = rest(&site, &stack, p.model, &drop) else { continue };
            let block = InstanceId(stack.blocks.len() as u32 + 1);
            let there = PlacedBlock { block, model: p.model, site_from_block: rest };
            stack.add(there, 1);
            placed.push(there);
        }
        if shift + 1 < errors.shifts {
            let now = PlanInput { placed: &placed, ..*input };
            plan = replan(&now, &Plan::default(), config, seed.child("plan", 0), &Silent)?;
        }
    }
    Ok((placed.len() - input.placed.len()) as u32)
}

/// Where the crane really lets go: beside and turned, and never inside what stands.
fn missed(
    stack: &Stack,
    model: ModelId,
    drop: &Pose,
    errors: &BuildingConfig,
    rng: &mut impl Rng,
) -> Pose {
    let block = stack.catalog.get(model);
    let mut normal = || -> f32 { StandardNormal.sample(rng) };
    let shift_sd_m = errors.shift_sd_m.unwrap_or(SHIFT_SD.1.min(SHIFT_SD.0 * block.d_box_m));
    let shift = Vec3::new(normal(), normal(), 0.0) * shift_sd_m;
    let turn = Vec3::new(normal(), normal(), normal()) * errors.turn_sd_deg.to_radians();
    let rotation = (Quat::from_scaled_axis(turn) * drop.rotation).normalize();
    let centre = *drop * block.centre + shift;
    let pose = Pose::from_parts(centre - rotation * block.centre, rotation);
    let (_, under) = stack.surface.top_and_underside(&block.mesh, &pose);
    let cells = under.z_m.iter().zip(&stack.surface.z_m);
    let lift_m = cells.map(|(under, top)| top - under).filter(|d| d.is_finite());
    let lift_m = lift_m.fold(0.0, f32::max);
    Pose::from_parts(pose.translation + Vec3::Z * lift_m, rotation)
}

/// Where it comes to rest; a block that still rolls when the time is over lies where it is then. `None`: it left the site.
fn rest(site: &Site, stack: &Stack, model: ModelId, drop: &Pose) -> Option<Pose> {
    let settings = &site.of_model(model)?.settings;
    let trial = Drop::new(stack, settings, model, drop).settle(settings.roam_m, &|_| false);
    let rest = trial.rest;
    let centre = rest * stack.catalog.get(model).centre;
    centre.is_finite().then_some(rest)
}
