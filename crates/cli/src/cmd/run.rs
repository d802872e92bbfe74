//! `tsumu run`: all stages for one site.

use crate::cmd::chosen::{Chosen, Planning};
use crate::words;
use anyhow::anyhow;
use clap::Args;
use std::path::PathBuf;
use terminal::Terminal;
use tsumu::{
    Error, Job, PlanOptions, RecogniseOptions, RecogniseSummary, Result, RunOptions, RunSummary,
    Site, WholeRun,
};

/// Everything for one site: segment, recognise, plan, report.
///
/// Checks SITE_DIR as `tsumu check` does, reads its site.toml and leaves a run folder with the recognised blocks, the stacking plan and
/// report.html, which opens by double click. A site without a [design] gives an inventory: all of it but the plan. A run that was interrupted goes on from its last finished part when the
/// same command is given again, and ends as if it had not been.
#[derive(Debug, Args)]
pub struct RunArgs {
    /// Folder with site.toml, its catalogue and surveys
    #[arg(value_name = "SITE_DIR")]
    pub site: PathBuf,
    /// Run folder [default: SITE_DIR/run]
    #[arg(long, value_name = "RUN_DIR")]
    pub out: Option<PathBuf>,
    /// Plan also where no block was recognised: on the surveyed ground
    #[arg(long)]
    pub bare_ground: bool,
    /// Also recognise both halves of the surveys and tell how far they agree: repeatability without truth
    #[arg(long)]
    pub self_check: bool,
    /// How blocks are added
    #[command(flatten)]
    pub planning: Planning,
    /// Weights and settings
    #[command(flatten)]
    pub chosen: Chosen,
}

impl RunArgs {
    fn options(&self) -> RunOptions {
        let proposer = self.planning.placement_model.clone();
        RunOptions {
            recognise: RecogniseOptions { self_check: self.self_check, ..self.chosen.options() },
            plan: PlanOptions { proposer, ..PlanOptions::default() },
        }
    }
}

/// Runs every stage and writes every file.
pub fn run(args: &RunArgs, terminal: &Terminal, job: &Job) -> Result<()> {
    let options = args.options();
    let settings = args.planning.with(args.chosen.settings());
    let site = Site::load_checked(&args.site, &settings, job)?;
    let out = args.out.clone().unwrap_or_else(|| site.run_folder());
    let whole = WholeRun::begin(&site, &out, &options, job)?;
    through(&site, whole, args.bare_ground, terminal)
}

/// The steps of a run that was begun, and what is said of each.
pub fn through(site: &Site, whole: WholeRun, bare_ground: bool, terminal: &Terminal) -> Result<()> {
    let recognition = whole.recognise()?;
    let recognised = RecogniseSummary::of(&site.survey, &recognition, &site.catalog);
    words::review(&recognition, terminal);
    words::recognised(&recognised, terminal);
    site.size_sentence(&recognition).iter().for_each(|line| terminal.say(line));
    let nothing = recognised.recognised_blocks == 0 && !bare_ground;
    let planned = if nothing { None } else { whole.plan(&recognition)? };
    let summary = planned.as_ref().map(|p| p.summary());
    match &summary {
        Some(summary) => {
            site.learned.iter().for_each(|learned| terminal.say(learned.line()));
            words::planned(summary, terminal);
        }
        None if nothing => {}
        None => terminal.say("no [design], so nothing is planned: this is an inventory"),
    }
    let run = whole.finish(&recognition, planned.as_ref())?;
    run.write_timing(&terminal.timing())?;
    let folder = run.root().to_path_buf();
    terminal
        .emit("run", &RunSummary { recognised: &recognised, planned: summary.as_ref(), folder });
    terminal.say(format!("open {}", run.report().display()));
    if nothing {
        return Err(Error::failed(anyhow!(words::nothing_recognised(&recognised))));
    }
    Ok(())
}
