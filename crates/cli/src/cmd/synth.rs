//! `tsumu synth`: synthetic piles with known truth, scanned like a survey; as a dataset folder or as one site.

use crate::cmd::synth_dataset::{self, Order, Shared};
use crate::cmd::synth_site::{self, Georeference};
use crate::exit::{Exit, OrBadInput};
use crate::inputs;
use crate::progress::Terminal;
use anyhow::{Context, anyhow};
use clap::Args;
use scene::{Catalog, CatalogSpec};
use std::fs;
use std::path::{Path, PathBuf};
use synth::Recipe;

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
    #[arg(long, value_name = "E,N,H", value_parser = super::recognise::point, allow_hyphen_values = true)]
    #[arg(requires = "site_crs")]
    pub site_origin: Option<[f64; 3]>,
}

/// Which scenes one process makes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    /// This process, from 0.
    pub index: u32,
    /// Processes in all.
    pub count: u32,
}

impl std::str::FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parts =
            text.split_once('/').and_then(|(i, n)| Some((i.parse().ok()?, n.parse().ok()?)));
        match parts {
            Some((index, count)) if index < count => Ok(Self { index, count }),
            Some((index, count)) => Err(format!(
                "shard {index} of {count} does not exist; give 0/{count} to {}/{count}",
                count.max(1) - 1
            )),
            None => Err("write it as i/n, for example 0/4".into()),
        }
    }
}

/// Makes the scenes.
pub fn synth(args: &SynthArgs, terminal: &Terminal) -> Result<(), Exit> {
    if args.scenes == 0 {
        return Err(Exit::bad_input(anyhow!("--scenes 0: give at least 1")));
    }
    let split = shares(&args.split).or_bad_input()?;
    let text = fs::read_to_string(&args.recipe)
        .with_context(|| format!("cannot read {}", args.recipe.display()))
        .or_bad_input()?;
    let named = || args.recipe.display().to_string();
    let mut recipe = Recipe::parse(&text).with_context(named).or_bad_input()?;
    recipe.check().with_context(named).or_bad_input()?;
    let (spec, catalog, shared) = catalog(args, &recipe, terminal)?;
    recipe.check_with(&catalog).with_context(named).or_bad_input()?;
    if let (Some(crs), Some(origin)) = (&args.site_crs, args.site_origin) {
        let scene =
            synth::scene(&recipe, &catalog, synth_dataset::seed(args.seed, 0)).or_bad_input()?;
        synth_site::write(&args.out, &scene, &catalog, &Georeference { crs: crs.clone(), origin })?;
        terminal.say(format!(
            "{} blocks, {} points",
            scene.scene.blocks.len(),
            scene.survey.cloud.len()
        ));
        return Ok(());
    }
    recipe.catalog = Some(spec);
    let order = Order {
        recipe: &recipe,
        catalog: &catalog,
        scenes: args.scenes,
        seed: args.seed,
        shard: args.shard,
        split,
        preview: args.preview,
    };
    synth_dataset::make(&args.out, &order, shared, terminal)
}

fn shares(split: &[f64]) -> anyhow::Result<[f64; 3]> {
    let [train, validation, test] = *split else {
        return Err(anyhow!("--split needs three shares, for example 0.8,0.1,0.1"));
    };
    let sum = train + validation + test;
    if [train, validation, test].iter().any(|s| !(0.0..=1.0).contains(s))
        || (sum - 1.0).abs() > 1e-6
    {
        return Err(anyhow!(
            "--split {train},{validation},{test}: three shares from 0 to 1 that add up to 1"
        ));
    }
    Ok([train, validation, test])
}

/// The catalogue of `--catalog` or of the recipe. Its meshes go into the dataset, whose recipe names them there.
fn catalog(
    args: &SynthArgs,
    recipe: &Recipe,
    terminal: &Terminal,
) -> Result<(CatalogSpec, Catalog, Shared), Exit> {
    let (file, mut spec) = match (&args.catalog, &recipe.catalog) {
        (Some(file), _) => (file, io::site::load_catalog(file).or_bad_input()?),
        (None, Some(spec)) => (&args.recipe, spec.clone()),
        (None, None) => {
            let file = args.recipe.display();
            return Err(Exit::bad_input(anyhow!(
                "{file}: has no [[catalog.block]]; add one or give --catalog FILE"
            )));
        }
    };
    let loaded = inputs::models(&spec, file, terminal)?;
    let beside = file.parent().unwrap_or(Path::new(""));
    let mut meshes = Vec::new();
    for (k, block) in spec.block.iter_mut().enumerate() {
        if let Some(mesh) = &mut block.mesh {
            let from = beside.join(&*mesh);
            let kind = from.extension().and_then(|e| e.to_str()).unwrap_or("mesh").to_lowercase();
            *mesh = PathBuf::from(format!("meshes/{k}.{kind}"));
            meshes.push((
                mesh.clone(),
                fs::read(&from).with_context(|| from.display().to_string()).or_bad_input()?,
            ));
        }
    }
    Ok((spec, loaded, meshes))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shards_outside_are_refused() {
        assert_eq!("2/4".parse::<Shard>(), Ok(Shard { index: 2, count: 4 }));
        assert!("4/4".parse::<Shard>().unwrap_err().contains("0/4 to 3/4"));
        assert!("1/0".parse::<Shard>().is_err());
        assert!("one".parse::<Shard>().unwrap_err().contains("0/4"));
    }

    #[test]
    fn shares_must_add_up() {
        assert!(shares(&[0.8, 0.1, 0.1]).is_ok());
        assert!(shares(&[0.8, 0.1]).is_err());
        assert!(shares(&[0.8, 0.3, 0.1]).is_err());
    }
}
