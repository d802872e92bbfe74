//! `tsumu plan`.

use crate::{exit::Exit, progress::Terminal};
use clap::Args;

/// Plan.
#[derive(Debug, Args)]
pub struct PlanArgs {}

/// Runs the stage.
pub fn plan(_args: &PlanArgs, _terminal: &Terminal) -> Result<(), Exit> {
    Err(Exit::failed(anyhow::anyhow!("plan is not connected yet")))
}
