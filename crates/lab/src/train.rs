//! `tsumu-lab train`: networks from recipes, scenes made while it trains.

use crate::train_placement::{PlacementTraining, train_placement};
use anyhow::{Context, anyhow};
use clap::{Args, Subcommand, ValueEnum};
use geom::SeedTree;
use net::Processor;
use segment::train_table::TrainedNetwork;
use segment::{NetworkConfig, SegmentModel, Split, TrainConfig, TrainTable};
use std::path::{Path, PathBuf};
use teach::{Blocks, TrainingScenes};
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
    /// Sparse convolutions on voxels, with votes for the pose centre
    SparseUnet,
}

impl Architecture {
    fn trained(self) -> TrainedNetwork {
        match self {
            Self::Fpccv2 => TrainedNetwork::Fpccv2,
            Self::Fpcc => TrainedNetwork::Fpcc,
            Self::SparseUnet => TrainedNetwork::SparseUnet,
        }
    }
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
    /// Optimiser steps: 2000 are a first model, 6000 a good one [default: the recipe's, or 6000]
    #[arg(long)]
    steps: Option<u64>,
    /// Weights to start from: a model file, a training's folder, or shipped weights by name (`tetrapod`, `bin-parts`, `any-shape`, `fpcc`);
    /// `shipped`: those that suit the first recipe's blocks
    #[arg(long, value_name = "MODEL")]
    init: Option<PathBuf>,
    /// Which network: ours on the thesis' second backbone, the thesis' first, or the sparse U-Net [default: the recipe's, or fpccv2]
    #[arg(long, value_enum)]
    network: Option<Architecture>,
    /// A key of the recipe's [train] table, counted before it: loss, valid_distance, attention, alpha, beta, epsilon_same,
    /// epsilon_other, rate, warmup, decay, batch, points, neighbours, dilation, edge, level, out
    #[arg(long = "set", value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Train by the thesis' letter: loss summed over every pair, 4096 points, rate 0.0001; needs many more steps
    #[arg(long)]
    thesis: bool,
    /// What the weights are called in messages and manifests [default: the names of the recipes]
    #[arg(long)]
    name: Option<String>,
    /// Seed of scenes, tiles and first weights
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Points of a batch of FPCC, by which a survey is then looked at, or of a tile [default: the recipe's, or the network's]
    #[arg(long, value_name = "N")]
    batch_points: Option<usize>,
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
    let piles: Vec<TrainingScenes> =
        args.recipes.iter().map(|r| training_scenes(r, args, job)).collect::<Result<_>>()?;
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
        config.steps,
        held_out(&config, &trained),
        args.out.join("model.safetensors").display()
    ));
    whole(trained.steps, config.steps)
}

/// Weights to start from.
fn init(args: &SegmentTraining, piles: &[TrainingScenes]) -> Result<Option<SegmentModel>> {
    match args.init.as_deref() {
        Some(path) if path == Path::new("shipped") => {
            SegmentModel::shipped(piles[0].catalog()).map(Some).map_err(Error::bad_input)
        }
        Some(path) => tsumu::load_weights(path).map(Some),
        None => Ok(None),
    }
}

fn config(args: &SegmentTraining, piles: &[TrainingScenes]) -> Result<TrainConfig> {
    let mut table = table(args, piles)?;
    // The network's own table would put its loss in the place of the letter's.
    let mut config = if args.thesis {
        TrainConfig::thesis(table.network.take().unwrap_or(TrainedNetwork::Fpcc))
    } else {
        TrainConfig::default()
    };
    config.steps = 6000;
    config.mirror = !args.handed;
    table.apply(&mut config).map_err(Error::bad_input)?;
    if args.any_shape {
        // What is learnt is as wide as the shapes seen: more piles, each looked at less often.
        config.steps_per_scene = 8;
        config.scenes_kept = 240;
    }
    if args.gpu {
        config.processor = Processor::Gpu;
        config.processor.device().map_err(Error::bad_input)?;
    }
    config.warmup = config.warmup.min(config.steps / 10);
    let names = || piles.iter().map(TrainingScenes::name).collect::<Vec<_>>().join(", ");
    config.name = args.name.clone().unwrap_or_else(names);
    for shape in piles.iter().flat_map(TrainingScenes::shapes) {
        if !config.shapes.iter().any(|s| s.matches(&shape)) {
            config.shapes.push(shape);
        }
    }
    Ok(config)
}

/// What the recipes' `[train]` tables say, under what `--set` and the other flags say.
fn table(args: &SegmentTraining, piles: &[TrainingScenes]) -> Result<TrainTable> {
    let mut tables = piles.iter().map(TrainingScenes::train_table);
    let first = tables.next().flatten();
    if let Some(other) = tables.position(|t| t != first) {
        return Err(Error::bad_input(anyhow!(
            "{} and {} differ in [train]: a training has one; give the same table in each, or none",
            args.recipes[0].display(),
            args.recipes[other + 1].display()
        )));
    }
    let mut all = first.cloned().unwrap_or_default();
    for said in &args.set {
        // A word that is no TOML value is a text.
        let quoted = || said.split_once('=').map(|(k, v)| format!("{k} = \"{}\"", v.trim()));
        let one = said.parse::<toml::Table>().ok().or_else(|| quoted()?.parse().ok());
        let one = one.filter(|_| said.contains('=')).ok_or_else(|| {
            Error::bad_input(anyhow!("--set {said}: give KEY=VALUE, as alpha=3 or loss=sum"))
        })?;
        all.extend(one);
    }
    let mut table: TrainTable =
        toml::Value::Table(all).try_into().context("[train]").map_err(Error::bad_input)?;
    table.network = args.network.map(Architecture::trained).or(table.network);
    table.steps = args.steps.or(table.steps);
    table.points = args.batch_points.or(table.points);
    Ok(table)
}

fn held_out(config: &TrainConfig, trained: &segment::Trained) -> String {
    let v = &trained.validation;
    match config.network {
        NetworkConfig::Fpcc(_) => format!("pair loss {:.4}, centre loss {:.4}", v.pair, v.centre),
        _ => format!("votes off by {:.3} d_max in the mean", v.offset),
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
fn training_scenes(path: &Path, args: &SegmentTraining, job: &Job) -> Result<TrainingScenes> {
    let inputs = tsumu::read_recipe(path, args.catalog.as_deref(), job)?;
    let blocks = if args.any_shape { Blocks::AnyShape } else { Blocks::Catalog };
    TrainingScenes::new(inputs.recipe, inputs.catalog, blocks).map_err(Error::bad_input)
}
