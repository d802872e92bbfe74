//! Any result against any truth, in the files of `docs/guide/formats.md`.

use crate::error::OrBadInput;
use crate::{Error, Job, Result, catalogue, outputs, stored, summary};
use anyhow::anyhow;
use io::blocks_csv::BlockRow;
use io::not_judged_csv::NotJudgedRow;
use io::{RawCloud, ReadOptions};
use metrics::bop::{MssdScore, score_mssd};
use metrics::labelled_clouds::{Labelled, MatchedLabels, Zero, match_labels, tolerance_m};
use metrics::{DetectionCounts, InstanceScene, PoseCriteria, PoseScore, TrueBlock};
use scene::{Catalog, Fit, InstanceId, Recognised, SiteFrame};
use serde::Serialize;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// What to hold against what.
#[derive(Clone, Debug, Default)]
pub struct Evaluation {
    /// Folder with truth.csv, or with one folder a scene.
    pub truth: PathBuf,
    /// Folder with blocks.csv, a run folder, or a folder with one of these a scene.
    pub result: PathBuf,
    /// Catalogue both speak of; `None`: catalog.toml in either or beside them.
    pub catalog: Option<PathBuf>,
    /// When a pose is right, and which blocks are scored.
    pub criteria: PoseCriteria,
}

/// The figures, as `metrics.json` has them; absent ones could not be computed from the files given.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Scores {
    /// Scenes pooled.
    pub scenes: usize,
    /// True blocks.
    pub true_blocks: usize,
    /// True blocks below the occlusion limit: the others count neither way.
    pub true_blocks_asked_for: usize,
    /// Stated blocks.
    pub recognised_blocks: usize,
    /// Blocks that are not judged.
    pub not_judged_blocks: usize,
    /// True positives over all stated blocks.
    pub pose_precision: Option<f64>,
    /// True positives over all true blocks that are scored.
    pub pose_recall: Option<f64>,
    /// Stated blocks in their place.
    pub pose_true_positives: usize,
    /// Stated blocks where none is.
    pub pose_false_positives: usize,
    /// Missed blocks.
    pub pose_false_negatives: usize,
    /// Stated blocks that meet one too occluded to be scored.
    pub pose_ignored: usize,
    /// E_d, metres.
    pub mean_displacement_m: Option<f64>,
    /// E_d about the survey's own shift, metres.
    pub mean_displacement_about_shift_m: Option<f64>,
    /// E_R, degrees.
    pub mean_rotation_deg: Option<f64>,
    /// AR_MSSD of the BOP benchmark: recall averaged over ten limits, .05 to .50 of the block's diameter.
    pub mssd_average_recall: Option<f64>,
    /// Right types among the judged ones.
    pub type_accuracy: Option<f64>,
    /// True positives whose type is left open.
    pub types_not_judged: usize,
    /// Of instances at IoU 0.5.
    pub instance_precision: Option<f64>,
    /// Of instances at IoU 0.5.
    pub instance_recall: Option<f64>,
    /// Of the stated blocks' points at IoU 0.5.
    pub block_point_precision: Option<f64>,
    /// Of the stated blocks' points at IoU 0.5.
    pub block_point_recall: Option<f64>,
    /// True points without a point of the result near them; they belong to no instance.
    pub unmatched_true_points: Option<usize>,
    /// Points of the result without a true point near them; they do not enter the figures.
    pub unmatched_result_points: Option<usize>,
    /// E_f, metres.
    pub fitting_error_m: Option<f64>,
    /// R, in [0, 1].
    pub matching_rate: Option<f64>,
    /// Threshold of the two, metres.
    pub fitting_threshold_m: Option<f64>,
}

impl Scores {
    /// Writes them as JSON, whole or not at all. Errors: a file of another kind is there.
    pub fn write(&self, file: &Path) -> Result<()> {
        outputs::write_named_json(file, self)
    }
}

/// Scores a result; scenes of one name are compared and pooled. Errors: files that are missing or do not belong together.
pub fn evaluate(order: &Evaluation, job: &Job) -> Result<Scores> {
    let scenes = pair_scenes(&order.truth, &order.result)?;
    let catalog = catalogue::read(&find_catalog(order)?, job)?;
    let mut total = Total::default();
    for (truth, result) in &scenes {
        total.add(score_scene(truth, result, &catalog, &order.criteria, job)?);
    }
    total.scores(scenes.len())
}

/// One scene's folders, or every scene both sides have.
fn pair_scenes(truth: &Path, result: &Path) -> Result<Vec<(PathBuf, PathBuf)>> {
    if truth.join("truth.csv").is_file() {
        return Ok(vec![(truth.to_path_buf(), result.to_path_buf())]);
    }
    let mut names: Vec<_> = std::fs::read_dir(truth)
        .map_err(|e| Error::bad_input(anyhow!("cannot read {}: {e}", truth.display())))?
        .filter_map(|entry| entry.ok())
        .filter(|entry| entry.path().join("truth.csv").is_file())
        .map(|entry| entry.file_name())
        .collect();
    names.sort();
    if names.is_empty() {
        return Err(Error::bad_input(anyhow!(
            "{}: no truth.csv here, nor in a folder below",
            truth.display()
        )));
    }
    let pairs: Vec<_> = names.into_iter().map(|n| (truth.join(&n), result.join(&n))).collect();
    for (t, r) in &pairs {
        if !r.is_dir() {
            return Err(Error::bad_input(anyhow!(
                "{}: has no result at {}",
                t.display(),
                r.display()
            )));
        }
    }
    Ok(pairs)
}

fn find_catalog(order: &Evaluation) -> Result<PathBuf> {
    if let Some(file) = &order.catalog {
        return Ok(file.clone());
    }
    let near = |dir: &Path| [dir.join("catalog.toml"), dir.join("../catalog.toml")];
    let candidates: Vec<_> = near(&order.truth).into_iter().chain(near(&order.result)).collect();
    candidates.into_iter().find(|f| f.is_file()).ok_or_else(|| {
        Error::bad_input(anyhow!(
            "no catalog.toml in {} or {}; name one with --catalog",
            order.truth.display(),
            order.result.display()
        ))
    })
}

/// Labels of a scene, and which true instances are hidden.
type Labels = (MatchedLabels, Vec<bool>);

/// Everything of one scene that can be added to others.
#[derive(Default)]
struct Total {
    true_blocks: usize,
    scored: usize,
    recognised: usize,
    not_judged: usize,
    poses: PoseScore,
    mssd: MssdScore,
    instances: Vec<Labels>,
    block_points: Vec<Labels>,
    distance_m: Vec<f32>,
    threshold_m: f32,
}

impl Total {
    fn add(&mut self, scene: Total) {
        self.true_blocks += scene.true_blocks;
        self.scored += scene.scored;
        self.recognised += scene.recognised;
        self.not_judged += scene.not_judged;
        self.poses = self.poses.plus(&scene.poses);
        self.mssd = self.mssd.plus(&scene.mssd);
        self.instances.extend(scene.instances);
        self.block_points.extend(scene.block_points);
        self.distance_m.extend(scene.distance_m);
        self.threshold_m = scene.threshold_m;
    }

    fn scores(&self, scenes: usize) -> Result<Scores> {
        let fit = metrics::fitting(&self.distance_m, self.threshold_m);
        let (poses, counts) = (&self.poses, &self.poses.counts);
        let instances = detections(&self.instances)?;
        let block_points = detections(&self.block_points)?;
        let unmatched = |of: fn(&MatchedLabels) -> usize| {
            let labels = &self.instances;
            (!labels.is_empty()).then(|| labels.iter().map(|(matched, _)| of(matched)).sum())
        };
        Ok(Scores {
            scenes,
            true_blocks: self.true_blocks,
            true_blocks_asked_for: self.scored,
            recognised_blocks: self.recognised,
            not_judged_blocks: self.not_judged,
            pose_precision: counts.precision(),
            pose_recall: counts.recall(),
            pose_true_positives: counts.true_positives,
            pose_false_positives: counts.false_positives,
            pose_false_negatives: counts.false_negatives,
            pose_ignored: poses.ignored,
            mean_displacement_m: poses.mean_displacement_m(),
            mean_displacement_about_shift_m: poses.mean_about_shift_m(),
            mean_rotation_deg: poses.mean_rotation_rad().map(f64::to_degrees),
            mssd_average_recall: self.mssd.average_recall(),
            type_accuracy: poses.type_accuracy(),
            types_not_judged: poses.types_open,
            instance_precision: instances.and_then(|i| i.precision()),
            instance_recall: instances.and_then(|i| i.recall()),
            block_point_precision: block_points.and_then(|i| i.precision()),
            block_point_recall: block_points.and_then(|i| i.recall()),
            unmatched_true_points: unmatched(|m| m.unmatched_truth),
            unmatched_result_points: unmatched(|m| m.unmatched_predicted),
            fitting_error_m: fit.error_m,
            matching_rate: fit.matching_rate,
            fitting_threshold_m: fit.matching_rate.map(|_| f64::from(self.threshold_m)),
        })
    }
}

/// Blocks too occluded to be scored are neither right nor wrong, nor is an instance that lies on one.
fn detections(scenes: &[Labels]) -> Result<Option<DetectionCounts>> {
    let mut pooled: Option<DetectionCounts> = None;
    for (labels, hidden) in scenes {
        let (predicted, truth) = metrics::without_hidden(&labels.predicted, &labels.truth, hidden);
        let scene = InstanceScene { predicted: &predicted, truth: &truth };
        let counts = metrics::precision_recall(&[scene], 0.5)?;
        pooled = Some(pooled.map_or(counts, |p| p.plus(&counts)));
    }
    Ok(pooled)
}

fn score_scene(
    truth_dir: &Path,
    result_dir: &Path,
    catalog: &Catalog,
    criteria: &PoseCriteria,
    job: &Job,
) -> Result<Total> {
    let truth_file = truth_dir.join("truth.csv");
    let truth_rows = io::blocks_csv::read(&truth_file).or_bad_input()?;
    let result_file = blocks_file(result_dir)?;
    let result_rows = io::blocks_csv::read(&result_file).or_bad_input()?;
    let frame = frame_of(truth_rows.iter().chain(&result_rows));
    let truths = true_blocks(&blocks(&truth_rows, catalog, &frame, &truth_file)?);
    let estimates = blocks(&result_rows, catalog, &frame, &result_file)?;
    let mut total = Total {
        true_blocks: truths.len(),
        scored: truths.iter().filter(|t| t.occlusion < criteria.occlusion_limit).count(),
        recognised: estimates.len(),
        not_judged: not_judged(&result_file)?.len(),
        poses: metrics::score_poses(&estimates, &truths, catalog, criteria),
        mssd: score_mssd(&estimates, &truths, catalog, criteria.occlusion_limit),
        threshold_m: summary::fitting_threshold_m(catalog),
        ..Total::default()
    };
    let own = ["segment/cloud.laz", "cloud.ply", "cloud.laz", "cloud.las"];
    if let Some(file) = first_file(result_dir, &own) {
        let cloud =
            io::points::read_with(&file, &ReadOptions::every_point(), job).or_bad_input()?;
        let points: Vec<_> = cloud.position.iter().map(|&p| frame.local_from_site(p)).collect();
        let placed = pipeline::placed_blocks(&estimates);
        total.distance_m = metrics::model_distances_m(&points, &placed, catalog, total.threshold_m);
        total.add_labels(truth_dir, result_dir, &cloud, catalog, &truths, criteria, job)?;
    }
    Ok(total)
}

/// Rows as stated blocks.
fn blocks(
    rows: &[BlockRow],
    catalog: &Catalog,
    frame: &SiteFrame,
    file: &Path,
) -> Result<Vec<Recognised>> {
    let block = |row: &BlockRow| {
        let fit = stored::fit(row, catalog, frame, file)?;
        Ok(Recognised::of_fit(InstanceId(row.block_id), Vec::new(), fit))
    };
    rows.iter().map(block).collect()
}

/// What a truth does not say to be hidden is in sight.
fn true_blocks(rows: &[Recognised]) -> Vec<TrueBlock> {
    let truth = |(block, fit): (&Recognised, &Fit)| {
        Some(TrueBlock { placed: block.placed()?, occlusion: fit.occlusion.unwrap_or(0.0) })
    };
    scene::stated(rows).filter_map(truth).collect()
}

impl Total {
    #[expect(clippy::too_many_arguments, reason = "a scene's files and what they are held against")]
    fn add_labels(
        &mut self,
        truth_dir: &Path,
        result_dir: &Path,
        cloud: &RawCloud,
        catalog: &Catalog,
        truths: &[TrueBlock],
        criteria: &PoseCriteria,
        job: &Job,
    ) -> Result<()> {
        let clouds = ["cloud.ply", "cloud.laz", "cloud.las", "segment/cloud.laz"];
        let Some(truth_file) = first_file(truth_dir, &clouds) else { return Ok(()) };
        let truth =
            io::points::read_with(&truth_file, &ReadOptions::every_point(), job).or_bad_input()?;
        self.instances.extend(labels(&truth, cloud, catalog, truths, criteria)?);
        if let Some(file) = first_file(result_dir, &["recognise/cloud.laz"]) {
            let explained =
                io::points::read_with(&file, &ReadOptions::every_point(), job).or_bad_input()?;
            self.block_points.extend(labels(&truth, &explained, catalog, truths, criteria)?);
        }
        Ok(())
    }
}

/// Labels of both clouds point by point, whatever their order; `None` where one has none.
fn labels(
    truth: &RawCloud,
    result: &RawCloud,
    catalog: &Catalog,
    truths: &[TrueBlock],
    criteria: &PoseCriteria,
) -> Result<Option<Labels>> {
    let (Some(true_label), Some(label)) = (&truth.instance, &result.instance) else {
        return Ok(None);
    };
    let wide = |labels: &[u32]| labels.iter().map(|&l| i64::from(l)).collect::<Vec<_>>();
    let (true_wide, wide) = (wide(true_label), wide(label));
    let side = |cloud: &'_ RawCloud| cloud.position.clone();
    let (true_at, at) = (side(truth), side(result));
    let labelled = |position, instance| Labelled { position, instance, confidence: None };
    let smallest_m = catalog.iter().map(|(_, m)| m.d_max_m).fold(f32::INFINITY, f32::min);
    let tolerance_m = tolerance_m(smallest_m).max(FILE_STEP_M);
    let matched = match_labels(
        labelled(&true_at, &true_wide),
        labelled(&at, &wide),
        tolerance_m,
        [Zero::None; 2],
    )?;
    let hidden_blocks: BTreeSet<u32> = truths
        .iter()
        .filter(|t| t.occlusion >= criteria.occlusion_limit)
        .map(|t| t.placed.block.0)
        .collect();
    // Matched labels are numbered on, in the order of the blocks' numbers.
    let numbers: BTreeSet<u32> = true_label.iter().copied().filter(|&l| l > 0).collect();
    let hidden = numbers.iter().map(|n| hidden_blocks.contains(n)).collect();
    Ok(Some((matched, hidden)))
}

/// Files round coordinates to their scale, LAS often to a millimetre.
const FILE_STEP_M: f64 = 2e-3;

/// A frame near the blocks, so that f32 holds them.
fn frame_of<'a>(mut rows: impl Iterator<Item = &'a BlockRow>) -> SiteFrame {
    let origin = rows.next().map_or([0.0; 3], |r| r.pose.position_m.map(f64::round));
    SiteFrame { origin, ..SiteFrame::default() }
}

fn blocks_file(result: &Path) -> Result<PathBuf> {
    first_file(result, &["blocks.csv", "recognise/blocks.csv"]).ok_or_else(|| {
        Error::bad_input(anyhow!("{}: no blocks.csv here, nor in recognise/", result.display()))
    })
}

fn not_judged(blocks_file: &Path) -> Result<Vec<NotJudgedRow>> {
    let file = blocks_file.with_file_name("not_judged.csv");
    if file.is_file() { io::not_judged_csv::read(&file).or_bad_input() } else { Ok(Vec::new()) }
}

fn first_file(dir: &Path, names: &[&str]) -> Option<PathBuf> {
    names.iter().map(|n| dir.join(n)).find(|f| f.is_file())
}
