//! The steps one by one: from the thesis' way on the network's segments to the default, and its sliding windows.

use crate::pose_judge::{Pooled, heads, no_segments, row};
use crate::{Bench, Experiment, ReproduceError, Table, site_sets, weights_line};
use pose::{EvidenceConfig, Method, Places, PoseConfig};

pub const EXPERIMENT: Experiment = Experiment {
    name: "pose-ablation",
    about: "sliding windows; PPF + ICP, + SDF, + verification, + re-search; PPF as second source",
    body,
};

/// The ladder, lowest first; the flag says whether the network's segments are used.
fn steps() -> [(&'static str, bool, PoseConfig); 6] {
    // Without verification nothing may be refused: what the thesis' way finds, it states.
    let all = EvidenceConfig { min_confidence: 0.0, max_shared: 1.0, ..Default::default() };
    let plain =
        PoseConfig { verification: false, re_search: false, evidence: all, ..Default::default() };
    let thesis = PoseConfig { method: Method::Ppf, ..plain.clone() };
    let verified = PoseConfig { re_search: false, ..Default::default() };
    let second = PoseConfig { ppf_hypotheses: true, ..Default::default() };
    [
        (
            "sliding windows, PPF + ICP (§3.7)",
            false,
            PoseConfig { places: Places::Windows, ..thesis.clone() },
        ),
        ("segments, PPF + ICP (thesis)", true, thesis),
        ("segments, SDF", true, plain),
        ("+ verification", true, verified),
        ("+ re-search (default)", true, PoseConfig::default()),
        ("default with PPF hypotheses", true, second),
    ]
}

fn body(bench: &Bench) -> Result<String, ReproduceError> {
    let mut text = String::new();
    let mut weights = Vec::new();
    let mut everything: Vec<Pooled> = steps().iter().map(|_| Pooled::default()).collect();
    let mut per_set = Table::new(&heads("set, step"));
    for set in site_sets()? {
        let model = bench.network(&set.catalog)?;
        let mut pooled: Vec<Pooled> = steps().iter().map(|_| Pooled::default()).collect();
        for (i, made) in set.held_out(bench).enumerate() {
            let made = made?;
            let network = set.segmented(bench, &model, &made, i as u64)?;
            for (n, (_, segments, config)) in steps().iter().enumerate() {
                let nothing = no_segments(&made);
                let segmentation = if *segments { &network } else { &nothing };
                pooled[n].add(bench, &made, segmentation, &set.catalog, config)?;
            }
        }
        for ((name, ..), pooled) in steps().iter().zip(&pooled) {
            per_set.row(row(format!("{}, {name}", set.name), pooled));
        }
        for (all, pooled) in everything.iter_mut().zip(&pooled) {
            all.score = all.score.plus(&pooled.score);
            all.seconds += pooled.seconds;
            all.scenes += pooled.scenes;
        }
        let line = weights_line(&model)?;
        if !weights.contains(&line) {
            weights.push(line);
        }
    }
    let mut total = Table::new(&heads("six sets together"));
    for ((name, ..), pooled) in steps().iter().zip(&everything) {
        total.row(row((*name).into(), pooled));
    }
    text.push_str(&format!(
        "Weights: {}. Time: the pose stage alone, wall.\n\n",
        weights.join("; ")
    ));
    text.push_str(&total.finish());
    text.push('\n');
    text.push_str(&per_set.finish());
    Ok(text)
}
