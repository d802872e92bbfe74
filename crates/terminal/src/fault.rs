//! A fault of the program's own ends like any other failure: one line, finished parts kept, and a file that a user can send.

use std::backtrace::Backtrace;
use std::panic::{self, AssertUnwindSafe};
use std::path::PathBuf;
use std::sync::Mutex;
use tsumu::{Error, Result};

/// What the first fault said; later ones follow from it.
static SAID: Mutex<Option<String>> = Mutex::new(None);

/// Runs a command; a panic in it, on whatever thread, becomes an error.
pub fn caught(command: impl FnOnce() -> Result<()>) -> Result<()> {
    panic::set_hook(Box::new(|fault| {
        let said = format!("{fault}\n{}", Backtrace::force_capture());
        if let Ok(mut first) = SAID.lock() {
            first.get_or_insert(said);
        }
    }));
    match panic::catch_unwind(AssertUnwindSafe(command)) {
        Ok(ended) => ended,
        Err(_) => {
            let said = SAID.lock().ok().and_then(|mut s| s.take()).unwrap_or_default();
            Err(Error::failed(anyhow::anyhow!(line(&said))))
        }
    }
}

fn line(said: &str) -> String {
    let first = said.lines().take(2).collect::<Vec<_>>().join(" ");
    let sent = match written(said) {
        Some(file) => format!("please send {}", file.display()),
        None => "no file about it could be written".into(),
    };
    format!(
        "the program came upon a fault of its own ({first}); finished parts are kept, and {sent}"
    )
}

/// Version, command line and where it happened; nothing of the user's data.
fn written(said: &str) -> Option<PathBuf> {
    let file = std::env::temp_dir().join(format!("tsumu-fault-{}.txt", std::process::id()));
    let command: Vec<String> = std::env::args().collect();
    let text = format!(
        "tsumu {} on {} {}\n{}\n\n{said}\n",
        env!("CARGO_PKG_VERSION"),
        std::env::consts::OS,
        std::env::consts::ARCH,
        command.join(" ")
    );
    // A file of that name that is there already is somebody else's.
    let mut new = std::fs::OpenOptions::new().write(true).create_new(true).open(&file).ok()?;
    std::io::Write::write_all(&mut new, text.as_bytes()).ok()?;
    Some(file)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_is_one_line_and_names_a_file() {
        let error = caught(|| panic!("a corner was lost")).unwrap_err();
        let line = error.line();
        assert!(line.contains("a corner was lost") && !line.contains('\n'), "{line}");
        let name = line.split("please send ").nth(1).unwrap();
        assert!(std::fs::read_to_string(name).unwrap().contains("fault.rs"));
        std::fs::remove_file(name).unwrap();
        assert!(caught(|| Ok(())).is_ok());
    }
}
