//! `tsumu verify`.

use crate::{exit::Exit, progress::Terminal};
use clap::Args;

/// Verify.
#[derive(Debug, Args)]
pub struct VerifyArgs {}

/// Runs the stage.
pub fn verify(_args: &VerifyArgs, _terminal: &Terminal) -> Result<(), Exit> {
    Err(Exit::failed(anyhow::anyhow!("verify is not connected yet")))
}
