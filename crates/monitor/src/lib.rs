//! What happened to every block between two surveys.
//!
//! In: two epochs, each a survey with the blocks recognised in it, and the catalogue. Out: for every block whether it
//! stayed, moved, turned, sank, went or came, each with the level below which nobody could tell. Start at [`compare()`].

mod alike;
pub mod as_built;
mod body;
mod breakage;
mod built_level;
mod change;
mod common_error;
pub mod compare;
mod dense;
mod detection;
mod epoch;
mod error;
mod grades;
mod heights;
mod layer;
mod limits;
mod margin;
mod matching;
mod motion;
mod registering;
mod registration;
mod rivals;
mod robust;
mod room;
pub mod series;
mod single;
mod spans;
mod stable;
pub mod surface;
mod surface_samples;
mod view;

pub use as_built::{AsBuilt, AsBuiltConfig, Built, BuiltBlock, as_built};
pub use breakage::BreakageConfig;
pub use change::{Change, Class};
pub use common_error::CommonError;
pub use compare::{CompareConfig, Comparison, compare};
pub use detection::DetectionConfig;
pub use epoch::{Epoch, SeenBlock};
pub use error::MonitorError;
pub use grades::{Grade, GradeRules, Limits};
pub use matching::MatchConfig;
pub use motion::Motion;
pub use registration::{
    Basis, CommonMovement, Decided, MovedAlike, Registration, RegistrationConfig,
};
pub use series::{Observation, Series, Track};
pub use single::SingleConfig;
pub use spans::{Span, SpanConfig, spans};
pub use stable::StableGround;
pub use surface::{SurfaceChange, SurfaceConfig, surface_changes};
