//! What can go wrong with a placement network.

/// Names the cause and says what to do.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PlacementError {
    /// Weights that cannot be used.
    #[error("weights: {0}")]
    Weights(#[from] net::WeightsError),
    /// A training's folder that cannot be used.
    #[error(transparent)]
    Checkpoint(#[from] net::CheckpointError),
    /// Data could not be generated.
    #[error(transparent)]
    Plan(#[from] plan::PlanError),
    /// A model file of another kind of network.
    #[error(
        "the model file holds a `{found}` network; a placement network comes from `tsumu-lab train placement`"
    )]
    Architecture {
        /// What the file says.
        found: String,
    },
    /// The model file has no usable description.
    #[error("the model file's description is unusable: {0}")]
    Description(String),
    /// A file could not be read or written.
    #[error("{path}: {message}")]
    File {
        /// The path.
        path: String,
        /// What is wrong.
        message: String,
    },
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
    /// A background pile could not be made.
    #[error("no background pile {index}: {message}")]
    Background {
        /// Number of the pile.
        index: u64,
        /// The source's message.
        message: String,
    },
    /// Nothing to learn from.
    #[error(
        "no window of the background piles holds a drop that stayed: make the piles lower than the design, or drop more blocks"
    )]
    NoSamples,
    /// No thread for a replica.
    #[error("no thread for training: {0}")]
    Threads(String),
    /// The loss is not a number.
    #[error(
        "training diverged at step {step}: the loss is {loss}; begin again with a smaller learning rate"
    )]
    Diverged {
        /// Step.
        step: u64,
        /// Loss.
        loss: f32,
    },
}

impl From<net::TrainingError> for PlacementError {
    fn from(error: net::TrainingError) -> Self {
        match error {
            net::TrainingError::Diverged { step, loss } => Self::Diverged { step, loss },
            net::TrainingError::Threads(message) => Self::Threads(message),
        }
    }
}
