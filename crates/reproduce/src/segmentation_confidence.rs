//! How far the confidence of a hypothesis can be believed: of those given 0.9, nine in ten should be right.

use crate::markdown::percent;
use crate::{Bench, Experiment, ReproduceError, Table, site_sets, weights_line};
use scene::SensorKind;

pub const EXPERIMENT: Experiment = Experiment {
    name: "segmentation-confidence",
    about: "stated confidence of centre hypotheses against the share that is right",
    body,
};

/// Distance to a true centre below which a hypothesis is right, d_max.
const RIGHT: f32 = 0.25;

fn body(bench: &Bench) -> Result<String, ReproduceError> {
    // (confidence, right) by sensor: drone, sounder.
    let mut seen: [Vec<(f32, bool)>; 2] = [Vec::new(), Vec::new()];
    let mut weights = String::new();
    for set in site_sets()? {
        let model = bench.network(&set.catalog)?;
        weights = weights_line(&model)?;
        for (i, scene) in set.held_out(bench).enumerate() {
            let scene = scene?;
            let found = set.segmented(bench, &model, &scene, i as u64)?;
            let near = |p: geom::Vec3| {
                scene.scene.blocks.iter().any(|b| {
                    let block = set.catalog.get(b.model);
                    (b.site_from_block * block.centre - p).length() < RIGHT * block.d_max_m
                })
            };
            let of = &mut seen[usize::from(scene.survey.sensor != SensorKind::Uav)];
            of.extend(found.hypotheses.iter().map(|h| (h.score, near(h.centre))));
        }
    }
    let mut table = Table::new(&[
        "confidence",
        "drone: hypotheses",
        "right %",
        "sounder: hypotheses",
        "right %",
    ]);
    for tenth in 0..10 {
        let (low, high) = (tenth as f32 * 0.1, (tenth + 1) as f32 * 0.1);
        let cells = seen.iter().flat_map(|s| {
            let bin: Vec<bool> =
                s.iter().filter(|x| x.0 >= low && x.0 < high).map(|x| x.1).collect();
            let right = bin.iter().filter(|r| **r).count();
            [
                bin.len().to_string(),
                percent((!bin.is_empty()).then(|| right as f64 / bin.len() as f64)),
            ]
        });
        table.row(std::iter::once(format!("{low:.1}–{high:.1}")).chain(cells));
    }
    Ok(format!(
        "Right: a true centre within {RIGHT} d_max. Weights: {weights}.\n\n{}",
        table.finish()
    ))
}
