//! Piles, surveys and recognitions that the tests make themselves.

use geom::{PointCloud, Pose, Quat, SeedTree, Vec3};
use monitor::SeenBlock;
use rand::{Rng, RngExt};
use rand_distr::{Distribution, StandardNormal};
use scene::{Catalog, ModelId, Shape, Survey};

const SD_M: f32 = 0.006;
const SD_RAD: f32 = 0.003;
/// Distance of neighbouring places.
pub const STEP_M: f32 = 2.3;

pub fn catalog(shape: Shape) -> Catalog {
    Catalog::new(vec![blocks::shape_model("block", shape, 2300.0).unwrap()])
}

pub fn tetrapods() -> Catalog {
    catalog(Shape::Tetrapod { size: 2.0 })
}

/// Blocks with room between them on a grid, as nobody knows them.
pub fn pile(catalog: &Catalog, count: usize, seed: u64) -> Vec<Pose> {
    let mut rng = SeedTree::new(seed).rng();
    let centre = catalog.get(ModelId(0)).centre;
    let side = (count as f32).sqrt().ceil() as usize;
    (0..count)
        .map(|i| {
            let mut jitter = || rng.random_range(-0.3..0.3_f32);
            let at = Vec3::new(
                (i % side) as f32 * STEP_M + jitter(),
                (i / side) as f32 * STEP_M + jitter(),
                1.2 + jitter(),
            );
            let turn = Quat::from_scaled_axis(Vec3::new(jitter(), jitter(), jitter()) * 10.0);
            Pose::from_parts(at - turn * centre, turn)
        })
        .collect()
}

/// What a sensor straight above shows of the pile on its grid of `places` and of the bed at height 0.
pub fn survey(catalog: &Catalog, poses: &[Pose], places: usize, seed: u64) -> Survey {
    let mut rng = SeedTree::new(seed).child("survey", 0).rng();
    let mesh = &catalog.get(ModelId(0)).mesh;
    let mut position_m = Vec::new();
    for pose in poses {
        for (p, n) in mesh.sample_surface(500, &mut rng) {
            if (pose.rotation * n).z > 0.05 {
                position_m.push(pose.transform_point(p) + noise(&mut rng) * 0.005);
            }
        }
    }
    let reach = 1.0 + STEP_M * (places as f32).sqrt().ceil();
    for _ in 0..6000 {
        let at = Vec3::new(rng.random_range(-2.0..reach), rng.random_range(-2.0..reach), 0.0);
        let open = poses.iter().all(|p| {
            (p.transform_point(catalog.get(ModelId(0)).centre) - at).truncate().length() > 0.7
        });
        if open {
            position_m.push(at);
        }
    }
    Survey { cloud: PointCloud::from_positions(position_m), ..Survey::default() }
}

fn noise(rng: &mut impl Rng) -> Vec3 {
    let mut normal = || -> f32 { StandardNormal.sample(rng) };
    Vec3::new(normal(), normal(), normal())
}

/// The blocks as a recognition would state them: off by their covariance, in any of their symmetric readings.
pub fn seen(catalog: &Catalog, poses: &[Pose], seed: u64) -> Vec<SeenBlock> {
    let mut rng = SeedTree::new(seed).child("seen", 0).rng();
    let model = catalog.get(ModelId(0));
    let mut covariance = [0.0; 36];
    for i in 0..6 {
        let sd = if i < 3 { SD_M } else { SD_RAD };
        covariance[7 * i] = sd * sd;
    }
    let one = |(i, pose): (usize, &Pose)| {
        let at = pose.transform_point(model.centre) + noise(&mut rng) * SD_M;
        let turn = Quat::from_scaled_axis(noise(&mut rng) * SD_RAD) * pose.rotation;
        let posed = Pose::from_parts(at - turn * model.centre, turn);
        let element = rng.random_range(0..model.symmetry.order());
        SeenBlock {
            id: i as u32 + 1,
            model: ModelId(0),
            type_judged: true,
            site_from_block: posed * model.symmetry.element(element),
            covariance: Some(covariance),
            confidence: 0.99,
            occlusion: 0.4,
            points: Vec::new(),
        }
    };
    poses.iter().enumerate().map(one).collect()
}

/// The pose moved and turned about its centre.
pub fn moved(catalog: &Catalog, pose: &Pose, shift: Vec3, turn: Quat) -> Pose {
    let centre = catalog.get(ModelId(0)).centre;
    let at = pose.transform_point(centre) + shift;
    let rotation = turn * pose.rotation;
    Pose::from_parts(at - rotation * centre, rotation)
}
