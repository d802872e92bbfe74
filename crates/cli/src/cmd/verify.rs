//! `tsumu verify`: is every file of a run as it was written?

use anyhow::anyhow;
use clap::Args;
use std::path::PathBuf;
use terminal::Terminal;
use tsumu::{Error, Result, Run};

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
    /// Also check the signature with this public key: a key file, or the key itself
    #[arg(long, value_name = "KEY")]
    pub key: Option<String>,
}

/// Exit status 1 when anything differs.
pub fn verify(args: &VerifyArgs, terminal: &Terminal) -> Result<()> {
    let found = Run::verify(&args.run, args.site.as_deref())?;
    let differences: Vec<String> = found.iter().map(ToString::to_string).collect();
    differences.iter().for_each(|difference| terminal.say(difference));
    terminal.emit("verified", &differences);
    if differences.is_empty() {
        if let Some(key) = &args.key {
            Run::check_signature(&args.run, key)?;
            terminal.say("signed with this key, and not changed since");
        }
        terminal.say("every file is as it was written");
        return Ok(());
    }
    Err(Error::failed(anyhow!(
        "{}: {} files differ from the manifest",
        args.run.display(),
        differences.len()
    )))
}
