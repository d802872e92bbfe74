//! What became of the blocks that no instance stands for: never voted for, voted for and disbelieved, or found with the
//! wrong points. Says which part of the stage a missing percent of recall is lost in.

use crate::segmentation_judge::HIDDEN;
use crate::{Bench, Experiment, ReproduceError, Table, site_sets, weights_line};
use geom::SeedTree;
use scene::{Catalog, Segmentation};
use segment::{SegmentConfig, segment};
use std::collections::BTreeMap;
use synth::SynthScene;

pub const EXPERIMENT: Experiment = Experiment {
    name: "segmentation-misses",
    about: "why blocks are missed: no hypothesis, too little confidence, wrong points",
    body,
};

/// Distance to a true centre below which a hypothesis is the block's, d_max.
const NEAR: f32 = 0.25;

/// Why a block has no instance.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Cause {
    NoHypothesis,
    Disbelieved,
    WrongPoints,
}

/// Number, points and occlusion of the blocks of one cause.
type Sums = BTreeMap<Cause, (usize, f64, f64)>;

fn body(bench: &Bench) -> Result<String, ReproduceError> {
    let mut heads = vec!["set", "scored blocks", "missed"];
    heads.extend([
        "never voted for",
        "hypothesis below the limit",
        "instance of other points",
        "their points, hidden %",
    ]);
    let mut table = Table::new(&heads);
    let (mut weights, mut least) = (String::new(), 0.0);
    let config = SegmentConfig::default();
    for set in site_sets()? {
        let model = bench.network(&set.catalog)?;
        weights = weights_line(&model)?;
        least = model.description.least_instance_score(config.least_instance_score);
        let (mut asked, mut sums) = (0, Sums::new());
        for (i, made) in set.held_out(bench).enumerate() {
            let made = made?;
            let seed = SeedTree::new(bench.settings.seed).child("segment", i as u64);
            let found =
                segment(&made.survey.cloud, &set.catalog, &model, &config, seed, bench.observer)?;
            asked += causes(&made, &set.catalog, &found, &mut sums);
        }
        let count = |cause| sums.get(&cause).map_or(0, |s| s.0);
        let missed: usize = sums.values().map(|s| s.0).sum();
        let mean = |of: fn(&(usize, f64, f64)) -> f64| {
            sums.values().map(of).sum::<f64>() / missed.max(1) as f64
        };
        let mut row = vec![set.name.to_string(), asked.to_string(), missed.to_string()];
        row.extend(
            [Cause::NoHypothesis, Cause::Disbelieved, Cause::WrongPoints]
                .map(|c| count(c).to_string()),
        );
        row.push(if missed == 0 {
            "–".into()
        } else {
            format!("{:.0}, {:.0}", mean(|s| s.1), 100.0 * mean(|s| s.2))
        });
        table.row(row);
    }
    Ok(format!(
        "Blocks hidden to less than 80 % and not met by an instance at IoU 0.5. A block's hypothesis lies within {NEAR} d_max of \
         its centre; instances need a confidence of {least}. Weights: {weights}.\n\n{}",
        table.finish()
    ))
}

/// Adds the causes of one scene's misses; returns the number of blocks scored.
fn causes(made: &SynthScene, catalog: &Catalog, found: &Segmentation, sums: &mut Sums) -> usize {
    let mut shared: BTreeMap<(u32, u32), usize> = BTreeMap::new();
    let mut of_instance = vec![0; found.instances + 1];
    let mut of_block = vec![0; made.scene.blocks.len() + 1];
    for (&i, &b) in found.instance.iter().zip(&made.instance) {
        *shared.entry((b, i)).or_default() += 1;
        of_instance[i as usize] += 1;
        of_block[b as usize] += 1;
    }
    let met = |b: u32| {
        shared.range((b, 1)..=(b, u32::MAX)).any(|(&(_, i), &both)| {
            let either = of_instance[i as usize] + of_block[b as usize] - both;
            2 * both >= either
        })
    };
    let mut asked = 0;
    for (at, block) in made.scene.blocks.iter().enumerate() {
        let points = of_block[at + 1];
        if made.occlusion[at] >= HIDDEN || points == 0 {
            continue;
        }
        asked += 1;
        if met(at as u32 + 1) {
            continue;
        }
        let model = catalog.get(block.model);
        let centre = block.site_from_block * model.centre;
        let near =
            |h: &scene::CentreHypothesis| (h.centre - centre).length() < NEAR * model.d_max_m;
        let cause = match found.hypotheses.iter().position(near) {
            None => Cause::NoHypothesis,
            Some(h) if h < found.instances => Cause::WrongPoints,
            Some(_) => Cause::Disbelieved,
        };
        let sum = sums.entry(cause).or_default();
        *sum = (sum.0 + 1, sum.1 + points as f64, sum.2 + f64::from(made.occlusion[at]));
    }
    asked
}
