//! One file a subcommand.

pub mod completions;
pub mod evaluate;
pub mod man;
pub mod plan;
pub mod recognise;
pub mod report;
pub mod reproduce;
pub mod run;
pub mod segment;
pub mod synth;
pub mod synth_dataset;
pub mod synth_site;
pub mod train;
pub mod train_placement;
pub mod verify;

use crate::args::{Command, Options};
use crate::exit::{Exit, OrBadInput};
use crate::progress::Terminal;
use anyhow::Context;

/// Runs the chosen subcommand.
pub fn dispatch(options: &Options, terminal: &Terminal) -> Result<(), Exit> {
    if let Some(threads) = options.output.threads {
        if threads == 0 {
            return Err(Exit::bad_input(anyhow::anyhow!("--threads 0: give at least 1")));
        }
        rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build_global()
            .context("starting threads")
            .or_bad_input()?;
    }
    match &options.command {
        Command::Run(args) => run::run(args, terminal),
        Command::Synth(args) => synth::synth(args, terminal),
        Command::Train(args) => train::train(args, terminal),
        Command::Segment(args) => segment::segment(args, terminal),
        Command::Recognise(args) => recognise::recognise(args, terminal),
        Command::Plan(args) => plan::plan(args, terminal),
        Command::Report(args) => report::report(args, terminal),
        Command::Evaluate(args) => evaluate::evaluate(args, terminal),
        Command::Reproduce(args) => reproduce::reproduce(args, terminal),
        Command::Verify(args) => verify::verify(args, terminal),
        Command::Completions(args) => completions::completions(args),
        Command::Man(args) => man::man(args, terminal),
    }
}
