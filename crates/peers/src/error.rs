//! What can go wrong with a peer.

/// Names the cause.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PeerError {
    /// No scenes to learn from.
    #[error("a peer needs at least one scene to learn from; none of those given has enough points")]
    NoScenes,
    /// The training could not go on.
    #[error(transparent)]
    Training(#[from] net::TrainingError),
    /// A training's files could not be read or written.
    #[error(transparent)]
    Checkpoint(#[from] net::CheckpointError),
    /// The weights could not be written.
    #[error("weights: {0}")]
    Weights(#[from] net::WeightsError),
}
