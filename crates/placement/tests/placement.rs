//! The stage from outside: training that can be stopped, a model that survives its file, what is shipped.

use geom::{Event, Observer, Quat, SeedTree, Silent, Vec3};
use placement::{
    GoodPose, NetworkShape, PlacementError, PlacementModel, RotationCode, Sample, TrainConfig,
    errors, stored_view, train,
};
use plan::{DepthView, Proposer};
use scene::{BlockModel, Shape};
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};

/// First weights come from one generator a process: trainings take turns.
static TRAINING: Mutex<()> = Mutex::new(());

fn tetrapod() -> BlockModel {
    blocks::shape_model("tetrapod", Shape::Tetrapod { size: 2.0 }, 2300.0).unwrap()
}

fn config() -> TrainConfig {
    let mut config = TrainConfig {
        steps: 60,
        warmup: 5,
        batch: 8,
        learning_rate: 3e-3,
        ..TrainConfig::default()
    };
    config.network = NetworkShape {
        view: DepthView { pixels: 16, edge: 1.6 },
        features: 32,
        modes: 3,
        ..config.network
    };
    config.network.backbone.width = 8;
    config
}

/// Windows with a hole; the block belongs over the hole, one leg along its long side.
fn holes(config: &TrainConfig, count: usize) -> Vec<Sample> {
    let view = stored_view(&config.network.view);
    let n = view.pixels as usize;
    (0..count)
        .map(|i| {
            let turn = i as f32 * 2.4;
            let at = 0.25 * Vec3::new(turn.cos(), turn.sin(), 0.0);
            let depth: Vec<f32> = (0..n * n)
                .map(|k| {
                    let off = Vec3::new(view.offset(k % n), view.offset(k / n), 0.0) - at;
                    if off.length() < 0.3 { 1.0 } else { 0.1 }
                })
                .collect();
            let rotation = Quat::from_rotation_z(turn) * Quat::from_rotation_x(0.5);
            Sample::new(&depth, vec![GoodPose { centre: at, rotation, filled: 0.5 }])
        })
        .collect()
}

/// Stops after some steps.
struct Stop(u64, AtomicU64);

impl Observer for Stop {
    fn event(&self, event: Event) {
        if let Event::Advanced { done, .. } = event {
            self.1.store(done, Ordering::Relaxed);
        }
    }
    fn cancelled(&self) -> bool {
        self.1.load(Ordering::Relaxed) + 1 >= self.0
    }
}

#[test]
fn training_learns_stops_and_goes_on_as_if_it_had_not_stopped() {
    let _turn = TRAINING.lock().unwrap_or_else(|e| e.into_inner());
    let (block, config) = (tetrapod(), config());
    let samples = holes(&config, 24);
    let run = |folder: &std::path::Path, config: &TrainConfig, observer: &dyn Observer| {
        train(&samples, &samples[..6], &block, config, folder, SeedTree::new(1), observer)
    };
    let (one, two) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let whole = run(one.path(), &config, &Silent).unwrap();
    let part = run(two.path(), &config, &Stop(17, AtomicU64::new(0))).unwrap();
    assert_eq!(part.steps, 17);
    let rest = run(two.path(), &config, &Silent).unwrap();
    assert_eq!((whole.steps, rest.steps), (60, 60));
    let curve = |folder: &tempfile::TempDir| {
        std::fs::read_to_string(folder.path().join("curve.csv")).unwrap()
    };
    let losses = |text: &str| -> Vec<f32> {
        text.lines().skip(1).map(|l| l.split(',').nth(2).unwrap().parse().unwrap()).collect()
    };
    let (first, second) = (losses(&curve(&one)), losses(&curve(&two)));
    assert_eq!(first.len(), 3);
    assert!(
        first.iter().zip(&second).all(|(a, b)| (a - b).abs() < 2e-3),
        "{first:?} against {second:?}"
    );
    let found = errors(&whole.model, &samples, &block.symmetry);
    assert!(found.displacement < 0.2, "the hole is 0.25 from the middle: {found:?}");
    assert!(found.nearest_rotation_rad <= found.rotation_rad);
    let other = TrainConfig { batch: 4, ..config };
    assert!(matches!(run(two.path(), &other, &Silent), Err(PlacementError::Checkpoint(_))));
}

#[test]
fn both_ways_to_write_a_rotation_train() {
    let _turn = TRAINING.lock().unwrap_or_else(|e| e.into_inner());
    let block = tetrapod();
    for rotation in [RotationCode::Euler, RotationCode::SixNumbers] {
        let mut config = TrainConfig { steps: 3, targets: 1, ..config() };
        (config.network.rotation, config.network.modes) = (rotation, 1);
        let folder = tempfile::tempdir().unwrap();
        let samples = holes(&config, 8);
        let trained =
            train(&samples, &samples, &block, &config, folder.path(), SeedTree::new(2), &Silent)
                .unwrap();
        let n = trained.model.view().pixels as usize;
        let depth = vec![0.3; n * n];
        assert_eq!(trained.model.propose(&depth, 0.0).len(), 6, "one for each turn");
        let again = PlacementModel::load(&folder.path().join("model.safetensors")).unwrap();
        assert_eq!(again.propose(&depth, 0.0), trained.model.propose(&depth, 0.0));
    }
}

#[test]
fn foreign_files_and_settings_are_named() {
    assert!(matches!(PlacementModel::from_bytes(b"ply"), Err(PlacementError::Weights(_))));
    let missing = PlacementModel::load("no such file".as_ref()).unwrap_err();
    assert!(missing.to_string().starts_with("no such file: "), "{missing}");
    let mut bad = config();
    bad.network.backbone.width = 12;
    let (samples, folder) = (holes(&config(), 2), tempfile::tempdir().unwrap());
    let refused = train(&samples, &[], &tetrapod(), &bad, folder.path(), SeedTree::new(1), &Silent)
        .unwrap_err();
    assert!(matches!(refused, PlacementError::Setting { .. }), "{refused}");
    let empty = train(&[], &[], &tetrapod(), &config(), folder.path(), SeedTree::new(1), &Silent)
        .unwrap_err();
    assert_eq!(empty, PlacementError::NoSamples);
}

#[test]
fn the_shipped_network_knows_tetrapods_of_any_size_and_proposes_different_poses() {
    let model = PlacementModel::shipped().unwrap();
    let large = blocks::shape_model("large", Shape::Tetrapod { size: 4.0 }, 2300.0).unwrap();
    let cube = blocks::shape_model("cube", Shape::Cube { size: 2.0 }, 2300.0).unwrap();
    assert!(model.knows(&tetrapod()) && model.knows(&large) && !model.knows(&cube));
    let view = model.view();
    let n = view.pixels as usize;
    let slope: Vec<f32> = (0..n * n).map(|k| 0.5 + 0.3 * view.offset(k % n)).collect();
    let proposals = model.propose(&slope, 0.0);
    assert!(proposals.len() >= 8);
    let symmetry = &tetrapod().symmetry;
    let apart = |i: usize, j: usize| {
        symmetry.rotation_error_rad(proposals[i].rotation, proposals[j].rotation)
    };
    assert!((1..8).any(|j| apart(0, j) > 0.2), "all modes say the same");
    assert!(proposals.iter().all(|p| p.rotation.is_finite() && p.centre.length() < 1.5));
}
