//! A dataset folder of synthetic scenes: one folder a scene, each there whole or not at all.

use crate::catalogue::RecipeInputs;
use crate::error::OrBadInput;
use crate::{Error, Job, Result};
use anyhow::{Context, anyhow};
use geom::{Event, Observer, SeedTree, Stage};
use io::blocks_csv::{self, BlockRow};
use io::{RawCloud, atomic, points};
use rayon::prelude::*;
use scene::{Catalog, CatalogSpec};
use serde::{Deserialize, Serialize};
use std::fs;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::sync::atomic::{AtomicU64, Ordering};
use synth::{Recipe, SynthScene};

/// Layout of the dataset folder.
const FORMAT: u32 = 1;
/// Largest mesh of a catalogue.
const MOST_BYTES: u64 = 1 << 30;

/// Files that all scenes share, by their name in the dataset folder.
type Shared = Vec<(PathBuf, Vec<u8>)>;

/// Which scenes one process makes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    /// This process, from 0.
    pub index: u32,
    /// Processes in all.
    pub count: u32,
}

/// `i/n`, as a flag has it.
impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> std::result::Result<Self, String> {
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

/// How many scenes to make.
#[derive(Clone, Debug, PartialEq)]
pub struct DatasetOptions {
    /// Scenes in all.
    pub scenes: u32,
    /// Root of all random choices.
    pub seed: u64,
    /// Which of them this process makes.
    pub shard: Shard,
    /// Shares of train, validation and test.
    pub split: [f64; 3],
    /// Whether to draw each.
    pub preview: bool,
}

/// What became of the scenes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DatasetSummary {
    /// Scenes made now.
    pub made: usize,
    /// Scenes that were there.
    pub there: usize,
    /// The list of all scenes, once no shard misses any.
    pub index: Option<PathBuf>,
}

/// Which scenes to make, and how.
struct Order<'a> {
    /// What they look like, catalogue included.
    recipe: &'a Recipe,
    /// Its block types.
    catalog: &'a Catalog,
    options: &'a DatasetOptions,
}

/// The stream of one scene.
pub(crate) fn seed(root: u64, scene: u32) -> SeedTree {
    SeedTree::new(root).child("synth", u64::from(scene))
}

/// What `dataset.json` says; all scenes of a folder share it.
#[derive(Debug, Serialize)]
struct Dataset<'a> {
    format: u32,
    version: &'a str,
    recipe: &'a str,
    seed: u64,
    split: [f64; 3],
}

/// What `scene.json` says.
#[derive(Debug, Serialize, Deserialize)]
struct SceneFacts {
    scene: u32,
    /// Value of the seed's child `synth`/i, in hexadecimal: JSON numbers lose its last bits.
    stream: String,
    split: String,
    blocks: usize,
    points: usize,
    mean_occlusion: f64,
    /// Why earlier piles of this scene were thrown away.
    redraws: Vec<String>,
    sensor: scene::SensorKind,
    sensor_positions: Vec<[f32; 3]>,
}

/// Makes the scenes that are not there yet. Errors: a bad order, a folder of another dataset, a recipe that gives no pile.
pub fn make_dataset(
    out: &Path,
    inputs: &RecipeInputs,
    options: &DatasetOptions,
    job: &Job,
) -> Result<DatasetSummary> {
    check(options)?;
    let (spec, shared) = with_meshes(&inputs.spec, &inputs.catalog_file)?;
    let recipe = Recipe { catalog: Some(spec), ..inputs.recipe.clone() };
    let order = Order { recipe: &recipe, catalog: &inputs.catalog, options };
    let claimed = claim(out, &order, shared)?;
    let made = job.install(|| make_missing(out, &order, job));
    if made.is_err() && !(0..options.scenes).any(|i| folder(out, i).is_dir()) {
        // A recipe that gives no scene must not keep the folder from the next one.
        unclaim(out, &claimed);
    }
    made
}

fn check(options: &DatasetOptions) -> Result<()> {
    if options.scenes == 0 {
        return Err(Error::bad_input(anyhow!("--scenes 0: give at least 1")));
    }
    let [train, validation, test] = options.split;
    let outside = options.split.iter().any(|s| !(0.0..=1.0).contains(s));
    if outside || (train + validation + test - 1.0).abs() > 1e-6 {
        return Err(Error::bad_input(anyhow!(
            "--split {train},{validation},{test}: three shares from 0 to 1 that add up to 1"
        )));
    }
    Ok(())
}

/// The catalogue with its meshes in the dataset folder, and those files.
fn with_meshes(spec: &CatalogSpec, file: &Path) -> Result<(CatalogSpec, Shared)> {
    let (mut spec, mut meshes) = (spec.clone(), Vec::new());
    let beside = file.parent().unwrap_or(Path::new(""));
    for (k, block) in spec.block.iter_mut().enumerate() {
        let Some(mesh) = &mut block.mesh else { continue };
        let from = beside.join(&*mesh);
        let kind = from.extension().and_then(|e| e.to_str()).unwrap_or("mesh").to_lowercase();
        *mesh = PathBuf::from(format!("meshes/{k}.{kind}"));
        let bytes = io::read_bytes(&from, MOST_BYTES).or_bad_input()?;
        meshes.push((mesh.clone(), bytes));
    }
    Ok((spec, meshes))
}

fn make_missing(out: &Path, order: &Order, job: &Job) -> Result<DatasetSummary> {
    let DatasetOptions { scenes, shard, .. } = *order.options;
    let wanted: Vec<u32> = (0..scenes).filter(|i| i % shard.count == shard.index).collect();
    let missing: Vec<u32> = wanted.iter().copied().filter(|&i| !folder(out, i).is_dir()).collect();
    sweep(out, &missing)?;
    job.event(Event::Started { stage: Stage::Synth, total: missing.len() as u64 });
    let done = AtomicU64::new(0);
    missing.par_iter().try_for_each(|&i| {
        if job.cancelled() {
            return Err(Error::stopped(anyhow!(
                "stopped with {} of {} scenes made; the same command goes on from here",
                done.load(Ordering::Relaxed),
                missing.len()
            )));
        }
        one(out, order, i, job)?;
        let done = done.fetch_add(1, Ordering::Relaxed) + 1;
        job.event(Event::Advanced { stage: Stage::Synth, done });
        Ok(())
    })?;
    job.event(Event::Finished { stage: Stage::Synth });
    let complete = (0..scenes).all(|i| folder(out, i).is_dir());
    let index = if complete { Some(index(out, scenes)?) } else { None };
    Ok(DatasetSummary { made: missing.len(), there: wanted.len() - missing.len(), index })
}

/// Takes back what [`claim`] wrote. What cannot be removed stays: there is a better error to report.
fn unclaim(out: &Path, written: &[PathBuf]) {
    for path in written {
        let _ = fs::remove_file(path);
    }
    for folder in [out.join("scenes"), out.join("meshes"), out.to_path_buf()] {
        let _ = fs::remove_dir(folder);
    }
}

/// Writes what all scenes share, or checks that the folder is one of this very dataset; the files it wrote.
fn claim(out: &Path, order: &Order, mut shared: Shared) -> Result<Vec<PathBuf>> {
    let mut written = Vec::new();
    let dataset = Dataset {
        format: FORMAT,
        version: env!("CARGO_PKG_VERSION"),
        recipe: &order.recipe.name,
        seed: order.options.seed,
        split: order.options.split,
    };
    let json = serde_json::to_string_pretty(&dataset).context("dataset.json")? + "\n";
    shared.push(("dataset.json".into(), json.into_bytes()));
    shared.push(("recipe.toml".into(), order.recipe.to_toml().or_bad_input()?.into_bytes()));
    for (name, bytes) in shared {
        let path = out.join(name);
        match fs::read(&path) {
            Ok(there) if there == bytes => {}
            Ok(_) => {
                return Err(Error::bad_input(anyhow!(
                    "{} is of another recipe, catalogue, seed, split or version; choose another --out",
                    path.display()
                )));
            }
            Err(_) => {
                atomic::write_bytes(&path, &bytes)?;
                written.push(path);
            }
        }
    }
    Ok(written)
}

/// Removes what a killed run left of the scenes that are to be made again.
fn sweep(out: &Path, missing: &[u32]) -> Result<()> {
    let Ok(entries) = fs::read_dir(out.join("scenes")) else { return Ok(()) };
    for entry in entries {
        let path = entry.context("scenes")?.path();
        let name = path.file_name().and_then(|n| n.to_str()).unwrap_or_default();
        let scene = name
            .strip_prefix('.')
            .and_then(|n| n.strip_suffix(".part"))
            .and_then(|n| n.split('-').next());
        if scene.and_then(|s| s.parse().ok()).is_some_and(|i: u32| missing.contains(&i)) {
            fs::remove_dir_all(&path).with_context(|| path.display().to_string())?;
        }
    }
    Ok(())
}

fn folder(out: &Path, scene: u32) -> PathBuf {
    out.join("scenes").join(format!("{scene:05}"))
}

/// Makes one scene beside its place and moves it there when it is whole.
fn one(out: &Path, order: &Order, scene: u32, job: &Job) -> Result<()> {
    let seed = seed(order.options.seed, scene);
    let made = synth::scene(order.recipe, order.catalog, seed)
        .with_context(|| format!("scene {scene}"))
        .or_bad_input()?;
    for reason in &made.redraws {
        job.event(Event::Noted {
            stage: Stage::Synth,
            message: format!("scene {scene} was dropped again: {reason}"),
        });
    }
    let place = folder(out, scene);
    let aside = place.with_file_name(format!(".{scene:05}-{}.part", std::process::id()));
    let written = write(&aside, &made, order, facts(&made, scene, seed, order.options.split));
    let moved = written.and_then(|()| match fs::rename(&aside, &place) {
        // Another process has put the same scene there.
        Err(_) if place.is_dir() => Ok(()),
        other => other.with_context(|| place.display().to_string()).map_err(Error::failed),
    });
    if aside.exists() {
        fs::remove_dir_all(&aside).with_context(|| aside.display().to_string())?;
    }
    moved
}

fn facts(
    made: &SynthScene,
    scene: u32,
    seed: SeedTree,
    [train, validation, _]: [f64; 3],
) -> SceneFacts {
    // The split of a scene does not depend on how many scenes are made.
    let u = (seed.child("split", 0).value() >> 11) as f64 / (1_u64 << 53) as f64;
    let split = match u {
        u if u < train => "train",
        u if u < train + validation => "validation",
        _ => "test",
    };
    let mean = made.occlusion.iter().map(|&o| f64::from(o)).sum::<f64>()
        / made.occlusion.len().max(1) as f64;
    SceneFacts {
        scene,
        stream: format!("{:016x}", seed.value()),
        split: split.into(),
        blocks: made.scene.blocks.len(),
        points: made.instance.len(),
        mean_occlusion: mean,
        redraws: made.redraws.clone(),
        sensor: made.survey.sensor,
        sensor_positions: made.survey.sensor_positions.iter().map(|p| p.to_array()).collect(),
    }
}

fn write(to: &Path, made: &SynthScene, order: &Order, facts: SceneFacts) -> Result<()> {
    let cloud = RawCloud {
        position: made
            .survey
            .cloud
            .position_m
            .iter()
            .map(|p| made.survey.frame.site_from_local(*p))
            .collect(),
        instance: Some(made.instance.clone()),
        line: (!made.survey.line.is_empty()).then(|| made.survey.line.clone()),
        ..Default::default()
    };
    points::write(&to.join("cloud.ply"), &cloud)?;
    let truth = made.scene.blocks.iter().zip(&made.occlusion);
    let rows: Vec<BlockRow> = truth
        .map(|(b, &occlusion)| BlockRow::of_truth(b, occlusion, order.catalog, &made.survey.frame))
        .collect();
    blocks_csv::write_truth(&to.join("truth.csv"), &rows)?;
    let json = serde_json::to_string_pretty(&facts).context("scene.json")? + "\n";
    atomic::write_bytes(&to.join("scene.json"), json.as_bytes())?;
    if order.options.preview {
        atomic::write_bytes(
            &to.join("preview.png"),
            &synth::preview_png(made).context("preview.png")?,
        )?;
    }
    Ok(())
}

/// One line a scene, read from the scenes themselves, so that it does not matter who made them.
fn index(out: &Path, scenes: u32) -> Result<PathBuf> {
    let mut text = String::from("scene,folder,split,blocks,points,mean_occlusion,redraws\n");
    for i in 0..scenes {
        let path = folder(out, i).join("scene.json");
        let bytes = fs::read(&path).with_context(|| path.display().to_string())?;
        let facts: SceneFacts =
            serde_json::from_slice(&bytes).with_context(|| path.display().to_string())?;
        text += &format!(
            "{i},scenes/{i:05},{},{},{},{:.6},{}\n",
            facts.split,
            facts.blocks,
            facts.points,
            facts.mean_occlusion,
            facts.redraws.len()
        );
    }
    let path = out.join("index.csv");
    atomic::write_bytes(&path, text.as_bytes())?;
    Ok(path)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shards_outside_are_refused() {
        let shard = |text: &str| text.parse::<Shard>();
        assert_eq!(shard("2/4"), Ok(Shard { index: 2, count: 4 }));
        assert!(shard("4/4").unwrap_err().contains("0/4 to 3/4"));
        assert!(shard("1/0").is_err());
        assert!(shard("one").unwrap_err().contains("0/4"));
    }

    #[test]
    fn shares_must_add_up() {
        let said = |scenes, split| {
            let shard = Shard { index: 0, count: 1 };
            let options = DatasetOptions { scenes, seed: 1, shard, split, preview: false };
            check(&options).err().map(|e| e.line())
        };
        assert_eq!(said(1, [0.8, 0.1, 0.1]), None);
        assert!(said(1, [0.8, 0.3, 0.1]).unwrap().contains("add up to 1"));
        assert!(said(0, [0.8, 0.1, 0.1]).unwrap().contains("at least 1"));
    }
}
