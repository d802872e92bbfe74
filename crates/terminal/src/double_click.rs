//! The program started without a terminal, by a double click: it opens the page.

use std::ffi::OsString;
use std::io::IsTerminal;
use std::path::PathBuf;

/// Sites of people without a terminal lie here, in their home folder.
const FOLDER: &str = "Tsumu";

/// The arguments, or those of `tsumu open` for a program that was started by a double click.
pub fn arguments() -> Vec<OsString> {
    let given: Vec<OsString> = std::env::args_os().collect();
    match home().filter(|_| given.len() == 1 && clicked()) {
        Some(home) => {
            let folder = home.join(FOLDER);
            // A folder that cannot be made is named by the command.
            let _ = std::fs::create_dir_all(&folder);
            given.into_iter().chain(["open".into(), folder.into()]).collect()
        }
        None => given,
    }
}

fn home() -> Option<PathBuf> {
    std::env::home_dir().filter(|home| home.is_dir())
}

/// Windows gives a window of its own to a program that was clicked, and cannot be asked which it is: without arguments the page is
/// what is wanted there. Elsewhere nothing is connected to a terminal, and there is a screen.
fn clicked() -> bool {
    let screen = ["DISPLAY", "WAYLAND_DISPLAY"].iter().any(|name| std::env::var_os(name).is_some());
    let terminal = std::io::stdin().is_terminal()
        || std::io::stdout().is_terminal()
        || std::io::stderr().is_terminal();
    cfg!(windows) || (screen && !terminal)
}
