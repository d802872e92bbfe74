//! `tsumu next`: the next block to place, from a list of what was placed.

use crate::cmd::chosen::OfRun;
use crate::words;
use clap::Args;
use serde_json::json;
use std::path::PathBuf;
use terminal::Terminal;
use tsumu::{Job, Result};

/// Say which block to place next when those placed so far do not stand quite as planned.
///
/// Takes the run with its blocks, its plan and as_placed.csv (order, x_m, y_m, rest_level_m of each block's centre as in plan/lifts.csv; qw qx qy qz
/// where the attitude was measured). The next blocks are told as planned where they still come to rest so, else in the best pose at
/// that place; the rest of the plan stays.
#[derive(Debug, Args)]
pub struct NextArgs {
    /// The run and its site
    #[command(flatten)]
    pub of: OfRun,
    /// What was placed
    #[arg(long, value_name = "FILE")]
    pub placed: PathBuf,
    /// The plan that is built (placements.csv, or the folder of a plan) [default: that of the run]
    #[arg(long, value_name = "PLAN")]
    pub plan: Option<PathBuf>,
    /// How many blocks to say
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    pub count: u32,
    /// Write them in the columns of placements.csv as well
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
}

/// Looks and says.
pub fn next(args: &NextArgs, terminal: &Terminal, job: &Job) -> Result<()> {
    let (site, run, found) = args.of.opened(job)?;
    let plan = site.read_plan(args.plan.as_deref().unwrap_or(run.root()))?;
    let (lifts, rows) = site.next(&found, &plan, &args.placed, args.count as usize, job)?;
    if let Some(file) = &args.out {
        site.write_placements(file, &rows)?;
    }
    terminal.emit("next", &json!({ "blocks": lifts }));
    words::next(&lifts, terminal);
    Ok(())
}
