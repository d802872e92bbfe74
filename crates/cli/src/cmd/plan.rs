//! `tsumu plan`: how many blocks to add, where, in which order and attitude.

use crate::cmd::chosen::{Laid, OfRun, Planning};
use crate::words;
use clap::Args;
use std::path::PathBuf;
use terminal::Terminal;
use tsumu::{Job, PlanOptions, Result, Run, Settings, Site};

/// Plan how many blocks to add, where, in which order and attitude.
///
/// Takes the recognised blocks of a run (or of a site's run folder) and the site's design surface.
/// Leaves plan/placements.csv, plan/summary.json, config.toml and manifest.json in the folder given with --out.
#[derive(Debug, Args)]
pub struct PlanArgs {
    /// The run and its site
    #[command(flatten)]
    pub of: OfRun,
    /// Folder for the plan
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// Plan on from this placements.csv (or the folder of a plan): what still holds of it is kept
    #[arg(long, value_name = "PLAN")]
    pub from: Option<PathBuf>,
    /// Improve the plan: so many times for each block it is lifted and its surroundings are filled anew [default: 0]
    #[arg(long, value_name = "PASSES")]
    pub improve: Option<f32>,
    /// Make three plans to choose from as well: fewest blocks, fullest, most stable (plan/choices.csv)
    #[arg(long)]
    pub choices: bool,
    /// How blocks are added
    #[command(flatten)]
    pub planning: Planning,
    /// Settings over the site's
    #[command(flatten)]
    pub laid: Laid,
}

/// Plans and writes.
pub fn plan(args: &PlanArgs, terminal: &Terminal, job: &Job) -> Result<()> {
    let (folder, run) = args.of.folders()?;
    let settings = Settings { improve: args.improve, ..args.planning.with(args.laid.settings()) };
    let site = Site::load_with(&folder, &settings, job)?;
    site.needed_design()?;
    let found = Run::open_recognition(run.root(), &site, job)?;
    let previous = args.from.as_deref().map(|from| site.read_plan(from)).transpose()?;
    let mut new = Run::create(&args.out, &site)?;
    new.note_source(&run, args.from.as_deref())?;
    let proposer = args.planning.placement_model.clone();
    let options = PlanOptions { proposer, previous, choices: args.choices };
    let planned = site.plan(&found, &options, job)?;
    let run = new.keep(&planned)?.seal()?;
    let summary = planned.summary();
    terminal.emit("planned", &summary);
    site.learned.iter().for_each(|learned| terminal.say(learned.line()));
    words::planned(&summary, terminal);
    words::choices(&planned.choices, terminal);
    if let Some(previous) = &options.previous {
        words::against_earlier(&planned.plan, previous, terminal);
    }
    terminal.say(format!("plan: {}", run.placements().display()));
    Ok(())
}
