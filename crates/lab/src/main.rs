//! `tsumu-lab`: what makes the program and judges it, and is no part of it: trainings, fits, the method's tables.

mod halve;
mod reproduce;
mod train;
mod train_placement;

use clap::{Parser, Subcommand};
use std::process::ExitCode;
use terminal::{Output, Terminal};

// glibc's allocator returns every tensor to the system: training takes more than twice as long with it.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

/// Train the networks of Tsumu, and make the tables of its method again.
#[derive(Debug, Parser)]
#[command(name = "tsumu-lab", version, long_version = tsumu::version::LONG, propagate_version = true, arg_required_else_help = true)]
struct Options {
    /// How much to say, and to whom
    #[command(flatten)]
    output: Output,
    /// What to do
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Train the networks on synthetic piles
    Train(train::TrainArgs),
    /// Make the method's tables again, on scenes no training has seen
    Reproduce(reproduce::ReproduceArgs),
    /// Write trained weights as they are shipped: 16 bits a number instead of 32
    Halve(halve::HalveArgs),
}

fn main() -> ExitCode {
    let options = Options::parse();
    let terminal = Terminal::new(&options.output);
    terminal::end(&terminal, || {
        let job = terminal.job()?;
        job.install(|| match &options.command {
            Command::Train(args) => train::train(args, &terminal, &job),
            Command::Reproduce(args) => reproduce::reproduce(args, &terminal, &job),
            Command::Halve(args) => halve::halve(args, &terminal),
        })
    })
}
