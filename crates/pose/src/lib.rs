//! From segments and centre hypotheses to accepted blocks with pose and type (METHOD §4).
//!
//! [`recognise`] is the stage. The default searches rotations on the model's distance field and lets all hypotheses
//! compete for the points; the thesis' point pair features are there for comparison and as a second source.

pub mod config;
pub mod rotation_grid;

mod acceptance;
mod confidence;
mod error;
mod evidence;
mod fattening;
mod features;
mod finish;
mod fit;
mod leftovers;
mod levelling;
mod measured;
mod recognise;
mod search;
mod sight;
mod template;
mod thesis;
mod types;

pub use confidence::Features;
pub use config::{EvidenceConfig, IcpError, Method, Places, PoseConfig, PpfConfig, SearchConfig};
pub use error::PoseError;
pub use recognise::{recognise, recognise_with_features};
