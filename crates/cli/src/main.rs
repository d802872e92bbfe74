//! `tsumu`: subcommands are the stages of the pipeline, `run` is all of them.
//!
//! The words of a command line become `Options` here and nowhere else; the stages see their own configs.

mod args;
mod cmd;
mod drawings;
mod exit;
mod inputs;
mod kept;
mod outputs;
mod page;
mod progress;
mod result_folder;
mod review;
mod settings;
mod version;
mod weights;

use clap::Parser;
use std::process::ExitCode;

// glibc's allocator returns every tensor to the system: training takes more than twice as long with it.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

fn main() -> ExitCode {
    let options = args::Options::parse();
    let observer = progress::Terminal::new(&options.output);
    match cmd::dispatch(&options, &observer) {
        Ok(()) => ExitCode::SUCCESS,
        Err(exit) => {
            observer.failed(&exit);
            ExitCode::from(exit.code())
        }
    }
}
