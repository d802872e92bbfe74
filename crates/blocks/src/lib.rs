//! From a catalogue entry to a [`scene::BlockModel`]: shape or mesh in, volume, mass, symmetry and convex parts out.

pub mod frustum;
pub mod rotation_group;
pub mod tetrapod;

mod error;
mod model;

pub use error::BlockError;
pub use model::{catalog, shape_model};
