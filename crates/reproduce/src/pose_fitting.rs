//! Table 3.5: what can be said of a scene without its true poses: fitting error E_f and matching rate R (Eqs. 3.15, 3.16), with the
//! bed's points in the cloud and without them, at the thesis' thresholds.

use crate::markdown::percent;
use crate::pose_judge::Pooled;
use crate::{Bench, Experiment, ReproduceError, SiteSet, Table, table_sets, weights_line};
use geom::SeedTree;
use metrics::{fitting, model_distances_m};
use pose::PoseConfig;
use scene::PlacedBlock;
use segment::{SegmentConfig, SegmentModel, segment};
use synth::SynthScene;

pub const EXPERIMENT: Experiment = Experiment {
    name: "pose-fitting",
    about: "fitting error and matching rate, with the bed and without (Table 3.5)",
    body,
};

/// Distances of all points of a set to the nearest recognised block, and which of them the bed has.
#[derive(Default)]
struct Distances {
    all_m: Vec<f32>,
    of_blocks_m: Vec<f32>,
}

fn body(bench: &Bench) -> Result<String, ReproduceError> {
    let mut table = Table::new(&[
        "set, chain",
        "h_th m",
        "points",
        "E_f mm",
        "R %",
        "points of blocks",
        "their E_f mm",
        "their R %",
    ]);
    let mut weights = Vec::new();
    for set in table_sets(bench.settings.quick)? {
        let model = bench.network(&set.catalog)?;
        let chains = [
            ("ours", SegmentConfig::default(), PoseConfig::default()),
            ("thesis' poses", SegmentConfig::default(), PoseConfig::thesis()),
        ];
        let threshold_m = threshold_m(&set);
        let mut found = [Distances::default(), Distances::default()];
        for made in set.held_out(bench) {
            let made = made?;
            for ((_, segments, poses), distances) in chains.iter().zip(&mut found) {
                distances.add(bench, &set, &model, &made, segments, poses, threshold_m)?;
            }
        }
        for ((name, ..), distances) in chains.iter().zip(&found) {
            table.row(row(format!("{}, {name}", set.name), distances, threshold_m));
        }
        let line = weights_line(&model)?;
        if !weights.contains(&line) {
            weights.push(line);
        }
    }
    Ok(format!(
        "Distance of a survey point to the nearest face of any recognised block; E_f is the mean of those within h_th, R the share within \
         it. The thesis' clouds hold hardly any bed; ours do, and the second half of the table leaves the bed's points out by their true \
         label. *thesis' poses*: point pair features, point-to-point ICP and least fitness on the same segments. Weights: {}.\n\n{}\n\
         The thesis, its real sites, E_f mm / R %: Sawara 33/71.3 (UAV), 39/67.3 (MBES); Todohokke 34/66.2, 38/60.5; Era 48/75.1, \
         58/71.5.\n",
        weights.join("; "),
        table.finish()
    ))
}

/// 0.1 m, and 0.2 m where blocks are as large as Era's.
fn threshold_m(set: &SiteSet) -> f32 {
    let largest_m = set.catalog.iter().map(|(_, m)| m.d_box_m).fold(0.0, f32::max);
    if largest_m > 4.0 { 0.2 } else { 0.1 }
}

impl Distances {
    #[expect(clippy::too_many_arguments, reason = "a chain's two settings and what it works on")]
    fn add(
        &mut self,
        bench: &Bench,
        set: &SiteSet,
        model: &SegmentModel,
        made: &SynthScene,
        segments: &SegmentConfig,
        poses: &PoseConfig,
        threshold_m: f32,
    ) -> Result<(), ReproduceError> {
        let seed = SeedTree::new(bench.settings.seed).child("segment", 0);
        let cloud = &made.survey.cloud;
        let labels = segment(cloud, &set.catalog, model, segments, seed, bench.observer)?;
        let blocks = Pooled::default().add(bench, made, &labels, &set.catalog, poses)?;
        let placed: Vec<PlacedBlock> = blocks.iter().filter_map(|b| b.placed()).collect();
        let m = model_distances_m(&cloud.position_m, &placed, &set.catalog, threshold_m);
        let of_blocks = m.iter().zip(&made.instance).filter(|(_, i)| **i > 0);
        self.of_blocks_m.extend(of_blocks.map(|(d, _)| *d));
        self.all_m.extend(m);
        Ok(())
    }
}

fn row(name: String, distances: &Distances, threshold_m: f32) -> Vec<String> {
    let mut cells = vec![name, threshold_m.to_string()];
    for of in [&distances.all_m, &distances.of_blocks_m] {
        let fit = fitting(of, threshold_m);
        cells.push(of.len().to_string());
        cells.push(fit.error_m.map_or("–".into(), |m| format!("{:.1}", m * 1e3)));
        cells.push(percent(fit.matching_rate));
    }
    cells
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_blocks_have_the_wider_threshold() {
        let sets = table_sets(true).unwrap();
        let of = |name: &str| threshold_m(sets.iter().find(|s| s.name == name).unwrap());
        assert_eq!(["sawara-uav", "todohokke-b-uav", "era-mbes"].map(of), [0.1, 0.1, 0.2]);
    }

    #[test]
    fn points_out_of_reach_count_against_the_rate_alone() {
        let distances =
            Distances { all_m: vec![0.01, 0.03, f32::INFINITY, 0.5], of_blocks_m: vec![0.01] };
        assert_eq!(
            row("a".into(), &distances, 0.1),
            ["a", "0.1", "4", "20.0", "50.0", "1", "10.0", "100.0"]
        );
    }
}
