//! `cargo xtask check | bench | fit | fuzz | reproducible | package | release`: the project's own chores, in the language of the project.

mod bench;
mod check;
mod citations;
mod deb;
mod fit;
mod fuzz;
mod package;
mod process;
mod release;
mod reproducible;
mod trust;

use anyhow::{Result, bail};
use std::path::PathBuf;
use std::process::ExitCode;

const USAGE: &str = "\
cargo xtask check [--strict] [STEP...]   all that must pass before a change lands, or some steps of it
cargo xtask check --list                 the steps and their commands
cargo xtask bench kernels [FILTER]       times of the eight kernels (benches/)
cargo xtask bench sites OUT [--scenes N] [--seed SEED] [--white-noise]
                                         recognition on held-out piles of the six site-sensor sets
cargo xtask bench trust OUT [--seeds S,…] [--only CONDITION,…] [--shapes SHAPE,…] [--data DIR] [--check]
                                         recognition on piles of another engine, in bins and on real clouds
cargo xtask fit [NAME [OUT]]             fits a fitted vector anew; without a name, what there is to fit
cargo xtask fuzz [TARGET SECONDS [FOLDER]]
                                         libFuzzer over readers, sites and runs; without a target, which there are
cargo xtask reproducible [--profile P] [PACKAGE PROGRAM]
                                         the program built twice at two places: the same bytes
cargo xtask package [--profile P] [TARGET...]
                                         archives, Debian package, components, notes and checksums of this tree
cargo xtask release [--dry-run | TARGET...]
                                         the same for a version that is ready, after all checks";

/// The repository's folder.
fn root() -> PathBuf {
    PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/.."))
}

fn main() -> ExitCode {
    let args: Vec<String> = std::env::args().skip(1).collect();
    match run(&args) {
        Ok(code) => code,
        Err(error) => {
            eprintln!("xtask: {error:#}");
            ExitCode::FAILURE
        }
    }
}

fn run(args: &[String]) -> Result<ExitCode> {
    let words: Vec<&str> = args.iter().map(String::as_str).collect();
    match words.as_slice() {
        ["check", rest @ ..] => return check::check(rest),
        ["bench", rest @ ..] => bench::bench(rest)?,
        ["fit", rest @ ..] => fit::fit(rest)?,
        ["fuzz", rest @ ..] => fuzz::fuzz(rest)?,
        ["reproducible", rest @ ..] => reproducible::reproducible(rest)?,
        ["package", rest @ ..] => package::package(rest, &release::version()?)?,
        ["release", rest @ ..] => release::release(rest)?,
        [] | ["--help" | "-h" | "help"] => println!("{USAGE}"),
        [other, ..] => bail!("there is no chore `{other}`\n{USAGE}"),
    }
    Ok(ExitCode::SUCCESS)
}
