//! Blocks carried sideways where straight lowering is shut.

use crate::site::Site;
use geom::{Pose, Quat, SeedTree, Silent, Vec3};
use plan::{Insertion, PlanConfig, plan, replan};
use scene::{
    Catalog, DesignSurface, Ground, InstanceId, ModelId, PlacedBlock, Plan, Scene, Shape, SiteFrame,
};

/// A pit of 1.35 m × 1.1 m for a cube of 1 m. A lip reaches into it from the west, a stone lies at its foot in the east: clear of the
/// one the cube stands on the other, unless it is moved under the lip on its way down.
fn pit() -> Site {
    let cube = |name: &str, size| blocks::shape_model(name, Shape::Cube { size }, 2300.0).unwrap();
    let catalog = Catalog::new(vec![cube("cube", 1.0), cube("stone", 0.3)]);
    let stone = |block, x: f32, z: f32| PlacedBlock {
        block: InstanceId(block),
        model: ModelId(1),
        site_from_block: Pose::from_parts(
            Vec3::new(x, 0.55, z) - catalog.get(ModelId(1)).centre,
            Quat::IDENTITY,
        ),
    };
    // The lip ends at 0.15, the stone begins at 1.10.
    let blocks = vec![stone(1, 0.0, 1.75), stone(2, 1.25, 0.15)];
    let scene = Scene { blocks, ground: Ground::Level { z_m: 0.0 } };
    let boundary = vec![[0.0, 0.0], [1.35, 0.0], [1.35, 1.1], [0.0, 1.1]];
    let design = DesignSurface::Level { boundary, level_m: 0.6 };
    Site { scene, frame: SiteFrame::default(), design, catalog }
}

fn config(insertion: Insertion) -> PlanConfig {
    PlanConfig {
        insertion,
        block: Some("cube".into()),
        minimum_volume_m3: Some(0.1),
        overflow_m: Some(0.05),
        ..PlanConfig::default()
    }
}

#[test]
fn a_block_goes_round_the_lip() {
    let site = pit();
    let input = site.input();
    let planned = |insertion| plan(&input, &config(insertion), SeedTree::new(1), &Silent).unwrap();
    assert_eq!(planned(Insertion::Straight).summary.blocks, 0, "the stone keeps it up");
    let guided = planned(Insertion::Guided);
    assert_eq!((guided.summary.blocks, guided.summary.guided), (1, 1), "{:?}", guided.summary);
    assert!(guided.summary.shut >= 1 && guided.summary.opened == 1);
    let p = &guided.placements[0];
    assert!(!p.handling.path.is_empty());
    path_is_free(&site, p);
    // The same plan again, from the plan itself: the path is carried once more.
    let again =
        replan(&input, &guided, &config(Insertion::Guided), SeedTree::new(2), &Silent).unwrap();
    assert_eq!(again.placements[0].rest, p.rest);
}

/// Fine steps between the poses of the path, each measured anew: no overlap anywhere.
fn path_is_free(site: &Site, p: &scene::Placement) {
    let block = site.catalog.get(p.model);
    let shape = |m: ModelId| sim::BlockShape::new(site.catalog.get(m)).unwrap();
    let path = &p.handling.path;
    for (from, to) in path.iter().zip(path.iter().skip(1).chain([&p.drop])) {
        for k in 0..=200 {
            let part = k as f32 / 200.0;
            let rotation = from.rotation.slerp(to.rotation, part);
            let centre = (*from * block.centre).lerp(*to * block.centre, part);
            let mut world = sim::World::new(&sim::PhysicsConfig::default());
            for b in &site.scene.blocks {
                world.add_fixed(&shape(b.model), &b.site_from_block);
            }
            let pose = Pose::from_parts(centre - rotation * block.centre, rotation);
            let id = world.add_moving(&shape(p.model), &pose);
            let deepest = world.contacts(id).iter().map(|c| c.depth_m).fold(-1.0, f32::max);
            assert!(deepest < 0.0, "touches by {deepest} m");
        }
    }
}

#[test]
fn what_can_be_lowered_needs_no_path() {
    let site = crate::site::site(9.0, 12, 1.8);
    let mut config = PlanConfig { rounds: 8, block: Some("large".into()), ..PlanConfig::default() };
    (config.search.attitudes, config.search.verify) = (64, 3);
    let straight = plan(&site.input(), &config, SeedTree::new(1), &Silent).unwrap();
    config.insertion = Insertion::Guided;
    let guided = plan(&site.input(), &config, SeedTree::new(1), &Silent).unwrap();
    assert!(guided.summary.blocks >= straight.summary.blocks);
    let same = |p: &Plan, n: usize| p.placements[..n].iter().map(|p| p.rest).collect::<Vec<_>>();
    let n = straight.placements.len();
    assert_eq!(same(&guided, n), same(&straight, n), "paths come after the rounds");
}

#[test]
fn a_window_behind_a_lip_has_a_place_that_no_straight_way_leads_to() {
    let site = pit();
    let config = config(Insertion::Straight);
    let found =
        plan::shut_windows(&site.input(), &config, 4000, SeedTree::new(1), &Silent).unwrap();
    assert!(!found.is_empty());
    let sum = |of: fn(&plan::ShutWindow) -> u32| found.iter().map(of).sum::<u32>();
    assert!(sum(|w| w.hidden) > 0, "{found:?}");
    assert!(found.iter().any(|w| w.opened && w.path), "{found:?}");
    for w in &found {
        let parts = [w.too_high, w.left, w.unstable, w.wedged, w.straight, w.hidden];
        assert_eq!(parts.iter().sum::<u32>(), w.tried);
    }
}
