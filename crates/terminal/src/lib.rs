//! What the programs share at a terminal: flags for output, progress for people and for machines, how a command begins and ends,
//! manual pages and completions of any command line.

#[cfg(unix)]
mod abort;
mod completions;
mod double_click;
mod fault;
mod flags;
mod language;
mod man;
mod terminal;
mod watch;

pub use completions::{CompletionsArgs, completions};
pub use double_click::arguments;
pub use flags::Output;
pub use language::Language;
pub use man::{ManArgs, man};
pub use terminal::Terminal;

use std::process::ExitCode;
use tsumu::{Error, Kind, Result};

/// Runs a command and ends as it does: 0 done, 1 failed or stopped, 2 what the user gave is wrong.
pub fn end(terminal: &Terminal, command: impl FnOnce() -> Result<()>) -> ExitCode {
    let ended = fault::caught(command).and_then(|()| match terminal::lost_lines() {
        None => Ok(()),
        Some(why) => Err(Error::failed(anyhow::anyhow!(
            "cannot write to standard output: {why}; the files of the result are written, what was to be printed is not"
        ))),
    });
    match ended {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            let code = code(&error);
            terminal.failed(&error, code);
            ExitCode::from(code)
        }
    }
}

fn code(error: &Error) -> u8 {
    match error.kind() {
        Kind::BadInput => 2,
        Kind::Failed | Kind::Stopped => 1,
        // EX_TEMPFAIL of sysexits.h: what schedulers take for "try again".
        Kind::TryAgain => 75,
    }
}
