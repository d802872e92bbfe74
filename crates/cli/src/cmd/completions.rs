//! `tsumu completions`: the shell's completion script.

use crate::{args::Options, exit::Exit};
use clap::{Args, CommandFactory};
use clap_complete::Shell;

/// For example: tsumu completions bash > ~/.local/share/bash-completion/completions/tsumu
#[derive(Debug, Args)]
pub struct CompletionsArgs {
    /// Which shell
    pub shell: Shell,
}

/// Prints the script.
pub fn completions(args: &CompletionsArgs) -> Result<(), Exit> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut Options::command(), "tsumu", &mut script);
    use std::io::Write;
    std::io::stdout().write_all(&script)?;
    Ok(())
}
