//! The command line.

use crate::cmd;
use clap::{Parser, Subcommand};
use terminal::Output;

/// Recognise every block of a pile in a survey and plan how to stack more up to a design surface.
///
/// The usual way is `tsumu run SITE`: it reads SITE/site.toml and leaves a run folder with the recognised
/// blocks, the stacking plan and report.html. The other commands are its stages, one at a time.
#[derive(Debug, Parser)]
#[command(name = "tsumu", version, long_version = tsumu::version::LONG, propagate_version = true, arg_required_else_help = true)]
pub struct Options {
    /// How much to say, and to whom
    #[command(flatten)]
    pub output: Output,
    /// What to do
    #[command(subcommand)]
    pub command: Command,
}

/// What makes a site, the stages in the order data passes them, then what serves them.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Write a first site from surveys alone
    Init(cmd::init::InitArgs),
    /// List the built-in blocks
    Blocks(cmd::blocks::BlocksArgs),
    /// Look at a site before it is worked on: all complaints, and whether it can be answered
    Check(cmd::check::CheckArgs),
    /// Everything for one site: segment, recognise, plan, report
    Run(cmd::run::RunArgs),
    /// Cut a large site into tiles, work on them one at a time, merge them into a run
    Tiles(cmd::tiles::TilesArgs),
    /// Label every point of a cloud with the block it belongs to
    Segment(cmd::segment::SegmentArgs),
    /// Find pose and type of every block in a cloud
    Recognise(cmd::recognise::RecogniseArgs),
    /// Plan how many blocks to add, where, in which order and attitude
    Plan(cmd::plan::PlanArgs),
    /// Say which block to place next, from a list of what was placed
    Next(cmd::next::NextArgs),
    /// Plan under other assumptions: crest, slope, block, overflow
    WhatIf(cmd::what_if::WhatIfArgs),
    /// Write the report of a run folder again
    Report(cmd::report::ReportArgs),
    /// Tell what happened to every block between surveys, or what became of a plan
    Compare(cmd::compare::CompareArgs),
    /// Score a result against a truth, also files made by other programs
    Evaluate(cmd::evaluate::EvaluateArgs),
    /// Check that no file of a run folder has changed since it was written
    Verify(cmd::verify::VerifyArgs),
    /// Sign a finished run, so that changes can be told by whoever has the public key
    Sign(cmd::sign::SignArgs),
    /// Stay and answer: one cloud of a bin in, its parts out in the order in which to take them
    ServeBin(cmd::serve_bin::ServeBinArgs),
    /// Make synthetic piles with known truth, scanned like a survey
    Synth(cmd::synth::SynthArgs),
    /// Open the page: the same work in the browser, without a command line
    Open(cmd::open::OpenArgs),
    /// Print the completion script of a shell
    Completions(terminal::CompletionsArgs),
    /// Write the manual pages
    Man(terminal::ManArgs),
}
