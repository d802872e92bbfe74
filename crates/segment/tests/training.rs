//! Training: it learns, it stops and goes on as if it had not stopped, it refuses a folder of another training.

use geom::{Event, Observer, SeedTree, Silent, Stage, Vec3};
use net::BackboneConfig;
use rand::RngExt;
use segment::fpcc::FpccConfig;
use segment::fpccv2::FpccV2Config;
use segment::loss::LossConfig;
use segment::tile::LabelledScene;
use segment::{NetworkConfig, SegmentError, Split, TrainConfig, train};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};

/// First weights come from a generator that a process has once: trainings side by side would share it.
static ALONE: Mutex<()> = Mutex::new(());

/// Nine flattened balls on a floor.
fn balls(split: Split, index: u64) -> Result<LabelledScene, String> {
    let mut rng =
        SeedTree::new(if split == Split::Train { 1 } else { 2 }).child("balls", index).rng();
    let mut scene = LabelledScene { unit_m: 1.0, ..Default::default() };
    for ball in 0..9 {
        let centre =
            Vec3::new((ball % 3) as f32 * 2.0, (ball / 3) as f32 * 2.0, rng.random::<f32>());
        scene.centre_m.push(centre);
        for _ in 0..60 {
            let mut draw = || rng.random_range(-1.0_f32..1.0);
            scene.position_m.push(
                centre
                    + Vec3::new(draw(), draw(), draw()).normalize_or(Vec3::X)
                        * Vec3::new(1.0, 0.6, 0.4),
            );
            scene.instance.push(ball + 1);
        }
    }
    for _ in 0..200 {
        let mut draw = || rng.random_range(-1.0_f32..6.0);
        scene.position_m.push(Vec3::new(draw(), draw(), -1.2));
        scene.instance.push(0);
    }
    Ok(scene)
}

fn small(steps: u64) -> TrainConfig {
    let backbone = BackboneConfig {
        neighbours: 6,
        dilation: 2,
        edge: vec![6, 6, 6],
        level: vec![8, 8, 8],
        out: 16,
    };
    TrainConfig {
        network: NetworkConfig::FpccV2(FpccV2Config { backbone }),
        steps,
        tile_points: 200,
        warmup: 2,
        scenes_first: 2,
        steps_per_scene: 4,
        checkpoint_steps: 3,
        validation_steps: 1000,
        validation_scenes: 1,
        calibration_scenes: 1,
        learning_rate: 5e-3,
        ..Default::default()
    }
}

/// Asks to stop once so many steps are done.
struct StopAfter {
    steps: u64,
    done: AtomicU64,
}

impl Observer for StopAfter {
    fn event(&self, event: Event) {
        if let Event::Advanced { stage: Stage::Train, done } = event {
            self.done.store(done, Ordering::Relaxed);
        }
    }

    fn cancelled(&self) -> bool {
        self.done.load(Ordering::Relaxed) + 1 >= self.steps
    }
}

fn losses(folder: &Path) -> Vec<f32> {
    let text = std::fs::read_to_string(folder.join("curve.csv")).unwrap();
    text.lines().skip(1).map(|l| l.split(',').nth(2).unwrap().parse().unwrap()).collect()
}

#[test]
fn both_networks_learn() {
    let fpcc =
        FpccConfig { batch_points: 200, edge: 8, global: 16, joined: [16, 16], neighbours: 20 };
    let thesis = TrainConfig {
        network: NetworkConfig::Fpcc(fpcc),
        loss: LossConfig::of_the_thesis(),
        ..small(80)
    };
    let _alone = ALONE.lock().unwrap_or_else(|e| e.into_inner());
    for config in [small(80), thesis] {
        let folder = tempfile::tempdir().unwrap();
        train(&balls, &config, None, folder.path(), SeedTree::new(3), &Silent).unwrap();
        let curve = losses(folder.path());
        assert!(curve.len() >= 4 && curve[curve.len() - 1] < curve[0], "{curve:?}");
        assert!(
            folder.path().join("curve.svg").exists()
                && folder.path().join("model.safetensors").exists()
        );
    }
}

#[test]
fn a_stopped_training_goes_on_as_if_it_had_not_stopped() {
    let (whole, parts) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let config = small(9);
    let _alone = ALONE.lock().unwrap_or_else(|e| e.into_inner());
    let once = train(&balls, &config, None, whole.path(), SeedTree::new(3), &Silent).unwrap();
    let stop = StopAfter { steps: 4, done: AtomicU64::new(0) };
    let first = train(&balls, &config, None, parts.path(), SeedTree::new(3), &stop).unwrap();
    assert!(first.steps > 0 && first.steps < 9, "{}", first.steps);
    let second = train(&balls, &config, None, parts.path(), SeedTree::new(3), &Silent).unwrap();
    assert_eq!(second.steps, 9);
    assert!(
        once.model.to_bytes().unwrap() == second.model.to_bytes().unwrap(),
        "the weights differ"
    );
}

/// Every file of a training's folder. The checkpoint's once held numbers that the library draws for its parameters.
#[test]
fn the_same_training_leaves_the_same_bytes() {
    let _alone = ALONE.lock().unwrap_or_else(|e| e.into_inner());
    let trained = |seed: u64| {
        let folder = tempfile::tempdir().unwrap();
        train(&balls, &small(7), None, folder.path(), SeedTree::new(seed), &Silent).unwrap();
        files_below(folder.path())
    };
    let once = trained(3);
    assert!(once.contains_key(Path::new("checkpoint/optimiser.bpk")), "{:?}", once.keys());
    let again = trained(3);
    for (name, bytes) in &once {
        assert!(
            again.get(name) == Some(bytes),
            "{}: the same seed gives other bytes",
            name.display()
        );
    }
    assert_eq!(again.len(), once.len());
    let model = Path::new("model.safetensors");
    assert!(once[model] != trained(4)[model], "another seed is another training");
}

fn files_below(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let (mut found, mut open) = (BTreeMap::new(), vec![folder.to_path_buf()]);
    while let Some(here) = open.pop() {
        for entry in std::fs::read_dir(&here).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                open.push(path);
            } else {
                let name = path.strip_prefix(folder).unwrap().to_path_buf();
                found.insert(name, std::fs::read(&path).unwrap());
            }
        }
    }
    found
}

#[test]
fn a_folder_of_another_training_is_refused() {
    let _alone = ALONE.lock().unwrap_or_else(|e| e.into_inner());
    let folder = tempfile::tempdir().unwrap();
    train(&balls, &small(3), None, folder.path(), SeedTree::new(3), &Silent).unwrap();
    let other = TrainConfig { cell: 0.2, ..small(6) };
    let error = train(&balls, &other, None, folder.path(), SeedTree::new(3), &Silent).unwrap_err();
    assert!(matches!(&error, SegmentError::OtherTraining { key, .. } if key == "cell"), "{error}");
    // More steps are not another training.
    assert_eq!(
        train(&balls, &small(6), None, folder.path(), SeedTree::new(3), &Silent).unwrap().steps,
        6
    );
}
