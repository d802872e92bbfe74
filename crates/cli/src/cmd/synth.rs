//! `tsumu synth`: synthetic piles with known truth, scanned like a survey.

use crate::cmd::synth_site::{self, Georeference};
use crate::exit::{Exit, OrBadInput};
use crate::inputs;
use crate::progress::Terminal;
use anyhow::{Context, anyhow};
use clap::Args;
use geom::SeedTree;
use std::path::PathBuf;

/// Make synthetic piles with known truth, scanned like a survey.
#[derive(Debug, Args)]
pub struct SynthArgs {
    /// What the scenes look like
    #[arg(value_name = "RECIPE")]
    pub recipe: PathBuf,
    /// Root of all random choices
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Folder for the scenes
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// Block types [default: those in the recipe]
    #[arg(long, value_name = "FILE")]
    pub catalog: Option<PathBuf>,
    /// Write one scene as the survey and truth of a site in this CRS, e.g. EPSG:6679
    #[arg(long, value_name = "EPSG:N", requires = "site_origin")]
    pub site_crs: Option<String>,
    /// East, north and height of the site's middle
    #[arg(long, value_name = "E,N,H", value_parser = super::recognise::point, allow_hyphen_values = true)]
    pub site_origin: Option<[f64; 3]>,
}

/// Makes the scenes.
pub fn synth(args: &SynthArgs, terminal: &Terminal) -> Result<(), Exit> {
    let text = std::fs::read_to_string(&args.recipe)
        .with_context(|| format!("cannot read {}", args.recipe.display()))
        .or_bad_input()?;
    let recipe = synth::Recipe::parse(&text).with_context(|| args.recipe.display().to_string()).or_bad_input()?;
    let catalog = match (&args.catalog, &recipe.catalog) {
        (Some(file), _) => inputs::catalog(file, terminal)?,
        (None, Some(spec)) => inputs::models(spec, &args.recipe, terminal)?,
        (None, None) => {
            return Err(Exit::bad_input(anyhow!("{}: has no [catalog]; give --catalog", args.recipe.display())));
        }
    };
    let (Some(crs), Some(origin)) = (&args.site_crs, args.site_origin) else {
        return Err(Exit::bad_input(anyhow!("give --site-crs and --site-origin")));
    };
    let scene = synth::scene(&recipe, &catalog, SeedTree::new(args.seed).child("synth", 0)).or_bad_input()?;
    synth_site::write(&args.out, &scene, &catalog, &Georeference { crs: crs.clone(), origin })?;
    terminal.say(format!("{} blocks, {} points", scene.scene.blocks.len(), scene.survey.cloud.len()));
    Ok(())
}
