//! `tsumu-lab halve`: weights as they are shipped, 16 bits a number.

use anyhow::{Context, anyhow};
use clap::Args;
use net::half_weights::halved;
use placement::PlacementModel;
use segment::SegmentModel;
use std::path::{Path, PathBuf};
use terminal::Terminal;
use tsumu::{Error, Result};

/// Write trained weights as they are shipped: 16 bits a number instead of 32.
///
/// The header stays as it is. Every network computes with 32 bits all the same; a training goes on from its own folder, not from
/// such a file, without loss.
#[derive(Debug, Args)]
pub struct HalveArgs {
    /// Weights file of a training
    #[arg(value_name = "MODEL")]
    model: PathBuf,
    /// File to write
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
}

/// Runs the command.
pub fn halve(args: &HalveArgs, terminal: &Terminal) -> Result<()> {
    let bytes = read(&args.model)?;
    let half = halved(&bytes)
        .with_context(|| args.model.display().to_string())
        .map_err(Error::bad_input)?;
    loads(&half).with_context(|| args.model.display().to_string()).map_err(Error::bad_input)?;
    io::atomic::write_bytes(&args.out, &half)?;
    terminal.say(format!("{}: {} of {} bytes", args.out.display(), half.len(), bytes.len()));
    Ok(())
}

/// A file, or the one in a training's folder.
fn read(model: &Path) -> Result<Vec<u8>> {
    let file = if model.is_dir() { model.join("model.safetensors") } else { model.to_owned() };
    std::fs::read(&file).with_context(|| file.display().to_string()).map_err(Error::bad_input)
}

/// That a stage takes them.
fn loads(bytes: &[u8]) -> anyhow::Result<()> {
    let words = net::weights::metadata(bytes)?;
    match words.get("architecture").map(String::as_str) {
        Some("placement") => PlacementModel::from_bytes(bytes).map(drop).map_err(|e| anyhow!(e)),
        _ => SegmentModel::from_bytes(bytes).map(drop).map_err(|e| anyhow!(e)),
    }
}
