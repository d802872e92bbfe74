//! The span both examples plan on: 25 m wide, blocks dropped layer by layer, level design.

use geom::{Bounds, Pose, SeedTree, Vec3};
use rand::{RngExt, seq::SliceRandom};
use scene::{Catalog, DesignSurface, Ground, InstanceId, ModelId, PlacedBlock, Scene, Shape};
use sim::{BlockShape, PhysicsConfig, World};

/// Width of the span.
pub const WIDTH_M: f32 = 25.0;

/// `key=value` of the command line, or the default.
pub fn value(key: &str, default: &str) -> String {
    let found =
        std::env::args().find_map(|a| a.strip_prefix(&format!("{key}=")).map(str::to_owned));
    found.unwrap_or_else(|| default.to_owned())
}

/// The same as a number.
pub fn number(key: &str, default: f32) -> f32 {
    value(key, &default.to_string()).parse().unwrap_or_else(|_| panic!("{key} must be a number"))
}

/// Tetrapods (or `shape=xbloc`) of 2 m lie there (5.2 t); 2.1 m (6 t) are added, with `types=both` 1.7 m too.
pub fn catalog() -> Catalog {
    let shape = |size: f32| match value("shape", "tetrapod").as_str() {
        "xbloc" => Shape::XblocLike { size },
        _ => Shape::Tetrapod { size },
    };
    let block = |name: &str, size: f32| {
        blocks::shape_model(name, shape(size), 2300.0).expect("a valid shape")
    };
    Catalog::new(vec![block("existing", 2.0), block("supplement", 2.1), block("smaller", 1.7)])
}

/// A level over the whole span.
pub fn design(length_m: f32, level_m: f32) -> DesignSurface {
    let (l, w) = (f64::from(length_m), f64::from(WIDTH_M));
    DesignSurface::Level {
        level_m: f64::from(level_m),
        boundary: vec![[0.0, 0.0], [l, 0.0], [l, w], [0.0, w]],
    }
}

/// Blocks dropped layer by layer into a pen, each layer fixed once it rests.
pub fn pile(catalog: &Catalog, length_m: f32, count: usize, seed: SeedTree) -> Scene {
    let model = catalog.get(ModelId(0));
    let shape = BlockShape::new(model).expect("a valid block");
    let ground = Ground::Level { z_m: 0.0 };
    let physics = PhysicsConfig { step_s: 1.0 / 60.0, ..PhysicsConfig::default() }
        .for_block_size(model.d_box_m);
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
                let axis = Vec3::new(
                    rng.random::<f32>() - 0.5,
                    rng.random::<f32>() - 0.5,
                    rng.random::<f32>() - 0.5,
                );
                let turn = geom::Quat::from_axis_angle(
                    axis.normalize_or(Vec3::Z),
                    6.3 * rng.random::<f32>(),
                );
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
