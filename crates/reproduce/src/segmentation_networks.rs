//! The networks of the stage against each other: the same scenes, steps and heads, another backbone.
//!
//! One training a network on all six sets in turn, from nothing; then instances by votes on held-out scenes of each, seconds for
//! 100,000 points and the size of the weights. What the sparse U-Net must win to become the default is decided here.

use crate::bin_kept::{RowResult, RowsOnDisk};
use crate::markdown::percent;
use crate::peak_memory::with_peak;
use crate::segmentation_judge::{Judged, verdict};
use crate::{Bench, Experiment, ReproduceError, SiteSet, Table, site_sets};
use geom::SeedTree;
use segment::sparse_votes::SparseVotesConfig;
use segment::{NetworkConfig, SegmentConfig, SegmentModel, Split, TrainConfig, segment, train};
use teach::{Blocks, TrainingScenes};

pub const EXPERIMENT: Experiment = Experiment {
    name: "segmentation-networks",
    about: "graph network and sparse U-Net, equally long trained, on the six sets",
    body,
};

/// What a comparison is made of.
fn networks() -> Vec<(&'static str, NetworkConfig)> {
    vec![
        ("FPCCv2", NetworkConfig::default()),
        ("sparse U-Net", NetworkConfig::SparseUnet(SparseVotesConfig::default())),
    ]
}

/// A network after its training.
struct Made {
    model: SegmentModel,
    /// Wall time of its training, seconds; of what was left of one that was taken up again.
    training_s: f64,
}

fn body(bench: &Bench) -> Result<String, ReproduceError> {
    let sets = site_sets()?;
    let sets = if bench.settings.quick { &sets[..2] } else { &sets[..] };
    let steps =
        if bench.settings.quick { bench.settings.steps.min(10) } else { bench.settings.steps };
    let folder = bench.folder.join("segmentation-networks");
    let trainings = format!(
        "seed {} steps {steps} sets {} quick {} {}",
        bench.settings.seed,
        sets.len(),
        bench.settings.quick,
        env!("CARGO_PKG_VERSION")
    );
    let settings = format!("{trainings} scenes {}", bench.settings.scenes);
    let disk = RowsOnDisk::at(&folder, settings, trainings)?;
    let mut heads = vec!["network".to_string()];
    heads.extend(sets.iter().map(|s| format!("{} P/R %", s.name)));
    heads.extend(["s for 100,000 points", "peak MB", "training s", "weights MB"].map(String::from));
    let mut table = Table::new(&heads.iter().map(String::as_str).collect::<Vec<_>>());
    for (name, network) in networks() {
        let made = trained(bench, sets, name, network, steps, &disk)?;
        let mut cells = vec![name.to_string()];
        let (mut seconds, mut points, mut peak) = (0.0, 0.0, None);
        for set in sets {
            let result =
                disk.row(&format!("{name} on {}", set.name), || judged(bench, set, &made))?;
            seconds += result.seconds;
            points += result.points;
            peak = result.peak_mb.map(|mb| mb.max(peak.unwrap_or(0.0)));
            cells.push(format!("{}/{}", percent(result.precision()), percent(result.recall())));
        }
        let bytes = made.model.to_bytes()?.len();
        cells.push(format!("{:.2}", seconds * 1e5 / points.max(1.0)));
        cells.push(peak.map_or("–".into(), |mb| format!("{mb:.0}")));
        cells.push(format!("{:.0}", made.training_s));
        cells.push(format!("{:.1}", bytes as f64 / 1e6));
        table.row(cells);
    }
    Ok(format!(
        "{steps} steps of two tiles of 2048 points each, from nothing, on scenes of all sets in turn; instances by votes of four passes. \
         Seconds are those of the whole stage, memory the most that a scene took beyond what was held before. *Training* holds the making of its scenes and the fit of its confidence; of one that was \
         stopped, only its last part.\n\n{}",
        table.finish()
    ))
}

fn trained(
    bench: &Bench,
    sets: &[SiteSet],
    name: &str,
    network: NetworkConfig,
    steps: u64,
    disk: &RowsOnDisk,
) -> Result<Made, ReproduceError> {
    let training_scenes: Vec<TrainingScenes> = sets
        .iter()
        .map(|s| TrainingScenes::new(s.recipe.clone(), s.catalog.clone(), Blocks::Catalog))
        .collect::<Result<_, _>>()?;
    let root = SeedTree::new(bench.settings.seed).child("networks", 0);
    let source = |split: Split, index: u64| {
        let of = if split == Split::Train { "train" } else { "held out" };
        training_scenes[(index % training_scenes.len() as u64) as usize]
            .scene(index, root.child(of, index))
    };
    let mut shapes = Vec::new();
    for shape in training_scenes.iter().flat_map(TrainingScenes::shapes) {
        if !shapes.iter().any(|s: &segment::ShapeSignature| s.matches(&shape)) {
            shapes.push(shape);
        }
    }
    let config = TrainConfig {
        network,
        steps,
        warmup: (steps / 10).clamp(1, 200),
        checkpoint_steps: 100,
        validation_steps: steps.max(1),
        calibration_scenes: if bench.settings.quick { 2 } else { 12 },
        scenes_first: if bench.settings.quick { 2 } else { 12 },
        validation_scenes: if bench.settings.quick { 2 } else { 6 },
        name: format!("six sets, {name}"),
        shapes,
        ..Default::default()
    };
    let from = (bench.clock)();
    let folder = disk.training(name);
    let trained = train(&source, &config, None, &folder, root.child("network", 0), bench.observer)?;
    if trained.steps < steps {
        return Err(ReproduceError::Stopped);
    }
    Ok(Made { model: trained.model, training_s: (bench.clock)() - from })
}

fn judged(bench: &Bench, set: &SiteSet, made: &Made) -> Result<RowResult, ReproduceError> {
    let (mut judged, mut seconds, mut points, mut peak) = (Vec::new(), 0.0, 0_usize, None);
    for (i, scene) in set.held_out(bench).enumerate() {
        let scene = scene?;
        let seed = SeedTree::new(bench.settings.seed).child("segment", i as u64);
        let from = (bench.clock)();
        let config = SegmentConfig::default();
        let cloud = &scene.survey.cloud;
        let (found, bytes) =
            with_peak(|| segment(cloud, &set.catalog, &made.model, &config, seed, bench.observer));
        peak = peak.max(bytes);
        seconds += (bench.clock)() - from;
        points += cloud.len();
        judged.push(Judged::of(&found?, &scene));
    }
    let v = verdict(&judged)?;
    Ok(RowResult {
        right: v.counts.true_positives,
        wrong: v.counts.false_positives,
        missed: v.counts.false_negatives,
        ap: v.ap,
        ap50: v.ap50,
        seconds: seconds / judged.len().max(1) as f64,
        points: points as f64 / judged.len().max(1) as f64,
        peak_mb: peak.map(|bytes| bytes as f64 / 1e6),
        steps: made.model.description.steps,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_networks_are_compared_under_names_of_their_own() {
        let names: Vec<&str> = networks().iter().map(|n| n.0).collect();
        assert_eq!(names, ["FPCCv2", "sparse U-Net"]);
        assert!(networks()[0].1.architecture() != networks()[1].1.architecture());
    }
}
