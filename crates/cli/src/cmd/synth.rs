//! `tsumu synth`: synthetic piles with known truth, scanned like a survey; as a dataset folder or as one site.

use anyhow::anyhow;
use clap::Args;
use std::path::PathBuf;
use terminal::Terminal;
use tsumu::{
    DatasetOptions, DatasetSummary, Error, Georeference, Job, RecipeInputs, Result, Shard,
};

/// Make synthetic piles with known truth, scanned like a survey.
///
/// DIR/scenes/00000/ holds cloud.ply (points with their block), truth.csv (poses and occlusion) and scene.json
/// (stream of the seed, split, sensor positions). DIR/index.csv appears once all scenes are there. Run the same
/// line again to go on after an interruption; shards written on several machines can be copied into one folder.
#[derive(Debug, Args)]
pub struct SynthArgs {
    /// What the scenes look like, for example recipes/sawara-uav.toml
    #[arg(value_name = "RECIPE")]
    pub recipe: PathBuf,
    /// Number of scenes
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub scenes: u32,
    /// Root of all random choices; scene i of a seed is always the same
    #[arg(long, value_name = "S", default_value_t = 1)]
    pub seed: u64,
    /// Folder for the scenes; finished ones in it are kept
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// Make only every n-th scene, starting at i, counted from 0
    #[arg(long, value_name = "I/N", default_value = "0/1")]
    pub shard: Shard,
    /// Block types [default: those in the recipe]
    #[arg(long, value_name = "FILE")]
    pub catalog: Option<PathBuf>,
    /// Shares of train, validation and test scenes
    #[arg(
        long,
        value_name = "A,B,C",
        value_delimiter = ',',
        num_args = 1,
        default_value = "0.8,0.1,0.1"
    )]
    pub split: Vec<f64>,
    /// Also draw preview.png of every scene
    #[arg(long)]
    pub preview: bool,
    /// Write one scene as the survey and truth of a site in this CRS, e.g. EPSG:6679
    #[arg(long, value_name = "EPSG:N", requires = "site_origin")]
    pub site_crs: Option<String>,
    /// East, north and height of the site's middle
    #[arg(long, value_name = "E,N,H", value_parser = super::measured::point, allow_hyphen_values = true)]
    #[arg(requires = "site_crs")]
    pub site_origin: Option<[f64; 3]>,
    /// Let this happen to the site and survey it again: DIR/then holds the second survey, its truth and what happened
    #[arg(long, value_name = "STORM", requires = "site_crs")]
    pub then: Option<PathBuf>,
    /// The placements.csv (or the folder of a plan) that works of --then build
    #[arg(long, value_name = "PLAN", requires = "then")]
    pub then_plan: Option<PathBuf>,
}

/// Makes the scenes.
pub fn synth(args: &SynthArgs, terminal: &Terminal, job: &Job) -> Result<()> {
    let options = options(args)?;
    let inputs = tsumu::read_recipe(&args.recipe, args.catalog.as_deref(), job)?;
    if let (Some(crs), Some(origin)) = (&args.site_crs, args.site_origin) {
        return site(args, &inputs, Georeference { crs: crs.clone(), origin }, terminal);
    }
    let DatasetSummary { made, there, index } =
        tsumu::make_dataset(&args.out, &inputs, &options, job)?;
    let state = index.map_or("other shards are still missing".to_owned(), |index| {
        format!("all {} are in {}", args.scenes, index.display())
    });
    terminal.say(format!("{made} scenes made, {there} were there; {state}"));
    Ok(())
}

fn options(args: &SynthArgs) -> Result<DatasetOptions> {
    let split = <[f64; 3]>::try_from(args.split.as_slice()).map_err(|_| {
        Error::bad_input(anyhow!("--split needs three shares, for example 0.8,0.1,0.1"))
    })?;
    let SynthArgs { scenes, seed, shard, preview, .. } = *args;
    Ok(DatasetOptions { scenes, seed, shard, split, preview })
}

fn site(
    args: &SynthArgs,
    inputs: &RecipeInputs,
    place: Georeference,
    terminal: &Terminal,
) -> Result<()> {
    // What cannot happen is refused before anything is written.
    let then = args.then.as_deref().map(tsumu::read_then).transpose()?;
    let next = then.map(|then| {
        let (folder, plan) = (args.out.join("then"), args.then_plan.as_deref());
        tsumu::make_next_epoch(&folder, inputs, args.seed, &place, &then, plan)
    });
    let next = next.transpose()?;
    let made = tsumu::make_site(&args.out, inputs, args.seed, &place)?;
    terminal.say(format!("{} blocks, {} points", made.blocks, made.points));
    if let Some(next) = next {
        terminal.say(format!("then: {} blocks, {} points", next.blocks, next.points));
    }
    Ok(())
}
