//! `tsumu`: flags → options → calls of the library → words. Subcommands are the stages of the pipeline, `run` is all of them.

mod args;
mod cmd;
mod words;

use args::Command;
use clap::Parser;
use std::process::ExitCode;
use terminal::Terminal;

// glibc's allocator returns every tensor to the system: inference takes much longer with it.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

fn main() -> ExitCode {
    let options = args::Options::parse();
    let terminal = Terminal::new(&options.output);
    terminal::end(&terminal, || dispatch(&options.command, &terminal))
}

fn dispatch(command: &Command, terminal: &Terminal) -> tsumu::Result<()> {
    match command {
        Command::Run(args) => cmd::run::run(args, terminal),
        Command::Segment(args) => cmd::segment::segment(args, terminal),
        Command::Recognise(args) => cmd::recognise::recognise(args, terminal),
        Command::Plan(args) => cmd::plan::plan(args, terminal),
        Command::Report(args) => cmd::report::report(args, terminal),
        Command::Evaluate(args) => cmd::evaluate::evaluate(args, terminal),
        Command::Verify(args) => cmd::verify::verify(args, terminal),
        Command::Synth(args) => cmd::synth::synth(args, terminal),
        Command::Completions(args) => cmd::completions::completions::<args::Options>(args),
        Command::Man(args) => cmd::man::man::<args::Options>(args, terminal),
    }
}
