//! Table 2.3: the radius of Algorithm 1 (γ · d_max) against precision and recall of the thesis' clustering.

use crate::markdown::percent;
use crate::segmentation_judge::{Judged, verdict};
use crate::{Bench, Experiment, ReproduceError, Table, site_sets, weights_line};
use geom::SeedTree;
use segment::{Clustering, SegmentConfig, segment};

pub const EXPERIMENT: Experiment = Experiment {
    name: "segmentation-gamma",
    about: "suppression radius of the thesis' clustering (Table 2.3)",
    body,
};

/// γ as in the thesis and around it.
const GAMMA: [f32; 5] = [0.6, 0.8, 1.0, 1.2, 1.4];

fn body(bench: &Bench) -> Result<String, ReproduceError> {
    let sets = site_sets()?;
    let mut heads = vec!["γ".to_string()];
    heads.extend(sets.iter().map(|s| format!("{} P/R %", s.name)));
    let mut table = Table::new(&heads.iter().map(String::as_str).collect::<Vec<_>>());
    let mut rows: Vec<Vec<String>> = GAMMA.iter().map(|g| vec![format!("{g:.1}")]).collect();
    let mut weights = String::new();
    for set in &sets {
        let model = bench.network(&set.catalog)?;
        weights = weights_line(&model)?;
        let scenes = set.held_out(bench).collect::<Result<Vec<_>, _>>()?;
        for (row, &suppression) in rows.iter_mut().zip(&GAMMA) {
            let config = SegmentConfig {
                clustering: Clustering::Embedding,
                suppression,
                ..Default::default()
            };
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
            let counts = verdict(&judged)?.counts;
            row.push(format!("{}/{}", percent(counts.precision()), percent(counts.recall())));
        }
    }
    rows.into_iter().for_each(|row| table.row(row));
    Ok(format!(
        "Weights: {weights}. Clustering by embedding; our default (votes) has no such radius.\n\n{}",
        table.finish()
    ))
}
