//! `tsumu train`.

use crate::{exit::Exit, progress::Terminal};
use clap::Args;

/// Train.
#[derive(Debug, Args)]
pub struct TrainArgs {}

/// Runs the stage.
pub fn train(_args: &TrainArgs, _terminal: &Terminal) -> Result<(), Exit> {
    Err(Exit::failed(anyhow::anyhow!("train is not connected yet")))
}
