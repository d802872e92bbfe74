//! Training data: the planner's generate-and-test on background piles, kept on disk pile by pile.
//!
//! In: a source of piles with a design above them. Out: windows with the drops that stayed and filled most. What a pile gave
//! lies in a file of its own, so a run that was stopped goes on with the next pile.

use crate::{PlacementError, image::stored_view};
use geom::{Event, Observer, Quat, SeedTree, Silent, Stage, Vec3};
use plan::{DepthView, GenerateConfig, PlanConfig, PlanInput, WindowSample, generate_and_test};
use scene::{BlockModel, Catalog, DesignSurface, Scene, SiteFrame};
use serde::{Deserialize, Serialize};
use std::fs;
use std::path::{Path, PathBuf};

/// How much data.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SampleConfig {
    /// Background piles to learn from.
    pub piles: u64,
    /// Piles never learnt from, to judge by.
    pub held_out_piles: u64,
    /// Random drops a window (the thesis: 1000–3000).
    pub drops: u32,
    /// Drops kept of a window, the best.
    pub keep: u32,
}

impl Default for SampleConfig {
    fn default() -> Self {
        Self { piles: 24, held_out_piles: 4, drops: 300, keep: 24 }
    }
}

/// Which piles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Split {
    /// Learnt from.
    Train,
    /// Never learnt from.
    HeldOut,
}

/// A pile and what is to be built on it.
#[derive(Clone, Debug)]
pub struct Background {
    /// The pile.
    pub scene: Scene,
    /// The surface above it.
    pub design: DesignSurface,
}

/// A drop that stayed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct GoodPose {
    /// Centre of mass from the window's middle at design height, block lengths.
    pub centre: Vec3,
    /// Attitude when let go.
    pub rotation: Quat,
    /// Void it fills, block volumes.
    pub filled: f32,
}

/// A window and its good drops, best first.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sample {
    /// The stored image, thousandths of a block length.
    pub(crate) depth: Vec<i16>,
    /// What to answer.
    pub good: Vec<GoodPose>,
}

/// The windows of a split. `config.block` names the block that is dropped; `folder` keeps what was made.
#[allow(clippy::too_many_arguments)] // Inputs of one verb; a struct of them would be built once and taken apart here.
pub fn make_samples(
    source: &dyn Fn(Split, u64) -> Result<Background, String>,
    catalog: &Catalog,
    plan: &PlanConfig,
    view: &DepthView,
    config: &SampleConfig,
    split: Split,
    folder: &Path,
    seed: SeedTree,
    observer: &dyn Observer,
) -> Result<Vec<Sample>, PlacementError> {
    let (word, piles) = match split {
        Split::Train => ("train", config.piles),
        Split::HeldOut => ("held-out", config.held_out_piles),
    };
    fs::create_dir_all(folder).map_err(|e| file_error(folder, e))?;
    let generate = GenerateConfig {
        drops: config.drops,
        windows: 0,
        view: stored_view(view),
        keep: config.keep,
    };
    observer.event(Event::Started { stage: Stage::Generate, total: piles });
    let mut samples = Vec::new();
    for index in 0..piles {
        let path = folder.join(format!("{word}-{index:04}.json"));
        let made = match read(&path, &generate)? {
            Some(made) => made,
            None => {
                let background = source(split, index)
                    .map_err(|message| PlacementError::Background { index, message })?;
                let made = pile_samples(
                    &background,
                    catalog,
                    plan,
                    &generate,
                    seed.child(word, index),
                    observer,
                )?;
                write(&path, &Stored { generate, samples: made.clone() })?;
                made
            }
        };
        samples.extend(made);
        observer.event(Event::Advanced { stage: Stage::Generate, done: index + 1 });
    }
    observer.event(Event::Finished { stage: Stage::Generate });
    if samples.is_empty() { Err(PlacementError::NoSamples) } else { Ok(samples) }
}

/// What a file holds.
#[derive(Serialize, Deserialize)]
struct Stored {
    generate: GenerateConfig,
    samples: Vec<Sample>,
}

fn pile_samples(
    background: &Background,
    catalog: &Catalog,
    config: &PlanConfig,
    generate: &GenerateConfig,
    seed: SeedTree,
    observer: &dyn Observer,
) -> Result<Vec<Sample>, PlacementError> {
    let frame = SiteFrame::default();
    let input = PlanInput {
        scene: &background.scene,
        frame: &frame,
        design: &background.design,
        catalog,
        placed: &[],
        proposer: None,
        survey: None,
    };
    /// Only a wish to stop goes through; progress counts piles.
    struct Quiet<'a>(&'a dyn Observer);
    impl Observer for Quiet<'_> {
        fn event(&self, event: Event) {
            Silent.event(event);
        }
        fn cancelled(&self) -> bool {
            self.0.cancelled()
        }
    }
    let windows = generate_and_test(&input, config, generate, seed, &Quiet(observer))?;
    let block = plan::block_to_place(&input, config)?;
    let block = catalog.get(block);
    Ok(windows.into_iter().filter(|w| !w.best.is_empty()).map(|w| sample(w, block)).collect())
}

fn sample(window: WindowSample, block: &BlockModel) -> Sample {
    let good = window.best.iter().map(|drop| GoodPose {
        centre: drop.drop.translation / block.d_box_m,
        rotation: drop.drop.rotation,
        filled: drop.filled_m3 / block.volume_m3,
    });
    Sample::new(&window.depth, good.collect())
}

impl Sample {
    /// From an image as [`stored_view`] says (block lengths) and poses, best first.
    pub fn new(depth: &[f32], good: Vec<GoodPose>) -> Self {
        Self { depth: depth.iter().map(|d| (d * 1000.0).round() as i16).collect(), good }
    }

    /// The stored image, block lengths.
    pub(crate) fn depth(&self) -> Vec<f32> {
        self.depth.iter().map(|&d| f32::from(d) / 1000.0).collect()
    }
}

/// The samples of a file made with the same settings; `None` without a file.
fn read(path: &Path, generate: &GenerateConfig) -> Result<Option<Vec<Sample>>, PlacementError> {
    let bytes = match fs::read(path) {
        Ok(bytes) => bytes,
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(None),
        Err(e) => return Err(file_error(path, e)),
    };
    let stored: Stored = serde_json::from_slice(&bytes).map_err(|e| file_error(path, e))?;
    let pixels = (generate.view.pixels * generate.view.pixels) as usize;
    if stored.generate != *generate || stored.samples.iter().any(|s| s.depth.len() != pixels) {
        return Err(file_error(
            path,
            "this data was made with other settings; choose another folder",
        ));
    }
    Ok(Some(stored.samples))
}

fn write(path: &Path, stored: &Stored) -> Result<(), PlacementError> {
    let text = serde_json::to_string(stored).map_err(|e| file_error(path, e))?;
    let new: PathBuf = path.with_extension("new");
    fs::write(&new, text).map_err(|e| file_error(&new, e))?;
    fs::rename(&new, path).map_err(|e| file_error(path, e))
}

fn file_error(path: &Path, message: impl ToString) -> PlacementError {
    PlacementError::File { path: path.display().to_string(), message: message.to_string() }
}
