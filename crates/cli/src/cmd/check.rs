//! `tsumu check`: can this site be answered?

use crate::words;
use clap::Args;
use std::path::PathBuf;
use terminal::Terminal;
use tsumu::{Job, Result};

/// Look at a site before it is worked on: everything that is wrong or doubtful, and whether it can be answered.
///
/// Reads every file, and seeks blocks in a part of the surveys to hold their size against the catalogue's. Each complaint is a line with its file, what was read and what to do. The last
/// line says whether the site can be answered; exit status 2 when it cannot. `tsumu run` begins with the same check of the files.
#[derive(Debug, Args)]
pub struct CheckArgs {
    /// Folder with site.toml, its catalogue and surveys
    #[arg(value_name = "SITE_DIR")]
    pub site: PathBuf,
    /// Also write what the surveys and the design look like from above, as a grid in a JSON file
    #[arg(long, value_name = "FILE")]
    pub map: Option<PathBuf>,
}

/// Says all complaints.
pub fn check(args: &CheckArgs, terminal: &Terminal, job: &Job) -> Result<()> {
    let found = tsumu::check(&args.site, job);
    if let Some(file) = &args.map {
        tsumu::write_map(&found, file)?;
    }
    terminal.emit("check", &found);
    words::checked(&found, terminal);
    tsumu::cannot(&found).map_or(Ok(()), Err)
}
