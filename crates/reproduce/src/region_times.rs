//! Tables 3.7 and 3.8: what scenes and a training cost, and what a region costs once the network is there, step by step.

use crate::{Bench, Experiment, ReproduceError, SiteSet, Table, table_sets, weights_line};
use geom::SeedTree;
use pose::PoseConfig;
use scene::{Catalog, Segmentation};
use segment::tile::{LabelledScene, ThinScene};
use segment::train::train_on_tile;
use segment::{NetworkConfig, SegmentConfig, SegmentModel, TrainConfig, segment};
use synth::SynthScene;

pub const EXPERIMENT: Experiment = Experiment {
    name: "region-times",
    about: "seconds for scenes, training, segments, poses, types (Tables 3.7, 3.8)",
    body,
};

/// Steps that are timed.
const STEPS: u32 = 4;
/// Training scenes of the thesis.
const SCENES: f64 = 500.0;

/// What is measured of a set, seconds a scene.
#[derive(Default)]
struct Seconds {
    scenes: u32,
    blocks: usize,
    points: usize,
    making: f64,
    segments: f64,
    poses: f64,
    all_types: f64,
}

fn body(bench: &Bench) -> Result<String, ReproduceError> {
    let heads = ["set", "types", "blocks", "points", "s a scene", "h for 500", "steps", "s a step"];
    let mut costs = Table::new(&[&heads[..], &["h in all"]].concat());
    let mut times =
        Table::new(&["set", "points", "blocks", "segments s", "poses s", "types s", "in all s"]);
    let mut weights = Vec::new();
    for set in table_sets(bench.settings.quick)? {
        let model = bench.network(&set.catalog)?;
        let (s, last) = measured(bench, &set, &model)?;
        let step_s = last.map(|scene| step_s(bench, &set, &model, &scene)).transpose()?;
        costs.row(cost_row(&set, &s, &model, step_s.flatten()));
        times.row(time_row(&set, &s));
        let line = weights_line(&model)?;
        if !weights.contains(&line) {
            weights.push(line);
        }
    }
    Ok(format!(
        "Wall time of this machine, now. Weights: {}.\n\n## Table 3.7: scenes and training\n\nA scene is dropped, scanned and labelled. \
         *steps* are those of the last training of the shipped weights, which serve all sets of their shape; a step is two tiles of {} \
         points, timed on one of them twice. The thesis: 30 h a set, and about 3 minutes a scene.\n\n{}\n\
         ## Table 3.8: a region\n\n*poses*: with one type in the catalogue. *types*: what the other types add to it; – where there is one \
         type. The thesis: 0.4–0.8 s and 3.6–4.2 s for segments, 72–175 s for poses, 24–160 s for types.\n\n{}",
        weights.join("; "),
        TrainConfig::default().tile_points,
        costs.finish(),
        times.finish()
    ))
}

/// All scenes of a set, and the last of them.
fn measured(
    bench: &Bench,
    set: &SiteSet,
    model: &SegmentModel,
) -> Result<(Seconds, Option<SynthScene>), ReproduceError> {
    let (mut s, mut last) = (Seconds::default(), None);
    let mut from = (bench.clock)();
    for made in set.held_out(bench) {
        let made = made?;
        s.making += (bench.clock)() - from;
        s.scenes += 1;
        s.blocks += made.scene.blocks.len();
        s.points += made.survey.cloud.len();
        let seed = SeedTree::new(bench.settings.seed).child("segment", 0);
        let start = (bench.clock)();
        let found = segment(
            &made.survey.cloud,
            &set.catalog,
            model,
            &SegmentConfig::default(),
            seed,
            bench.observer,
        )?;
        s.segments += (bench.clock)() - start;
        s.all_types += poses_s(bench, &made, &found, &set.catalog)?;
        if let Some(first) = first_type(&set.catalog) {
            s.poses += poses_s(bench, &made, &found, &first)?;
        }
        last = Some(made);
        from = (bench.clock)();
    }
    Ok((s, last))
}

/// A catalogue of the first type alone, where there are several.
fn first_type(catalog: &Catalog) -> Option<Catalog> {
    let (_, model) = catalog.iter().next().filter(|_| catalog.len() > 1)?;
    Some(Catalog::new(vec![model.clone()]))
}

fn poses_s(
    bench: &Bench,
    made: &SynthScene,
    found: &Segmentation,
    catalog: &Catalog,
) -> Result<f64, ReproduceError> {
    let start = (bench.clock)();
    let seed = SeedTree::new(bench.settings.seed).child("pose", 0);
    let config = PoseConfig::default();
    pose::recognise(&made.survey, found, catalog, &config, seed, bench.observer)?;
    Ok((bench.clock)() - start)
}

/// Seconds of a training step, both tiles one after the other; `None` for a scene without a tile.
fn step_s(
    bench: &Bench,
    set: &SiteSet,
    model: &SegmentModel,
    made: &SynthScene,
) -> Result<Option<f64>, ReproduceError> {
    let config =
        TrainConfig { network: model.description.network.clone(), ..TrainConfig::default() };
    if !matches!(config.network, NetworkConfig::FpccV2(_)) {
        return Ok(None);
    }
    let centre = made
        .scene
        .blocks
        .iter()
        .map(|b| b.site_from_block * set.catalog.get(b.model).centre)
        .collect();
    let scene = LabelledScene {
        position_m: made.survey.cloud.position_m.clone(),
        instance: made.instance.clone(),
        centre_m: centre,
        unit_m: set.catalog.d_max_m(),
    };
    let seed = SeedTree::new(bench.settings.seed).child("tile", 0);
    let thin = ThinScene::new(&scene, config.cell, config.sparsest, seed);
    let tile = thin.tile(config.tile_points, config.margin, false, seed);
    let (mut steps, start) = (0, (bench.clock)());
    train_on_tile(model, &tile, &config, 1e-6, &mut |_| {
        steps += 1;
        steps < STEPS
    })?;
    Ok(Some(((bench.clock)() - start) / f64::from(STEPS) * config.replicas as f64))
}

fn cost_row(set: &SiteSet, s: &Seconds, model: &SegmentModel, step_s: Option<f64>) -> Vec<String> {
    let n = f64::from(s.scenes.max(1));
    let (scene_s, steps) = (s.making / n, model.description.steps);
    let scenes_h = scene_s * SCENES / 3600.0;
    let training_h = step_s.map(|step| step * steps as f64 / 3600.0);
    vec![
        set.name.to_string(),
        set.catalog.len().to_string(),
        format!("{:.0}", s.blocks as f64 / n),
        format!("{:.0}", s.points as f64 / n),
        format!("{scene_s:.1}"),
        format!("{scenes_h:.2}"),
        steps.to_string(),
        step_s.map_or("–".into(), |step| format!("{step:.2}")),
        training_h.map_or("–".into(), |h| format!("{:.2}", h + scenes_h)),
    ]
}

fn time_row(set: &SiteSet, s: &Seconds) -> Vec<String> {
    let n = f64::from(s.scenes.max(1));
    let several = set.catalog.len() > 1;
    let poses = if several { s.poses } else { s.all_types };
    let types = several.then(|| (s.all_types - s.poses).max(0.0));
    vec![
        set.name.to_string(),
        format!("{:.0}", s.points as f64 / n),
        format!("{:.0}", s.blocks as f64 / n),
        format!("{:.2}", s.segments / n),
        format!("{:.2}", poses / n),
        types.map_or("–".into(), |t| format!("{:.2}", t / n)),
        format!("{:.2}", (s.segments + s.all_types) / n),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn types_are_what_the_other_types_add() {
        let sets = table_sets(true).unwrap();
        let of = |name: &str| sets.iter().find(|s| s.name == name).unwrap();
        let s = Seconds {
            scenes: 2,
            blocks: 110,
            points: 4000,
            making: 2.0,
            segments: 1.0,
            poses: 3.0,
            all_types: 5.0,
        };
        let two = time_row(of("era-uav"), &s);
        assert_eq!(two, ["era-uav", "2000", "55", "0.50", "1.50", "1.00", "3.00"]);
        let one = time_row(of("sawara-uav"), &s);
        assert_eq!(one[4..], ["2.50", "–", "3.00"].map(String::from));
        assert!(first_type(&of("sawara-uav").catalog).is_none());
        assert_eq!(first_type(&of("era-uav").catalog).unwrap().len(), 1);
    }
}
