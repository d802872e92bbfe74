//! PLY: point clouds and meshes, ascii or binary of either byte order, float or double.
//!
//! Own reader because the library at hand builds a map for every point and trusts the header's counts.

mod header;
mod read;
mod relabel;
mod write;

pub(crate) use read::{instance_number, label, not_a_label, read_mesh, reference};
pub use read::{stream, stream_with};
pub(crate) use relabel::relabel;
pub use write::{write_cloud, write_mesh};
