//! `tsumu compare`: what happened to every block between two surveys, or to a plan.

use crate::words;
use clap::Args;
use std::path::PathBuf;
use terminal::Terminal;
use tsumu::{CompareOptions, Compared, ComparisonFolder, EpochRun, Job, Result};

/// Tell what happened to every block between surveys, or what became of a plan.
///
/// Each epoch is a run folder inside its site, or a site folder: its run is taken, and a site without one is recognised
/// first. Leaves changes.csv, changes.geojson, changes.gpkg, cloud.laz, registration.json, summary.json and report.html.
/// Of more than two epochs all but changes.gpkg, which holds every one, are about the last two.
#[derive(Debug, Args)]
pub struct CompareArgs {
    /// Runs or sites in order of time, the earliest first; with --plan the later one alone
    #[arg(value_name = "EPOCH", required = true, num_args = 1..)]
    pub epochs: Vec<PathBuf>,
    /// Folder for the comparison; an earlier comparison in it is replaced
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// Settings over the method's: a TOML file with tables [compare.…] and [spans], grades in [spans.grades]
    #[arg(long, value_name = "FILE")]
    pub config: Option<PathBuf>,
    /// Leave the coordinates as they are, without registration
    #[arg(long)]
    pub fixed: bool,
    /// Ground that does not move, such as the crown wall: polygons of a GeoJSON file in site coordinates
    #[arg(long, value_name = "FILE")]
    pub stable: Option<PathBuf>,
    /// A run whose plan was built since: each planned block is held against the later survey
    #[arg(long, value_name = "RUN")]
    pub plan: Option<PathBuf>,
}

/// Compares and writes.
pub fn compare(args: &CompareArgs, terminal: &Terminal, job: &Job) -> Result<()> {
    let options = options(args)?;
    let folder = ComparisonFolder::begin(&args.out)?;
    let paths = args.plan.iter().chain(&args.epochs);
    let opened = paths.map(|path| EpochRun::open(path, &options.recognise, job));
    let epochs = opened.collect::<Result<Vec<_>>>()?;
    let epochs: Vec<&EpochRun> = epochs.iter().collect();
    folder.is_none_of(&epochs)?;
    let found = compared(args, &epochs, &options, job)?;
    let place = found.write(folder, &options)?;
    terminal.emit("compared", &found.summary());
    words::compared(&found, terminal);
    terminal.say(format!("comparison: {}", place.display()));
    Ok(())
}

fn options(args: &CompareArgs) -> Result<CompareOptions> {
    let mut options = CompareOptions::default();
    if let Some(file) = &args.config {
        options.read_config(file)?;
    }
    options.config.registration.fixed |= args.fixed;
    if let Some(file) = &args.stable {
        options.stable = tsumu::read_stable_ground(file)?;
    }
    Ok(options)
}

fn compared<'a>(
    args: &CompareArgs,
    epochs: &[&'a EpochRun],
    options: &CompareOptions,
    job: &Job,
) -> Result<Compared<'a>> {
    match (&args.plan, epochs) {
        (Some(_), &[planned, later]) => tsumu::compare_with_plan(planned, later, options, job),
        (Some(_), _) => Err(tsumu::Error::bad_input(anyhow::anyhow!(
            "--plan RUN is held against one later survey; give one"
        ))),
        (None, epochs) => tsumu::compare_series(epochs, options, job),
    }
}
