//! What can be wrong with the input of a metric.

/// Columns that do not belong together.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MetricsError {
    /// Two label columns of one scene differ in length.
    #[error(
        "scene {scene}: {predicted} predicted labels but {truth} true ones; both must have one label a point"
    )]
    LabelCount {
        /// Scene, from 0.
        scene: usize,
        /// Predicted labels.
        predicted: usize,
        /// True labels.
        truth: usize,
    },
    /// An instance without a score.
    #[error(
        "scene {scene}: instance {instance} has no score; give one for each of the {scores} instances, from 1"
    )]
    NoScore {
        /// Scene, from 0.
        scene: usize,
        /// Label without a score.
        instance: u32,
        /// Scores given.
        scores: usize,
    },
    /// A label column that is not as long as its cloud.
    #[error("the {side} has {labels} labels for {points} points; give one a point")]
    LabelColumn {
        /// Which cloud.
        side: &'static str,
        /// Labels.
        labels: usize,
        /// Points.
        points: usize,
    },
    /// A tolerance that is no length.
    #[error("the tolerance {metres} m is not a positive length")]
    Tolerance {
        /// The value.
        metres: f64,
    },
    /// A limit of overlap that no two instances can have.
    #[error("the limit of overlap {value} is not above 0 and at most 1")]
    IouLimit {
        /// The value.
        value: f64,
    },
}
