//! `tsumu what-if`: the plan under other assumptions.

use crate::cmd::chosen::OfRun;
use crate::words;
use clap::Args;
use serde_json::json;
use std::path::PathBuf;
use terminal::Terminal;
use tsumu::{Job, Result, WhatIf};

/// Plan with another crest, slope, block or overflow threshold, every combination, into one table.
///
/// Takes the recognised blocks of a run and leaves what_if.csv in the folder given with --out, row by row: an interrupted table is gone
/// on with when the same command is given again. Lists are separated by commas; what is not listed stays as the site has it.
#[derive(Debug, Args)]
pub struct WhatIfArgs {
    /// The run and its site
    #[command(flatten)]
    pub of: OfRun,
    /// Folder for the table
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// How much higher the design is, m (of a section its crest)
    #[arg(long, value_name = "M,…", value_delimiter = ',', allow_hyphen_values = true)]
    pub raise: Vec<f64>,
    /// Slopes on both sides, 1 vertical to so much horizontal
    #[arg(long, value_name = "M,…", value_delimiter = ',')]
    pub slope: Vec<f64>,
    /// Types to place, one at a time
    #[arg(long, value_name = "NAME,…", value_delimiter = ',')]
    pub block: Vec<String>,
    /// Overflow thresholds f, m
    #[arg(long, value_name = "M,…", value_delimiter = ',')]
    pub overflow: Vec<f32>,
}

/// Plans and says.
pub fn what_if(args: &WhatIfArgs, terminal: &Terminal, job: &Job) -> Result<()> {
    let (site, _, found) = args.of.opened(job)?;
    let what_if = WhatIf {
        raise_m: args.raise.clone(),
        slope_m: args.slope.clone(),
        block: args.block.clone(),
        overflow_m: args.overflow.clone(),
    };
    words::what_if_head(terminal);
    site.what_if(&found, &what_if, &args.out, job, |row, kept| {
        let value = json!({ "assumed": row.assumed, "figures": row.figures, "kept": kept });
        terminal.emit("what-if", &value);
        words::what_if(row, terminal);
    })?;
    terminal.say(format!("table: {}", args.out.join("what_if.csv").display()));
    Ok(())
}
