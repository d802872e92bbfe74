//! `tsumu train`: networks from recipes, scenes made while it trains.

use crate::exit::{Exit, OrBadInput};
use crate::progress::Terminal;
use anyhow::{Context, anyhow};
use clap::{Args, Subcommand};
use geom::SeedTree;
use pipeline::Lessons;
use pipeline::lessons::Blocks;
use segment::{SegmentModel, Split, TrainConfig};
use std::path::{Path, PathBuf};

/// Train.
#[derive(Debug, Args)]
pub struct TrainArgs {
    /// Which network
    #[command(subcommand)]
    network: Network,
}

#[derive(Debug, Subcommand)]
enum Network {
    /// The segmentation network, on piles that the recipes describe
    Segment(SegmentTraining),
}

/// `tsumu train segment`.
#[derive(Debug, Args)]
struct SegmentTraining {
    /// Recipe files; scenes are drawn from all of them in turn
    #[arg(required = true, value_name = "RECIPE")]
    recipes: Vec<PathBuf>,
    /// Folder for the model, its curves and checkpoints; one that exists is gone on with
    #[arg(long, value_name = "FOLDER")]
    out: PathBuf,
    /// Catalogue, for recipes that name no blocks
    #[arg(long, value_name = "FILE")]
    catalog: Option<PathBuf>,
    /// Optimiser steps: 2000 are a first model, 6000 a good one
    #[arg(long, default_value_t = 6000)]
    steps: u64,
    /// Weights to start from: a model file, or `shipped`
    #[arg(long, value_name = "MODEL")]
    init: Option<String>,
    /// Seed of scenes, tiles and first weights
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// The blocks are not their own mirror image: do not train on mirrored piles
    #[arg(long)]
    handed: bool,
    /// Train for blocks of any shape: most piles are of random unions of convex parts of the recipes' sizes, the
    /// others of the recipes' own blocks, cubes and Antifer blocks
    #[arg(long)]
    any_shape: bool,
}

/// Runs the stage.
pub fn train(args: &TrainArgs, terminal: &Terminal) -> Result<(), Exit> {
    match &args.network {
        Network::Segment(args) => train_segment(args, terminal),
    }
}

fn train_segment(args: &SegmentTraining, terminal: &Terminal) -> Result<(), Exit> {
    let piles: Vec<Lessons> = args.recipes.iter().map(|r| lessons(r, args)).collect::<Result<_, _>>().or_bad_input()?;
    let init = match args.init.as_deref() {
        Some("shipped") => Some(SegmentModel::shipped(piles[0].catalog()).or_bad_input()?),
        Some(path) => Some(SegmentModel::load(path.as_ref()).or_bad_input()?),
        None => None,
    };
    let root = SeedTree::new(args.seed);
    // One thread makes scenes, the others train; more would take the training's cores.
    let maker = rayon::ThreadPoolBuilder::new().num_threads(1).build().context("starting a thread")?;
    let source = |split: Split, index: u64| {
        let seed = root.child(if split == Split::Train { "train" } else { "held out" }, index);
        maker.install(|| piles[(index % piles.len() as u64) as usize].scene(index, seed))
    };
    let mut config = TrainConfig { steps: args.steps, mirror: !args.handed, ..Default::default() };
    config.warmup = config.warmup.min(args.steps / 10);
    config.name = piles.iter().map(Lessons::name).collect::<Vec<_>>().join(", ");
    for pile in &piles {
        for shape in pile.shapes() {
            if !config.shapes.iter().any(|s| s.matches(&shape)) {
                config.shapes.push(shape);
            }
        }
    }
    let trained = segment::train(&source, &config, init.as_ref(), &args.out, root.child("segment", 0), terminal)?;
    terminal.say(format!(
        "{} of {} steps; held out: votes off by {:.3} d_max in the mean. {}",
        trained.steps,
        args.steps,
        trained.validation.offset,
        args.out.join("model.safetensors").display()
    ));
    if trained.steps < args.steps {
        return Err(Exit::failed(anyhow!("stopped at a checkpoint; the same command goes on from there")));
    }
    Ok(())
}

/// A recipe file with the blocks it or the catalogue names.
fn lessons(path: &Path, args: &SegmentTraining) -> anyhow::Result<Lessons> {
    let text = std::fs::read_to_string(path).with_context(|| format!("{}", path.display()))?;
    let recipe = synth::Recipe::parse(&text).with_context(|| format!("{}", path.display()))?;
    let (file, spec) = match (&args.catalog, &recipe.catalog) {
        (Some(file), _) => (file.clone(), io::site::load_catalog(file)?),
        (None, Some(spec)) => (path.to_owned(), spec.clone()),
        (None, None) => {
            return Err(anyhow!("{} names no blocks: give --catalog catalog.toml", path.display()));
        }
    };
    let catalog = blocks::catalog(&spec, &io::site::mesh_loader(&file))?;
    let blocks = if args.any_shape { Blocks::AnyShape } else { Blocks::Catalog };
    Ok(Lessons::new(recipe, catalog, blocks)?)
}
