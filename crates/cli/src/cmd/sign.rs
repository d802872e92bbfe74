//! `tsumu sign`: whose run it is.

use clap::Args;
use std::path::PathBuf;
use terminal::Terminal;
use tsumu::{Result, Run};

/// Sign a finished run, so that everybody with the public key can tell that nobody changed it.
///
/// Leaves manifest.json.minisig beside manifest.json: an Ed25519 signature in minisign's format. `tsumu verify --key`
/// checks it, and so does minisign itself.
#[derive(Debug, Args)]
pub struct SignArgs {
    /// The run folder
    #[arg(value_name = "RUN_DIR", required_unless_present = "new_key")]
    pub run: Option<PathBuf>,
    /// The secret key file
    #[arg(long, value_name = "FILE", required_unless_present = "new_key")]
    pub key: Option<PathBuf>,
    /// Make a pair of keys first: FILE is the secret one, FILE.pub the public one
    #[arg(long, value_name = "FILE", conflicts_with = "key")]
    pub new_key: Option<PathBuf>,
}

/// Makes the keys, signs, or both.
pub fn sign(args: &SignArgs, terminal: &Terminal) -> Result<()> {
    if let Some(file) = &args.new_key {
        let public = Run::new_keys(file)?;
        terminal.say(format!("secret key {}; keep it to yourself", file.display()));
        terminal.say(format!("public key {}; give it to whoever checks", public.display()));
    }
    let key = args.new_key.as_ref().or(args.key.as_ref());
    if let (Some(run), Some(key)) = (&args.run, key) {
        Run::sign(run, key)?;
        terminal.say(format!("signed: {}", run.display()));
    }
    Ok(())
}
