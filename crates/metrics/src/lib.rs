//! Figures that judge a result against a truth (METHOD §5). Pure functions: nothing is read, nothing is filled in.

pub mod average_precision;
pub mod bop;
pub mod fitting;
pub mod instances;
pub mod labelled_clouds;
pub mod occlusion;
pub mod packing;
pub mod poses;
pub mod repeatability;
pub mod surface_distance;

mod error;

pub use average_precision::{AveragePrecision, ScoredScene, average_precision};
pub use error::MetricsError;
pub use fitting::{Fitting, fitting, model_distances_m, point_fit_m};
pub use instances::{DetectionCounts, InstanceScene, iou_pairs, precision_recall, without_hidden};
pub use labelled_clouds::{
    LabelFigures, Labelled, MatchedLabels, Zero, label_figures, match_labels,
};
pub use occlusion::occlusion_rate;
pub use packing::{expected_blocks, packing_density_per_m2, porosity};
pub use poses::{PoseCriteria, PoseScore, TrueBlock, score_poses};
pub use repeatability::{Repeatability, Split, StatedBlock, repeatability};
pub use surface_distance::{SurfaceMoments, surface_distance_m};
