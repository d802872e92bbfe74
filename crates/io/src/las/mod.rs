//! LAS 1.0–1.4 and LAZ: f64 points with the extra dimensions `instance`, `model`, `confidence` and the CRS.
//!
//! The `laz` crate does the arithmetic coding; headers, counts and chunks are read here, because every number
//! in them has to be checked against the size of the file before anything is allocated or decompressed.

mod chunks;
mod copc;
mod extra;
mod header;
mod read;
mod relabel;
mod write;

pub use copc::{is_copc, stream_box, stream_box_with};
pub use header::LasSummary;
pub use read::{stream, stream_with, summary};
pub(crate) use relabel::relabel;
pub use write::{ExtraColumn, write_cloud, write_cloud_with};
