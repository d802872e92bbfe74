//! From segments and centre hypotheses to accepted blocks with pose and type (METHOD §4).
//!
//! [`recognise`] is the stage: [`prepare`] · [`Prepared::recognise`] · [`Prepared::judge`]. The default searches rotations on the model's distance field and lets all hypotheses
//! compete for the points; the thesis' point pair features are there for comparison and as a second source.

pub mod config;
pub mod gridded;
pub mod rotation_grid;

mod absolute;
mod acceptance;
mod beside;
mod beyond;
mod canonical;
mod cells;
mod confidence;
mod error;
mod evidence;
mod exchange;
mod fattening;
mod features;
mod finish;
mod fit;
mod ground;
mod handed;
mod hypotheses;
mod judge;
mod leftovers;
mod levelling;
mod limbs;
mod measured;
mod pile_facts;
mod prepare;
mod recognise;
mod rivals;
mod search;
mod shell;
mod sight;
pub mod size;
pub mod size_search;
pub mod size_windows;
pub mod survey_facts;
mod template;
mod thesis;
mod twins;
mod types;
mod unjudged;
mod verdict;
mod viewpoint;

pub use absolute::CommonSize;
pub use cells::Cells;
pub use confidence::{AMONG_NAMES, Features, NAMES, among_terms, speaks};
pub use config::{
    EvidenceConfig, IcpError, Method, Places, PoseConfig, PpfConfig, SearchConfig, StatedPlane,
};
pub use error::PoseError;
pub use hypotheses::Found;
pub use limbs::{Limb, LimbState};
pub use pile_facts::{LineShifts, Part, PileFacts};
pub use prepare::{Prepared, Templates, prepare};
pub use recognise::{
    Outcome, recognise, recognise_part, recognise_pile, recognise_with, recognise_with_features,
};
pub use verdict::PileVerdict;
pub use viewpoint::Viewpoint;
