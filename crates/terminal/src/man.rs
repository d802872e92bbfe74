//! `tsumu man`: a manual page for the program and one for each subcommand.

use crate::Terminal;
use anyhow::Context;
use clap::{Args, CommandFactory};
use std::path::PathBuf;
use tsumu::Result;

/// Writes tsumu.1, tsumu-run.1, … into a folder.
#[derive(Debug, Args)]
pub struct ManArgs {
    /// Folder for the pages; made when missing
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
}

/// Writes the pages of the command line `C`.
pub fn man<C: CommandFactory>(args: &ManArgs, terminal: &Terminal) -> Result<()> {
    std::fs::create_dir_all(&args.out).with_context(|| args.out.display().to_string())?;
    clap_mangen::generate_to(C::command(), &args.out)
        .with_context(|| args.out.display().to_string())?;
    terminal.say(format!("manual pages: {}", args.out.display()));
    Ok(())
}
