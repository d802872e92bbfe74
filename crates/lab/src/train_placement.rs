//! `tsumu-lab train placement`: background piles from a recipe, drops generated and tested on them, the network trained on these.

use crate::train::whole;
use anyhow::anyhow;
use clap::Args;
use geom::SeedTree;
use net::{ImageTransformerConfig, ResNetDepth};
use placement::{NetworkShape, RotationCode, SampleConfig, TrainConfig};
use scene::{BlockModel, Catalog};
use std::path::PathBuf;
use teach::PlacementScenes;
use terminal::Terminal;
use tsumu::{Error, Job, Result};

/// `tsumu-lab train placement`.
#[derive(Debug, Args)]
pub struct PlacementTraining {
    /// Recipe of the background piles
    #[arg(value_name = "RECIPE")]
    recipe: PathBuf,
    /// Folder for the data, the model, its curve and checkpoints; an existing one is resumed
    #[arg(long, value_name = "FOLDER")]
    out: PathBuf,
    /// Catalogue, for a recipe that names no blocks
    #[arg(long, value_name = "FILE")]
    catalog: Option<PathBuf>,
    /// Block to place [default: the last of the catalogue]
    #[arg(long, value_name = "NAME")]
    block: Option<String>,
    /// Optimiser steps
    #[arg(long, default_value_t = TrainConfig::default().steps)]
    steps: u64,
    /// Background piles to learn from
    #[arg(long, default_value_t = SampleConfig::default().piles)]
    piles: u64,
    /// Background piles to judge by
    #[arg(long, default_value_t = SampleConfig::default().held_out_piles)]
    held_out: u64,
    /// Random drops tested in each window
    #[arg(long, default_value_t = SampleConfig::default().drops)]
    drops: u32,
    /// Depth of the residual network
    #[arg(long, value_enum, default_value_t = Depth::Resnet18)]
    network: Depth,
    /// Channels of its first stage, a multiple of 8; the literature's is 64
    #[arg(long, default_value_t = NetworkShape::default().backbone.width)]
    width: usize,
    /// Answers to a window; 1: the thesis' regression of the best drop
    #[arg(long, default_value_t = NetworkShape::default().modes)]
    modes: usize,
    /// Good drops of a window that teach; 1: the best alone, as in the thesis
    #[arg(long, default_value_t = TrainConfig::default().targets)]
    targets: usize,
    /// How rotations are written
    #[arg(long, value_enum, default_value_t = Rotation::SixNumbers)]
    rotation: Rotation,
    /// Only make the data
    #[arg(long)]
    data_only: bool,
    /// Seed of piles, drops, batches and first weights
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

/// Networks on the command line.
#[derive(Clone, Copy, Debug, clap::ValueEnum)]
enum Depth {
    /// 18 layers
    #[value(name = "resnet-18")]
    Resnet18,
    /// 34 layers
    #[value(name = "resnet-34")]
    Resnet34,
    /// 50 layers
    #[value(name = "resnet-50")]
    Resnet50,
    /// An image Transformer
    Transformer,
}

/// Rotation codes on the command line.
#[derive(Clone, Copy, Debug, clap::ValueEnum)]
enum Rotation {
    /// The first two columns of the matrix, made orthonormal: continuous
    SixNumbers,
    /// Three angles, as in the thesis
    Euler,
}

/// Runs the stage.
pub fn train_placement(args: &PlacementTraining, terminal: &Terminal, job: &Job) -> Result<()> {
    let inputs = tsumu::read_recipe(&args.recipe, args.catalog.as_deref(), job)?;
    let block = block(args, &inputs.catalog)?;
    let config = config(args, format!("{} on piles of {}", block.name, inputs.recipe.name));
    let seed = SeedTree::new(args.seed);
    let scenes = PlacementScenes { recipe: &inputs.recipe, catalog: &inputs.catalog, block };
    let [samples, held_out] =
        scenes.samples(&config, &args.out.join("data"), seed, job).map_err(Error::bad_input)?;
    terminal.say(format!(
        "{} windows with {} good drops to learn from, {} windows to judge by",
        samples.len(),
        samples.iter().map(|s| s.good.len()).sum::<usize>(),
        held_out.len()
    ));
    if args.data_only {
        return Ok(());
    }
    let seed = seed.child("placement", 0);
    let trained = placement::train(&samples, &held_out, block, &config, &args.out, seed, job)
        .map_err(Error::bad_input)?;
    terminal.say(errors(args, &trained, block));
    whole(trained.steps, args.steps)
}

fn errors(args: &PlacementTraining, trained: &placement::Trained, block: &BlockModel) -> String {
    let e = trained.errors;
    format!(
        "{} of {} steps; {} held-out windows: surest answer off by {:.1}° and {:.2} m, nearest of {} by {:.1}° and {:.2} m. {}",
        trained.steps,
        args.steps,
        e.windows,
        e.rotation_rad.to_degrees(),
        e.displacement * block.d_box_m,
        args.modes,
        e.nearest_rotation_rad.to_degrees(),
        e.nearest_displacement * block.d_box_m,
        args.out.join("model.safetensors").display()
    )
}

fn block<'a>(args: &PlacementTraining, catalog: &'a Catalog) -> Result<&'a BlockModel> {
    let found = match &args.block {
        Some(name) => catalog.find(name),
        None => catalog.iter().last().map(|(id, _)| id),
    };
    let asked = args.block.as_deref().unwrap_or("");
    let id = found
        .ok_or_else(|| Error::bad_input(anyhow!("--block `{asked}` is not in the catalogue")))?;
    Ok(catalog.get(id))
}

fn config(args: &PlacementTraining, name: String) -> TrainConfig {
    let mut config =
        TrainConfig { steps: args.steps, targets: args.targets, name, ..TrainConfig::default() };
    config.warmup = config.warmup.min(args.steps / 10);
    config.samples.piles = args.piles;
    config.samples.held_out_piles = args.held_out;
    config.samples.drops = args.drops;
    config.network.modes = args.modes;
    config.network.backbone.width = args.width;
    config.network.backbone.depth = match args.network {
        Depth::Resnet18 | Depth::Transformer => ResNetDepth::Layers18,
        Depth::Resnet34 => ResNetDepth::Layers34,
        Depth::Resnet50 => ResNetDepth::Layers50,
    };
    if let Depth::Transformer = args.network {
        config.network.transformer = Some(ImageTransformerConfig::default());
    }
    config.network.rotation = match args.rotation {
        Rotation::SixNumbers => RotationCode::SixNumbers,
        Rotation::Euler => RotationCode::Euler,
    };
    config
}
