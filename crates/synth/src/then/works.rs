//! What a crane does with a plan.

use super::happening::Works;
use super::storm::about_centre;
use super::{Events, Start, What};
use crate::SynthError;
use crate::pile::random_rotation;
use geom::{Pose, Quat, SeedTree, Vec3};
use rand::RngExt;
use rand_distr::{Distribution, StandardNormal};
use scene::{Catalog, Plan, Scene};

pub(super) fn events(
    works: &Works,
    before: &Scene,
    plan: &Plan,
    catalog: &Catalog,
    seed: SeedTree,
) -> Result<Events, SynthError> {
    if let Some(p) = plan.placements.iter().find(|p| usize::from(p.model.0) >= catalog.len()) {
        return Err(SynthError::PlanModel { order: p.order, known: catalog.len() });
    }
    let mut blocks: Vec<Start> = before
        .blocks
        .iter()
        .map(|b| Start {
            earlier: Some(b.block),
            planned: None,
            model: b.model,
            pose: b.site_from_block,
            what: What::Kept,
            speed: Vec3::ZERO,
            lost_leg: 0.0,
            cut: None,
            last: false,
        })
        .collect();
    let mut skipped = Vec::new();
    for placement in &plan.placements {
        let mut rng = seed.child("placement", placement.order.into()).rng();
        if rng.random::<f32>() < works.skipped {
            skipped.push((placement.order, placement.model));
            continue;
        }
        let mut normal = || -> f32 { StandardNormal.sample(&mut rng) };
        let shift = Vec3::new(normal(), normal(), 0.0) * works.crane_shift_sd_m;
        let turn = Vec3::new(normal(), normal(), normal()) * works.crane_turn_sd_deg.to_radians();
        let centre = catalog.get(placement.model).centre;
        let mut pose = about_centre(&placement.drop, centre, Quat::from_scaled_axis(turn));
        pose.translation += shift;
        blocks.push(Start {
            earlier: None,
            planned: Some((placement.order, placement.rest)),
            model: placement.model,
            pose,
            what: What::Placed,
            speed: Vec3::ZERO,
            lost_leg: 0.0,
            cut: None,
            last: true,
        });
    }
    let mut rng = seed.child("extra", 0).rng();
    let extra = (works.extra * plan.placements.len() as f32).round() as usize;
    for _ in 0..extra {
        let like = &plan.placements[rng.random_range(0..plan.placements.len())];
        let model = catalog.get(like.model);
        let mut around = || rng.random_range(-2.0..2.0_f32) * model.d_box_m;
        let at = like.rest * model.centre + Vec3::new(around(), around(), 0.0);
        let turn = random_rotation(&mut rng);
        blocks.push(Start {
            earlier: None,
            planned: None,
            model: like.model,
            pose: Pose::from_parts(at - turn * model.centre, turn),
            what: What::Added,
            speed: Vec3::ZERO,
            lost_leg: 0.0,
            cut: None,
            last: true,
        });
    }
    Ok(Events { blocks, gone: Vec::new(), skipped, ground: before.ground.clone() })
}
