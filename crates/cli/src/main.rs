//! `tsumu`: flags → options → calls of the library → words. Subcommands are the stages of the pipeline, `run` is all of them.

mod args;
mod cmd;
mod words;

use args::Command;
use clap::Parser;
use std::process::ExitCode;
use terminal::Terminal;
use tsumu::Job;

// glibc's allocator returns every tensor to the system: inference takes much longer with it.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

fn main() -> ExitCode {
    let options = args::Options::parse_from(terminal::arguments());
    let terminal = Terminal::new(&options.output);
    terminal::end(&terminal, || {
        let job = terminal.job()?;
        job.install(|| dispatch(&options.command, &terminal, &job))
    })
}

fn dispatch(command: &Command, terminal: &Terminal, job: &Job) -> tsumu::Result<()> {
    match command {
        Command::Init(args) => cmd::init::init(args, terminal, job),
        Command::Blocks(args) => cmd::blocks::blocks(args, terminal, job),
        Command::Check(args) => cmd::check::check(args, terminal, job),
        Command::Run(args) => cmd::run::run(args, terminal, job),
        Command::Tiles(args) => cmd::tiles::tiles(args, terminal, job),
        Command::Segment(args) => cmd::segment::segment(args, terminal, job),
        Command::Recognise(args) => cmd::recognise::recognise(args, terminal, job),
        Command::Plan(args) => cmd::plan::plan(args, terminal, job),
        Command::Next(args) => cmd::next::next(args, terminal, job),
        Command::WhatIf(args) => cmd::what_if::what_if(args, terminal, job),
        Command::Report(args) => cmd::report::report(args, terminal, job),
        Command::Compare(args) => cmd::compare::compare(args, terminal, job),
        Command::Evaluate(args) => cmd::evaluate::evaluate(args, terminal, job),
        Command::Verify(args) => cmd::verify::verify(args, terminal),
        Command::Sign(args) => cmd::sign::sign(args, terminal),
        Command::ServeBin(args) => cmd::serve_bin::serve_bin(args, terminal, job),
        Command::Synth(args) => cmd::synth::synth(args, terminal, job),
        Command::Open(args) => cmd::open::open(args, terminal, job),
        Command::Completions(args) => terminal::completions::<args::Options>(args),
        Command::Man(args) => terminal::man::<args::Options>(args, terminal),
    }
}
