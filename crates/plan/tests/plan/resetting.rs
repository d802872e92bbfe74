//! Blocks of the pile that are set elsewhere.

use crate::site::{Heard, Site};
use geom::{Pose, Quat, SeedTree, Silent, Vec3};
use plan::{PlanConfig, PlanError, PlanInput, plan, replan};
use scene::{
    Catalog, DesignSurface, Ground, InstanceId, ModelId, PlacedBlock, Scene, Shape, SiteFrame,
};

/// Cubes of 1 m: a tower of two (1 below, 2 on it) at one end of a bed that lacks a layer.
fn tower() -> Site {
    let catalog =
        Catalog::new(vec![blocks::shape_model("cube", Shape::Cube { size: 1.0 }, 2300.0).unwrap()]);
    let centre = catalog.get(ModelId(0)).centre;
    let cube = |block, x: f32, z: f32| PlacedBlock {
        block: InstanceId(block),
        model: ModelId(0),
        site_from_block: Pose::from_parts(Vec3::new(x, 1.0, z) - centre, Quat::IDENTITY),
    };
    let blocks = vec![cube(1, 1.0, 0.5), cube(2, 1.0, 1.5)];
    let scene = Scene { blocks, ground: Ground::Level { z_m: 0.0 } };
    let boundary = vec![[0.0, 0.0], [6.0, 0.0], [6.0, 2.0], [0.0, 2.0]];
    let design = DesignSurface::Level { boundary, level_m: 1.0 };
    Site { scene, frame: SiteFrame::default(), design, catalog }
}

fn config(reset: u32, reset_blocks: &[u32]) -> PlanConfig {
    let reset_blocks = reset_blocks.to_vec();
    let mut config = PlanConfig { reset, reset_blocks, rounds: 3, ..PlanConfig::default() };
    (config.search.attitudes, config.search.verify) = (64, 4);
    config
}

#[test]
fn the_block_that_stands_too_high_is_set_where_volume_lacks() {
    let site = tower();
    let input = site.input();
    let without = plan(&input, &config(0, &[]), SeedTree::new(1), &Silent).unwrap();
    let with = plan(&input, &config(2, &[]), SeedTree::new(1), &Silent).unwrap();
    let p = &with.placements[0];
    let reset = p.handling.reset.expect("it comes before all new blocks");
    assert_eq!((reset.block, reset.from), (InstanceId(2), site.scene.blocks[1].site_from_block));
    let centre = p.rest * site.catalog.get(p.model).centre;
    assert!(centre.z < 0.7 && centre.x > 1.5, "{centre}");
    assert_eq!(with.summary.reset, 1);
    assert_eq!(with.summary.blocks as usize + 1, with.placements.len());
    assert!(with.summary.blocks < without.summary.blocks, "one block less is to be ordered");

    // Planned on from, before and after it was done.
    let again = replan(&input, &with, &config(2, &[]), SeedTree::new(2), &Silent).unwrap();
    assert_eq!(again.placements[0], *p);
    let mut scene = site.scene.clone();
    scene.blocks[1].site_from_block = p.rest;
    let done = PlanInput { scene: &scene, ..input };
    let rest = replan(&done, &with, &config(2, &[]), SeedTree::new(2), &Silent).unwrap();
    assert_eq!((rest.summary.reset, rest.summary.blocks), (0, with.summary.blocks));
}

#[test]
fn a_block_that_carries_others_stays() {
    let site = tower();
    let input = site.input();
    let refused = |blocks: &[u32]| {
        plan(&input, &config(1, blocks), SeedTree::new(1), &Silent).unwrap_err().to_string()
    };
    let carrying = refused(&[1]);
    assert!(carrying.contains("block 1 cannot be lifted") && carrying.contains("2"), "{carrying}");
    assert!(refused(&[7]).contains("no block 7"));
    let none = plan(&input, &config(0, &[2]), SeedTree::new(1), &Silent);
    assert_eq!(none.unwrap_err(), PlanError::ResetNone { named: 1 });
    // With a third cube on it the second carries too: nothing can be re-set but the third.
    let mut scene = site.scene.clone();
    let mut third = scene.blocks[1];
    third.block = InstanceId(3);
    third.site_from_block.translation.z += 1.0;
    scene.blocks.insert(0, third);
    let heard = Heard::default();
    let higher = PlanInput { scene: &scene, ..input };
    let found = plan(&higher, &config(1, &[]), SeedTree::new(1), &heard).unwrap();
    assert_eq!(found.placements[0].handling.reset.unwrap().block, InstanceId(3));
}
