//! Drops blocks into the site until they rest, and checks the pile (METHOD §1, thesis §2.4.1).

use crate::SynthError;
use crate::recipe::{Recipe, Resolved};
use geom::{Bounds, Pose, Quat, SeedTree, Vec3};
use rand::{Rng, RngExt};
use rand_distr::{Distribution, StandardNormal};
use scene::{Catalog, Ground, InstanceId, ModelId, PlacedBlock};
use sim::{BlockShape, BodyId, World};

/// A block hangs this much of the widest one above what lies below: half of it, and a little.
const HANGS: f32 = 0.55;

/// A pile that passed every check.
pub(crate) struct Pile {
    pub blocks: Vec<PlacedBlock>,
}

/// One pile, or what was wrong with it.
pub(crate) fn drop_pile(
    recipe: &Recipe,
    resolved: &Resolved,
    catalog: &Catalog,
    ground: &Ground,
    seed: SeedTree,
) -> Result<Result<Pile, String>, SynthError> {
    if let Some(joint_m) = recipe.drop.rows_joint_m {
        return Ok(rows(recipe, resolved, catalog, ground, joint_m, seed));
    }
    let shapes = catalog.iter().map(|(_, m)| BlockShape::new(m)).collect::<Result<Vec<_>, _>>()?;
    let physics = recipe.physics.for_block_size(resolved.largest_m);
    let half = Vec3::new(resolved.size_m[0] / 2.0, resolved.size_m[1] / 2.0, resolved.largest_m);
    let mut world = World::new(&physics);
    world.add_ground(ground, &Bounds { min: -half, max: half }.grown(resolved.largest_m));
    for (normal, reach) in
        [(Vec3::X, half.x), (Vec3::NEG_X, half.x), (Vec3::Y, half.y), (Vec3::NEG_Y, half.y)]
    {
        world.add_wall(-normal * reach, normal);
    }

    let mut rng = seed.rng();
    let [fewest, most] = recipe.count;
    let count = rng.random_range(fewest..=most) as usize;
    let mut dropped: Vec<(BodyId, ModelId)> = Vec::with_capacity(count);
    let interval = recipe.drop.layer_interval_s * (resolved.largest_m / 2.0).sqrt();
    while dropped.len() < count {
        let places = layer(resolved, recipe.drop.spacing, count - dropped.len(), &mut rng);
        let below = dropped.len();
        for place in places {
            let highest = highest_m(&world, &dropped[..below], place, catalog, ground, resolved);
            let model = draw(&resolved.mix, &mut rng);
            let above = Vec3::Z * (highest + HANGS * resolved.widest_m);
            let turn = random_rotation(&mut rng);
            // The centre of mass hangs at the place, whatever the mesh's origin.
            let pose = Pose::from_parts(place + above - turn * catalog.get(model).centre, turn);
            dropped.push((world.add_moving(&shapes[model.0 as usize], &pose), model));
        }
        if interval > 0.0 {
            world.step((interval / world.step_s()).ceil() as usize);
        }
    }
    let settled = world.settle(physics.max_time_s * (resolved.largest_m / 2.0).sqrt());
    if !settled.at_rest {
        return Ok(Err(format!("it still moved after {:.1} s", settled.time_s)));
    }
    Ok(check(&world, &dropped, recipe, resolved, catalog, ground))
}

/// Blocks side by side as a crane sets them: in rows from the middle outwards, every joint, height and turn a little off.
fn rows(
    recipe: &Recipe,
    resolved: &Resolved,
    catalog: &Catalog,
    ground: &Ground,
    joint_m: f32,
    seed: SeedTree,
) -> Result<Pile, String> {
    let mut rng = seed.rng();
    let [fewest, most] = recipe.count;
    let count = rng.random_range(fewest..=most);
    let columns = (count as f32).sqrt().ceil() as u32;
    let widest = resolved.mix.iter().map(|(id, _)| catalog.get(*id).mesh.bounds().size());
    let pitch = widest.fold(Vec3::ZERO, Vec3::max) + Vec3::splat(joint_m);
    let mut blocks = Vec::new();
    for k in 0..count {
        let model = draw(&resolved.mix, &mut rng);
        let mut off = |sd: f32| -> f32 { sd * rng.sample::<f32, _>(StandardNormal) };
        // A quarter of a degree and a few millimetres, never more than the joint allows.
        let slack = (0.15 * joint_m).min(0.01 * resolved.largest_m);
        let turn = Quat::from_scaled_axis(Vec3::new(off(0.002), off(0.002), off(0.004)));
        let place = |i: u32, n: u32, pitch: f32| (i as f32 + 0.5 - n as f32 / 2.0) * pitch;
        let x = place(k % columns, columns, pitch.x) + off(slack).clamp(-slack, slack);
        let y =
            place(k / columns, count.div_ceil(columns), pitch.y) + off(slack).clamp(-slack, slack);
        if x.abs() > resolved.size_m[0] / 2.0 || y.abs() > resolved.size_m[1] / 2.0 {
            return Err(format!("{count} blocks in rows do not fit into the site"));
        }
        let foot = ground.height_m(x, y) - catalog.get(model).mesh.bounds().min.z;
        let place = Vec3::new(x, y, foot + off(0.002 * resolved.largest_m));
        blocks.push(PlacedBlock {
            block: InstanceId(k + 1),
            model,
            site_from_block: Pose::from_parts(place, turn),
        });
    }
    Ok(Pile { blocks })
}

fn check(
    world: &World,
    dropped: &[(BodyId, ModelId)],
    recipe: &Recipe,
    resolved: &Resolved,
    catalog: &Catalog,
    ground: &Ground,
) -> Result<Pile, String> {
    let mut blocks = Vec::with_capacity(dropped.len());
    for (i, &(id, model)) in dropped.iter().enumerate() {
        let site_from_block = world.pose(id).ok_or("a block vanished")?;
        let centre = site_from_block.transform_point(catalog.get(model).centre);
        let inside =
            centre.x.abs() < resolved.size_m[0] / 2.0 && centre.y.abs() < resolved.size_m[1] / 2.0;
        if !inside || !centre.is_finite() || centre.z < ground.height_m(centre.x, centre.y) {
            return Err(format!("block {} escaped to {centre}", i + 1));
        }
        blocks.push(PlacedBlock { block: InstanceId(i as u32 + 1), model, site_from_block });
    }
    let overlap = world.deepest_overlap_m();
    let limit = recipe.drop.deepest_overlap * resolved.smallest_m;
    if overlap > limit {
        return Err(format!("two blocks overlap by {overlap:.4} m, more than {limit:.4} m"));
    }
    Ok(Pile { blocks })
}

/// Places of one layer, in random order: a jittered grid that fills the site.
fn layer(resolved: &Resolved, spacing: f32, most: usize, rng: &mut impl Rng) -> Vec<Vec3> {
    let pitch = spacing * resolved.widest_m;
    let [nx, ny] = resolved.size_m.map(|s| ((s / pitch) as usize).max(1));
    let step = [resolved.size_m[0] / nx as f32, resolved.size_m[1] / ny as f32];
    // Jitter may use what the grid leaves free, so that no two blocks of a layer start inside each other.
    let slack = step.map(|s| (s - resolved.widest_m).max(0.0) / 2.0);
    let mut places: Vec<Vec3> = (0..nx * ny)
        .map(|k| {
            let mut at = |i: usize, n: usize, axis: usize| {
                (i as f32 + 0.5 - n as f32 / 2.0) * step[axis]
                    + slack[axis] * rng.random_range(-1.0..1.0_f32)
            };
            Vec3::new(at(k % nx, nx, 0), at(k / nx, ny, 1), 0.0)
        })
        .collect();
    for i in (1..places.len()).rev() {
        places.swap(i, rng.random_range(0..=i));
    }
    places.truncate(most);
    places
}

/// Top of what could touch a block that falls at `place`: the bed and the blocks that were there before this layer.
fn highest_m(
    world: &World,
    dropped: &[(BodyId, ModelId)],
    place: Vec3,
    catalog: &Catalog,
    ground: &Ground,
    resolved: &Resolved,
) -> f32 {
    let reach = 0.5 * resolved.widest_m;
    let around = [-1.0, -0.5, 0.0, 0.5, 1.0];
    let heights = around
        .iter()
        .flat_map(|x| around.iter().map(move |y| (place.x + x * reach, place.y + y * reach)));
    let bed = heights.map(|(x, y)| ground.height_m(x, y)).fold(f32::NEG_INFINITY, f32::max);
    dropped.iter().fold(bed, |top, &(id, model)| {
        let model = catalog.get(model);
        let centre = world.pose(id).map_or(Vec3::ZERO, |p| p.transform_point(model.centre));
        let near = (centre - place).truncate().length() < reach + model.d_max_m;
        if near { top.max(centre.z + model.d_max_m) } else { top }
    })
}

fn draw(mix: &[(ModelId, f32)], rng: &mut impl Rng) -> ModelId {
    let total: f32 = mix.iter().map(|(_, w)| w).sum();
    let mut u = rng.random::<f32>() * total;
    for &(model, weight) in mix {
        u -= weight;
        if u < 0.0 {
            return model;
        }
    }
    mix[mix.len() - 1].0
}

/// Uniform over all orientations: a normalised four-dimensional Gaussian.
pub(crate) fn random_rotation(rng: &mut impl Rng) -> Quat {
    loop {
        let q: [f32; 4] = std::array::from_fn(|_| StandardNormal.sample(rng));
        let length2: f32 = q.iter().map(|v| v * v).sum();
        if length2 > 1e-6 {
            return Quat::from_array(q).normalize();
        }
    }
}
