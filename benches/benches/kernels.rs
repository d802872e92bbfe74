//! Eight kernels: neighbours, distance field, fit, drop, pooling, LAZ, visibility, page.

use divan::{Bencher, black_box};
use geom::hidden_points::{RADIUS_FACTOR, visible};
use geom::{Bounds, DVec3, DistanceField, Pose, Quat, SeedTree, Silent, Vec3, knn};
use io::RawCloud;
use kernels::{row, scattered, tetrapod};
use net::Neighbourhood;
use net::attentive_pooling::{PoolingWeights, RELATIVE, pool};
use pose::PoseConfig;
use rand::RngExt;
use report::ReportInput;
use scene::Ground;
use sim::{BlockShape, PhysicsConfig, World};

fn main() {
    divan::main();
}

/// The 80 nearest of every point: what the backbone asks for.
#[divan::bench(args = [10_000, 100_000], sample_count = 10)]
fn neighbours(bencher: Bencher, points: usize) {
    let cloud = scattered(points);
    bencher.bench(|| knn(black_box(&cloud), 80));
}

/// The distance field of a block, and reading it.
#[divan::bench(args = [64, 96], sample_count = 10)]
fn distance_field(bencher: Bencher, cells: usize) {
    let mesh = tetrapod().mesh;
    bencher.bench(|| DistanceField::new(black_box(&mesh), cells, 0.3));
}

#[divan::bench]
fn distance_field_read(bencher: Bencher) {
    let field = DistanceField::new(&tetrapod().mesh, 64, 0.3).expect("a closed mesh");
    let places: Vec<Vec3> = scattered(10_000).into_iter().map(|p| p * 0.1 - Vec3::ONE).collect();
    bencher.bench(|| places.iter().map(|p| field.at(*p).0).sum::<f32>());
}

/// The pose stage on true segments: search, fit, judgement.
#[divan::bench(args = [1, 8], sample_count = 10)]
fn fit(bencher: Bencher, blocks: u32) {
    let pile = row(blocks);
    let config = PoseConfig::default();
    let recognise = || {
        let seed = SeedTree::new(1);
        pose::recognise(&pile.survey, &pile.segmentation, &pile.catalog, &config, seed, &Silent)
    };
    assert_eq!(recognise().map_or(0, |found| found.len()), blocks as usize);
    bencher.bench(recognise);
}

/// One block onto eight fixed ones, until it rests.
#[divan::bench(sample_count = 20)]
fn drop_one(bencher: Bencher) {
    let model = tetrapod();
    let shape = BlockShape::new(&model).expect("convex parts of the program's own");
    let config = PhysicsConfig::default().for_block_size(model.d_box_m);
    let area = Bounds { min: Vec3::splat(-10.0), max: Vec3::splat(10.0) };
    bencher.bench(|| {
        let mut world = World::new(&config);
        world.add_ground(&Ground::Level { z_m: 0.0 }, &area);
        for k in 0..8 {
            let at = Vec3::new((k % 3) as f32 * 1.9 - 1.9, (k / 3) as f32 * 1.9 - 1.9, 0.9);
            world.add_fixed(&shape, &Pose::from_parts(at, Quat::IDENTITY));
        }
        world.add_moving(&shape, &Pose::from_parts(Vec3::new(0.2, 0.1, 3.5), Quat::IDENTITY));
        world.settle(config.max_time_s)
    });
}

/// The fused graph convolution, forward, at the backbone's widths.
#[divan::bench(args = [54, 118], sample_count = 10)]
fn pooling(bencher: Bencher, features: usize) {
    let n = 2048;
    let hood = Neighbourhood::dilated(scattered(n), 20, 4);
    let mut rng = SeedTree::new(3).rng();
    let mut draw =
        |count: usize| -> Vec<f32> { (0..count).map(|_| rng.random::<f32>() - 0.5).collect() };
    let (a, position, bias) = (draw(n * features), draw(RELATIVE * features), draw(features));
    let attention = draw((features + RELATIVE) * (features + RELATIVE));
    let weights = PoolingWeights { position: &position, bias: &bias, attention: &attention };
    bencher.bench(|| pool(black_box(&a), &hood, n, weights));
}

/// A labelled cloud of 100,000 points to a LAZ file and back.
#[divan::bench(sample_count = 10)]
fn laz(bencher: Bencher) {
    let folder = tempfile::tempdir().expect("room for a file");
    let path = folder.path().join("cloud.laz");
    let position: Vec<DVec3> = scattered(100_000).iter().map(|p| p.as_dvec3()).collect();
    let instance = Some((0..position.len() as u32).map(|i| i % 50).collect());
    let cloud = RawCloud { position, instance, ..Default::default() };
    bencher.bench(|| {
        io::points::write(&path, &cloud).expect("a folder of our own");
        io::points::read(&path, &Silent).expect("just written").len()
    });
}

/// Hidden-point removal, one viewpoint.
#[divan::bench(sample_count = 10)]
fn visibility(bencher: Bencher) {
    let points = row(8).survey.cloud.position_m;
    bencher.bench(|| visible(&points, Vec3::new(10.0, 0.0, 60.0), RADIUS_FACTOR));
}

/// The report's page.
#[divan::bench(sample_count = 10)]
fn page(bencher: Bencher) {
    let pile = row(8);
    bencher.bench(|| report::html(&ReportInput::new("bench", &pile.survey, &pile.catalog)));
}
