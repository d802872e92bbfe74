//! A trained network with its description, as one safetensors file.

use crate::SegmentError;
use crate::calibration::{Calibration, Confidence};
use crate::network::{ARCHITECTURES, Network, NetworkConfig};
use crate::train::TrainConfig;
use scene::{BlockModel, Catalog, ShapeSignature};
use serde::{Deserialize, Serialize};
use std::path::Path;
use std::sync::Arc;

/// What the header of a model file says beside its tensors.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ModelDescription {
    /// What it was trained on.
    pub name: String,
    /// Network; in the file its sizes alone, for the header names the architecture.
    #[serde(serialize_with = "NetworkConfig::sizes")]
    pub network: NetworkConfig,
    /// Edge of a thinning cell, d_max.
    pub cell: f32,
    /// Steps trained.
    pub steps: u64,
    /// Shapes it was trained on; empty: many.
    #[serde(default)]
    pub shapes: Vec<ShapeSignature>,
    /// Width of the kernel under which votes gather, d_max.
    #[serde(default = "narrow")]
    pub vote_width: f32,
    /// From a density of votes to a confidence.
    #[serde(default)]
    pub confidence: Confidence,
}

/// So much more confidence an instance needs from weights for any shape: theirs was fitted to shapes like those they were
/// trained on, and a user's own was never seen.
const CAUTION: f32 = 0.1;

/// For files that state no width.
fn narrow() -> f32 {
    Calibration::default().vote_width
}

impl ModelDescription {
    /// How votes become hypotheses.
    pub fn calibration(&self) -> Calibration {
        Calibration { vote_width: self.vote_width, confidence: self.confidence }
    }

    /// Confidence below which a hypothesis of these weights does not become an instance, where others need `stated`.
    pub fn least_instance_score(&self, stated: f32) -> f32 {
        (stated + if self.shapes.is_empty() { CAUTION } else { 0.0 }).min(1.0)
    }

    /// The same network with its votes read anew.
    pub fn calibrate(&mut self, calibration: Calibration) {
        self.vote_width = calibration.vote_width;
        self.confidence = calibration.confidence;
    }
}

/// Weights ready for [`crate::segment`].
#[derive(Clone, Debug)]
pub struct SegmentModel {
    /// What they are.
    pub description: ModelDescription,
    pub(crate) network: Arc<dyn Network>,
}

impl SegmentModel {
    /// Reads `model.safetensors` as training writes it.
    pub fn load(path: &Path) -> Result<Self, SegmentError> {
        let bytes = std::fs::read(path).map_err(|e| SegmentError::File {
            path: path.display().to_string(),
            message: e.to_string(),
        })?;
        Self::from_bytes(&bytes)
    }

    /// Reads the bytes of such a file.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, SegmentError> {
        let metadata = net::weights::metadata(bytes)?;
        let architecture = metadata.get("architecture").map_or("nameless", String::as_str);
        if !ARCHITECTURES.contains(&architecture) {
            return Err(SegmentError::Architecture { found: architecture.to_owned() });
        }
        let text = metadata.get("description").map_or("", String::as_str);
        let description = description_of(text, architecture)
            .map_err(|e| SegmentError::Description(e.to_string()))?;
        let design = description.network.design();
        if let Some(fault) = design.fault() {
            return Err(SegmentError::Description(fault.into()));
        }
        if !(description.cell > 0.0 && description.cell.is_finite()) {
            return Err(SegmentError::Description("the network has no cell size".into()));
        }
        if !(description.vote_width >= 0.02 && description.vote_width <= 1.0) {
            return Err(SegmentError::Description(
                "the width of the votes' kernel is not 0.02 to 1 d_max".into(),
            ));
        }
        // Before memory is taken: a header of a few lines may claim any width.
        if design.matrix_weights() > bytes.len() as u128 {
            return Err(SegmentError::Description(
                "the network's widths ask for more weights than the file holds".into(),
            ));
        }
        let network = design.load(bytes)?;
        Ok(Self { description, network })
    }

    /// The bytes of a model file.
    pub fn to_bytes(&self) -> Result<Vec<u8>, SegmentError> {
        let description = serde_json::to_string(&self.description)
            .map_err(|e| SegmentError::Description(e.to_string()))?;
        let metadata = [
            ("architecture".to_owned(), self.description.network.architecture().to_owned()),
            ("description".to_owned(), description),
        ];
        Ok(self.network.to_bytes(&metadata.into())?)
    }

    /// Writes a model file.
    pub fn save(&self, path: &Path) -> Result<(), SegmentError> {
        std::fs::write(path, self.to_bytes()?).map_err(|e| SegmentError::File {
            path: path.display().to_string(),
            message: e.to_string(),
        })
    }

    /// Names of the catalogue's blocks whose shape these weights never saw.
    pub fn unseen_types<'a>(&self, catalog: &'a Catalog) -> Vec<&'a str> {
        let known = &self.description.shapes;
        let strange = |b: &BlockModel| {
            !known.is_empty() && !known.iter().any(|k| k.matches(&ShapeSignature::of(b)))
        };
        catalog.iter().filter(|(_, b)| strange(b)).map(|(_, b)| b.name.as_str()).collect()
    }

    /// A network in training as a model.
    pub(crate) fn of_network(network: Arc<dyn Network>, config: &TrainConfig, steps: u64) -> Self {
        let description = ModelDescription {
            name: config.name.clone(),
            network: config.network.clone(),
            cell: config.cell,
            steps,
            shapes: config.shapes.clone(),
            vote_width: narrow(),
            confidence: Confidence::default(),
        };
        Self { description, network }
    }
}

/// The description in a header whose `architecture` says whose sizes it holds.
fn description_of(text: &str, architecture: &str) -> serde_json::Result<ModelDescription> {
    let mut description: serde_json::Value = serde_json::from_str(text)?;
    if let Some(network) = description.get_mut("network").and_then(|n| n.as_object_mut()) {
        network.insert("architecture".into(), architecture.into());
    }
    serde_json::from_value(description)
}
