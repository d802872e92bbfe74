//! What the networks learn from: piles of a recipe, scanned and labelled or given a design, made when they are asked for.
//!
//! In: a recipe and its blocks, a seed. Out: the scenes that `segment::train` and `placement::train` draw. The shipped program
//! does not know this room.

mod placement_scenes;
mod training_scenes;

pub use placement_scenes::PlacementScenes;
pub use training_scenes::{Blocks, TrainingScenes};
