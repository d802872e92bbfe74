//! A small span: blocks dropped by the physics engine on level ground at 0 m.

use geom::{Bounds, Event, Observer, Pose, SeedTree, Vec3};
use rand::RngExt;
use scene::{
    Catalog, DesignSurface, Ground, InstanceId, ModelId, PlacedBlock, Scene, Shape, SiteFrame,
};
use std::sync::Mutex;

/// Everything [`plan::PlanInput`] borrows.
pub struct Site {
    pub scene: Scene,
    pub frame: SiteFrame,
    pub design: DesignSurface,
    pub catalog: Catalog,
}

impl Site {
    pub fn input(&self) -> plan::PlanInput<'_> {
        plan::PlanInput {
            scene: &self.scene,
            frame: &self.frame,
            design: &self.design,
            catalog: &self.catalog,
            placed: &[],
            proposer: None,
            survey: None,
        }
    }
}

/// `edge_m` × `edge_m`, `count` tetrapods of 2 m, design level in site heights (the local origin lies at 1000, 2000, 10).
pub fn site(edge_m: f32, count: usize, level_m: f64) -> Site {
    let model =
        |name: &str, size| blocks::shape_model(name, Shape::Tetrapod { size }, 2300.0).unwrap();
    let catalog = Catalog::new(vec![model("small", 2.0), model("large", 2.1)]);
    let ground = Ground::Level { z_m: 0.0 };
    let shape = sim::BlockShape::new(catalog.get(ModelId(0))).unwrap();
    let physics =
        sim::PhysicsConfig { step_s: 1.0 / 60.0, ..Default::default() }.for_block_size(2.0);
    let mut rng = SeedTree::new(3).rng();
    let mut world = sim::World::new(&physics);
    world.add_ground(&ground, &Bounds { min: Vec3::ZERO, max: Vec3::splat(edge_m) });
    let mut ids = Vec::new();
    for i in 0..count {
        let place = Vec3::new(
            rng.random::<f32>() * (edge_m - 3.0) + 1.5,
            rng.random::<f32>() * (edge_m - 3.0) + 1.5,
            2.5,
        );
        let turn = geom::Quat::from_rotation_x(6.0 * rng.random::<f32>());
        let id = world
            .add_moving(&shape, &Pose::from_parts(place + Vec3::Z * (i / 4) as f32 * 0.5, turn));
        world.settle(6.0);
        world.freeze(id);
        ids.push(id);
    }
    let blocks = ids.iter().enumerate().map(|(i, &id)| PlacedBlock {
        block: InstanceId(i as u32 + 1),
        model: ModelId(0),
        site_from_block: world.pose(id).unwrap(),
    });
    let scene = Scene { blocks: blocks.collect(), ground };
    let e = f64::from(edge_m);
    let boundary = vec![
        [1000.0, 2000.0],
        [1000.0 + e, 2000.0],
        [1000.0 + e, 2000.0 + e],
        [1000.0, 2000.0 + e],
    ];
    let design = DesignSurface::Level { level_m: level_m + 10.0, boundary };
    let frame = SiteFrame { origin: [1000.0, 2000.0, 10.0], ..SiteFrame::default() };
    Site { scene, frame, design, catalog }
}

/// Remembers warnings.
#[derive(Default)]
pub struct Heard(pub Mutex<Vec<String>>);

impl Observer for Heard {
    fn event(&self, event: Event) {
        if let Event::Warned(warning) = event {
            self.0.lock().unwrap().push(warning.message);
        }
    }
}

impl Heard {
    pub fn has(&self, words: &str) -> bool {
        self.0.lock().unwrap().iter().any(|w| w.contains(words))
    }
}
