//! Settles what was disturbed; what is out of its reach stays where it is, to the last bit.

use super::Events;
use super::broken::broken;
use crate::SynthError;
use crate::recipe::{Recipe, Resolved};
use geom::{Bounds, Pose, Vec3};
use scene::{Catalog, InstanceId, ModelId, PlacedBlock, Scene};
use sim::{BlockShape, BodyId, World};

/// Blocks within this many block lengths of a disturbed one may move with it.
const REACH_BLOCKS: f32 = 1.3;
/// Blocks of a plan whose first touch is awaited before the next one falls, seconds (× √unit).
const BETWEEN_S: f32 = 1.5;

pub(super) struct Settled {
    /// Blocks after, models of `catalog`.
    pub blocks: Vec<PlacedBlock>,
    /// Their types in the catalogue that was given.
    pub model: Vec<ModelId>,
    /// The catalogue with every broken block as a type of its own.
    pub catalog: Catalog,
    pub at_rest: bool,
}

pub(super) fn settled(
    recipe: &Recipe,
    resolved: &Resolved,
    catalog: &Catalog,
    before: &Scene,
    events: &Events,
) -> Result<Settled, SynthError> {
    let (catalog, models) = with_broken(catalog, events);
    let shapes = catalog.iter().map(|(_, m)| BlockShape::new(m)).collect::<Result<Vec<_>, _>>()?;
    let physics = recipe.physics.for_block_size(resolved.largest_m);
    let mut world = World::new(&physics);
    let half = Vec3::new(resolved.size_m[0] / 2.0, resolved.size_m[1] / 2.0, resolved.largest_m);
    world.add_ground(&events.ground, &Bounds { min: -half, max: half }.grown(resolved.largest_m));
    let walls =
        [(Vec3::X, half.x), (Vec3::NEG_X, half.x), (Vec3::Y, half.y), (Vec3::NEG_Y, half.y)];
    for (normal, reach) in walls {
        world.add_wall(-normal * reach, normal);
    }
    let disturbed = disturbed(&catalog, before, events, resolved.largest_m);
    let unit = (resolved.largest_m / 2.0).sqrt();
    let mut ids: Vec<Option<BodyId>> = vec![None; events.blocks.len()];
    for (i, start) in events.blocks.iter().enumerate().filter(|(_, s)| !s.last) {
        let shape = &shapes[models[i].0 as usize];
        let id = if disturbed[i] {
            world.add_moving(shape, &start.pose)
        } else {
            world.add_fixed(shape, &start.pose)
        };
        let mass_kg = catalog.get(models[i]).mass_kg();
        world.apply_impulse(id, start.speed * mass_kg);
        ids[i] = Some(id);
    }
    let mut at_rest = world.settle(physics.max_time_s * unit).at_rest;
    for (i, start) in events.blocks.iter().enumerate().filter(|(_, s)| s.last) {
        let pose = above(&world, &ids, &models, &catalog, events, start.pose, models[i]);
        ids[i] = Some(world.add_moving(&shapes[models[i].0 as usize], &pose));
        world.settle(BETWEEN_S * unit);
    }
    if events.blocks.iter().any(|s| s.last) {
        at_rest = world.settle(physics.max_time_s * unit).at_rest;
    }
    let pose = |i: usize| match (disturbed[i] || events.blocks[i].last, ids[i]) {
        (true, Some(id)) => world.pose(id).unwrap_or(events.blocks[i].pose),
        _ => events.blocks[i].pose,
    };
    let blocks = (0..events.blocks.len())
        .map(|i| PlacedBlock {
            block: InstanceId(i as u32 + 1),
            model: models[i],
            site_from_block: pose(i),
        })
        .collect();
    let model = events.blocks.iter().map(|s| s.model).collect();
    Ok(Settled { blocks, model, catalog, at_rest })
}

/// The catalogue with a type for every broken block, and the type of every block in it.
fn with_broken(catalog: &Catalog, events: &Events) -> (Catalog, Vec<ModelId>) {
    let mut models: Vec<scene::BlockModel> = catalog.iter().map(|(_, m)| m.clone()).collect();
    let mut of_block = Vec::with_capacity(events.blocks.len());
    for start in &events.blocks {
        match &start.cut {
            Some(cut) => {
                models.push(broken(catalog.get(start.model), cut));
                of_block.push(ModelId(models.len() as u16 - 1));
            }
            None => of_block.push(start.model),
        }
    }
    (Catalog::new(models), of_block)
}

/// Which blocks may move: those something was done to, those that stand on changed ground, and their neighbours.
fn disturbed(catalog: &Catalog, before: &Scene, events: &Events, size_m: f32) -> Vec<bool> {
    let centre = |pose: &Pose, model: ModelId| *pose * catalog.get(model).centre;
    let mut places: Vec<Vec3> =
        events.gone.iter().map(|b| centre(&b.site_from_block, b.model)).collect();
    for start in &events.blocks {
        let at = centre(&start.pose, start.model);
        let ground_moved =
            (events.ground.height_m(at.x, at.y) - before.ground.height_m(at.x, at.y)).abs() > 1e-6;
        let rolled_or_kept = matches!(start.what, super::What::Kept | super::What::Rolled);
        if !start.last && (ground_moved || !rolled_or_kept) {
            places.push(at);
        }
        if start.last && start.planned.is_some() {
            places.push(at);
        }
    }
    let reach = REACH_BLOCKS * size_m;
    let near = |start: &super::Start| {
        let at = centre(&start.pose, start.model);
        places.iter().any(|p| (*p - at).length() < reach)
    };
    events.blocks.iter().map(near).collect()
}

/// The pose raised until its lowest point is clear of everything below it in plan.
fn above(
    world: &World,
    ids: &[Option<BodyId>],
    models: &[ModelId],
    catalog: &Catalog,
    events: &Events,
    pose: Pose,
    model: ModelId,
) -> Pose {
    let own = catalog.get(model);
    let at = pose * own.centre;
    let mut map = geom::HeightMap::empty(
        at.truncate() - own.d_max_m,
        at.truncate() + own.d_max_m,
        0.05 * own.d_box_m,
    );
    map.fill_with(|x, y| events.ground.height_m(x, y));
    for (i, id) in ids.iter().enumerate() {
        let Some(other) = id.and_then(|id| world.pose(id)) else { continue };
        let model = catalog.get(models[i]);
        let near = (other * model.centre - at).truncate().length() < own.d_max_m + model.d_max_m;
        if near {
            map.raise(&model.mesh, &other);
        }
    }
    let mut below = geom::HeightMap::empty(map_min(&map), map_max(&map), 0.05 * own.d_box_m);
    below.lower(&own.mesh, &pose);
    let mut lift = 0.0_f32;
    for iy in 0..below.ny.min(map.ny) {
        for ix in 0..below.nx.min(map.nx) {
            let (top, bottom) = (map.at(ix, iy), below.at(ix, iy));
            if top.is_finite() && bottom.is_finite() {
                lift = lift.max(top - bottom);
            }
        }
    }
    let lift = if lift > 0.0 { lift + 0.02 * own.d_box_m } else { 0.0 };
    Pose::from_parts(pose.translation + Vec3::Z * lift, pose.rotation)
}

fn map_min(map: &geom::HeightMap) -> geom::Vec2 {
    map.centre(0, 0) - map.cell_m / 2.0
}

fn map_max(map: &geom::HeightMap) -> geom::Vec2 {
    map.centre(map.nx - 1, map.ny - 1) + map.cell_m / 2.0
}
