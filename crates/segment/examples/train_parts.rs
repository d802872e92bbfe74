//! Trains weights for bin parts: `train_parts FOLDER STEPS fpcc|fpccv2 INIT|none RECIPE…`. Resumes when FOLDER has a checkpoint.
//!
//! FPCC, which knows no ground, sees the parts alone; FPCCv2 sees the bin in half of its scenes. Scenes come from all
//! recipes in turn.

use geom::{Event, Observer, SeedTree};
use scene::{BlockModel, Catalog, PlacedBlock};
use segment::loss::LossConfig;
use segment::tile::LabelledScene;
use segment::{NetworkConfig, SegmentModel, ShapeSignature, Split, TrainConfig, train};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;
use synth::Recipe;

#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

static STOP: AtomicBool = AtomicBool::new(false);

struct Print(Instant);

impl Observer for Print {
    fn event(&self, event: Event) {
        if let Event::Advanced { done, .. } = event
            && (done < 20 || done % 20 == 0)
        {
            println!("{done} steps, {:.0} s", self.0.elapsed().as_secs_f64());
        }
    }

    fn cancelled(&self) -> bool {
        STOP.load(Ordering::Relaxed)
    }
}

/// A recipe with its blocks; meshes are not read here.
fn part(file: &str) -> Result<(Recipe, Catalog), Box<dyn std::error::Error>> {
    let recipe = Recipe::parse(&std::fs::read_to_string(file)?)?;
    let spec = recipe.catalog.clone().ok_or_else(|| format!("{file} names no blocks"))?;
    let catalog = blocks::catalog(&spec, &|_| Err("only built-in shapes here".into()))?;
    Ok((recipe, catalog))
}

fn labelled(recipe: &Recipe, catalog: &Catalog, seed: SeedTree) -> Result<LabelledScene, String> {
    let made = synth::scene(recipe, catalog, seed).map_err(|e| e.to_string())?;
    let centre = |b: &PlacedBlock| b.site_from_block * catalog.get(b.model).centre;
    Ok(LabelledScene {
        centre_m: made.scene.blocks.iter().map(centre).collect(),
        position_m: made.survey.cloud.position_m,
        instance: made.instance,
        unit_m: catalog.d_max_m(),
    })
}

/// Whether the block is its own mirror image: then half of the piles may be mirrored.
fn is_mirrored(model: &BlockModel) -> bool {
    !["hook-plate", "bracket"].contains(&model.name.as_str())
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let [folder, steps, network, init, recipes @ ..] = args.as_slice() else {
        return Err("FOLDER STEPS fpcc|fpccv2 INIT|none RECIPE…".into());
    };
    let init = match init.as_str() {
        "none" => None,
        name => Some(match SegmentModel::shipped_as(name) {
            Some(model) => model?,
            None => SegmentModel::load(Path::new(name))?,
        }),
    };
    let parts = recipes.iter().map(|r| part(r)).collect::<Result<Vec<_>, _>>()?;
    let models = || parts.iter().flat_map(|p| p.1.iter().map(|m| m.1));
    let fpcc = network == "fpcc";
    let config = TrainConfig {
        steps: steps.parse()?,
        network: if fpcc { NetworkConfig::Fpcc(Default::default()) } else { Default::default() },
        loss: if fpcc { LossConfig::of_the_thesis() } else { Default::default() },
        replicas: if fpcc { 1 } else { 2 },
        warmup: 30,
        mirror: models().all(is_mirrored),
        checkpoint_steps: 20,
        validation_steps: 100,
        validation_scenes: 5,
        steps_per_scene: 4,
        name: format!("{}, {network}", recipes_in_words(&parts)),
        shapes: models().map(ShapeSignature::of).collect(),
        ..Default::default()
    };
    ctrlc::set_handler(|| STOP.store(true, Ordering::Relaxed))?;
    let root = SeedTree::new(20261130);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    let source = |split: Split, index: u64| {
        let node = root.child(if split == Split::Train { "train" } else { "held out" }, index);
        let (recipe, catalog) = &parts[(index % parts.len() as u64) as usize];
        let mut recipe = recipe.clone();
        recipe.bin.measured = !fpcc && (index / parts.len() as u64).is_multiple_of(2);
        let start = Instant::now();
        let scene = pool.install(|| labelled(&recipe, catalog, node));
        if index < 12 {
            let points = scene.as_ref().map(|s| s.position_m.len());
            println!("scene {index}: {:.2} s, {points:?} points", start.elapsed().as_secs_f64());
        }
        scene
    };
    let folder = PathBuf::from(folder);
    let print = Print(Instant::now());
    let trained = train(&source, &config, init.as_ref(), &folder, SeedTree::new(6), &print)?;
    println!("{} steps, held out {:?}", trained.steps, trained.validation);
    Ok(())
}

fn recipes_in_words(parts: &[(Recipe, Catalog)]) -> String {
    parts.iter().map(|p| p.0.name.as_str()).collect::<Vec<_>>().join(", ")
}
