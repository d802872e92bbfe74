//! Ground from a survey minus recognised blocks.

use crate::site::{self, Heard};
use geom::{PointCloud, Pose, SeedTree, Vec3};
use plan::{GroundConfig, estimate_ground, with_obstacles};
use rand::RngExt;
use scene::{Fit, Ground, Guess, InstanceId, ModelId, Recognised, Verdict};

fn recognised(pose: Pose) -> Recognised {
    Recognised::of_fit(InstanceId(1), Vec::new(), Fit::of_pose(ModelId(0), pose))
}

#[test]
fn a_slope_under_blocks_comes_back() {
    let site = site::site(6.0, 0, 1.0);
    let model = site.catalog.get(ModelId(0));
    let slope = |x: f32, y: f32| 1.0 + 0.2 * x - 0.1 * y;
    let mut rng = SeedTree::new(5).rng();
    let poses: Vec<Pose> = (0..5)
        .map(|i| {
            let (x, y) = (4.0 + 2.5 * i as f32, 10.0);
            Pose::from_translation(Vec3::new(x, y, slope(x, y) + 1.0))
        })
        .collect();
    let mut points: Vec<Vec3> = (0..20_000)
        .map(|_| (rng.random::<f32>() * 20.0, rng.random::<f32>() * 20.0))
        .map(|(x, y)| Vec3::new(x, y, slope(x, y)))
        .filter(|p| poses.iter().all(|q| (q.translation - *p).truncate().length() > 1.3))
        .collect();
    for pose in &poses {
        points.extend(model.mesh.sample_surface(800, &mut rng).iter().map(|(p, _)| *pose * *p));
    }
    // A block nobody recognised.
    let stray = Pose::from_translation(Vec3::new(10.0, 4.0, slope(10.0, 4.0) + 1.0));
    points.retain(|p| {
        (stray.translation - *p).truncate().length() > 1.3 || p.z > stray.translation.z
    });
    points.extend(
        model
            .mesh
            .sample_surface(800, &mut rng)
            .iter()
            .map(|(p, _)| stray * *p)
            .filter(|p| p.z > stray.translation.z),
    );
    let cloud = PointCloud::from_positions(points);
    let found: Vec<Recognised> = poses.into_iter().map(recognised).collect();
    let heard = Heard::default();
    let ground = estimate_ground(&cloud, &found, &site.catalog, &GroundConfig::default(), &heard);
    assert!(matches!(ground, Ground::Grid { .. }));
    let mut worst = 0.0_f32;
    for i in 0..40 {
        for j in 0..40 {
            let (x, y) = (0.5 + 0.475 * i as f32, 0.5 + 0.475 * j as f32);
            worst = worst.max((ground.height_m(x, y) - slope(x, y)).abs());
        }
    }
    assert!(worst < 0.25, "worst error {worst} m on a 2 m block");
    assert!(!heard.has("no ground"));
    // What was not recognised is solid all the same, and said to be; all else stays as it was.
    let config = GroundConfig::default();
    let with = with_obstacles(ground.clone(), &cloud, &found, &site.catalog, &config, &heard);
    let over = |g: &Ground| g.height_m(stray.translation.x, stray.translation.y);
    let top = over(&with);
    assert!(
        (stray.translation.z..stray.translation.z + 1.5).contains(&top),
        "{top} above {}",
        stray.translation.z
    );
    assert!(heard.has("taken as solid"));
    for pose in scene::stated(&found).map(|(_, fit)| fit.site_from_block.translation) {
        assert!((with.height_m(pose.x, pose.y) - ground.height_m(pose.x, pose.y)).abs() < 0.05);
    }
    // A block that is there but not judged is such a thing too; one that is recognised is not.
    let mut judged = found.clone();
    let guess = Guess::Fit(Fit::of_pose(ModelId(0), stray));
    judged.push(Recognised { verdict: Verdict::NotJudged(guess), ..recognised(stray) });
    let left_open = with_obstacles(ground.clone(), &cloud, &judged, &site.catalog, &config, &heard);
    assert_eq!(left_open, with);
    *judged.last_mut().unwrap() = recognised(stray);
    assert_eq!(
        with_obstacles(ground.clone(), &cloud, &judged, &site.catalog, &config, &heard),
        ground
    );
}

#[test]
fn without_ground_points_the_lowest_block_gives_the_level() {
    let site = site::site(6.0, 0, 1.0);
    let model = site.catalog.get(ModelId(0));
    let mut rng = SeedTree::new(5).rng();
    let pose = Pose::from_translation(Vec3::new(3.0, 3.0, 5.0));
    let points = model.mesh.sample_surface(500, &mut rng).iter().map(|(p, _)| pose * *p).collect();
    let heard = Heard::default();
    let cloud = PointCloud::from_positions(points);
    let ground = estimate_ground(
        &cloud,
        &[recognised(pose)],
        &site.catalog,
        &GroundConfig::default(),
        &heard,
    );
    let lowest = model.mesh.bounds().min.z + 5.0;
    assert!(matches!(ground, Ground::Level { z_m } if (z_m - lowest).abs() < 1e-4), "{ground:?}");
    assert!(heard.has("no ground"));
    let empty = estimate_ground(
        &PointCloud::default(),
        &[],
        &site.catalog,
        &GroundConfig::default(),
        &heard,
    );
    assert_eq!(empty, Ground::Level { z_m: 0.0 });
}
