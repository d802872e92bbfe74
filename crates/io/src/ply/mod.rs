//! PLY: point clouds and meshes, ascii or binary of either byte order, float or double.
//!
//! Own reader because the library at hand builds a map for every point and trusts the header's counts.

mod header;
mod read;
mod write;

pub(crate) use read::{label, not_a_label};
pub use read::{read_mesh, stream};
pub use write::{write_cloud, write_mesh};
