//! Which weights a run uses.

use crate::error::OrBadInput;
use crate::{Error, Result};
use anyhow::{Context, anyhow};
use geom::{Event, Observer, Stage, Warning};
use io::manifest::{Entry, Manifest};
use placement::{PlacementError, PlacementModel};
use plan::{PlanConfig, Policy};
use scene::Catalog;
use segment::SegmentModel;
use serde_json::json;
use std::path::{Path, PathBuf};

/// The file `tsumu-lab train segment` leaves in its folder.
const MODEL_FILE: &str = "model.safetensors";

/// Weights and where they come from.
pub(crate) struct Chosen {
    /// The weights.
    pub model: SegmentModel,
    /// What a result says of them.
    pub origin: WeightsOrigin,
}

/// Which weights a result comes from.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct WeightsOrigin {
    /// One line for people and manifests.
    pub line: String,
    /// Size and hash of the user's file; the shipped ones are part of the program.
    pub file: Option<Entry>,
}

impl WeightsOrigin {
    pub(crate) fn record(&self, manifest: &mut Manifest) {
        manifest.notes.insert("weights".into(), self.line.as_str().into());
        if let Some(file) = &self.file {
            manifest.notes.insert("weights_file".into(), json!(file));
        }
    }

    pub(crate) fn of(manifest: &Manifest) -> Self {
        let line = manifest.notes.get("weights").and_then(|v| v.as_str()).unwrap_or_default();
        let file = manifest.notes.get("weights_file").cloned();
        let file = file.and_then(|v| serde_json::from_value(v).ok());
        Self { line: line.into(), file }
    }
}

/// The user's weights (a file, or the folder of a training), or the shipped ones that suit the catalogue.
pub(crate) fn choose(
    path: Option<&Path>,
    catalog: &Catalog,
    observer: &dyn Observer,
) -> Result<Chosen> {
    let (model, from, file) = match path {
        Some(path) if is_shipped(path) => (load(path)?, "shipped", None),
        Some(path) => (load(path)?, "of your own", Some(io::manifest::entry(&weights_file(path))?)),
        None => (SegmentModel::shipped(catalog).or_bad_input()?, "shipped", None),
    };
    let description = &model.description;
    let origin = format!("{} ({from}, {} steps)", description.name, description.steps);
    observer.event(Event::Noted { stage: Stage::Segment, message: format!("weights: {origin}") });
    Ok(Chosen { model, origin: WeightsOrigin { line: origin, file } })
}

/// Shipped weights by name, a weights file, or the folder of a training.
pub fn load(path: &Path) -> Result<SegmentModel> {
    if is_shipped(path) {
        let name = path.to_str().expect("shipped names are ASCII");
        return SegmentModel::shipped_as(name).expect("it was just found").or_bad_input();
    }
    let file = weights_file(path);
    io::open_regular(&file).or_bad_input()?;
    SegmentModel::load(&file).with_context(|| file.display().to_string()).or_bad_input()
}

/// A name of shipped weights, unless a file or folder is called so.
fn is_shipped(path: &Path) -> bool {
    !path.exists() && path.to_str().is_some_and(|name| SegmentModel::shipped_as(name).is_some())
}

/// The placement network of policy `network`: the user's, or the shipped one; `None` for the other policies.
pub(crate) fn proposer(
    path: Option<&Path>,
    config: &PlanConfig,
    catalog: &Catalog,
    observer: &dyn Observer,
) -> Result<Option<PlacementModel>> {
    if config.policy != Policy::Network {
        return match path {
            Some(_) => {
                Err(Error::bad_input(anyhow!("--placement-model goes with --policy network")))
            }
            None => Ok(None),
        };
    }
    let model = match path {
        Some(path) => {
            let file = weights_file(path);
            io::open_regular(&file).or_bad_input()?;
            // A file that cannot be read is named already.
            let named = |e: PlacementError| match e {
                PlacementError::File { .. } => anyhow!(e),
                other => anyhow!(other).context(file.display().to_string()),
            };
            PlacementModel::load(&file).map_err(named).or_bad_input()?
        }
        None => PlacementModel::shipped().or_bad_input()?,
    };
    let description = &model.description;
    let message = format!("placement network: {} ({} steps)", description.name, description.steps);
    observer.event(Event::Noted { stage: Stage::Plan, message });
    let strange =
        |name: &String| catalog.find(name).is_some_and(|id| !model.knows(catalog.get(id)));
    let placed = config.block.iter().filter(|n| strange(n)).cloned();
    let any = catalog
        .iter()
        .filter(|(_, b)| config.block.is_none() && !model.knows(b))
        .map(|(_, b)| b.name.clone());
    let unseen_types: Vec<String> = placed.chain(any).collect();
    if !unseen_types.is_empty() {
        let message = format!(
            "the placement network never saw the shape of {}: its proposals may be poor; use policy `search`, or train \
             one with `tsumu-lab train placement`",
            unseen_types.join(", ")
        );
        observer.event(Event::Warned(Warning { stage: Stage::Plan, message }));
    }
    Ok(Some(model))
}

/// Size and hash of the user's placement network: a plan follows from it.
pub(crate) fn proposer_file(path: Option<&Path>) -> Result<Option<Entry>> {
    Ok(path.map(|path| io::manifest::entry(&weights_file(path))).transpose()?)
}

/// A training's folder or the file itself.
fn weights_file(path: &Path) -> PathBuf {
    if path.is_dir() { path.join(MODEL_FILE) } else { path.to_path_buf() }
}
