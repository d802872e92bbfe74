//! `tsumu evaluate`: any result against any truth, in the files of `docs/guide/formats.md`.

use crate::words;
use clap::Args;
use std::path::PathBuf;
use terminal::Terminal;
use tsumu::{Evaluation, Job, Result};

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

/// Prints the table; with `--json` or `--out` also as JSON.
pub fn evaluate(args: &EvaluateArgs, terminal: &Terminal, job: &Job) -> Result<()> {
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
