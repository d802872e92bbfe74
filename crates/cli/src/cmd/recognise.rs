//! `tsumu recognise`: pose and type of every block in a cloud.

use crate::cmd::chosen::Chosen;
use crate::cmd::measured::Measured;
use crate::words;
use clap::Args;
use std::path::PathBuf;
use terminal::Terminal;
use tsumu::{Job, RecogniseOptions, RecogniseSummary, Result, Run, Site};

/// Find pose and type of every block in a cloud.
///
/// Leaves recognise/blocks.csv (one row a block), recognise/cloud.laz (the block of every point),
/// recognise/summary.json, segment/cloud.laz, picture.png, config.toml and manifest.json in the folder given with --out.
#[derive(Debug, Args)]
pub struct RecogniseArgs {
    /// Clouds: LAS, LAZ or PLY; several are joined
    #[arg(value_name = "CLOUD", required = true)]
    pub clouds: Vec<PathBuf>,
    /// The block types that may be in the pile
    #[arg(long, value_name = "FILE")]
    pub catalog: PathBuf,
    /// Folder for the results
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// A review.json saved from a report: its decisions stand
    #[arg(long, value_name = "FILE")]
    pub review: Option<PathBuf>,
    /// Also recognise both halves of the clouds and tell how far they agree: repeatability without truth
    #[arg(long)]
    pub self_check: bool,
    /// How the cloud was measured
    #[command(flatten)]
    pub measured: Measured,
    /// Weights and settings
    #[command(flatten)]
    pub chosen: Chosen,
}

/// Recognises and writes.
pub fn recognise(args: &RecogniseArgs, terminal: &Terminal, job: &Job) -> Result<()> {
    let clouds = args.measured.clouds(&args.clouds);
    let (review, settings) = (args.review.as_deref(), args.chosen.settings());
    let site = Site::of_clouds(&clouds, &args.catalog, review, &settings, job)?;
    let run = Run::create(&args.out, &site)?;
    let options = RecogniseOptions { self_check: args.self_check, ..args.chosen.options() };
    let found = site.recognise(&options, job)?;
    words::review(&found, terminal);
    let run = run.keep(&found)?;
    run.picture()?;
    run.seal()?;
    let summary = RecogniseSummary::of(&site.survey, &found, &site.catalog);
    terminal.emit("recognised", &summary);
    words::recognised(&summary, terminal);
    site.size_sentence(&found).iter().for_each(|line| terminal.say(line));
    terminal.say(format!("results: {}", args.out.display()));
    Ok(())
}
