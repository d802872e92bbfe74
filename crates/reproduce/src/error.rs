//! What can go wrong while a table is made.

use thiserror::Error;

/// A stage refused, each with its own words.
#[derive(Debug, Error)]
#[allow(missing_docs)]
pub enum ReproduceError {
    #[error("the recipe of {set}: {message}")]
    Recipe { set: String, message: String },
    #[error("scene {index} of {set}: {source}")]
    Scene { set: String, index: u64, source: synth::SynthError },
    #[error(transparent)]
    Block(#[from] blocks::BlockError),
    #[error(transparent)]
    Segment(#[from] segment::SegmentError),
    #[error(transparent)]
    Pose(#[from] pose::PoseError),
    #[error(transparent)]
    Plan(#[from] plan::PlanError),
    #[error(transparent)]
    Placement(#[from] placement::PlacementError),
    #[error(transparent)]
    Pipeline(#[from] pipeline::PipelineError),
    #[error(transparent)]
    Monitor(#[from] monitor::MonitorError),
    #[error(transparent)]
    Metrics(#[from] metrics::MetricsError),
    #[error("{file}: {source}")]
    File { file: String, source: std::io::Error },
    #[error(transparent)]
    Peer(#[from] peers::PeerError),
    #[error(transparent)]
    Io(#[from] io::IoError),
    #[error("{folder}: none of {wanted} is in it; {sources}")]
    Data { folder: String, wanted: String, sources: &'static str },
    #[error("{file}: {message}")]
    DataFile { file: String, message: String },
    #[error("--data: {experiment} takes none; {takers} do")]
    NoData { experiment: &'static str, takers: String },
    #[error("stopped")]
    Stopped,
}

impl ReproduceError {
    /// Whether the user asked to stop.
    pub fn is_interruption(&self) -> bool {
        match self {
            Self::Stopped
            | Self::Segment(segment::SegmentError::Cancelled)
            | Self::Pose(pose::PoseError::Cancelled)
            | Self::Plan(plan::PlanError::Cancelled)
            | Self::Monitor(monitor::MonitorError::Stopped) => true,
            Self::Pipeline(error) => error.is_interruption(),
            _ => false,
        }
    }

    /// Whether a folder or file of the user's is at fault.
    pub fn is_bad_input(&self) -> bool {
        matches!(self, Self::Data { .. } | Self::DataFile { .. } | Self::NoData { .. })
    }
}
