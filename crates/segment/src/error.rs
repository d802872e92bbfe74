//! What can go wrong in segmentation.

/// Names the cause and says what to do.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SegmentError {
    /// No block types.
    #[error("the catalogue is empty: segmentation needs the size of at least one block")]
    EmptyCatalog,
    /// A block without a size.
    #[error("block `{name}` has d_max = {d_max_m} m; its mesh must have a positive size")]
    BadBlockSize {
        /// Block name.
        name: String,
        /// The value.
        d_max_m: f32,
    },
    /// A coordinate that is not a number.
    #[error(
        "point {point} has a coordinate that is not a finite number; remove it from the survey"
    )]
    NotFinite {
        /// Point number, from 0.
        point: usize,
    },
    /// Weights that cannot be used.
    #[error("weights: {0}")]
    Weights(#[from] net::WeightsError),
    /// A model file of another kind of network.
    #[error(
        "the model file holds a `{found}` network; this program reads {}",
        crate::network::known()
    )]
    Architecture {
        /// What the file says.
        found: String,
    },
    /// Weights that do not vote have no votes to calibrate.
    #[error(
        "a `{architecture}` network casts no votes, so there is nothing to fit a confidence to"
    )]
    NoVotes {
        /// The network.
        architecture: &'static str,
    },
    /// The model file has no usable description.
    #[error("the model file's description is unusable: {0}")]
    Description(String),
    /// A file could not be read or written.
    #[error("{path}: {message}")]
    File {
        /// The path.
        path: String,
        /// The system's message.
        message: String,
    },
    /// A training's files could not be read or written.
    #[error(transparent)]
    Checkpoint(#[from] net::CheckpointError),
    /// A setting out of range.
    #[error("{name} = {value} is out of range: {allowed}")]
    Setting {
        /// The setting.
        name: &'static str,
        /// Its value.
        value: f64,
        /// What is allowed.
        allowed: &'static str,
    },
    /// A key that this network does not have.
    #[error(
        "{name} says nothing to a `{architecture}` network; leave it out, or choose another train.network"
    )]
    NoSuchKey {
        /// The key.
        name: &'static str,
        /// The network.
        architecture: &'static str,
    },
    /// A training folder of other settings.
    #[error(
        "{folder} holds a training with another `{key}`; give the same recipes and options, or another folder"
    )]
    OtherTraining {
        /// The folder.
        folder: String,
        /// The setting that differs.
        key: String,
    },
    /// The scene source failed while training.
    #[error("no training scene {index}: {message}")]
    Scene {
        /// Number of the scene.
        index: u64,
        /// The source's message.
        message: String,
    },
    /// No graphics card.
    #[error(transparent)]
    Processor(#[from] net::ProcessorError),
    /// No thread to work on.
    #[error("the system gives no thread: {0}")]
    Threads(String),
    /// The loss is not a number.
    #[error(
        "training diverged at step {step}: the loss is {loss}; resume from the last checkpoint with a smaller learning rate"
    )]
    Diverged {
        /// Step.
        step: u64,
        /// Loss.
        loss: f32,
    },
    /// The observer asked to stop; what was computed is lost (training: is in the checkpoint).
    #[error("stopped by the user")]
    Cancelled,
}

impl From<net::TrainingError> for SegmentError {
    fn from(error: net::TrainingError) -> Self {
        match error {
            net::TrainingError::Diverged { step, loss } => Self::Diverged { step, loss },
            net::TrainingError::Threads(message) => Self::Threads(message),
        }
    }
}
