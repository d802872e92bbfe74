//! The methods that FPCC is compared with (METHOD §7, Table 2.2): each groups points as its paper says, on our backbones.
//!
//! In: labelled scenes to train on, a cloud to look at, lengths in d_max. Out: groups of points with scores. Only the
//! experiments use this crate; nothing here is a stage of the pipeline. There is one kind of object in a bin, so every
//! branch of a paper that tells classes apart is left out, and stands so in its module's head.

mod asis;
mod ball_query;
mod bonet;
mod error;
mod grouping;
mod network;
mod point_group;
mod sgpn;
mod train;
mod watershed;

pub use error::PeerError;
pub use grouping::{Group, Method};
pub use network::{Backbone, Peer, PeerConfig};
pub use train::train;
pub use watershed::{WatershedConfig, watershed};
