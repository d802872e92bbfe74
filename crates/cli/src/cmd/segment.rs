//! `tsumu segment`.

use crate::{exit::Exit, progress::Terminal};
use clap::Args;

/// Segment.
#[derive(Debug, Args)]
pub struct SegmentArgs {}

/// Runs the stage.
pub fn segment(_args: &SegmentArgs, _terminal: &Terminal) -> Result<(), Exit> {
    Err(Exit::failed(anyhow::anyhow!("segment is not connected yet")))
}
