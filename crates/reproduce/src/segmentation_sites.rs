//! Tables 2.2 and 3.2: precision, recall and AP of the instances on the six site-sensor sets, by both clusterings.

use crate::markdown::percent;
use crate::segmentation_judge::{Judged, verdict};
use crate::{Bench, Experiment, ReproduceError, Table, table_sets, weights_line, white_noise_sets};
use geom::SeedTree;
use segment::{Clustering, SegmentConfig, SegmentModel, segment};

pub const EXPERIMENT: Experiment = Experiment {
    name: "segmentation-sites",
    about: "instances on the six site-sensor sets (thesis, Tables 2.2 and 3.2)",
    body,
};

fn body(bench: &Bench) -> Result<String, ReproduceError> {
    let mut table =
        Table::new(&["set, clustering", "scored blocks", "P %", "R %", "AP %", "AP50 %"]);
    let mut weights = Vec::new();
    let white_noise = white_noise_sets()?;
    let without_ground: Vec<&str> = white_noise.iter().map(|s| s.name).collect();
    for set in table_sets(bench.settings.quick)?.into_iter().chain(white_noise.clone()) {
        let default = bench.network(&set.catalog)?;
        let mut ways = vec![("votes (default)", Clustering::Votes, default.clone())];
        ways.push(("embedding (thesis)", Clustering::Embedding, default));
        if without_ground.contains(&set.name)
            && let Some(fpcc) = SegmentModel::shipped_as("fpcc")
        {
            ways.push(("FPCC (thesis, chapter 2)", Clustering::Embedding, fpcc?));
        }
        let scenes = set.held_out(bench).collect::<Result<Vec<_>, _>>()?;
        for (label, clustering, model) in ways {
            let config = SegmentConfig { clustering, ..Default::default() };
            let mut judged = Vec::new();
            for (i, scene) in scenes.iter().enumerate() {
                let seed = SeedTree::new(bench.settings.seed).child("segment", i as u64);
                let found = segment(
                    &scene.survey.cloud,
                    &set.catalog,
                    &model,
                    &config,
                    seed,
                    bench.observer,
                )?;
                judged.push(Judged::of(&found, scene));
            }
            let v = verdict(&judged)?;
            let asked = v.counts.true_positives + v.counts.false_negatives;
            table.row([
                format!("{}, {label}", set.name),
                asked.to_string(),
                percent(v.counts.precision()),
                percent(v.counts.recall()),
                percent(v.ap),
                percent(v.ap50),
            ]);
            let line = weights_line(&model)?;
            if !weights.contains(&line) {
                weights.push(line);
            }
        }
    }
    Ok(format!(
        "Blocks hidden to less than 80 %, IoU ≥ 0.5; AP in ScanNet's manner. Weights: {}.\n\n{}\n\
         The thesis' own figures, on its sites with white noise: Sawara UAV 80.1/55.3, MBES 90.4/69.7; Todohokke 82.7/74.2 and \
         72.7/75.8; Era 88.6/49.5 and 86.3/68.2.\n",
        weights.join("; "),
        table.finish()
    ))
}
