//! What happened to every block between two surveys.
//!
//! In: two epochs, each a survey with the blocks recognised in it, and the catalogue. Out: for every block whether it
//! stayed, moved, turned, sank, went or came, each with the level below which nobody could tell. Start at [`compare()`].

mod body;
mod breakage;
mod change;
mod common_error;
pub mod compare;
mod dense;
mod detection;
mod epoch;
mod error;
mod matching;
mod motion;
mod registration;
mod robust;
mod single;
mod stable;
mod surface_samples;
mod view;

pub use breakage::BreakageConfig;
pub use change::{Change, Class};
pub use common_error::CommonError;
pub use compare::{CompareConfig, Comparison, compare};
pub use detection::DetectionConfig;
pub use epoch::{Epoch, SeenBlock};
pub use error::MonitorError;
pub use matching::MatchConfig;
pub use motion::Motion;
pub use registration::{Basis, CommonMovement, Registration, RegistrationConfig};
pub use single::SingleConfig;
pub use stable::StableGround;
