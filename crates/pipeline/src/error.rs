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
    /// A survey in which no block of the catalogue can be told.
    #[error("no block can be judged in this survey, not even `{block}`: {why}")]
    CannotBeJudged {
        /// A block of the catalogue.
        block: String,
        /// What stands in the way.
        why: String,
    },
    /// A design of which a part lies where nobody surveyed, far off.
    #[error(
        "the design reaches {beyond_m:.0} m {axis} beyond the survey, which is {surveyed_m:.0} m long; is a corner misplaced? Crop the design to what was surveyed"
    )]
    DesignFar {
        /// How far beyond.
        beyond_m: f64,
        /// Which way.
        axis: &'static str,
        /// Largest side of the survey.
        surveyed_m: f64,
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
