//! A trained network with its description, as one safetensors file; it proposes placements to the planner.

use crate::image::{stored_view, turned};
use crate::network::{NetworkShape, PlacementNetwork};
use crate::{PlacementError, rotation};
use geom::{Quat, Vec3};
use net::floats;
use net::prelude::{Device, log_softmax};
use plan::{DepthView, Proposal, Proposer};
use scene::{BlockModel, ShapeSignature};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// What the header of a model file says beside its tensors.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ModelDescription {
    /// What it was trained on.
    pub name: String,
    /// Network.
    pub network: NetworkShape,
    /// Steps trained.
    pub steps: u64,
    /// The block it places.
    pub block: ShapeSignature,
}

/// Weights ready to propose.
#[derive(Clone, Debug)]
pub struct PlacementModel {
    /// What they are.
    pub description: ModelDescription,
    network: PlacementNetwork,
}

/// One mode's answer to a window.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Answer {
    /// Centre of mass from the window's middle at design height, block lengths.
    pub centre: Vec3,
    pub rotation: Quat,
    pub sureness: f32,
}

/// Turns about the vertical at which a window is shown: each gives answers of its own, and there is rarely one right answer.
const TURNS: usize = 6;
/// Value of `architecture` in the header.
const ARCHITECTURE: &str = "placement";

impl PlacementModel {
    pub(crate) fn new(description: ModelDescription, network: PlacementNetwork) -> Self {
        Self { description, network }
    }

    /// Reads `model.safetensors` as training writes it.
    pub fn load(path: &Path) -> Result<Self, PlacementError> {
        let bytes = std::fs::read(path).map_err(|e| PlacementError::File {
            path: path.display().to_string(),
            message: e.to_string(),
        })?;
        Self::from_bytes(&bytes)
    }

    /// Reads the bytes of such a file.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, PlacementError> {
        let metadata = net::weights::metadata(bytes)?;
        match metadata.get("architecture").map(String::as_str) {
            Some(ARCHITECTURE) => {}
            other => {
                return Err(PlacementError::Architecture {
                    found: other.unwrap_or("nameless").to_owned(),
                });
            }
        }
        let text = metadata.get("description").map_or("", String::as_str);
        let description: ModelDescription =
            serde_json::from_str(text).map_err(|e| PlacementError::Description(e.to_string()))?;
        description.network.check()?;
        let mut network = PlacementNetwork::new(&description.network, &Device::flex());
        net::weights::from_bytes(&mut network, bytes)?;
        Ok(Self { description, network })
    }

    /// The bytes of a model file.
    pub fn to_bytes(&self) -> Result<Vec<u8>, PlacementError> {
        let description = serde_json::to_string(&self.description)
            .map_err(|e| PlacementError::Description(e.to_string()))?;
        let metadata = [
            ("architecture".to_owned(), ARCHITECTURE.to_owned()),
            ("description".to_owned(), description),
        ];
        Ok(net::weights::to_bytes(&self.network, &metadata.into())?)
    }

    /// Whether it was trained to place this block, whatever its size.
    pub fn knows(&self, block: &BlockModel) -> bool {
        self.description.block.matches(&ShapeSignature::of(block))
    }

    /// Answers to the network's image of a stored depth image at each of the turns, turned back, the surest first.
    pub(crate) fn answers(&self, stored: &[f32], turns_rad: &[f32]) -> Vec<Answer> {
        let shape = &self.description.network;
        let from = stored_view(&shape.view);
        let images =
            turns_rad.iter().flat_map(|&turn| turned(stored, &from, &shape.view, turn)).collect();
        let output = self.network.forward(images, shape, &Device::flex());
        let sureness = floats(log_softmax(output.sureness, 1));
        let (centre, attitude) = (floats(output.centre), floats(output.rotation));
        let mut answers: Vec<Answer> = (0..turns_rad.len() * shape.modes)
            .map(|k| {
                let back = Quat::from_rotation_z(-turns_rad[k / shape.modes]);
                Answer {
                    centre: back * Vec3::from_slice(&centre[3 * k..]),
                    rotation: back * rotation::quat(&attitude[9 * k..]),
                    sureness: sureness[k],
                }
            })
            .collect();
        answers.sort_by(|a, b| b.sureness.total_cmp(&a.sureness));
        answers
    }
}

/// Turns at which a window is shown, the first one given.
pub fn turns_rad(first: f32) -> Vec<f32> {
    (0..TURNS).map(|t| first + t as f32 * std::f32::consts::TAU / TURNS as f32).collect()
}

impl Proposer for PlacementModel {
    fn view(&self) -> DepthView {
        stored_view(&self.description.network.view)
    }

    fn propose(&self, depth: &[f32], turn_rad: f32) -> Vec<Proposal> {
        let proposal = |a: Answer| Proposal { centre: a.centre.truncate(), rotation: a.rotation };
        self.answers(depth, &turns_rad(turn_rad)).into_iter().map(proposal).collect()
    }
}
