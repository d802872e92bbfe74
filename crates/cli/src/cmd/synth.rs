//! `tsumu synth`.

use crate::{exit::Exit, progress::Terminal};
use clap::Args;

/// Synth.
#[derive(Debug, Args)]
pub struct SynthArgs {}

/// Runs the stage.
pub fn synth(_args: &SynthArgs, _terminal: &Terminal) -> Result<(), Exit> {
    Err(Exit::failed(anyhow::anyhow!("synth is not connected yet")))
}
