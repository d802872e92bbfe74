//! `tsumu-lab reproduce`: the method's tables on held-out scenes, one Markdown page an experiment.

use anyhow::{Context, anyhow};
use clap::Args;
use reproduce::{Bench, EXPERIMENTS, Experiment, ReproduceError, Settings};
use std::path::PathBuf;
use std::time::Instant;
use terminal::Terminal;
use tsumu::{Error, Job, Result};

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
pub fn reproduce(args: &ReproduceArgs, terminal: &Terminal, job: &Job) -> Result<()> {
    if args.names.is_empty() {
        EXPERIMENTS.iter().for_each(|e| terminal.say(format!("{:<26}{}", e.name, e.about)));
        return Ok(());
    }
    let chosen = if args.names == ["all"] {
        EXPERIMENTS.iter().collect()
    } else {
        args.names.iter().map(|n| experiment(n)).collect::<Result<Vec<_>>>()?
    };
    let settings = settings(args)?;
    let model = args.model.as_deref().map(tsumu::load_weights).transpose()?;
    std::fs::create_dir_all(&args.out)
        .with_context(|| args.out.display().to_string())
        .map_err(Error::bad_input)?;
    let start = Instant::now();
    let bench = Bench {
        settings: &settings,
        model: model.as_ref(),
        data: args.data.as_deref(),
        folder: &args.out,
        clock: &|| start.elapsed().as_secs_f64(),
        observer: job,
    };
    for experiment in chosen {
        let page = reproduce::page(experiment, &bench).map_err(ended)?;
        let path = args.out.join(format!("{}.md", experiment.name));
        io::atomic::write_bytes(&path, page.as_bytes())?;
        terminal.say(format!("{}", path.display()));
    }
    Ok(())
}

fn ended(error: ReproduceError) -> Error {
    if matches!(error, ReproduceError::Stopped) {
        Error::stopped(error)
    } else {
        Error::failed(error)
    }
}

fn settings(args: &ReproduceArgs) -> Result<Settings> {
    let at_least_one = [("scenes", args.scenes), ("steps", args.steps), ("repeats", args.repeats)];
    if let Some((name, _)) = at_least_one.iter().find(|(_, v)| *v == 0) {
        return Err(Error::bad_input(anyhow!("--{name} 0: give at least 1")));
    }
    if !(1..=100).contains(&args.percent) {
        return Err(Error::bad_input(anyhow!("--percent {}: give 1 to 100", args.percent)));
    }
    let ReproduceArgs { scenes, seed, steps, repeats, percent, quick, .. } = *args;
    Ok(Settings { scenes, seed, steps, repeats, percent, quick })
}

fn experiment(name: &str) -> Result<&'static Experiment> {
    reproduce::find(name).ok_or_else(|| {
        let names: Vec<&str> = EXPERIMENTS.iter().map(|e| e.name).collect();
        Error::bad_input(anyhow!(
            "no experiment is called `{name}`: there are {}",
            names.join(", ")
        ))
    })
}
