//! `tsumu recognise`.

use crate::{exit::Exit, progress::Terminal};
use clap::Args;

/// Recognise.
#[derive(Debug, Args)]
pub struct RecogniseArgs {}

/// Runs the stage.
pub fn recognise(_args: &RecogniseArgs, _terminal: &Terminal) -> Result<(), Exit> {
    Err(Exit::failed(anyhow::anyhow!("recognise is not connected yet")))
}
