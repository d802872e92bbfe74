//! Laws a physics world must keep, on blocks from the catalogue.

use blocks::shape_model;
use geom::{Bounds, Pose, Quat, SeedTree, Vec3};
use proptest::prelude::*;
use rand::RngExt;
use scene::{Ground, Shape};
use sim::{BlockShape, PhysicsConfig, Touched, World};

fn shape(shape: Shape) -> BlockShape {
    BlockShape::new(&shape_model("block", shape, 2300.0).unwrap()).unwrap()
}

fn cube(size: f32) -> BlockShape {
    shape(Shape::Cube { size })
}

fn around(reach: f32) -> Bounds {
    Bounds { min: Vec3::splat(-reach), max: Vec3::splat(reach) }
}

fn at(x: f32, y: f32, z: f32) -> Pose {
    Pose::from_translation(Vec3::new(x, y, z))
}

fn level_world(config: &PhysicsConfig) -> World {
    let mut world = World::new(config);
    world.add_ground(&Ground::Level { z_m: 0.0 }, &around(50.0));
    world
}

#[test]
fn parts_that_are_not_the_block_are_refused() {
    let mut model = blocks::shape_model("elbow", Shape::Cube { size: 1.0 }, 2300.0).unwrap();
    model.parts_volume_ratio = 1.46;
    let error = BlockShape::new(&model).err().unwrap();
    assert!(matches!(error, sim::SimError::LooseParts { parts: 1, .. }));
    assert!(error.to_string().contains("take 146 %"), "{error}");
    model.parts_volume_ratio = 1.09;
    assert!(BlockShape::new(&model).is_ok());
}

#[test]
fn a_block_falls_with_g() {
    let mut world = World::new(&PhysicsConfig::default());
    let id = world.add_moving(&cube(1.0), &at(0.0, 0.0, 100.0));
    world.step(120);
    let fallen = 100.0 - world.pose(id).unwrap().translation.z;
    assert!((fallen - 9.81 / 2.0).abs() < 0.1, "{fallen}");
    assert!((world.speed_m_s(id) - 9.81).abs() < 0.1);
}

#[test]
fn a_cube_rests_on_its_face_at_every_size() {
    for size in [0.03, 0.3, 2.0, 6.0] {
        let mut world = level_world(&PhysicsConfig::default().for_block_size(size));
        let id = world.add_moving(&cube(size), &at(0.0, 0.0, size));
        let settled = world.settle(30.0);
        assert!(settled.at_rest, "{size} m: {settled:?}");
        let z = world.pose(id).unwrap().translation.z;
        assert!((z / size - 0.5).abs() < 0.003, "{size} m: rests at {z}");
        assert!(world.deepest_overlap_m() < 0.005 * size);
        assert!(world.contacts(id).iter().any(|c| c.other == Touched::Ground && c.normal.z > 0.99));
    }
}

#[test]
fn friction_holds_below_its_angle_and_slides_above() {
    let travel = |slope_deg: f32| {
        let tilt = Quat::from_rotation_y(slope_deg.to_radians());
        let normal = tilt * Vec3::Z;
        let mut world = World::new(&PhysicsConfig { friction: 0.5, ..Default::default() });
        world.add_ground(&Ground::Plane { point: Vec3::ZERO, normal }, &around(50.0));
        let start = Pose::from_parts(normal * 0.501, tilt);
        let id = world.add_moving(&cube(1.0), &start);
        world.step(240);
        (world.pose(id).unwrap().translation - start.translation).length()
    };
    // tan⁻¹ 0.5 = 26.6°
    assert!(travel(20.0) < 0.02, "{}", travel(20.0));
    let slid = travel(35.0);
    let expected =
        0.5 * 9.81 * (35.0_f32.to_radians().sin() - 0.5 * 35.0_f32.to_radians().cos()) * 4.0;
    assert!((slid / expected - 1.0).abs() < 0.1, "{slid} against {expected}");
}

#[test]
fn fixed_blocks_that_overlap_stay_where_they_are() {
    let mut world = level_world(&PhysicsConfig::default());
    let block = shape(Shape::Tetrapod { size: 2.0 });
    let poses = [at(0.0, 0.0, 0.5), at(0.3, 0.0, 0.6), at(0.1, 0.2, -0.4)];
    let ids = poses.map(|p| world.add_fixed(&block, &p));
    let falling = world.add_moving(&block, &at(0.2, 0.1, 4.0));
    assert!(world.settle(30.0).at_rest);
    for (id, pose) in ids.iter().zip(&poses) {
        assert_eq!(world.pose(*id), Some(*pose));
    }
    let height = world.pose(falling).unwrap().translation.z;
    assert!((0.3..3.0).contains(&height), "thrown to {height}");
}

#[test]
fn a_grid_carries_like_the_plane_it_samples() {
    let slope = Ground::Plane { point: Vec3::ZERO, normal: Vec3::new(-0.2, 0.1, 1.0).normalize() };
    let (nx, ny, cell, origin) = (41, 33, 0.5, [-10.0, -8.0]);
    let node = |i: usize| (origin[0] + (i % nx) as f32 * cell, origin[1] + (i / nx) as f32 * cell);
    let z_m = (0..nx * ny).map(|i| slope.height_m(node(i).0, node(i).1)).collect();
    let grid = Ground::Grid { origin, cell_m: cell, nx, z_m };
    let rest = |ground: &Ground, bounds: Bounds| {
        let mut world = World::new(&PhysicsConfig::default());
        world.add_ground(ground, &bounds);
        let id = world.add_moving(&cube(1.0), &at(2.2, -1.3, 2.0));
        assert!(world.settle(30.0).at_rest);
        assert!(world.deepest_overlap_m() < 0.01);
        world.pose(id).unwrap().translation
    };
    let plane = rest(&slope, around(20.0));
    assert!(plane.distance(rest(&grid, around(20.0))) < 0.1);
    assert!(plane.distance(rest(&grid, around(4.0))) < 0.1);
    let mut world = World::new(&PhysicsConfig::default());
    world.add_ground(&grid, &around(20.0));
    for (x, y) in [(3.3, 2.1), (-7.0, 5.5), (0.0, -7.5)] {
        let (what, distance) = world.cast_ray(Vec3::new(x, y, 20.0), Vec3::NEG_Z, 50.0).unwrap();
        assert_eq!(what, Touched::Ground);
        assert!((20.0 - distance - slope.height_m(x, y)).abs() < 1e-3);
    }
}

#[test]
fn rays_see_what_was_just_added_and_not_what_was_removed() {
    let mut world = level_world(&PhysicsConfig::default());
    let down =
        |world: &mut World| world.cast_ray(Vec3::new(0.0, 0.0, 9.0), Vec3::NEG_Z, 20.0).unwrap();
    assert_eq!(down(&mut world).0, Touched::Ground);
    let id = world.add_fixed(&cube(1.0), &at(0.0, 0.0, 2.0));
    let (what, distance) = down(&mut world);
    assert_eq!(what, Touched::Block(id));
    assert!((distance - 6.5).abs() < 1e-4);
    world.remove(id);
    assert_eq!(down(&mut world).0, Touched::Ground);
    assert_eq!(world.pose(id), None);
}

#[test]
fn a_frozen_block_ignores_a_push_and_a_free_one_does_not() {
    let mut world = level_world(&PhysicsConfig::default());
    let ids = [at(0.0, 0.0, 0.5), at(5.0, 0.0, 0.5)].map(|p| world.add_moving(&cube(1.0), &p));
    assert!(world.settle(10.0).at_rest);
    let before = ids.map(|id| world.pose(id).unwrap());
    world.freeze(ids[0]);
    for id in ids {
        world.apply_impulse(id, Vec3::new(10_000.0, 0.0, 0.0));
    }
    assert!(world.settle(10.0).at_rest);
    assert_eq!(world.pose(ids[0]), Some(before[0]));
    assert!(world.pose(ids[1]).unwrap().translation.distance(before[1].translation) > 0.1);
}

/// A pile in a pen, as the scenes make them.
fn pile(config: &PhysicsConfig, seed: u64, count: usize) -> (Vec<Pose>, bool, f32) {
    let mut world = level_world(config);
    let half = 4.0;
    for normal in [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y] {
        world.add_wall(-normal * half, normal);
    }
    let block = shape(Shape::Tetrapod { size: 2.0 });
    let mut rng = SeedTree::new(seed).rng();
    let ids: Vec<_> = (0..count)
        .map(|i| {
            let turn = Quat::from_scaled_axis(Vec3::from_array(rng.random::<[f32; 3]>()) * 4.0);
            let (x, y) = ((i % 3) as f32 * 2.4 - 2.4, (i / 3 % 3) as f32 * 2.4 - 2.4);
            world.add_moving(
                &block,
                &Pose::from_parts(Vec3::new(x, y, 1.5 + (i / 9) as f32 * 2.5), turn),
            )
        })
        .collect();
    let settled = world.settle(config.max_time_s);
    let deep = world.deepest_overlap_m();
    (ids.iter().map(|id| world.pose(*id).unwrap()).collect(), settled.at_rest, deep)
}

#[test]
fn a_pile_of_tetrapods_comes_to_rest_without_overlap_and_repeats_bit_for_bit() {
    let config = PhysicsConfig { step_s: 1.0 / 60.0, ..Default::default() };
    let (poses, at_rest, deep) = pile(&config, 1, 27);
    assert!(at_rest);
    assert!(deep < 0.02, "{deep} m");
    assert!(poses.iter().all(|p| p.translation.z > 0.2 && p.translation.abs().max_element() < 8.0));
    assert_eq!(poses, pile(&config, 1, 27).0);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(16))]
    #[test]
    fn a_single_tetrapod_always_ends_on_the_ground(x in -3.0_f32..3.0, y in -3.0_f32..3.0, z in 1.5_f32..6.0, q in prop::array::uniform4(-1.0_f32..1.0)) {
        prop_assume!(q.iter().map(|v| v * v).sum::<f32>() > 0.01);
        let turn = Quat::from_array(q).normalize();
        let mut world = level_world(&PhysicsConfig::default());
        let id = world.add_moving(&shape(Shape::Tetrapod { size: 2.0 }), &Pose::from_parts(Vec3::new(x, y, z), turn));
        prop_assert!(world.settle(30.0).at_rest);
        prop_assert!(world.deepest_overlap_m() < 0.01);
        let grounded = world.contacts(id).iter().filter(|c| c.other == Touched::Ground).count();
        // Three legs as a rule; on the edges of two end faces, each as wide as a facet, it can balance.
        prop_assert!(grounded >= 2, "{} legs on the ground", grounded);
    }
}
