//! From a cloud to instances and centre hypotheses.

mod all_scales;
mod background;
pub mod calibration;
mod camera_place;
mod embedding_clusters;
pub mod error;
pub mod fpcc;
mod fpcc_batches;
pub mod fpccv2;
#[cfg(test)]
mod golden;
mod infer;
pub mod loss;
pub mod model;
mod network;
pub mod output;
mod shipped;
pub mod sparse_votes;
pub mod stage;
pub mod tile;
pub mod train;
pub mod train_table;
mod vote_instances;
mod vote_peaks;
mod walls;

pub use background::{BackgroundConfig, Foreground};
pub use calibration::Confidence;
pub use error::SegmentError;
pub use model::{ModelDescription, SegmentModel};
pub use network::NetworkConfig;
pub use scene::ShapeSignature;
pub use stage::{Clustering, SegmentConfig, scales, segment};
pub use train::{SceneSource, Split, TrainConfig, Trained, train};
pub use train_table::TrainTable;
