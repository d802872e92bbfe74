//! `tsumu report`.

use crate::{exit::Exit, progress::Terminal};
use clap::Args;

/// Report.
#[derive(Debug, Args)]
pub struct ReportArgs {}

/// Runs the stage.
pub fn report(_args: &ReportArgs, _terminal: &Terminal) -> Result<(), Exit> {
    Err(Exit::failed(anyhow::anyhow!("report is not connected yet")))
}
