//! Which weights a run uses.

use crate::exit::{Exit, OrBadInput};
use anyhow::Context;
use geom::{Event, Observer};
use io::manifest::{Entry, Manifest};
use scene::Catalog;
use segment::SegmentModel;
use serde_json::json;
use std::path::{Path, PathBuf};

/// The file `tsumu train segment` leaves in its folder.
const MODEL_FILE: &str = "model.safetensors";

/// Weights and where they come from.
pub struct Chosen {
    /// The weights.
    pub model: SegmentModel,
    /// One line for people and manifests.
    pub origin: String,
    /// Size and hash of the user's file; the shipped ones are part of the program.
    file: Option<Entry>,
}

impl Chosen {
    /// Which weights a result comes from.
    pub fn record(&self, manifest: &mut Manifest) {
        manifest.notes.insert("weights".into(), self.origin.as_str().into());
        if let Some(file) = &self.file {
            manifest.notes.insert("weights_file".into(), json!(file));
        }
    }
}

/// The user's weights (a file, or the folder of a training), or the shipped ones that suit the catalogue.
pub fn choose(path: Option<&Path>, catalog: &Catalog, observer: &dyn Observer) -> Result<Chosen, Exit> {
    let (model, from, file) = match path {
        Some(path) => {
            let file: PathBuf = if path.is_dir() { path.join(MODEL_FILE) } else { path.to_path_buf() };
            let model = SegmentModel::load(&file).with_context(|| file.display().to_string()).or_bad_input()?;
            (model, "of your own", Some(io::manifest::entry(&file)?))
        }
        None => (SegmentModel::shipped(catalog).or_bad_input()?, "shipped", None),
    };
    let description = &model.description;
    let origin = format!("{} ({from}, {} steps)", description.name, description.steps);
    observer.event(Event::Noted { stage: "segment", message: format!("weights: {origin}") });
    Ok(Chosen { model, origin, file })
}
