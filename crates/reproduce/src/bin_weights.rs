//! Weights as they are on the five parts: no training, the bin cut away and in view.

use crate::bin_data::{BinData, foreign_row};
use crate::bin_parts::{BinPart, bin_parts};
use crate::bin_rows::{Reading, Trained};
use crate::markdown::percent;
use crate::{Bench, Experiment, ReproduceError, Table, weights_line};
use segment::SegmentModel;
use synth::SynthScene;

pub const EXPERIMENT: Experiment = Experiment {
    name: "bin-weights",
    about: "weights as they are on five parts in bins, the bin cut away and in view",
    body,
};

const READINGS: [(&str, Reading); 3] =
    [("Algorithm 1", Reading::Thesis), ("votes", Reading::Votes), ("poses", Reading::Poses)];

/// Parts of a quick page.
const QUICK_PARTS: usize = 2;

fn body(bench: &Bench) -> Result<String, ReproduceError> {
    let data = bench.data.map(BinData::of).transpose()?;
    let own = |name: &str| data.as_ref().map_or(Ok(None), |d| d.model(name));
    let mut heads = vec!["part, bin".to_string(), "scored".to_string()];
    heads.extend(READINGS.iter().map(|r| format!("{} P/R %", r.0)));
    heads.extend(["votes AP50 %", "votes s", "poses s"].map(String::from));
    let mut table = Table::new(&heads.iter().map(String::as_str).collect::<Vec<_>>());
    let mut weights = Vec::new();
    let parts = bin_parts(&own)?;
    let shown = if bench.settings.quick { QUICK_PARTS } else { parts.len() };
    for part in &parts[..shown] {
        let model = weights_for(bench, part)?;
        let line = weights_line(&model)?;
        if !weights.contains(&line) {
            weights.push(line);
        }
        let trained = Trained::Model(Box::new(model));
        let count = bench.settings.scenes;
        let cut_away = part.held_out(bench, count)?;
        table.row(row(bench, part, &trained, &cut_away, "cut away")?);
        let in_view: Vec<SynthScene> =
            (0..count).map(|i| part.seen_bin(bench, i)).collect::<Result<_, _>>()?;
        table.row(row(bench, part, &trained, &in_view, "in view")?);
    }
    let foreign = data.map(|d| foreign_table(bench, &parts, &d)).transpose()?;
    Ok(format!(
        "{} scenes a row; parts hidden to 80 % or more are not scored. Weights: {}.\n\n{}{}",
        bench.settings.scenes,
        weights.join("; "),
        table.finish(),
        foreign.unwrap_or_default()
    ))
}

fn weights_for(bench: &Bench, part: &BinPart) -> Result<SegmentModel, ReproduceError> {
    match bench.model {
        Some(model) => Ok(model.clone()),
        None => Ok(SegmentModel::shipped(&part.catalog)?),
    }
}

/// The scenes of others that the folder has, our parts standing for theirs; nothing where it has none.
fn foreign_table(
    bench: &Bench,
    parts: &[BinPart],
    data: &BinData,
) -> Result<String, ReproduceError> {
    let mut table = Table::new(&["scene", "reading", "P %", "R %", "AP50 %", "coverage %"]);
    let mut rows_made = 0;
    for part in parts {
        let Some(scene) = data.scene(part.name, bench.observer)? else { continue };
        let model = weights_for(bench, part)?;
        for (name, reading) in &READINGS[..2] {
            let figures = scene.segmented(bench, part, &model, *reading)?;
            table.row(foreign_row(part.stands_for, name, &figures));
            rows_made += 1;
        }
    }
    if rows_made == 0 {
        return Ok(String::new());
    }
    Ok(format!(
        "\n## The authors' scenes\n\nThe weights are told d_max of our part that stands for theirs.\n\n{}",
        table.finish()
    ))
}

fn row(
    bench: &Bench,
    part: &BinPart,
    trained: &Trained,
    scenes: &[SynthScene],
    bin: &str,
) -> Result<Vec<String>, ReproduceError> {
    let mut results = Vec::new();
    for (_, reading) in READINGS {
        results.push(trained.judged(bench, part, scenes, reading, 1.0, 0)?);
    }
    let mut cells =
        vec![format!("{}, {bin}", part.name), (results[0].right + results[0].missed).to_string()];
    cells.extend(
        results.iter().map(|r| format!("{}/{}", percent(r.precision()), percent(r.recall()))),
    );
    cells.push(percent(results[1].ap50));
    cells.extend(results[1..].iter().map(|r| format!("{:.2}", r.seconds)));
    Ok(cells)
}
