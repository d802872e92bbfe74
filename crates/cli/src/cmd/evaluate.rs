//! `tsumu evaluate`: any result against any truth, in the files of `docs/guide/formats.md`.

use crate::words;
use anyhow::anyhow;
use clap::Args;
use std::path::PathBuf;
use terminal::Terminal;
use tsumu::{Error, Evaluation, Job, LabelEvaluation, Result};

/// Score a result against a truth, also files made by other programs.
///
/// TRUTH holds truth.csv and, for the scores of the labels, cloud.ply or cloud.laz with `instance`.
/// RESULT holds blocks.csv and such a cloud, or is a run folder. Both may also be folders of scenes:
/// then scenes of one name are compared and the figures pooled.
///
/// With --labels no poses are needed: TRUTH and RESULT are labelled clouds (PLY, LAS, LAZ, text, NPY), or folders of them, in
/// any order and numbering. Numbers below 1 mean no instance.
#[derive(Debug, Args)]
pub struct EvaluateArgs {
    /// Folder with truth.csv, or with one folder a scene; with --labels a labelled cloud or a folder of them
    #[arg(long, value_name = "TRUTH")]
    pub truth: PathBuf,
    /// Folder with blocks.csv, a run folder, or a folder with one of these a scene; with --labels a labelled cloud or a folder of them
    #[arg(long, value_name = "RESULT")]
    pub result: PathBuf,
    /// Score the labels of the points alone: precision and recall, AP, coverage
    #[arg(long)]
    pub labels: bool,
    /// How near two points of one place lie at most, metres (or the files' unit) [default: a hundredth of the smallest block's
    /// d_max with --catalog, else of half the median true instance]
    #[arg(long, value_name = "METRES", requires = "labels", allow_negative_numbers = true)]
    pub tolerance: Option<f64>,
    /// IoU from which an instance is right, above 0 and at most 1 [default: 0.5]
    #[arg(long, value_name = "IOU", requires = "labels", allow_negative_numbers = true)]
    pub iou: Option<f64>,
    /// Whose instances are numbered from 0, so that only numbers below 0 mean none
    #[arg(long, value_name = "SIDE", value_enum, requires = "labels")]
    pub zero_is_instance: Option<Sides>,
    /// Column of the truth's instances, from 1, in a file without column names
    #[arg(long, value_name = "N", requires = "labels")]
    pub truth_column: Option<usize>,
    /// Column of the result's instances, from 1, in a file without column names
    #[arg(long, value_name = "N", requires = "labels")]
    pub result_column: Option<usize>,
    /// Catalogue that both speak of [default: catalog.toml in TRUTH, RESULT or beside them]
    #[arg(long, value_name = "FILE")]
    pub catalog: Option<PathBuf>,
    /// Also write the figures to this JSON file
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    /// Blocks at or above this occlusion are not scored
    #[arg(long, value_name = "RATE", default_value_t = 0.8, conflicts_with = "labels")]
    pub occlusion_limit: f32,
}

/// One side or both.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Sides {
    /// The truth
    Truth,
    /// The result
    Result,
    /// Both of them
    Both,
}

/// Prints the table; with `--json` or `--out` also as JSON.
pub fn evaluate(args: &EvaluateArgs, terminal: &Terminal, job: &Job) -> Result<()> {
    if args.labels {
        return labels(args, terminal, job);
    }
    if let Some(file) = [&args.truth, &args.result].into_iter().find(|p| p.is_file()) {
        return Err(Error::bad_input(anyhow!(
            "{} is a file: give folders with truth.csv and blocks.csv, or labelled clouds with --labels",
            file.display()
        )));
    }
    let mut order = Evaluation {
        truth: args.truth.clone(),
        result: args.result.clone(),
        catalog: args.catalog.clone(),
        ..Evaluation::default()
    };
    order.criteria.occlusion_limit = args.occlusion_limit;
    let scores = tsumu::evaluate(&order, job)?;
    words::scores(&scores, terminal);
    terminal.emit("metrics", &scores);
    match &args.out {
        Some(out) => scores.write(out),
        None => Ok(()),
    }
}

/// The labels alone.
fn labels(args: &EvaluateArgs, terminal: &Terminal, job: &Job) -> Result<()> {
    let from_zero = |side: Sides| [Some(side), Some(Sides::Both)].contains(&args.zero_is_instance);
    let order = LabelEvaluation {
        truth: args.truth.clone(),
        result: args.result.clone(),
        catalog: args.catalog.clone(),
        tolerance_m: args.tolerance,
        min_iou: args.iou.unwrap_or(LabelEvaluation::default().min_iou),
        truth_column: args.truth_column,
        result_column: args.result_column,
        zero_is_instance: [from_zero(Sides::Truth), from_zero(Sides::Result)],
    };
    let scores = tsumu::evaluate_labels(&order, job)?;
    words::label_scores(&scores, terminal);
    terminal.emit("labels", &scores);
    match &args.out {
        Some(out) => scores.write(out),
        None => Ok(()),
    }
}
