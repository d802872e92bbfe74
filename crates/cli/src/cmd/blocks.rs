//! `tsumu blocks`: what can be named in a catalogue; `tsumu blocks fit`: which of it a survey shows.

use crate::cmd::measured::Measured;
use crate::words;
use clap::{Args, Subcommand};
use serde_json::json;
use std::path::PathBuf;
use terminal::Terminal;
use tsumu::{FitOptions, Job, Result};

/// List the built-in blocks: kind and nominal tonnage, with height and volume.
///
/// Each name is a `shape` of catalog.toml; any other tonnage ("dolos 7t") or size ("cube 1.5m") is taken too. Shapes whose kind
/// ends in -like follow the overall proportions of their namesakes' public drawings. `tsumu blocks fit` tells shape and size
/// from a survey.
#[derive(Debug, Args)]
#[command(args_conflicts_with_subcommands = true)]
pub struct BlocksArgs {
    /// What else can be asked of blocks
    #[command(subcommand)]
    pub command: Option<BlocksCommand>,
}

/// What else can be asked of blocks.
#[derive(Debug, Subcommand)]
pub enum BlocksCommand {
    /// Tell shape and size of the blocks from surveys alone
    Fit(FitArgs),
}

/// Tell shape and size of the blocks from surveys alone.
///
/// Tries each shape in sizes from --from to --to and proposes those that explain the survey, best first, with the standard error
/// of the size and the listed block that is nearest. Takes minutes: --kind, --from and --to make it shorter.
#[derive(Debug, Args)]
pub struct FitArgs {
    /// Surveys: LAS, LAZ, PLY or another format of the guide; several are joined
    #[arg(value_name = "SURVEY", required = true)]
    pub surveys: Vec<PathBuf>,
    /// A built-in kind, as `tsumu blocks` lists it; repeat it for several [default: all of them]
    #[arg(long, value_name = "KIND", conflicts_with = "catalog")]
    pub kind: Vec<String>,
    /// Try the blocks of this catalogue instead, whatever their sizes
    #[arg(long, value_name = "FILE")]
    pub catalog: Option<PathBuf>,
    /// Smallest longest edge, metres
    #[arg(long, value_name = "M", default_value_t = FitOptions::default().least_m)]
    pub from: f32,
    /// Largest longest edge, metres
    #[arg(long, value_name = "M", default_value_t = FitOptions::default().most_m)]
    pub to: f32,
    /// How the cloud was measured
    #[command(flatten)]
    pub measured: Measured,
}

/// Prints the list, or what fits.
pub fn blocks(args: &BlocksArgs, terminal: &Terminal, job: &Job) -> Result<()> {
    match &args.command {
        Some(BlocksCommand::Fit(args)) => fit(args, terminal, job),
        None => {
            list(terminal);
            Ok(())
        }
    }
}

fn fit(args: &FitArgs, terminal: &Terminal, job: &Job) -> Result<()> {
    let options = FitOptions {
        catalog: args.catalog.clone(),
        kinds: args.kind.clone(),
        least_m: args.from,
        most_m: args.to,
    };
    let found = tsumu::fit_blocks(&args.measured.clouds(&args.surveys), &options, job)?;
    terminal.emit("blocks-fit", &found);
    words::fitted(&found, terminal);
    Ok(())
}

fn list(terminal: &Terminal) {
    let all = scene::nominal_blocks();
    let rows: Vec<_> = all
        .iter()
        .map(|b| {
            json!({ "name": b.name(), "kind": b.kind, "nominal_t": b.tonnes,
                    "height_m": b.size_m, "volume_m3": b.volume_m3 })
        })
        .collect();
    terminal.emit("blocks", &rows);
    terminal.say(format!("{:<24}{:>10}{:>12}", "name", "height m", "volume m³"));
    for b in &all {
        terminal.say(format!("{:<24}{:>10.3}{:>12.2}", b.name(), b.size_m, b.volume_m3));
    }
}
