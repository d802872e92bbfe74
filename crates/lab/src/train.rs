//! `tsumu-lab train`: networks from recipes, scenes made while it trains.

use crate::train_placement::{PlacementTraining, train_placement};
use anyhow::{Context, anyhow};
use clap::{Args, Subcommand, ValueEnum};
use geom::SeedTree;
use net::Processor;
use segment::fpcc::FpccConfig;
use segment::loss::LossConfig;
use segment::{NetworkConfig, SegmentModel, Split, TrainConfig};
use std::path::{Path, PathBuf};
use teach::{Blocks, Lessons};
use terminal::Terminal;
use tsumu::{Error, Job, Result};

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
    /// The placement network, on drops that the planner generates and tests itself
    Placement(PlacementTraining),
}

/// The networks that can be trained.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum Architecture {
    /// Graph convolutions on Euclidean neighbours, with votes for the pose centre
    Fpccv2,
    /// Dynamic graph convolutions, embedding and centre score only
    Fpcc,
}

/// `tsumu-lab train segment`.
#[derive(Debug, Args)]
struct SegmentTraining {
    /// Recipe files; scenes are drawn from all of them in turn
    #[arg(required = true, value_name = "RECIPE")]
    recipes: Vec<PathBuf>,
    /// Folder for the model, its curves and checkpoints; an existing one is resumed
    #[arg(long, value_name = "FOLDER")]
    out: PathBuf,
    /// Catalogue, for recipes that name no blocks
    #[arg(long, value_name = "FILE")]
    catalog: Option<PathBuf>,
    /// Optimiser steps: 2000 are a first model, 6000 a good one
    #[arg(long, default_value_t = 6000)]
    steps: u64,
    /// Weights to start from: a model file, a training's folder, or shipped weights by name (`tetrapod`, `any-shape`, `fpcc`);
    /// `shipped`: those that suit the first recipe's blocks
    #[arg(long, value_name = "MODEL")]
    init: Option<PathBuf>,
    /// Which network: ours on the thesis' second backbone, or the thesis' first
    #[arg(long, value_enum, default_value = "fpccv2")]
    network: Architecture,
    /// What the weights are called in messages and manifests [default: the names of the recipes]
    #[arg(long)]
    name: Option<String>,
    /// Seed of scenes, tiles and first weights
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Points of a batch of FPCC; a survey is then looked at in batches of as many
    #[arg(long, value_name = "N", default_value_t = FpccConfig::default().batch_points)]
    batch_points: usize,
    /// Compute on a graphics card through Vulkan; for programs built with `--features gpu`
    #[arg(long)]
    gpu: bool,
    /// The blocks are not their own mirror image: do not train on mirrored piles
    #[arg(long)]
    handed: bool,
    /// Train for blocks of any shape: most piles are of random unions of convex parts of the recipes' sizes, the
    /// others of the recipes' own blocks, cubes and Antifer blocks
    #[arg(long)]
    any_shape: bool,
}

/// Runs the stage.
pub fn train(args: &TrainArgs, terminal: &Terminal, job: &Job) -> Result<()> {
    match &args.network {
        Network::Segment(args) => train_segment(args, terminal, job),
        Network::Placement(args) => train_placement(args, terminal, job),
    }
}

fn train_segment(args: &SegmentTraining, terminal: &Terminal, job: &Job) -> Result<()> {
    let piles: Vec<Lessons> =
        args.recipes.iter().map(|r| lessons(r, args, job)).collect::<Result<_>>()?;
    let init = init(args, &piles)?;
    let root = SeedTree::new(args.seed);
    // One thread makes scenes, the others train; more would take the training's cores.
    let maker =
        rayon::ThreadPoolBuilder::new().num_threads(1).build().context("starting a thread")?;
    let source = |split: Split, index: u64| {
        let seed = root.child(if split == Split::Train { "train" } else { "held out" }, index);
        maker.install(|| piles[(index % piles.len() as u64) as usize].scene(index, seed))
    };
    let config = config(args, &piles)?;
    let seed = root.child("segment", 0);
    let trained = segment::train(&source, &config, init.as_ref(), &args.out, seed, job)
        .map_err(Error::failed)?;
    terminal.say(format!(
        "{} of {} steps; held out: {}. {}",
        trained.steps,
        args.steps,
        held_out(args, &trained),
        args.out.join("model.safetensors").display()
    ));
    whole(trained.steps, args.steps)
}

/// Weights to start from.
fn init(args: &SegmentTraining, piles: &[Lessons]) -> Result<Option<SegmentModel>> {
    match args.init.as_deref() {
        Some(path) if path == Path::new("shipped") => {
            SegmentModel::shipped(piles[0].catalog()).map(Some).map_err(Error::bad_input)
        }
        Some(path) => tsumu::load_weights(path).map(Some),
        None => Ok(None),
    }
}

fn config(args: &SegmentTraining, piles: &[Lessons]) -> Result<TrainConfig> {
    let mut config = TrainConfig { steps: args.steps, mirror: !args.handed, ..Default::default() };
    if let Architecture::Fpcc = args.network {
        config.network = NetworkConfig::Fpcc(FpccConfig {
            batch_points: args.batch_points,
            ..Default::default()
        });
        config.loss = LossConfig::of_the_thesis();
    }
    if args.any_shape {
        // What is learnt is as wide as the shapes seen: more piles, each looked at less often.
        config.steps_per_scene = 8;
        config.scenes_kept = 240;
    }
    if args.gpu {
        config.processor = Processor::Gpu;
        config.processor.device().map_err(Error::bad_input)?;
    }
    config.warmup = config.warmup.min(args.steps / 10);
    let names = || piles.iter().map(Lessons::name).collect::<Vec<_>>().join(", ");
    config.name = args.name.clone().unwrap_or_else(names);
    for shape in piles.iter().flat_map(Lessons::shapes) {
        if !config.shapes.iter().any(|s| s.matches(&shape)) {
            config.shapes.push(shape);
        }
    }
    Ok(config)
}

fn held_out(args: &SegmentTraining, trained: &segment::Trained) -> String {
    let v = &trained.validation;
    match args.network {
        Architecture::Fpccv2 => format!("votes off by {:.3} d_max in the mean", v.offset),
        Architecture::Fpcc => format!("pair loss {:.4}, centre loss {:.4}", v.pair, v.centre),
    }
}

/// A training that was stopped is not done.
pub fn whole(steps: u64, of: u64) -> Result<()> {
    if steps >= of {
        return Ok(());
    }
    Err(Error::stopped(anyhow!("stopped at a checkpoint; the same command goes on from there")))
}

/// A recipe file with the blocks it or the catalogue names.
fn lessons(path: &Path, args: &SegmentTraining, job: &Job) -> Result<Lessons> {
    let inputs = tsumu::read_recipe(path, args.catalog.as_deref(), job)?;
    let blocks = if args.any_shape { Blocks::AnyShape } else { Blocks::Catalog };
    Lessons::new(inputs.recipe, inputs.catalog, blocks).map_err(Error::bad_input)
}
