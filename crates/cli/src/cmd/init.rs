//! `tsumu init`: a first site from surveys alone.

use clap::Args;
use serde_json::json;
use std::path::{Path, PathBuf};
use terminal::Terminal;
use tsumu::{Job, Result};

/// Write a first site from surveys alone: site.toml and catalog.toml, filled in and commented.
///
/// CRS, extents and levels are those of the surveys; the design is a proposal, and whatever is a guess says so. The surveys
/// stay where they are.
#[derive(Debug, Args)]
pub struct InitArgs {
    /// The surveys: LAS, LAZ, PLY or another format of the guide
    #[arg(value_name = "SURVEY", required = true)]
    pub surveys: Vec<PathBuf>,
    /// The block, as `tsumu blocks` lists it: "tetrapod 5t", "cube 1.5m" [default: tetrapod 5t]
    #[arg(long, value_name = "NAME")]
    pub block: Option<String>,
    /// The site folder [default: the first survey's name, here]
    #[arg(long, value_name = "SITE_DIR")]
    pub out: Option<PathBuf>,
}

/// Writes the two files.
pub fn init(args: &InitArgs, terminal: &Terminal, job: &Job) -> Result<()> {
    let of_survey = || args.surveys[0].file_stem().map_or("site".into(), PathBuf::from);
    let folder = args.out.clone().unwrap_or_else(of_survey);
    let made = tsumu::init(&args.surveys, args.block.as_deref(), &folder, job)?;
    terminal.emit("init", &json!({ "folder": folder, "to_check": made.to_check }));
    terminal
        .say(format!("wrote {} and catalog.toml; look at:", folder.join("site.toml").display()));
    made.to_check.iter().for_each(|what| terminal.say(format!("  {what}")));
    terminal.say(format!("then: tsumu run {}", shown(&folder)));
    Ok(())
}

/// A path as a shell takes it.
fn shown(folder: &Path) -> String {
    let text = folder.display().to_string();
    if text.contains(char::is_whitespace) { format!("\"{text}\"") } else { text }
}
