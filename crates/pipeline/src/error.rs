//! What can stop the pipeline between its stages.

/// Names the file or block and says what to do.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PipelineError {
    /// A block larger than the cloud.
    #[error(
        "block `{block}` is {block_m} m large, the whole cloud only {cloud_m} m: is the unit of the mesh (or of the cloud) right?"
    )]
    BlockTooLarge {
        /// Name of the block.
        block: String,
        /// Its largest edge.
        block_m: f32,
        /// Largest extent of the cloud.
        cloud_m: f32,
    },
    /// A block that no survey of this extent could resolve.
    #[error(
        "block `{block}` is {block_m} m large, the cloud {cloud_m} m: is the unit of the mesh (or of the cloud) right?"
    )]
    BlockTooSmall {
        /// Name of the block.
        block: String,
        /// Its largest edge.
        block_m: f32,
        /// Largest extent of the cloud.
        cloud_m: f32,
    },
    /// A design that no survey shows.
    #[error(
        "the design lies {away_m:.0} m away from the survey: check its coordinates (east, north, in {crs}) and axis_order"
    )]
    DesignElsewhere {
        /// Distance between their rectangles.
        away_m: f64,
        /// The site's CRS.
        crs: String,
    },
    /// Segmentation failed.
    #[error(transparent)]
    Segment(#[from] segment::SegmentError),
    /// Pose estimation failed.
    #[error(transparent)]
    Pose(#[from] pose::PoseError),
    /// Planning failed.
    #[error(transparent)]
    Plan(#[from] plan::PlanError),
}

impl PipelineError {
    /// Whether the user asked to stop, rather than gave something wrong.
    pub fn is_interruption(&self) -> bool {
        matches!(
            self,
            Self::Segment(segment::SegmentError::Cancelled)
                | Self::Pose(pose::PoseError::Cancelled)
                | Self::Plan(plan::PlanError::Cancelled)
        )
    }
}
