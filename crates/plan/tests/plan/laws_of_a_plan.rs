//! What holds for every plan.

use crate::site::{self, Heard, Site};
use geom::{HeightMap, Quat, SeedTree, Silent, Vec2};
use plan::{
    DepthView, PlanConfig, PlanInput, Policy, Proposal, Proposer, RandomConfig, plan,
    plans_over_volumes,
};
use scene::{PlacementState, Plan};

/// Proposes what a network without training might: some attitude over the deepest pixel, then others.
struct Deepest;

impl Proposer for Deepest {
    fn view(&self) -> DepthView {
        DepthView { pixels: 12, edge: 1.2 }
    }

    fn propose(&self, depth: &[f32], _turn_rad: f32) -> Vec<Proposal> {
        assert_eq!(depth.len(), 144);
        let deepest = (0..144).max_by(|&a, &b| depth[a].total_cmp(&depth[b])).unwrap();
        let view = self.view();
        let centre = Vec2::new(view.offset(deepest % 12), view.offset(deepest / 12));
        let turn =
            |i: u8| Quat::from_rotation_z(f32::from(i)) * Quat::from_rotation_x(0.7 * f32::from(i));
        (0..24)
            .map(|i| Proposal {
                centre: if i < 12 { centre } else { Vec2::ZERO },
                rotation: turn(i),
            })
            .collect()
    }
}

fn with_proposer(site: &Site) -> PlanInput<'_> {
    PlanInput { proposer: Some(&Deepest), ..site.input() }
}

fn config(policy: Policy) -> PlanConfig {
    let mut config =
        PlanConfig { policy, rounds: 6, block: Some("large".into()), ..PlanConfig::default() };
    config.search.attitudes = 64;
    config.search.verify = 3;
    config
}

fn bits(plan: &Plan) -> Vec<u32> {
    let pose = |p: &geom::Pose| {
        [p.translation.to_array().to_vec(), p.rotation.to_array().to_vec()].concat()
    };
    plan.placements
        .iter()
        .chain(&plan.removed)
        .flat_map(|p| [pose(&p.drop), pose(&p.rest), vec![p.filled_m3]].concat())
        .map(f32::to_bits)
        .collect()
}

fn check(site: &Site, config: &PlanConfig, plan: &Plan) {
    let model = site.catalog.find(config.block.as_deref().unwrap()).unwrap();
    let block = site.catalog.get(model);
    assert!(plan.summary.blocks as usize == plan.placements.len() && !plan.placements.is_empty());
    assert!(plan.summary.void_after_m3 < plan.summary.void_before_m3);
    let density = |porosity: f32| 1.0 - porosity;
    let (one, two) = (density(plan.summary.porosity), density(plan.summary.porosity_rasterised));
    assert!((one / two - 1.0).abs() < 0.01, "packing density {one} by volumes, {two} by columns");
    for (i, p) in plan.placements.iter().enumerate() {
        assert_eq!((p.order as usize, p.state, p.model), (i + 1, PlacementState::Kept, model));
        assert!(p.contacts >= 2 || (p.rest * block.centre).z < block.d_max_m, "{p:?}");
        for &v in &block.mesh.vertices {
            let at = site.frame.site_from_local(p.rest * v);
            assert!(
                site.design.level_at(at.x, at.y).is_some(),
                "a corner of block {} is outside",
                p.order
            );
        }
        let centre = site.frame.site_from_local(p.rest * block.centre);
        assert!(
            centre.z
                <= site.design.level_at(centre.x, centre.y).unwrap()
                    + 0.3 * f64::from(block.d_box_m) / 2.0
                    + 1e-3
        );
    }
    nothing_is_needed_before_it_comes(site, block, plan);
    nothing_overlaps(site, plan);
}

/// New blocks rest on the pile, not in it.
fn nothing_overlaps(site: &Site, plan: &Plan) {
    let shape = |model| sim::BlockShape::new(site.catalog.get(model)).unwrap();
    let mut world = sim::World::new(&sim::PhysicsConfig::default());
    for b in &site.scene.blocks {
        world.add_fixed(&shape(b.model), &b.site_from_block);
    }
    let new: Vec<_> =
        plan.placements.iter().map(|p| world.add_fixed(&shape(p.model), &p.rest)).collect();
    for id in new {
        let deepest = world.contacts(id).iter().map(|c| c.depth_m).fold(0.0, f32::max);
        assert!(deepest < 0.05, "overlap of {deepest} m between 2 m blocks");
    }
}

/// Seen from above, no block has a large part of its underside below a block that comes earlier.
fn nothing_is_needed_before_it_comes(site: &Site, block: &scene::BlockModel, plan: &Plan) {
    let raster = |pose: &geom::Pose, top: bool| {
        let mut map = HeightMap::empty(Vec2::ZERO, Vec2::splat(12.0), 0.2);
        if top {
            map.raise(&block.mesh, pose)
        } else {
            map.lower(&block.mesh, pose)
        };
        map
    };
    for (i, late) in plan.placements.iter().enumerate() {
        let under = raster(&late.rest, false);
        for early in &plan.placements[..i] {
            if (late.rest.translation - early.rest.translation).length() > 2.0 * block.d_max_m {
                continue;
            }
            let top = raster(&early.rest, true);
            let shared =
                under.z_m.iter().zip(&top.z_m).filter(|(u, t)| u.is_finite() && t.is_finite());
            let beneath = shared.filter(|(u, t)| **u < **t - 0.1 * block.d_box_m).count();
            let all = under.z_m.iter().filter(|u| u.is_finite()).count();
            assert!(
                beneath as f32 <= 0.25 * all as f32,
                "{} lies under {}",
                late.order,
                early.order
            );
        }
    }
    assert_eq!(site.scene.blocks.len(), 16);
}

#[test]
fn plans_obey_their_laws_and_threads_change_nothing() {
    let site = site::site(12.0, 16, 2.5);
    for policy in [Policy::Random, Policy::Network, Policy::Search] {
        let config = config(policy);
        let with = |threads: usize, seed: u64| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| {
                plan(&with_proposer(&site), &config, SeedTree::new(seed), &Silent).unwrap()
            })
        };
        let (one, two) = (with(1, 7), with(2, 7));
        assert_eq!(bits(&one), bits(&two));
        assert_eq!(one.summary, two.summary);
        check(&site, &config, &one);
    }
}

#[test]
fn search_places_more_and_closer_than_random() {
    let site = site::site(12.0, 16, 2.5);
    let run = |policy| {
        plan(&site.input(), &config(policy), SeedTree::new(1), &Heard::default()).unwrap().summary
    };
    let (random, search) = (run(Policy::Random), run(Policy::Search));
    assert!(
        search.blocks as f32 >= 1.12 * random.blocks as f32,
        "{} against {}",
        search.blocks,
        random.blocks
    );
    assert!(search.mean_distance_m < random.mean_distance_m);
    assert!(search.porosity < random.porosity);
}

#[test]
fn more_random_drops_fill_more() {
    let site = site::site(8.0, 6, 2.5);
    let with = |drops: u32| {
        let config = PlanConfig { random: RandomConfig { drops }, ..config(Policy::Random) };
        plan(&site.input(), &config, SeedTree::new(1), &Silent).unwrap().summary
    };
    let (one, many) = (with(1), with(30));
    assert!(
        many.void_after_m3 < one.void_after_m3,
        "{} against {}",
        many.void_after_m3,
        one.void_after_m3
    );
}

#[test]
fn loose_blocks_are_not_pushed_out_of_place() {
    let site = site::site(8.0, 6, 2.5);
    let with = |frozen: bool| {
        let mut config = PlanConfig { frozen, ..config(Policy::Search) };
        config.rounds = 4;
        let plan = plan(&site.input(), &config, SeedTree::new(3), &Silent).unwrap();
        assert!(plan.summary.blocks >= 3, "{:?}", plan.summary);
        (config, plan)
    };
    let (_, fixed) = with(true);
    let (config, loose) = with(false);
    assert!(loose.summary.blocks <= fixed.summary.blocks + 2, "freedom adds no room");
    // The last world again, all of the plan free at once: nothing leaves its place.
    let shape = |model| sim::BlockShape::new(site.catalog.get(model)).unwrap();
    let physics = config.physics.for_block_size(2.0);
    let mut world = sim::World::new(&physics);
    let bounds = geom::Bounds { min: geom::Vec3::ZERO, max: geom::Vec3::splat(8.0) };
    world.add_ground(&site.scene.ground, &bounds.grown(4.0));
    for b in &site.scene.blocks {
        world.add_fixed(&shape(b.model), &b.site_from_block);
    }
    let free: Vec<_> =
        loose.placements.iter().map(|p| (world.add_moving(&shape(p.model), &p.rest), p)).collect();
    world.step(120);
    let moved = |(id, p): &(sim::BodyId, &scene::Placement)| {
        let centre = site.catalog.get(p.model).centre;
        (world.pose(*id).unwrap() * centre - p.rest * centre).length()
    };
    let still = free.iter().filter(|f| moved(f) < 0.3).count();
    assert!(still * 10 >= free.len() * 9, "{still} of {} stayed", free.len());
}

#[test]
fn plans_of_several_volumes_are_those_made_one_by_one() {
    let site = site::site(12.0, 16, 2.5);
    let volumes = [3.0, 0.001, 0.2, 1.0];
    let mut taken_over = 0;
    for policy in [Policy::Random, Policy::Network, Policy::Search] {
        let together = plans_over_volumes(
            &with_proposer(&site),
            &config(policy),
            &volumes,
            SeedTree::new(3),
            &Silent,
        )
        .unwrap();
        for (of, v) in together.iter().zip(volumes) {
            let alone = PlanConfig { minimum_volume_m3: Some(v), ..config(policy) };
            let alone = plan(&with_proposer(&site), &alone, SeedTree::new(3), &Silent).unwrap();
            assert_eq!(
                (of.minimum_volume_m3, bits(&of.plan)),
                (v, bits(&alone)),
                "{policy:?}, v = {v}"
            );
            assert_eq!(of.plan.summary, alone.summary);
            taken_over += u32::from(!of.made);
        }
    }
    assert!((1..10).contains(&taken_over), "{taken_over} plans were taken over");
}
