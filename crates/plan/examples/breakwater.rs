//! Plans a breakwater span like the thesis' site: 150 × 25 m, 1000 blocks dropped at random, a level design, a
//! supplement one size larger. Prints one line of figures a plan.
//!
//! `cargo run --release -p tsumu-plan --example breakwater -- policy=search seeds=3 length=150 blocks=1000`

use geom::{Bounds, Pose, SeedTree, Silent, Vec3};
use plan::{PlanConfig, PlanInput, Policy};
use rand::{RngExt, seq::SliceRandom};
use scene::{
    Catalog, DesignSurface, Ground, InstanceId, ModelId, PlacedBlock, PlacementState, Scene, Shape, SiteFrame,
};
use sim::{BlockShape, PhysicsConfig, World};
use std::time::Instant;

const WIDTH_M: f32 = 25.0;

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let value = |key: &str, default: &str| {
        let found = arguments.iter().find_map(|a| a.strip_prefix(&format!("{key}=")).map(str::to_owned));
        found.unwrap_or_else(|| default.to_owned())
    };
    let number = |key: &str, default: f32| value(key, &default.to_string()).parse::<f32>().expect("a number");
    let length_m = number("length", 150.0);
    let count = number("blocks", 1000.0) as usize;
    let level_m = number("level", 3.0);

    let block =
        |name: &str, size: f32| blocks::shape_model(name, Shape::Tetrapod { size }, 2300.0).expect("a valid shape");
    let catalog = Catalog::new(vec![block("existing", 2.0), block("supplement", 2.1)]);
    let started = Instant::now();
    let scene = pile(&catalog, length_m, count, SeedTree::new(number("site", 1.0) as u64));
    println!("site: {count} blocks on {length_m} x {WIDTH_M} m in {:.1} s", started.elapsed().as_secs_f32());
    let corner =
        [[0.0, 0.0], [f64::from(length_m), 0.0], [f64::from(length_m), f64::from(WIDTH_M)], [0.0, f64::from(WIDTH_M)]];
    let design = DesignSurface::Level { level_m: f64::from(level_m), boundary: corner.to_vec() };
    let frame = SiteFrame::default();
    let input = PlanInput { scene: &scene, frame: &frame, design: &design, catalog: &catalog, placed: &[] };

    let mut config = PlanConfig { block: Some("supplement".into()), ..PlanConfig::default() };
    for a in &arguments {
        let Some((key, v)) = a.split_once('=') else { continue };
        let f = || v.parse::<f32>().expect("a number");
        match key {
            "v" => config.minimum_volume_m3 = Some(f()),
            "f" => config.overflow_m = Some(f()),
            "rounds" => config.rounds = f() as u32,
            "supports" => config.minimum_supports = f() as u32,
            "shake" => config.shake_m_s = f(),
            "wedge" => config.wedge_limit = f(),
            "iou" => config.nms_iou = f(),
            "stride" => config.stride_m = Some(f()),
            "window" => config.window_m = Some(f()),
            "attitudes" => config.search.attitudes = f() as u32,
            "step" => config.search.step_cells = f() as u32,
            "verify" => config.search.verify = f() as u32,
            "trapped" => config.search.trapped_weight = f(),
            "protrusion" => config.search.protrusion_weight = f(),
            "inside" => config.inside = if v == "centre" { plan::Inside::Centre } else { plan::Inside::Whole },
            "walls" => config.walls = v == "true",
            _ => {}
        }
    }
    println!(
        "policy seed blocks mean_m max_m protruding void_before void_after porosity rounds drops over/unset/unst/out seconds"
    );
    for policy in value("policy", "random,search").split(',') {
        config.policy = match policy {
            "random" => Policy::Random,
            "search" => Policy::Search,
            other => panic!("no policy {other} here"),
        };
        for seed in 0..number("seeds", 1.0) as u64 {
            let started = Instant::now();
            let plan = match plan::plan(&input, &config, SeedTree::new(seed), &Silent) {
                Ok(plan) => plan,
                Err(error) => return eprintln!("error: {error}"),
            };
            let s = plan.summary;
            println!(
                "{policy} {seed} {} {:.3} {:.2} {} {:.0} {:.0} {:.3} {} {} {}/{}/{}/{} {:.1}",
                s.blocks,
                s.mean_distance_m,
                s.max_distance_m,
                s.protruding,
                s.void_before_m3,
                s.void_after_m3,
                s.porosity,
                s.rounds,
                plan.placements.len() + plan.removed.len(),
                s.overflowed,
                s.unsettled,
                s.unstable,
                s.outside,
                started.elapsed().as_secs_f32()
            );
            debug_assert!(plan.placements.iter().all(|p| p.state == PlacementState::Kept));
        }
    }
}

/// Blocks dropped layer by layer into a pen, each layer fixed once it rests.
fn pile(catalog: &Catalog, length_m: f32, count: usize, seed: SeedTree) -> Scene {
    let model = catalog.get(ModelId(0));
    let shape = BlockShape::new(model).expect("a valid block");
    let ground = Ground::Level { z_m: 0.0 };
    let physics = PhysicsConfig { step_s: 1.0 / 60.0, ..PhysicsConfig::default() }.for_block_size(model.d_box_m);
    let mut world = World::new(&physics);
    world.add_ground(&ground, &Bounds { min: Vec3::ZERO, max: Vec3::new(length_m, WIDTH_M, 0.0) });
    for (point, inward) in [
        (Vec3::ZERO, Vec3::X),
        (Vec3::ZERO, Vec3::Y),
        (Vec3::new(length_m, WIDTH_M, 0.0), Vec3::NEG_X),
        (Vec3::new(length_m, WIDTH_M, 0.0), Vec3::NEG_Y),
    ] {
        world.add_wall(point, inward);
    }
    let mut rng = seed.rng();
    let edge_m = 2.5 * model.d_max_m;
    let (nx, ny) = ((length_m / edge_m) as usize, (WIDTH_M / edge_m) as usize);
    let mut ids = Vec::new();
    let mut height_m = 2.0;
    while ids.len() < count {
        let mut cells: Vec<usize> = (0..nx * ny).collect();
        cells.shuffle(&mut rng);
        let layer: Vec<_> = cells
            .into_iter()
            .take(count - ids.len())
            .map(|c| {
                let (x, y) = ((c % nx) as f32 + 0.5, (c / nx) as f32 + 0.5);
                let place = Vec3::new(x * length_m / nx as f32, y * WIDTH_M / ny as f32, height_m);
                let axis = Vec3::new(rng.random::<f32>() - 0.5, rng.random::<f32>() - 0.5, rng.random::<f32>() - 0.5);
                let turn = geom::Quat::from_axis_angle(axis.normalize_or(Vec3::Z), 6.3 * rng.random::<f32>());
                world.add_moving(&shape, &Pose::from_parts(place, turn))
            })
            .collect();
        world.settle(15.0);
        layer.iter().for_each(|&id| world.freeze(id));
        ids.extend(layer);
        height_m += 1.5;
    }
    let blocks = ids.iter().enumerate().map(|(i, &id)| PlacedBlock {
        block: InstanceId(i as u32 + 1),
        model: ModelId(0),
        site_from_block: world.pose(id).expect("no block was removed"),
    });
    Scene { blocks: blocks.collect(), ground }
}
