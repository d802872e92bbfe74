//! `tsumu verify`: is every file of a run as it was written?

use crate::exit::{Exit, OrBadInput};
use crate::progress::Terminal;
use anyhow::anyhow;
use clap::Args;
use serde_json::json;
use std::path::PathBuf;

/// Check that no file of a run folder has changed since it was written.
///
/// Recomputes the hash of every file named in manifest.json and names each that changed, went or came.
#[derive(Debug, Args)]
pub struct VerifyArgs {
    /// The run folder
    #[arg(value_name = "RUN_DIR")]
    pub run: PathBuf,
    /// Also check the inputs, in this site folder
    #[arg(long, value_name = "SITE_DIR")]
    pub site: Option<PathBuf>,
}

/// Exit status 1 when anything differs.
pub fn verify(args: &VerifyArgs, terminal: &Terminal) -> Result<(), Exit> {
    let differences = io::manifest::verify(&args.run, args.site.as_deref()).or_bad_input()?;
    for difference in &differences {
        terminal.say(difference.to_string());
    }
    terminal
        .emit("verified", json!(differences.iter().map(ToString::to_string).collect::<Vec<_>>()));
    if differences.is_empty() {
        terminal.say("every file is as it was written");
        return Ok(());
    }
    Err(Exit::failed(anyhow!(
        "{}: {} files differ from the manifest",
        args.run.display(),
        differences.len()
    )))
}
