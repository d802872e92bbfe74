//! `tsumu completions`: the shell's completion script.

use clap::{Args, CommandFactory};
use clap_complete::Shell;
use std::io::Write;
use tsumu::{Error, Result};

/// For example: tsumu completions bash > ~/.local/share/bash-completion/completions/tsumu
#[derive(Debug, Args)]
pub struct CompletionsArgs {
    /// Which shell
    pub shell: Shell,
}

/// Prints the script for the command line `C`.
pub fn completions<C: CommandFactory>(args: &CompletionsArgs) -> Result<()> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut C::command(), "tsumu", &mut script);
    std::io::stdout().write_all(&script).map_err(Error::failed)
}
