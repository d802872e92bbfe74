//! The learned half of the planner: a network that proposes placements (METHOD §6, policy `network`).
//!
//! In: a window's depth image. Out: poses to try, the surest first. [`make_samples`] has the planner generate and test
//! drops on background piles, [`train`] learns from them, [`PlacementModel`] is a [`plan::Proposer`].
//!
//! One window has many nearly equal answers (two searches of 500 drops each differ by 37°), so the network gives several:
//! each mode is taught by those good drops to which it is nearest already. With one mode, one target and Euler angles
//! it is the thesis' network.

mod error;
mod evaluate;
mod image;
mod loss;
mod model;
mod network;
mod rotation;
mod samples;
mod shipped;
mod train;

pub use error::PlacementError;
pub use evaluate::{Errors, errors, offsets};
pub use image::stored_view;
pub use model::{ModelDescription, PlacementModel, turns_rad};
pub use net::{ImageTransformerConfig, ResNetDepth};
pub use network::{NetworkShape, PlacementNetwork};
pub use rotation::RotationCode;
pub use samples::{Background, GoodPose, Sample, SampleConfig, Split, make_samples};
pub use train::{TrainConfig, Trained, train};
