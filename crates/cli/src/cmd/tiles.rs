//! `tsumu tiles`: a large site cut into tiles, worked on in any order and anywhere, merged without a seam.

use crate::cmd::run::through;
use clap::{Args, Subcommand};
use scene::MemoryBound;
use std::path::{Path, PathBuf};
use terminal::Terminal;
use tsumu::{
    Job, RecogniseOptions, Result, RunOptions, Settings, TileOptions, TilePlan, TileRequest,
    TiledSite, WholeRun,
};

/// Cut a large site into tiles, work on them one at a time, merge them into a run
///
/// `plan` cuts, `run` works on one tile (as often and in as many processes as you like), `status` says what is missing, `merge` makes the run
/// folder. `tsumu run` does all of it by itself on one machine; these are for clusters and for sites that do not fit.
#[derive(Debug, Args)]
pub struct TilesArgs {
    /// What to do
    #[command(subcommand)]
    pub step: Step,
}

/// The steps, in order.
#[derive(Debug, Subcommand)]
pub enum Step {
    /// Read the surveys once, cut them into tiles, and estimate what every tile must know of the whole
    Plan(PlanArgs),
    /// Work on one tile, unless it is done. Ends with 75 when another try is worth it
    Run(RunArgs),
    /// Say which tiles are done, which are missing, and what is wrong with the others
    Status(StatusArgs),
    /// Merge all tiles into a run folder, then plan, report and exports of the whole
    Merge(MergeArgs),
}

/// `tsumu tiles plan`.
#[derive(Debug, Args)]
pub struct PlanArgs {
    /// Folder with site.toml, its catalogue and surveys
    #[arg(value_name = "SITE_DIR")]
    pub site: PathBuf,
    /// Folder for the plan, where all who work on it see it
    #[arg(long, value_name = "PLAN")]
    pub out: PathBuf,
    /// About so many blocks a tile has at most
    #[arg(long, value_name = "N", default_value_t = TileOptions::default().blocks)]
    pub blocks_per_tile: u64,
    /// How far a tile sees beyond what it owns, in lengths of the largest block
    #[arg(long, value_name = "LENGTHS", default_value_t = TileOptions::default().halo)]
    pub halo: f64,
    /// Memory that working on a tile may need, e.g. 2GB
    #[arg(long, value_name = "SIZE", default_value_t = TileOptions::default().memory)]
    pub memory: MemoryBound,
    /// A TOML file whose settings count before the site's, or config.toml of a run
    #[arg(long, value_name = "FILE")]
    pub config: Option<PathBuf>,
    /// Folder or weights file of `tsumu-lab train segment`, or shipped weights by name
    #[arg(long, value_name = "MODEL")]
    pub model: Option<PathBuf>,
    /// Root of all random choices [default: the site's]
    #[arg(long)]
    pub seed: Option<u64>,
}

/// `tsumu tiles run`.
#[derive(Debug, Args)]
pub struct RunArgs {
    /// Folder of the plan
    #[arg(value_name = "PLAN")]
    pub plan: PathBuf,
    /// Number of the tile, from 0 [default: what the scheduler says in SLURM_ARRAY_TASK_ID, JOB_COMPLETION_INDEX or
    /// AWS_BATCH_JOB_ARRAY_INDEX]
    #[arg(long, value_name = "I", conflicts_with = "key")]
    pub index: Option<usize>,
    /// Name of the tile
    #[arg(long)]
    pub key: Option<String>,
    /// Refuse a tile that needs more memory, e.g. 2GB
    #[arg(long, value_name = "SIZE")]
    pub memory: Option<MemoryBound>,
    /// The site folder, when it is not where the plan was made
    #[arg(long, value_name = "SITE_DIR")]
    pub site: Option<PathBuf>,
}

/// `tsumu tiles status`.
#[derive(Debug, Args)]
pub struct StatusArgs {
    /// Folder of the plan
    #[arg(value_name = "PLAN")]
    pub plan: PathBuf,
}

/// `tsumu tiles merge`.
#[derive(Debug, Args)]
pub struct MergeArgs {
    /// Folder of the plan
    #[arg(value_name = "PLAN")]
    pub plan: PathBuf,
    /// Run folder
    #[arg(long, value_name = "RUN_DIR")]
    pub out: PathBuf,
    /// The site folder, when it is not where the plan was made
    #[arg(long, value_name = "SITE_DIR")]
    pub site: Option<PathBuf>,
}

/// One step.
pub fn tiles(args: &TilesArgs, terminal: &Terminal, job: &Job) -> Result<()> {
    match &args.step {
        Step::Plan(args) => plan(args, terminal, job),
        Step::Run(args) => run(args, terminal, job),
        Step::Status(args) => status(&args.plan, terminal),
        Step::Merge(args) => merge(args, terminal, job),
    }
}

fn plan(args: &PlanArgs, terminal: &Terminal, job: &Job) -> Result<()> {
    tsumu::check_first(&args.site, job)?;
    let what = TiledSite {
        settings: Settings { file: args.config.clone(), seed: args.seed, ..Settings::default() },
        recognise: RecogniseOptions { weights: args.model.clone(), ..RecogniseOptions::default() },
        tiles: TileOptions { blocks: args.blocks_per_tile, halo: args.halo, memory: args.memory },
    };
    let plan = TilePlan::make(&args.site, &args.out, &what, job)?;
    terminal.emit("tiles", &plan.tiles());
    let points: u64 = plan.tiles().iter().map(|t| t.points).sum();
    terminal.say(format!(
        "{} tiles for {points} points, each within {:.1} GB: {}",
        plan.tiles().len(),
        plan.largest_bytes() as f64 / 1e9,
        args.out.display()
    ));
    Ok(())
}

fn run(args: &RunArgs, terminal: &Terminal, job: &Job) -> Result<()> {
    let plan = TilePlan::open(&args.plan)?;
    let key = match (&args.key, args.index) {
        (Some(key), _) => key.clone(),
        (None, Some(index)) => plan.tile_at(index)?.key.clone(),
        (None, None) => plan.tile_of_job(|name| std::env::var(name).ok())?.key.clone(),
    };
    let request = TileRequest { site: args.site.clone(), memory: args.memory };
    let done = plan.work_on(&key, &request, job)?;
    terminal.emit("tile", &done);
    let how = if done.kept { "was done already" } else { "done" };
    terminal.say(format!("tile {key} {how}: it tells of {} blocks", done.blocks));
    Ok(())
}

fn status(plan: &Path, terminal: &Terminal) -> Result<()> {
    let status = TilePlan::open(plan)?.status()?;
    terminal.emit("status", &status);
    terminal.say(format!(
        "{} of {} tiles done, {} missing, {} wrong",
        status.done.len(),
        status.tiles,
        status.missing.len(),
        status.wrong.len()
    ));
    status.missing.iter().for_each(|key| terminal.say(format!("missing: {key}")));
    status.wrong.iter().for_each(|line| terminal.say(format!("wrong: {line}")));
    Ok(())
}

fn merge(args: &MergeArgs, terminal: &Terminal, job: &Job) -> Result<()> {
    let plan = TilePlan::open(&args.plan)?;
    let site = plan.load_site(args.site.as_deref(), job)?;
    let options = RunOptions::default();
    let whole = WholeRun::of_tiles(&plan, &site, &args.out, &options, job)?;
    through(&site, whole, false, terminal)
}
