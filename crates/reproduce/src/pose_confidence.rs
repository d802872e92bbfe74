//! Is a confidence what it says? Reliability on fresh scenes of all six sets, with the network's segments and with none.
//!
//! Leaves `pose-features.csv` in the folder: the features of every block and whether it was right.

use crate::pose_judge::{no_segments, truths};
use crate::{Bench, Experiment, ReproduceError, Table, site_sets};
use geom::SeedTree;
use pose::{EvidenceConfig, PoseConfig};
use std::fmt::Write;

pub const EXPERIMENT: Experiment = Experiment {
    name: "pose-confidence",
    about: "reliability of the confidence and of the type's margin on fresh scenes",
    body,
};

/// One stated block.
struct Case {
    confidence: f32,
    type_margin: f32,
    pose_right: bool,
    type_right: bool,
    type_judged: bool,
}

fn body(bench: &Bench) -> Result<String, ReproduceError> {
    // All that is accepted is looked at, also what the program would not state.
    let evidence = EvidenceConfig { min_confidence: 0.0, max_shared: 1.0, ..Default::default() };
    let config = PoseConfig { evidence, ..Default::default() };
    let mut cases = Vec::new();
    let mut csv = String::from("set,segments,pose_right,type_right,type_margin,features\n");
    for set in site_sets()? {
        let model = bench.network(&set.catalog)?;
        for (i, made) in set.held_out(bench).enumerate() {
            let made = made?;
            let network = set.segmented(bench, &model, &made, i as u64)?;
            for (name, segmentation) in [("network", network), ("none", no_segments(&made))] {
                let seed = SeedTree::new(bench.settings.seed).child("pose", 0);
                let found = pose::recognise_with_features(
                    &made.survey,
                    &segmentation,
                    &set.catalog,
                    &config,
                    seed,
                    bench.observer,
                )?;
                for (block, features) in found {
                    let (Some(features), Some(fit)) = (features, block.fit()) else { continue };
                    let posed = fit.posed(&set.catalog);
                    let right = truths(&made)
                        .into_iter()
                        .find(|t| scene::is_right(&posed, &t.placed.posed(&set.catalog)));
                    let case = Case {
                        confidence: fit.confidence.expect("what has features has a confidence"),
                        type_margin: features.type_margin,
                        pose_right: right.is_some(),
                        type_judged: fit.type_judged,
                        type_right: right.is_some_and(|t| t.placed.model == fit.model),
                    };
                    let terms: Vec<String> =
                        features.terms().iter().map(|f| format!("{f:.5}")).collect();
                    let _ = writeln!(
                        csv,
                        "{},{name},{},{},{},{}",
                        set.name,
                        u8::from(case.pose_right),
                        u8::from(case.type_right),
                        case.type_margin,
                        terms.join(" ")
                    );
                    cases.push(case);
                }
            }
        }
    }
    let file = bench.folder.join("pose-features.csv");
    std::fs::write(&file, csv)
        .map_err(|e| ReproduceError::File { file: file.display().to_string(), source: e })?;
    Ok(tables(&cases))
}

fn tables(cases: &[Case]) -> String {
    let mut all = Table::new(&["confidence", "blocks", "right", "right %", "mean confidence %"]);
    for (low, high) in
        [(0.0, 0.5), (0.5, 0.7), (0.7, 0.8), (0.8, 0.9), (0.9, 0.95), (0.95, 0.99), (0.99, 1.01)]
    {
        let bin: Vec<&Case> =
            cases.iter().filter(|c| (low..high).contains(&c.confidence)).collect();
        let right = bin.iter().filter(|c| c.pose_right && (c.type_right || !c.type_judged)).count();
        let mean =
            bin.iter().map(|c| f64::from(c.confidence)).sum::<f64>() / bin.len().max(1) as f64;
        all.row(line(
            format!("{low:.2} to {:.2}", f32::min(high, 1.0)),
            bin.len(),
            right,
            Some(mean),
        ));
    }
    let mut types = Table::new(&[
        "margin of the type, nats",
        "blocks in place",
        "right type",
        "right %",
        "mean confidence %",
    ]);
    for (low, high) in [(0.0, 2.0), (2.0, 5.0), (5.0, 10.0), (10.0, 20.0), (20.0, f32::MAX)] {
        let inside = |c: &&Case| c.pose_right && (low..high).contains(&c.type_margin);
        let bin: Vec<&Case> = cases.iter().filter(inside).collect();
        let right = bin.iter().filter(|c| c.type_right).count();
        let high = if high == f32::MAX { "more".into() } else { format!("{high}") };
        types.row(line(format!("{low} to {high}"), bin.len(), right, None));
    }
    format!(
        "Every accepted block, stated or not, of the network's segments and of a search without any.\n\n{}\n{}",
        all.finish(),
        types.finish()
    )
}

fn line(name: String, blocks: usize, right: usize, mean: Option<f64>) -> [String; 5] {
    let share = if blocks == 0 {
        "–".into()
    } else {
        format!("{:.1}", 100.0 * right as f64 / blocks as f64)
    };
    let mean = mean.filter(|_| blocks > 0).map_or("–".into(), |m| format!("{:.1}", 100.0 * m));
    [name, blocks.to_string(), right.to_string(), share, mean]
}
