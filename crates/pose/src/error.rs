//! What stops the pose stage before it starts.

/// Input that cannot be judged at all.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PoseError {
    /// The catalogue has no block.
    #[error("the catalogue is empty: add at least one [[block]]")]
    NoModels,
    /// A label column that does not belong to the cloud.
    #[error(
        "the segmentation has {labels} labels but the survey {points} points; segment this survey again"
    )]
    LabelCount {
        /// Labels.
        labels: usize,
        /// Points.
        points: usize,
    },
    /// A hypothesis names a point that is not there.
    #[error(
        "hypothesis {hypothesis} names point {point}, but the survey has {points}; segment this survey again"
    )]
    BadPoint {
        /// Hypothesis, from 0.
        hypothesis: usize,
        /// The point it names.
        point: u32,
        /// Points of the survey.
        points: usize,
    },
    /// A coordinate that is not a number.
    #[error("point {point} of the survey is not finite; remove such points when reading the file")]
    NotFinite {
        /// Point, from 0.
        point: usize,
    },
    /// A setting outside its range.
    #[error("pose.{key} = {value}: {rule}")]
    BadConfig {
        /// Key of the setting.
        key: &'static str,
        /// Its value.
        value: f64,
        /// What it must be.
        rule: &'static str,
    },
    /// A model's mesh is not a solid.
    #[error("block `{name}`: {source}")]
    Mesh {
        /// Block name.
        name: String,
        /// Why.
        source: geom::MeshError,
    },
    /// The model's size does not fit the survey's.
    #[error(
        "block `{name}` is {d_box_m} m long, but the survey {survey_m} m: check the mesh's `unit` and the survey's"
    )]
    WrongScale {
        /// Block name.
        name: String,
        /// Longest edge of its box.
        d_box_m: f32,
        /// Longest edge of the survey's box.
        survey_m: f32,
    },
    /// The user asked to stop.
    #[error("stopped on request")]
    Cancelled,
}
