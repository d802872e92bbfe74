//! Table 2.4: what the valid-distance and the attention matrix of the pair loss are worth. Four trainings that differ in
//! nothing else, from nothing and equally short; the thesis' clustering judges.

use crate::bin_kept::training_folder;
use crate::markdown::percent;
use crate::segmentation_judge::{Judged, verdict};
use crate::{Bench, Experiment, ReproduceError, Table, site_sets};
use geom::SeedTree;
use segment::loss::{LossConfig, PairDistance, PairLossConfig};
use segment::{Clustering, SegmentConfig, Split, TrainConfig, segment, train};
use teach::{Blocks, TrainingScenes};

pub const EXPERIMENT: Experiment = Experiment {
    name: "segmentation-loss",
    about: "valid-distance and attention matrix, literal readings, exact and sampled pairs (Table 2.4)",
    body,
};

/// Variants of the pair loss: name, settings, points drawn for it.
fn variants() -> Vec<(&'static str, PairLossConfig, usize)> {
    let both = PairLossConfig::default();
    let only =
        |valid_distance, attention| PairLossConfig { valid_distance, attention, ..both.clone() };
    vec![
        ("none", only(false, false), 512),
        ("valid distance", only(true, false), 512),
        ("attention", only(false, true), 512),
        ("both (default)", both.clone(), 512),
        ("both, every pair of the tile", both.clone(), usize::MAX),
        (
            "both, squared distance and double pull (authors' code)",
            PairLossConfig { distance: PairDistance::Squared, pull: 2.0, ..both },
            512,
        ),
    ]
}

fn body(bench: &Bench) -> Result<String, ReproduceError> {
    let sets = site_sets()?;
    // The smallest site seen from the air: what is compared here are losses, not sensors.
    let set = &sets[0];
    let scenes = set.held_out(bench).collect::<Result<Vec<_>, _>>()?;
    let training_scenes =
        TrainingScenes::new(set.recipe.clone(), set.catalog.clone(), Blocks::Catalog)?;
    let root = SeedTree::new(bench.settings.seed).child("loss ablation", 0);
    let source = |split: Split, index: u64| {
        training_scenes.scene(
            index,
            root.child(if split == Split::Train { "train" } else { "held out" }, index),
        )
    };
    let mut table = Table::new(&["pair loss", "P %", "R %", "AP %", "held-out vote error, d_max"]);
    for (name, pair, pair_points) in variants() {
        let loss = LossConfig { pair, pair_points, pair_weight: 1.0, ..Default::default() };
        let quick = bench.settings.quick;
        let few = |all: u64| if quick { all.min(2) } else { all };
        let usual = TrainConfig::default();
        let config = TrainConfig {
            loss,
            scenes_first: few(usual.scenes_first),
            validation_scenes: few(usual.validation_scenes),
            calibration_scenes: few(usual.calibration_scenes),
            steps: bench.settings.steps,
            warmup: (bench.settings.steps / 10).max(1),
            name: format!("ablation, {name}"),
            shapes: training_scenes.shapes(),
            ..usual
        };
        let settings = format!(
            "seed {} steps {} quick {quick} {}",
            bench.settings.seed,
            bench.settings.steps,
            env!("CARGO_PKG_VERSION")
        );
        let folder = bench.folder.join("segmentation-loss").join(training_folder(name, &settings));
        let trained =
            train(&source, &config, None, &folder, root.child("network", 0), bench.observer)?;
        if trained.steps < config.steps {
            return Err(ReproduceError::Stopped);
        }
        let way = SegmentConfig { clustering: Clustering::Embedding, ..Default::default() };
        let mut judged = Vec::new();
        for (i, scene) in scenes.iter().enumerate() {
            let seed = SeedTree::new(bench.settings.seed).child("segment", i as u64);
            let found = segment(
                &scene.survey.cloud,
                &set.catalog,
                &trained.model,
                &way,
                seed,
                bench.observer,
            )?;
            judged.push(Judged::of(&found, scene));
        }
        let v = verdict(&judged)?;
        table.row([
            name.to_string(),
            percent(v.counts.precision()),
            percent(v.counts.recall()),
            percent(v.ap),
            format!("{:.3}", trained.validation.offset),
        ]);
    }
    Ok(format!(
        "{} steps each from the same random weights on scenes of {}; clustering by embedding. Six numbers from one seed show the \
         order of size, no more.\n\n{}\nThe thesis, gear shaft, FPCC: none 40.9/23.7, both 54.3/69.5.\n",
        bench.settings.steps,
        set.name,
        table.finish()
    ))
}
