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
    /// Scenes of each set [default: 3, with --quick 1]
    #[arg(long)]
    scenes: Option<u64>,
    /// Seed of the scenes
    #[arg(long, default_value_t = Settings::default().seed)]
    seed: u64,
    /// Optimiser steps of experiments that train [default: 400, with --quick 10]
    #[arg(long)]
    steps: Option<u64>,
    /// Repetitions of plans with other seeds [default: 5, with --quick 1]
    #[arg(long)]
    repeats: Option<u64>,
    /// Part of the full planning site, percent [default: 100, with --quick 10]
    #[arg(long)]
    percent: Option<u64>,
    /// As little as still makes every table, half an hour for `all` on two cores: to see that it runs, not to be quoted
    #[arg(long)]
    quick: bool,
    /// Folder with parts and scenes of others, for `bin-picking` and `bin-weights`: IPAGearShaft.stl, IPARingScrew.stl, XA_A.txt, XA_B.txt, XA_C.txt
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
    let chosen = chosen(args)?;
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
        let from = start.elapsed();
        let bench = Bench { data: bench.data.filter(|_| experiment.takes_data()), ..bench };
        let page = reproduce::page(experiment, &bench).map_err(ended)?;
        let path = args.out.join(format!("{}.md", experiment.name));
        io::atomic::write_bytes(&path, page.as_bytes())?;
        let seconds = (start.elapsed() - from).as_secs_f64();
        terminal.say(format!("{} ({seconds:.0} s)", path.display()));
    }
    Ok(())
}

/// The experiments named. `all` gives a folder of data to those that take it; one named by itself that takes none refuses it.
fn chosen(args: &ReproduceArgs) -> Result<Vec<&'static Experiment>> {
    if args.names == ["all"] {
        return Ok(EXPERIMENTS.iter().collect());
    }
    let chosen = args.names.iter().map(|n| experiment(n)).collect::<Result<Vec<_>>>()?;
    if args.data.is_some() {
        chosen.iter().try_for_each(|e| e.refuse_data()).map_err(ended)?;
    }
    Ok(chosen)
}

fn ended(error: ReproduceError) -> Error {
    if error.is_interruption() {
        Error::stopped(error)
    } else if error.is_bad_input() {
        Error::bad_input(error)
    } else {
        Error::failed(error)
    }
}

fn settings(args: &ReproduceArgs) -> Result<Settings> {
    let base = if args.quick { Settings::quick() } else { Settings::default() };
    let settings = Settings {
        scenes: args.scenes.unwrap_or(base.scenes),
        seed: args.seed,
        steps: args.steps.unwrap_or(base.steps),
        repeats: args.repeats.unwrap_or(base.repeats),
        percent: args.percent.unwrap_or(base.percent),
        ..base
    };
    let Settings { scenes, steps, repeats, percent, .. } = settings;
    let at_least_one = [("scenes", scenes), ("steps", steps), ("repeats", repeats)];
    if let Some((name, _)) = at_least_one.iter().find(|(_, v)| *v == 0) {
        return Err(Error::bad_input(anyhow!("--{name} 0: give at least 1")));
    }
    if !(1..=100).contains(&percent) {
        return Err(Error::bad_input(anyhow!("--percent {percent}: give 1 to 100")));
    }
    Ok(settings)
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

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    #[derive(Parser)]
    struct Line {
        #[command(flatten)]
        args: ReproduceArgs,
    }

    fn chosen_by(words: &[&str]) -> Result<Vec<&'static Experiment>> {
        chosen(&Line::parse_from([&["reproduce"], words].concat()).args)
    }

    #[test]
    fn data_goes_to_those_that_take_it() {
        assert_eq!(chosen_by(&["all", "--data", "d"]).unwrap().len(), EXPERIMENTS.len());
        assert_eq!(chosen_by(&["bin-weights", "--data", "d"]).unwrap().len(), 1);
        let refused = chosen_by(&["bin-weights", "pose-sites", "--data", "d"]).err().unwrap();
        assert_eq!(refused.kind(), tsumu::Kind::BadInput);
        assert!(refused.line().starts_with("--data: pose-sites takes none"), "{}", refused.line());
        assert!(chosen_by(&["nothing"]).err().unwrap().line().contains("bin-picking"));
    }
}
