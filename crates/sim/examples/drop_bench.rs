//! Drops tetrapods into a pen and times it; prints everything another engine needs to repeat the drop, as JSON.
//! The other side is `tools/oracle/drop_compare.py`.
//!
//! Arguments: number of seeds, steps per second.

use geom::{Bounds, Pose, Quat, SeedTree, Vec3};
use rand::RngExt;
use scene::{Ground, Shape};
use sim::{BlockShape, PhysicsConfig, World};

const BLOCKS: usize = 54;
const HALF_PEN_M: f32 = 5.0;
const SPACING_M: f32 = 2.75;

/// Seconds this thread has had of a processor (Linux): other people's load does not count.
fn cpu_s() -> f64 {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat")
        .expect("Linux keeps scheduling times");
    text.split(' ').next().and_then(|ns| ns.parse::<f64>().ok()).expect("nanoseconds come first")
        * 1e-9
}

fn main() {
    let mut numbers = std::env::args().skip(1).map(|a| a.parse::<u64>().expect("a whole number"));
    let (seeds, rate) = (numbers.next().unwrap_or(20), numbers.next().unwrap_or(120));
    let model = blocks::shape_model("tetrapod", Shape::Tetrapod { size: 2.0 }, 2300.0)
        .expect("a valid shape");
    let shape = BlockShape::new(&model).expect("a valid block");
    let config = PhysicsConfig { step_s: 1.0 / rate as f32, ..Default::default() }
        .for_block_size(model.d_box_m);
    let list =
        |v: &[f32]| format!("[{}]", v.iter().map(f32::to_string).collect::<Vec<_>>().join(","));
    let joined = |v: Vec<String>| format!("[{}]", v.join(","));
    let hull =
        |p: &scene::ConvexPart| joined(p.corners.iter().map(|c| list(&c.to_array())).collect());
    let hulls = joined(model.parts.iter().map(hull).collect());
    let covariance = model.mesh.moments().covariance_m5 * model.density_kg_m3;
    // Inertia of a tetrapod is that of a ball: 2·∫x².
    let inertia = 2.0 * covariance.x_axis.x;

    let mut runs = Vec::new();
    for seed in 0..seeds {
        let mut rng = SeedTree::new(seed).rng();
        let starts: Vec<Pose> = (0..BLOCKS)
            .map(|i| {
                let q: [f32; 4] = std::array::from_fn(|_| rng.random_range(-1.0..1.0));
                let place = |k: usize| (k % 3) as f32 * SPACING_M - SPACING_M;
                let at = Vec3::new(place(i), place(i / 3), 1.5 + (i / 9) as f32 * SPACING_M);
                Pose::from_parts(at, Quat::from_array(q).normalize())
            })
            .collect();
        let begun = cpu_s();
        let mut world = World::new(&config);
        world.add_ground(
            &Ground::Level { z_m: 0.0 },
            &Bounds { min: Vec3::splat(-10.0), max: Vec3::splat(10.0) },
        );
        for normal in [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y] {
            world.add_wall(-normal * HALF_PEN_M, normal);
        }
        let ids: Vec<_> = starts.iter().map(|p| world.add_moving(&shape, p)).collect();
        let settled = world.settle(60.0);
        let cpu_s = cpu_s() - begun;
        let pose = |p: &Pose| {
            list(&[p.translation.to_array().as_slice(), &p.rotation.to_array()].concat())
        };
        let rest =
            ids.iter().map(|id| pose(&world.pose(*id).expect("nothing was removed"))).collect();
        runs.push(format!(
            "{{\"cpu_s\":{cpu_s},\"time_s\":{},\"at_rest\":{},\"overlap_m\":{},\"start\":{},\"rest\":{}}}",
            settled.time_s,
            settled.at_rest,
            world.deepest_overlap_m(),
            joined(starts.iter().map(pose).collect()),
            joined(rest)
        ));
    }
    println!(
        "{{\"hulls\":{hulls},\"mass_kg\":{},\"volume_m3\":{},\"inertia\":{inertia},\"step_s\":{},\"half_pen_m\":{HALF_PEN_M},\"friction\":0.8,\"rest_speed_m_s\":{},\"rest_time_s\":{},\"reach_m\":{},\"runs\":{}}}",
        model.mass_kg(),
        model.volume_m3,
        config.step_s,
        config.rest_speed_m_s,
        config.rest_time_s,
        shape.reach_m(),
        joined(runs)
    );
}
