//! What a storm does, before the pile settles.

use super::broken::cut;
use super::happening::{Sinking, Storm};
use super::{Events, Start, What};
use crate::pile::random_rotation;
use crate::recipe::Resolved;
use geom::{Pose, Quat, SeedTree, Vec3};
use rand::RngExt;
use scene::{Catalog, Ground, PlacedBlock, Scene};

/// Friction that the length of a slide is reckoned with.
const FRICTION: f32 = 0.8;
const GRAVITY_M_S2: f32 = 9.81;

pub(super) fn events(
    storm: &Storm,
    before: &Scene,
    catalog: &Catalog,
    resolved: &Resolved,
    seed: SeedTree,
) -> Events {
    let fate = fates(storm, before.blocks.len(), seed.child("fate", 0));
    let ground = match &storm.sinking {
        Some(sinking) => sunk_ground(&before.ground, sinking, resolved),
        None => before.ground.clone(),
    };
    let (mut blocks, mut gone) = (Vec::new(), Vec::new());
    for (i, block) in before.blocks.iter().enumerate() {
        let seed = seed.child("block", i as u64);
        match fate[i] {
            What::Missing => gone.push(*block),
            what => blocks.push(start(storm, block, what, catalog, seed)),
        }
    }
    let added = (storm.added * before.blocks.len() as f32).round() as usize;
    let mut rng = seed.child("added", 0).rng();
    for _ in 0..added {
        let like = before.blocks[rng.random_range(0..before.blocks.len())].model;
        let model = catalog.get(like);
        let half = resolved.size_m.map(|s| (s / 2.0 - model.d_max_m).max(0.0));
        let at = Vec3::new(
            rng.random_range(-1.0..=1.0_f32) * half[0],
            rng.random_range(-1.0..=1.0_f32) * half[1],
            0.0,
        );
        let turn = random_rotation(&mut rng);
        blocks.push(Start {
            earlier: None,
            planned: None,
            model: like,
            pose: Pose::from_parts(at - turn * model.centre, turn),
            what: What::Added,
            speed: Vec3::ZERO,
            lost_leg: 0.0,
            cut: None,
            last: true,
        });
    }
    Events { blocks, gone, skipped: Vec::new(), ground }
}

/// One fate a block: shares of a random order.
fn fates(storm: &Storm, count: usize, seed: SeedTree) -> Vec<What> {
    let mut rng = seed.rng();
    let mut order: Vec<usize> = (0..count).collect();
    for i in (1..count).rev() {
        order.swap(i, rng.random_range(0..=i));
    }
    let mut fate = vec![What::Kept; count];
    let mut next = order.into_iter();
    let shares = [
        (storm.kicked, What::Kicked),
        (storm.turned, What::Turned),
        (storm.missing, What::Missing),
        (storm.broken, What::Broken),
        (storm.rolled, What::Rolled),
    ];
    for (share, what) in shares {
        let many = (share * count as f32).round() as usize;
        next.by_ref().take(many).for_each(|i| fate[i] = what);
    }
    fate
}

fn start(
    storm: &Storm,
    block: &PlacedBlock,
    what: What,
    catalog: &Catalog,
    seed: SeedTree,
) -> Start {
    let model = catalog.get(block.model);
    let mut rng = seed.rng();
    let mut draw = |[low, high]: [f32; 2]| low + (high - low) * rng.random::<f32>();
    let mut pose = block.site_from_block;
    let (mut speed, mut lost_leg, mut broken) = (Vec3::ZERO, 0.0, None);
    match what {
        What::Kicked => {
            let slide_m = draw(storm.kick_blocks) * model.d_box_m;
            let v = (2.0 * FRICTION * GRAVITY_M_S2 * slide_m).sqrt();
            let side = draw([0.0, std::f32::consts::TAU]);
            // Half upwards: a wave lifts what it throws, or the neighbours would hold it.
            speed = Vec3::new(side.cos(), side.sin(), 0.5) * v;
        }
        What::Turned => {
            let angle = draw(storm.turn_deg).to_radians();
            let axis = random_rotation(&mut rng) * Vec3::Z;
            pose = about_centre(&pose, model.centre, Quat::from_axis_angle(axis, angle));
        }
        What::Broken => {
            lost_leg = draw(storm.broken_leg);
            broken = Some(cut(model, lost_leg, &mut rng));
        }
        What::Rolled if model.symmetry.order() > 1 => {
            pose *= model.symmetry.element(rng.random_range(1..model.symmetry.order()));
        }
        _ => {}
    }
    if let Some(sinking) = &storm.sinking {
        let at = pose * model.centre;
        pose.translation.z -= sinking.depth_at_m(at.x, at.y);
    }
    let sinks = storm.sinking.is_some_and(|s| {
        let at = block.site_from_block * model.centre;
        s.depth_at_m(at.x, at.y) > 0.0
    });
    let what = if what == What::Kept && sinks { What::Sunk } else { what };
    Start {
        earlier: Some(block.block),
        planned: None,
        model: block.model,
        pose,
        what,
        speed,
        lost_leg,
        cut: broken,
        last: false,
    }
}

/// The pose turned about the block's centre.
pub(super) fn about_centre(pose: &Pose, centre: Vec3, turn: Quat) -> Pose {
    let (at, rotation) = (*pose * centre, (turn * pose.rotation).normalize());
    Pose::from_parts(at - rotation * centre, rotation)
}

/// The ground with the hollow, as a grid.
fn sunk_ground(ground: &Ground, sinking: &Sinking, resolved: &Resolved) -> Ground {
    let (origin, cell_m, nx, ny) = match ground {
        Ground::Grid { origin, cell_m, nx, z_m } => (*origin, *cell_m, *nx, z_m.len() / nx),
        Ground::Level { .. } | Ground::Plane { .. } => {
            let cell = 0.2 * resolved.largest_m;
            let half = resolved.size_m.map(|s| s / 2.0 + 2.0 * resolved.largest_m);
            let count = half.map(|h| (2.0 * h / cell).ceil() as usize + 1);
            ([-half[0], -half[1]], cell, count[0], count[1])
        }
    };
    let node = |k: usize| {
        let (x, y) = (origin[0] + (k % nx) as f32 * cell_m, origin[1] + (k / nx) as f32 * cell_m);
        ground.height_m(x, y) - sinking.depth_at_m(x, y)
    };
    Ground::Grid { origin, cell_m, nx, z_m: (0..nx * ny).map(node).collect() }
}
