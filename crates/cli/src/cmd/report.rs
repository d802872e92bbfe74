//! `tsumu report`: the report of a run folder, again.

use clap::Args;
use std::path::PathBuf;
use terminal::Terminal;
use tsumu::{Job, Result, Run, Site};

/// Write the report of a run folder again.
///
/// Reads recognise/ and plan/ of the run, and the site's survey and design; useful after blocks.csv was corrected.
#[derive(Debug, Args)]
pub struct ReportArgs {
    /// The run folder
    #[arg(value_name = "RUN_DIR")]
    pub run: PathBuf,
    /// The HTML file [default: RUN_DIR/report.html]
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    /// The site folder, when the run does not lie in it
    #[arg(long, value_name = "SITE_DIR")]
    pub site: Option<PathBuf>,
}

/// Reads a run and writes its page.
pub fn report(args: &ReportArgs, terminal: &Terminal, job: &Job) -> Result<()> {
    let folder = Site::folder_of_run(&args.run, args.site.as_deref())?;
    let site = Run::settled(&args.run, Site::load(&folder, job)?, job)?;
    let run = Run::open(&args.run, &site)?;
    let page = run.report(&site, job)?;
    let out = match &args.out {
        Some(out) => page.write_html(out).map(|()| out.clone())?,
        None => run.put_report(&page)?,
    };
    terminal.say(format!("open {}", out.display()));
    Ok(())
}
