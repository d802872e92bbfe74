//! `tsumu reproduce`: the method's tables on held-out scenes, one Markdown page an experiment.

use crate::exit::{Exit, OrBadInput};
use crate::progress::Terminal;
use crate::weights;
use anyhow::{Context, anyhow};
use clap::Args;
use reproduce::{Bench, EXPERIMENTS, Experiment, Settings};
use std::path::PathBuf;
use std::time::Instant;

/// Make the method's tables again, on scenes no training has seen.
///
/// Without a name it lists the experiments. Each leaves FOLDER/NAME.md with its table, seeds and the hash of the
/// weights. Experiments that train keep their trainings beside the page and go on with them when stopped.
#[derive(Debug, Args)]
pub struct ReproduceArgs {
    /// Experiments to run, or `all`
    #[arg(value_name = "NAME")]
    names: Vec<String>,
    /// Folder for the pages
    #[arg(long, value_name = "FOLDER", default_value = "reproduced")]
    out: PathBuf,
    /// Scenes of each set
    #[arg(long, default_value_t = Settings::default().scenes)]
    scenes: u64,
    /// Seed of the scenes
    #[arg(long, default_value_t = Settings::default().seed)]
    seed: u64,
    /// Optimiser steps of experiments that train
    #[arg(long, default_value_t = Settings::default().steps)]
    steps: u64,
    /// Repetitions of plans with other seeds
    #[arg(long, default_value_t = Settings::default().repeats)]
    repeats: u64,
    /// Part of the full planning site, percent
    #[arg(long, default_value_t = Settings::default().percent)]
    percent: u64,
    /// As little as still makes every table: to see that it runs, not to be quoted
    #[arg(long)]
    quick: bool,
    /// Folder with parts and scenes of others, for `bin-picking`: IPAGearShaft.stl, IPARingScrew.stl, XA_A.txt, XA_B.txt, XA_C.txt
    #[arg(long, value_name = "FOLDER")]
    data: Option<PathBuf>,
    /// Weights to judge [default: the shipped ones]
    #[arg(long, value_name = "MODEL")]
    model: Option<PathBuf>,
}

/// Runs the experiments one after the other.
pub fn reproduce(args: &ReproduceArgs, terminal: &Terminal) -> Result<(), Exit> {
    if args.names.is_empty() {
        for e in EXPERIMENTS {
            terminal.say(format!("{:<26}{}", e.name, e.about));
        }
        return Ok(());
    }
    let chosen = if args.names == ["all"] {
        EXPERIMENTS.iter().collect()
    } else {
        args.names.iter().map(|n| experiment(n)).collect::<Result<Vec<_>, _>>()?
    };
    let at_least_one = [("scenes", args.scenes), ("steps", args.steps), ("repeats", args.repeats)];
    if let Some((name, _)) = at_least_one.iter().find(|(_, v)| *v == 0) {
        return Err(Exit::bad_input(anyhow!("--{name} 0: give at least 1")));
    }
    if !(1..=100).contains(&args.percent) {
        return Err(Exit::bad_input(anyhow!("--percent {}: give 1 to 100", args.percent)));
    }
    let model = match &args.model {
        Some(path) => Some(weights::load(path)?),
        None => None,
    };
    let settings = Settings {
        scenes: args.scenes,
        seed: args.seed,
        steps: args.steps,
        repeats: args.repeats,
        percent: args.percent,
        quick: args.quick,
    };
    std::fs::create_dir_all(&args.out)
        .with_context(|| args.out.display().to_string())
        .or_bad_input()?;
    let start = Instant::now();
    let clock = || start.elapsed().as_secs_f64();
    let bench = Bench {
        settings: &settings,
        model: model.as_ref(),
        data: args.data.as_deref(),
        folder: &args.out,
        clock: &clock,
        observer: terminal,
    };
    for experiment in chosen {
        let page = reproduce::page(experiment, &bench)?;
        let path = args.out.join(format!("{}.md", experiment.name));
        io::atomic::write_bytes(&path, page.as_bytes())?;
        terminal.say(format!("{}", path.display()));
    }
    Ok(())
}

fn experiment(name: &str) -> Result<&'static Experiment, Exit> {
    reproduce::find(name).ok_or_else(|| {
        let names: Vec<&str> = EXPERIMENTS.iter().map(|e| e.name).collect();
        Exit::bad_input(anyhow!("no experiment is called `{name}`: there are {}", names.join(", ")))
    })
}
