//! From a catalogue entry to a [`scene::BlockModel`]: shape or mesh in, volume, mass, symmetry and convex parts out.

pub mod antifer;
pub mod bin_parts;
pub mod convex_parts;
pub mod dolos;
pub mod frustum;
pub mod interlocking;
pub mod parts;
pub mod random_union;
pub mod rotation_group;
pub mod symmetry;
pub mod tetrapod;

mod error;
mod model;
mod plane_split;

pub use error::BlockError;
pub use model::{catalog, mesh_model, shape_model, warnings};
pub use random_union::random_union;
