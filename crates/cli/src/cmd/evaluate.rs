//! `tsumu evaluate`: any result against any truth, in the files of `docs/guide/formats.md`.

use crate::exit::{Exit, OrBadInput};
use crate::progress::Terminal;
use crate::{inputs, outputs};
use anyhow::anyhow;
use clap::Args;
use geom::DVec3;
use metrics::{DetectionCounts, Fitting, InstanceScene, PoseCriteria, PoseScore, TrueBlock};
use scene::{Catalog, Recognised, SiteFrame};
use serde::Serialize;
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// Score a result against a truth, also files made by other programs.
///
/// TRUTH holds truth.csv and, for the scores of the labels, cloud.ply or cloud.laz with `instance`.
/// RESULT holds blocks.csv and such a cloud, or is a run folder. Both may also be folders of scenes:
/// then scenes of one name are compared and the figures pooled.
#[derive(Debug, Args)]
pub struct EvaluateArgs {
    /// Folder with truth.csv, or with one folder a scene
    #[arg(long, value_name = "DIR")]
    pub truth: PathBuf,
    /// Folder with blocks.csv, a run folder, or a folder with one of these a scene
    #[arg(long, value_name = "DIR")]
    pub result: PathBuf,
    /// Catalogue that both speak of [default: catalog.toml in TRUTH, RESULT or beside them]
    #[arg(long, value_name = "FILE")]
    pub catalog: Option<PathBuf>,
    /// Also write the figures to this JSON file
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    /// Blocks at or above this occlusion are not asked for
    #[arg(long, value_name = "RATE", default_value_t = 0.8)]
    pub occlusion_limit: f32,
}

/// The figures, as `metrics.json` has them; absent ones could not be computed from the files given.
#[derive(Clone, Debug, Default, Serialize)]
struct Figures {
    scenes: usize,
    true_blocks: usize,
    true_blocks_asked_for: usize,
    recognised_blocks: usize,
    not_judged_blocks: usize,
    pose_precision: Option<f64>,
    pose_recall: Option<f64>,
    pose_true_positives: usize,
    pose_false_positives: usize,
    pose_false_negatives: usize,
    pose_ignored: usize,
    mean_displacement_m: Option<f64>,
    mean_displacement_about_shift_m: Option<f64>,
    mean_rotation_deg: Option<f64>,
    type_accuracy: Option<f64>,
    types_not_judged: usize,
    instance_precision: Option<f64>,
    instance_recall: Option<f64>,
    block_point_precision: Option<f64>,
    block_point_recall: Option<f64>,
    fitting_error_m: Option<f64>,
    matching_rate: Option<f64>,
    fitting_threshold_m: Option<f64>,
}

/// Prints the table; with `--json` or `--out` also as JSON.
pub fn evaluate(args: &EvaluateArgs, terminal: &Terminal) -> Result<(), Exit> {
    let scenes = pair_scenes(&args.truth, &args.result)?;
    let catalog_file = find_catalog(args)?;
    let catalog = inputs::catalog(&catalog_file, terminal)?;
    let criteria =
        PoseCriteria { occlusion_limit: args.occlusion_limit, ..PoseCriteria::default() };

    let mut total = Total::default();
    for (truth, result) in &scenes {
        total.add(score_scene(truth, result, &catalog, &criteria, terminal)?);
    }
    let figures = total.figures(scenes.len());
    print_table(&figures, terminal);
    let value = serde_json::to_value(&figures)?;
    terminal.emit("metrics", value.clone());
    if let Some(out) = &args.out {
        outputs::write_json(out, &value)?;
    }
    Ok(())
}

/// One scene's folders, or every scene both sides have.
fn pair_scenes(truth: &Path, result: &Path) -> Result<Vec<(PathBuf, PathBuf)>, Exit> {
    if truth.join("truth.csv").is_file() {
        return Ok(vec![(truth.to_path_buf(), result.to_path_buf())]);
    }
    let mut names: Vec<_> = std::fs::read_dir(truth)
        .map_err(|e| Exit::bad_input(anyhow!("cannot read {}: {e}", truth.display())))?
        .filter_map(|entry| entry.ok())
        .filter(|entry| entry.path().join("truth.csv").is_file())
        .map(|entry| entry.file_name())
        .collect();
    names.sort();
    if names.is_empty() {
        return Err(Exit::bad_input(anyhow!(
            "{}: no truth.csv here, nor in a folder below",
            truth.display()
        )));
    }
    let pairs: Vec<_> = names.into_iter().map(|n| (truth.join(&n), result.join(&n))).collect();
    for (t, r) in &pairs {
        if !r.is_dir() {
            return Err(Exit::bad_input(anyhow!(
                "{}: has no result at {}",
                t.display(),
                r.display()
            )));
        }
    }
    Ok(pairs)
}

fn find_catalog(args: &EvaluateArgs) -> Result<PathBuf, Exit> {
    if let Some(file) = &args.catalog {
        return Ok(file.clone());
    }
    let near = |dir: &Path| [dir.join("catalog.toml"), dir.join("../catalog.toml")];
    let candidates: Vec<_> = near(&args.truth).into_iter().chain(near(&args.result)).collect();
    candidates.into_iter().find(|f| f.is_file()).ok_or_else(|| {
        Exit::bad_input(anyhow!(
            "no catalog.toml in {} or {}; name one with --catalog",
            args.truth.display(),
            args.result.display()
        ))
    })
}

/// Everything of one scene that can be added to others.
#[derive(Default)]
struct Total {
    true_blocks: usize,
    asked_for: usize,
    recognised: usize,
    not_judged: usize,
    poses: PoseScore,
    instances: Option<DetectionCounts>,
    block_points: Option<DetectionCounts>,
    distance_m: Vec<f32>,
    threshold_m: f32,
}

impl Total {
    fn add(&mut self, scene: Total) {
        self.true_blocks += scene.true_blocks;
        self.asked_for += scene.asked_for;
        self.recognised += scene.recognised;
        self.not_judged += scene.not_judged;
        self.poses = self.poses.plus(&scene.poses);
        let pooled = |a: Option<DetectionCounts>, b: Option<DetectionCounts>| match (a, b) {
            (Some(a), Some(b)) => Some(a.plus(&b)),
            (a, b) => a.or(b),
        };
        self.instances = pooled(self.instances.take(), scene.instances);
        self.block_points = pooled(self.block_points.take(), scene.block_points);
        self.distance_m.extend(scene.distance_m);
        self.threshold_m = scene.threshold_m;
    }

    fn figures(&self, scenes: usize) -> Figures {
        let fit: Fitting = metrics::fitting(&self.distance_m, self.threshold_m);
        let counts = &self.poses.counts;
        Figures {
            scenes,
            true_blocks: self.true_blocks,
            true_blocks_asked_for: self.asked_for,
            recognised_blocks: self.recognised,
            not_judged_blocks: self.not_judged,
            pose_precision: counts.precision(),
            pose_recall: counts.recall(),
            pose_true_positives: counts.true_positives,
            pose_false_positives: counts.false_positives,
            pose_false_negatives: counts.false_negatives,
            pose_ignored: self.poses.ignored,
            mean_displacement_m: self.poses.mean_displacement_m(),
            mean_displacement_about_shift_m: self.poses.mean_about_shift_m(),
            mean_rotation_deg: self.poses.mean_rotation_rad().map(f64::to_degrees),
            type_accuracy: self.poses.type_accuracy(),
            types_not_judged: self.poses.types_open,
            instance_precision: self.instances.and_then(|i| i.precision()),
            instance_recall: self.instances.and_then(|i| i.recall()),
            block_point_precision: self.block_points.and_then(|i| i.precision()),
            block_point_recall: self.block_points.and_then(|i| i.recall()),
            fitting_error_m: fit.error_m,
            matching_rate: fit.matching_rate,
            fitting_threshold_m: fit.matching_rate.map(|_| f64::from(self.threshold_m)),
        }
    }
}

fn score_scene(
    truth_dir: &Path,
    result_dir: &Path,
    catalog: &Catalog,
    criteria: &PoseCriteria,
    terminal: &Terminal,
) -> Result<Total, Exit> {
    let truth_file = truth_dir.join("truth.csv");
    let truth_rows = io::blocks_csv::read(&truth_file).or_bad_input()?;
    let result_file =
        first_file(result_dir, &["blocks.csv", "recognise/blocks.csv"]).ok_or_else(|| {
            Exit::bad_input(anyhow!(
                "{}: no blocks.csv here, nor in recognise/",
                result_dir.display()
            ))
        })?;
    let result_rows = io::blocks_csv::read(&result_file).or_bad_input()?;

    // All poses near one origin, so that f32 holds them.
    let origin = truth_rows
        .iter()
        .chain(&result_rows)
        .next()
        .map_or([0.0; 3], |r| r.pose.position_m.map(f64::round));
    let frame = SiteFrame { origin, ..SiteFrame::default() };
    let truths: Vec<TrueBlock> = truth_rows
        .iter()
        .map(|row| {
            let block = inputs::recognised(row, catalog, &frame, &truth_file)?;
            let placed = block.placed().expect("a row is a stated block");
            Ok(TrueBlock { placed, occlusion: row.occlusion.unwrap_or(0.0) as f32 })
        })
        .collect::<Result<_, Exit>>()?;
    let estimates: Vec<Recognised> = result_rows
        .iter()
        .map(|row| inputs::recognised(row, catalog, &frame, &result_file))
        .collect::<Result<_, Exit>>()?;

    let mut total = Total {
        true_blocks: truths.len(),
        asked_for: truths.iter().filter(|t| t.occlusion < criteria.occlusion_limit).count(),
        recognised: estimates.iter().filter(|r| r.is_stated()).count(),
        not_judged: estimates.iter().filter(|r| !r.is_stated()).count(),
        poses: metrics::score_poses(&estimates, &truths, catalog, criteria),
        threshold_m: outputs::fitting_threshold_m(catalog),
        ..Total::default()
    };

    let clouds = ["cloud.ply", "cloud.laz", "cloud.las", "segment/cloud.laz"];
    let truth_cloud = first_file(truth_dir, &clouds);
    let result_cloud =
        first_file(result_dir, &["segment/cloud.laz", "cloud.ply", "cloud.laz", "cloud.las"]);
    if let Some(file) = &result_cloud {
        let cloud = io::points::read(file, terminal).or_bad_input()?;
        let points: Vec<_> = cloud.position.iter().map(|&p| frame.local_from_site(p)).collect();
        let blocks = pipeline::placed_blocks(&estimates);
        total.distance_m = metrics::model_distances_m(&points, &blocks, catalog, total.threshold_m);
        if let Some(truth_file) = &truth_cloud {
            let truth = io::points::read(truth_file, terminal).or_bad_input()?;
            total.instances = instance_counts(&truth, &cloud, &truths, criteria)?;
            if let Some(file) = first_file(result_dir, &["recognise/cloud.laz"]) {
                let explained = io::points::read(&file, terminal).or_bad_input()?;
                total.block_points = instance_counts(&truth, &explained, &truths, criteria)?;
            }
        }
    }
    Ok(total)
}

/// Labels of both clouds point by point: in file order when the positions agree, else by position.
fn instance_counts(
    truth: &io::RawCloud,
    result: &io::RawCloud,
    truths: &[TrueBlock],
    criteria: &PoseCriteria,
) -> Result<Option<DetectionCounts>, Exit> {
    let (Some(true_label), Some(label)) = (&truth.instance, &result.instance) else {
        return Ok(None);
    };
    // LAS rounds to its scale; two points of a survey are farther apart than this.
    let near = |a: DVec3, b: DVec3| (a - b).abs().max_element() < 2e-3;
    let same_order = truth.len() == result.len()
        && truth.position.iter().zip(&result.position).all(|(&a, &b)| near(a, b));
    let predicted = if same_order {
        label.clone()
    } else {
        let key = |p: DVec3| (p / 4e-3).round().to_array().map(|v| v as i64);
        let by_place: HashMap<_, _> =
            result.position.iter().map(|&p| key(p)).zip(label.iter().copied()).collect();
        let found: Vec<Option<u32>> =
            truth.position.iter().map(|&p| by_place.get(&key(p)).copied()).collect();
        if found.iter().filter(|f| f.is_some()).count() * 2 < found.len() {
            return Ok(None);
        }
        found.into_iter().map(|f| f.unwrap_or(0)).collect()
    };
    // Blocks too occluded to be asked for are neither right nor wrong, nor is an instance that lies on one.
    let labels = truths.iter().map(|t| t.placed.block.0).max().unwrap_or(0) as usize;
    let mut hidden = vec![false; labels];
    for t in
        truths.iter().filter(|t| t.occlusion >= criteria.occlusion_limit && t.placed.block.0 > 0)
    {
        hidden[t.placed.block.0 as usize - 1] = true;
    }
    let (predicted, truth) = metrics::without_hidden(&predicted, true_label, &hidden);
    let scene = InstanceScene { predicted: &predicted, truth: &truth };
    Ok(Some(metrics::precision_recall(&[scene], 0.5)?))
}

fn first_file(dir: &Path, names: &[&str]) -> Option<PathBuf> {
    names.iter().map(|n| dir.join(n)).find(|f| f.is_file())
}

fn print_table(f: &Figures, terminal: &Terminal) {
    let percent = |v: Option<f64>| v.map_or("–".to_string(), |v| format!("{:.1} %", v * 100.0));
    let millimetres =
        |v: Option<f64>| v.map_or("–".to_string(), |v| format!("{:.1} mm", v * 1000.0));
    let rows = [
        ("scenes", f.scenes.to_string()),
        ("true blocks", format!("{} ({} asked for)", f.true_blocks, f.true_blocks_asked_for)),
        ("recognised blocks", f.recognised_blocks.to_string()),
        ("pose precision", percent(f.pose_precision)),
        ("pose recall", percent(f.pose_recall)),
        ("mean displacement E_d", millimetres(f.mean_displacement_m)),
        ("E_d about the survey's own shift", millimetres(f.mean_displacement_about_shift_m)),
        ("mean rotation error E_R", f.mean_rotation_deg.map_or("–".into(), |v| format!("{v:.2}°"))),
        ("type right, where judged", percent(f.type_accuracy)),
        ("type not judged", f.types_not_judged.to_string()),
        ("instance precision, IoU ≥ .5", percent(f.instance_precision)),
        ("instance recall, IoU ≥ .5", percent(f.instance_recall)),
        ("points of blocks, precision", percent(f.block_point_precision)),
        ("points of blocks, recall", percent(f.block_point_recall)),
        ("fitting error E_f", millimetres(f.fitting_error_m)),
        ("matching rate R", percent(f.matching_rate)),
    ];
    for (name, value) in rows {
        terminal.say(format!("{name:<34}{value:>20}"));
    }
}
