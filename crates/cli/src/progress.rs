//! Progress for people (a bar with the time left, after two seconds) and for machines (`--json`).

use crate::{args::Output, exit::Exit};
use geom::{Event, Observer};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use serde_json::{Value, json};
use std::io::{IsTerminal, Write};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Work shorter than this shows no bar.
const PATIENCE: Duration = Duration::from_secs(2);

static INTERRUPTED: AtomicBool = AtomicBool::new(false);

/// Hears the stages and tells the terminal, or the program reading standard output.
pub struct Terminal {
    verbose: u8,
    quiet: bool,
    json: bool,
    bars: bool,
    running: Mutex<Option<Running>>,
    warnings: Mutex<Vec<String>>,
}

struct Running {
    stage: &'static str,
    total: u64,
    since: Instant,
    bar: Option<ProgressBar>,
}

impl Terminal {
    /// Installs the Ctrl-C handler: the first press asks the stages to stop, the second ends the program.
    pub fn new(output: &Output) -> Self {
        // A second handler in one process cannot be: main calls this once.
        let _ = ctrlc::set_handler(|| {
            if INTERRUPTED.swap(true, Ordering::SeqCst) {
                std::process::exit(1);
            }
            eprintln!("stopping after the work in hand; press Ctrl-C again to stop at once");
        });
        Self {
            verbose: output.verbose,
            quiet: output.quiet,
            json: output.json,
            bars: !output.json && !output.quiet && std::io::stderr().is_terminal(),
            running: Mutex::new(None),
            warnings: Mutex::new(Vec::new()),
        }
    }

    /// A line of the result, for people; silent with `--json` and `--quiet`.
    pub fn say(&self, line: impl AsRef<str>) {
        if !self.json && !self.quiet {
            print_line(line.as_ref());
        }
    }

    /// A result for machines; silent without `--json`.
    pub fn emit(&self, kind: &str, value: Value) {
        if self.json {
            print_line(&json!({ "event": kind, "value": value }).to_string());
        }
    }

    /// Warnings heard so far, in order.
    pub fn warnings(&self) -> Vec<String> {
        self.warnings.lock().expect("no thread panics with this lock").clone()
    }

    /// A warning of an earlier run whose work is kept, as [`Self::warnings`] has it.
    pub fn warn_again(&self, line: String) {
        if self.json {
            let (stage, message) = line.split_once(": ").unwrap_or(("", &line));
            print_line(
                &json!({ "event": "warning", "stage": stage, "message": message }).to_string(),
            );
        } else if !self.quiet {
            self.above_bar(&format!("warning: {line}"));
        }
        self.warnings.lock().expect("no thread panics with this lock").push(line);
    }

    /// The error that ends the program.
    pub fn failed(&self, exit: &Exit) {
        self.clear();
        if self.json {
            print_line(
                &json!({ "event": "failed", "code": exit.code(), "message": exit.line() })
                    .to_string(),
            );
        }
        eprintln!("tsumu: {}", exit.line());
    }

    fn clear(&self) {
        if let Some(running) = self.running.lock().expect("no thread panics with this lock").take()
            && let Some(bar) = running.bar
        {
            bar.finish_and_clear();
        }
    }

    fn above_bar(&self, line: &str) {
        match self
            .running
            .lock()
            .expect("no thread panics with this lock")
            .as_ref()
            .and_then(|r| r.bar.as_ref())
        {
            Some(bar) => bar.suspend(|| eprintln!("{line}")),
            None => eprintln!("{line}"),
        }
    }
}

impl Observer for Terminal {
    fn event(&self, event: Event) {
        if self.json {
            let value = match &event {
                Event::Started { stage, total } => {
                    json!({ "event": "started", "stage": stage, "total": total })
                }
                Event::Advanced { stage, done } => {
                    json!({ "event": "advanced", "stage": stage, "done": done })
                }
                Event::Finished { stage } => json!({ "event": "finished", "stage": stage }),
                Event::Warned(w) => {
                    json!({ "event": "warning", "stage": w.stage, "message": w.message })
                }
                Event::Noted { stage, message } => {
                    json!({ "event": "note", "stage": stage, "message": message })
                }
                _ => return,
            };
            print_line(&value.to_string());
        }
        match event {
            Event::Started { stage, total } => {
                self.clear();
                let running = Running { stage, total, since: Instant::now(), bar: None };
                *self.running.lock().expect("no thread panics with this lock") = Some(running);
            }
            Event::Advanced { stage, done } if self.bars => {
                let mut guard = self.running.lock().expect("no thread panics with this lock");
                if let Some(running) = guard.as_mut().filter(|r| r.stage == stage) {
                    if running.bar.is_none() && running.since.elapsed() > PATIENCE {
                        running.bar = Some(bar(running.stage, running.total));
                    }
                    if let Some(bar) = &running.bar {
                        bar.set_position(done);
                    }
                }
            }
            Event::Finished { .. } => self.clear(),
            Event::Warned(warning) => {
                let line = format!("{}: {}", warning.stage, warning.message);
                if !self.quiet && !self.json {
                    self.above_bar(&format!("warning: {line}"));
                }
                self.warnings.lock().expect("no thread panics with this lock").push(line);
            }
            Event::Noted { stage, message } if self.verbose > 0 && !self.json => {
                self.above_bar(&format!("{stage}: {message}"));
            }
            _ => {}
        }
    }

    fn cancelled(&self) -> bool {
        INTERRUPTED.load(Ordering::SeqCst)
    }
}

fn bar(stage: &'static str, total: u64) -> ProgressBar {
    let template = if total > 0 {
        "{msg:>10} {bar:32} {pos}/{len}  {elapsed} gone, {eta} left"
    } else {
        "{msg:>10} {spinner} {pos}  {elapsed} gone"
    };
    let style = ProgressStyle::with_template(template).expect("the template is constant");
    let bar =
        ProgressBar::with_draw_target((total > 0).then_some(total), ProgressDrawTarget::stderr());
    bar.set_style(style);
    bar.set_message(stage);
    bar
}

/// A reader that has gone away (`| head`) is no error.
fn print_line(line: &str) {
    let _ = writeln!(std::io::stdout(), "{line}");
}
