//! `tsumu evaluate`.

use crate::{exit::Exit, progress::Terminal};
use clap::Args;

/// Evaluate.
#[derive(Debug, Args)]
pub struct EvaluateArgs {}

/// Runs the stage.
pub fn evaluate(_args: &EvaluateArgs, _terminal: &Terminal) -> Result<(), Exit> {
    Err(Exit::failed(anyhow::anyhow!("evaluate is not connected yet")))
}
