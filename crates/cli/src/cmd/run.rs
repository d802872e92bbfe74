//! `tsumu run`.

use crate::{exit::Exit, progress::Terminal};
use clap::Args;

/// Run.
#[derive(Debug, Args)]
pub struct RunArgs {}

/// Runs the stage.
pub fn run(_args: &RunArgs, _terminal: &Terminal) -> Result<(), Exit> {
    Err(Exit::failed(anyhow::anyhow!("run is not connected yet")))
}
