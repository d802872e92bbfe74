//! Synthetic piles that look like surveys: a recipe, a catalogue and a seed in; a pile with true poses and the
//! labelled cloud a sensor would bring home out (METHOD §1).
//!
//! [`scene`] makes one scene without touching a disk: training streams from it, `tsumu synth` writes it to files.

mod around;
mod bed;
mod bin;
mod camera;
mod delivery;
mod error;
mod pile;
mod preview;
mod range_map;
mod recipe;
mod scene;
pub mod sensor;
mod swath;
mod targets;
pub mod then;

pub use crate::scene::{SynthScene, scene};
pub use around::Around;
pub use bin::Bin;
pub use delivery::{Delivery, Rule};
pub use error::SynthError;
pub use preview::preview_png;
pub use recipe::{Bed, Drop, Recipe, Share, Site, Visibility};
pub use sensor::Sensor;
