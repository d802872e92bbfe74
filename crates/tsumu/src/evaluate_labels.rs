//! Any labelled cloud against any other: no poses, no catalogue needed.
//!
//! In: two files of `docs/guide/formats.md` with an instance number a point, or two folders of such files. Out: precision and
//! recall at a chosen IoU, ScanNet's average precision, coverage, and how many points of either side found no partner.

use crate::error::OrBadInput;
use crate::{Error, Job, Result, catalogue, outputs};
use anyhow::anyhow;
use geom::{DVec3, Event, Observer, Stage, Warning};
use io::label_cloud::LabelCloud;
use metrics::labelled_clouds::{
    Labelled, MatchedLabels, Zero, label_figures, match_labels, tolerance_m,
};
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// What to hold against what.
#[derive(Clone, Debug)]
pub struct LabelEvaluation {
    /// A labelled cloud, or a folder of them.
    pub truth: PathBuf,
    /// A labelled cloud, or a folder of them with the names of the truth's.
    pub result: PathBuf,
    /// Catalogue whose smallest block decides how near two points of one place lie.
    pub catalog: Option<PathBuf>,
    /// How near they lie, metres (or the files' unit); before the catalogue.
    pub tolerance_m: Option<f64>,
    /// IoU from which an instance is right, in (0, 1].
    pub min_iou: f64,
    /// Column of the truth's instances, from 1, in files without column names.
    pub truth_column: Option<usize>,
    /// The same for the result.
    pub result_column: Option<usize>,
    /// Whether 0 is an instance: of the truth, of the result.
    pub zero_is_instance: [bool; 2],
}

impl Default for LabelEvaluation {
    fn default() -> Self {
        Self {
            truth: PathBuf::new(),
            result: PathBuf::new(),
            catalog: None,
            tolerance_m: None,
            min_iou: 0.5,
            truth_column: None,
            result_column: None,
            zero_is_instance: [false; 2],
        }
    }
}

/// The figures, pooled over the scenes, as `--json` and `--out` have them; absent ones have nothing to be computed from.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct LabelScores {
    /// Scenes pooled.
    pub scenes: usize,
    /// IoU from which an instance is right.
    pub min_iou: f64,
    /// How near two points of one place lie at most, metres; the largest of the scenes.
    pub tolerance_m: f64,
    /// Where the tolerance comes from.
    pub tolerance_from: &'static str,
    /// True instances.
    pub true_instances: usize,
    /// Instances of the result.
    pub result_instances: usize,
    /// Of these, those that lie mostly where the truth has no points: they count neither way.
    pub instances_outside_the_truth: usize,
    /// Instances of the result that meet a true one.
    pub true_positives: usize,
    /// Instances of the result that meet none.
    pub false_positives: usize,
    /// True instances that nothing meets.
    pub false_negatives: usize,
    /// Precision at `min_iou`.
    pub precision: Option<f64>,
    /// Recall at `min_iou`.
    pub recall: Option<f64>,
    /// Mean over IoU .50, .55 … .90, in ScanNet's manner.
    pub ap: Option<f64>,
    /// At IoU .5.
    pub ap50: Option<f64>,
    /// At IoU .25.
    pub ap25: Option<f64>,
    /// Whether instances were ordered by a stated confidence; without one all weigh the same.
    pub scored_by_confidence: bool,
    /// Mean over the true instances of the largest IoU any instance has with it.
    pub coverage: Option<f64>,
    /// The same, true instances weighted by their points.
    pub weighted_coverage: Option<f64>,
    /// Points of the truth.
    pub true_points: usize,
    /// Points of the result.
    pub result_points: usize,
    /// Points of the truth with no point of the result within the tolerance.
    pub unmatched_true_points: usize,
    /// Points of the result with no point of the truth within the tolerance.
    pub unmatched_result_points: usize,
}

impl LabelScores {
    /// Writes them as JSON, whole or not at all. Errors: a file of another kind is there.
    pub fn write(&self, file: &Path) -> Result<()> {
        outputs::write_named_json(file, self)
    }
}

/// Scores a result; files of one name are compared and pooled. Errors: files without instances, that do not belong together or
/// that cannot be read.
pub fn evaluate_labels(order: &LabelEvaluation, job: &Job) -> Result<LabelScores> {
    let pairs = pairs(&order.truth, &order.result)?;
    let catalog_m = match &order.catalog {
        Some(file) => {
            let catalog = catalogue::read(file, job)?;
            let smallest = catalog.iter().map(|(_, m)| m.d_max_m).fold(f32::INFINITY, f32::min);
            Some(tolerance_m(smallest))
        }
        None => None,
    };
    let mut total = Pooled::default();
    for (truth, result) in &pairs {
        job.install(|| total.add(order, catalog_m, truth, result, job))?;
    }
    total.scores(order)
}

/// Both files, or every file both folders have by its name without ending.
fn pairs(truth: &Path, result: &Path) -> Result<Vec<(PathBuf, PathBuf)>> {
    match (truth.is_dir(), result.is_dir()) {
        (false, false) => Ok(vec![(truth.into(), result.into())]),
        (true, true) => {
            let of = |folder: &Path| clouds_of(folder);
            let mut results = of(result)?;
            let pair = |(name, file): (String, PathBuf)| match results.remove(&name) {
                Some(other) => Ok((file, other)),
                None => Err(Error::bad_input(anyhow!(
                    "{}: {} has no cloud of the name {name}",
                    file.display(),
                    result.display()
                ))),
            };
            let pairs: Vec<_> = of(truth)?.into_iter().map(pair).collect::<Result<_>>()?;
            if pairs.is_empty() {
                let none = anyhow!("{}: no labelled cloud lies in it", truth.display());
                return Err(Error::bad_input(none));
            }
            Ok(pairs)
        }
        (folder, _) => {
            let (a, b) = if folder { (truth, result) } else { (result, truth) };
            Err(Error::bad_input(anyhow!(
                "{} is a folder and {} is not: give two labelled clouds, or two folders of them",
                a.display(),
                b.display()
            )))
        }
    }
}

const ENDINGS: [&str; 9] = ["ply", "las", "laz", "npy", "txt", "xyz", "asc", "csv", "pts"];

/// Clouds of a folder by name without ending.
fn clouds_of(folder: &Path) -> Result<BTreeMap<String, PathBuf>> {
    let entries = std::fs::read_dir(folder)
        .map_err(|e| Error::bad_input(anyhow!("cannot read {}: {e}", folder.display())))?;
    let mut clouds = BTreeMap::new();
    let mut files: Vec<PathBuf> = entries.filter_map(|e| Some(e.ok()?.path())).collect();
    files.sort();
    for file in files {
        let ending = file.extension().map(|e| e.to_string_lossy().to_lowercase());
        if !ending.is_some_and(|e| ENDINGS.contains(&e.as_str())) || !file.is_file() {
            continue;
        }
        let name = file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        if let Some(other) = clouds.insert(name, file.clone()) {
            return Err(Error::bad_input(anyhow!(
                "{} and {} have one name: which of them is meant?",
                other.display(),
                file.display()
            )));
        }
    }
    Ok(clouds)
}

/// Scenes so far.
#[derive(Default)]
struct Pooled {
    matched: Vec<MatchedLabels>,
    tolerance_m: f64,
    tolerance_from: &'static str,
    result_points: usize,
    confidence: bool,
}

impl Pooled {
    fn add(
        &mut self,
        order: &LabelEvaluation,
        catalog_m: Option<f64>,
        truth_file: &Path,
        result_file: &Path,
        job: &Job,
    ) -> Result<()> {
        let [zero_truth, zero_result] = order.zero_is_instance.map(zero);
        let truth = Side::read(truth_file, order.truth_column, zero_truth, job)?;
        let result = Side::read(result_file, order.result_column, zero_result, job)?;
        if truth.instances() == 0 {
            return Err(Error::bad_input(anyhow!(
                "{}: no point belongs to an instance (all numbers are {}), so there is nothing to score against",
                truth_file.display(),
                if zero_truth == Zero::Instance {
                    "below 0"
                } else if truth.cloud.instance.contains(&0) {
                    "0 or below; if 0 is an instance, say --zero-is-instance truth"
                } else {
                    "below 1"
                },
            )));
        }
        if result.instances() == 0 {
            warn(job, format!("{}: no point belongs to an instance", result_file.display()));
        }
        let (tolerance_m, from) = match (order.tolerance_m, catalog_m) {
            (Some(stated), _) => (stated, "--tolerance"),
            (None, Some(of_catalog)) => (of_catalog, "a hundredth of the smallest block's d_max"),
            (None, None) => (
                truth.own_tolerance_m(),
                "a hundredth of half the median true instance; --tolerance or --catalog state another",
            ),
        };
        let zero = [zero_truth, zero_result];
        let matched =
            match_labels(truth.labelled(), result.labelled(), tolerance_m, zero).or_bad_input()?;
        if matched.unmatched_truth == matched.truth.len() {
            return Err(Error::bad_input(anyhow!(
                "{} and {}: no point of one lies within {tolerance_m:.2e} m of a point of the other: are units and coordinates \
                 the same? --tolerance states how near is near enough",
                truth_file.display(),
                result_file.display()
            )));
        }
        self.tolerance_m = self.tolerance_m.max(tolerance_m);
        self.tolerance_from = from;
        self.result_points += result.cloud.position.len();
        self.confidence |= result.cloud.confidence.is_some();
        self.matched.push(matched);
        Ok(())
    }

    fn scores(&self, order: &LabelEvaluation) -> Result<LabelScores> {
        let f = label_figures(&self.matched, order.min_iou).or_bad_input()?;
        let (counts, ap) = (f.counts, f.average_precision);
        Ok(LabelScores {
            scenes: self.matched.len(),
            min_iou: order.min_iou,
            tolerance_m: self.tolerance_m,
            tolerance_from: self.tolerance_from,
            true_instances: counts.true_positives + counts.false_negatives,
            result_instances: counts.true_positives + counts.false_positives + f.not_judged,
            instances_outside_the_truth: f.not_judged,
            true_positives: counts.true_positives,
            false_positives: counts.false_positives,
            false_negatives: counts.false_negatives,
            precision: counts.precision(),
            recall: counts.recall(),
            ap: ap.ap,
            ap50: ap.ap50,
            ap25: ap.ap25,
            scored_by_confidence: self.confidence,
            coverage: f.coverage,
            weighted_coverage: f.weighted_coverage,
            true_points: f.true_points,
            result_points: self.result_points,
            unmatched_true_points: f.unmatched_truth,
            unmatched_result_points: f.unmatched_predicted,
        })
    }
}

fn warn(job: &Job, message: String) {
    job.event(Event::Warned(Warning { stage: Stage::Read, message }));
}

fn zero(is_instance: bool) -> Zero {
    if is_instance { Zero::Instance } else { Zero::None }
}

/// One of the two clouds.
struct Side {
    cloud: LabelCloud,
    least: i64,
}

impl Side {
    fn read(file: &Path, column: Option<usize>, zero: Zero, job: &Job) -> Result<Self> {
        let cloud = io::label_cloud::read(file, column, job).or_bad_input()?;
        if cloud.position.is_empty() {
            return Err(Error::bad_input(anyhow!("{}: no points in it", file.display())));
        }
        let has = |what: fn(&i64) -> bool| cloud.instance.iter().any(what);
        if zero == Zero::None && has(|&i| i < 0) && has(|&i| i == 0) {
            warn(
                job,
                format!(
                    "{}: numbers below 0 and 0 are both taken for no instance; if 0 is one, say --zero-is-instance",
                    file.display()
                ),
            );
        }
        Ok(Self { cloud, least: if zero == Zero::Instance { 0 } else { 1 } })
    }

    fn labelled(&self) -> Labelled<'_> {
        let LabelCloud { position, instance, confidence } = &self.cloud;
        Labelled { position, instance, confidence: confidence.as_deref() }
    }

    /// Corners of the box about each instance.
    fn boxes(&self) -> BTreeMap<i64, (DVec3, DVec3)> {
        let mut boxes = BTreeMap::new();
        let of_one = |(_, i): &(&DVec3, &i64)| **i >= self.least;
        for (p, i) in self.cloud.position.iter().zip(&self.cloud.instance).filter(of_one) {
            let (low, high) = boxes.entry(*i).or_insert((*p, *p));
            (*low, *high) = (low.min(*p), high.max(*p));
        }
        boxes
    }

    fn instances(&self) -> usize {
        self.boxes().len()
    }

    /// What the catalogue would say of a block as large as most instances: half their diagonal stands for d_max.
    fn own_tolerance_m(&self) -> f64 {
        let mut half: Vec<f64> =
            self.boxes().values().map(|(low, high)| 0.5 * (*high - *low).length()).collect();
        half.sort_by(f64::total_cmp);
        let median = half.get(half.len() / 2).copied().unwrap_or_default();
        // Instances of one point each have no extent.
        (0.01 * median).max(1e-9)
    }
}
