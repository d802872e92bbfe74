//! Progress for people (a bar with the time left, after two seconds) and for machines (`--json`).

use crate::{Language, Output, language};
use geom::{Event, JobPart, Observer, PartState, Stage};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use serde::Serialize;
use serde_json::json;
use std::io::{IsTerminal, Write};
use std::sync::Mutex;
use std::time::{Duration, Instant};
use tsumu::{Cancel, Error, Job, MemoryLimit, Result};

/// Work shorter than this shows no bar.
const PATIENCE: Duration = Duration::from_secs(2);

/// Hears the stages and tells the terminal, or the program reading standard output.
pub struct Terminal {
    verbose: u8,
    quiet: bool,
    json: bool,
    language: Language,
    bars: bool,
    threads: Option<usize>,
    cancel: Cancel,
    memory: MemoryLimit,
    running: Mutex<Option<Running>>,
    laps: Mutex<Laps>,
}

/// Wall time of each part of a job.
struct Laps {
    last: Instant,
    seconds: Vec<(JobPart, f64)>,
}

struct Running {
    stage: Stage,
    total: u64,
    since: Instant,
    bar: Option<ProgressBar>,
}

impl Terminal {
    /// Installs the Ctrl-C handler: the first press asks the stages to stop, the second ends the program. Watches memory, and
    /// has an abort end with a line.
    pub fn new(output: &Output) -> Self {
        // First, for the other threads may find no memory to begin with. Without it an abort ends as the system ends it.
        #[cfg(unix)]
        let _ = crate::abort::told(output.json);
        let cancel = Cancel::default();
        let asked = cancel.clone();
        // A second handler in one process cannot be: main calls this once.
        let _ = ctrlc::set_handler(move || {
            if asked.cancel() {
                std::process::exit(1);
            }
            to_stderr("stopping after the work in hand; press Ctrl-C again to stop at once");
        });
        let memory = MemoryLimit::default();
        crate::watch::over(memory.clone());
        Self {
            verbose: output.verbose,
            quiet: output.quiet,
            json: output.json,
            language: Language::chosen(output.lang, |name| std::env::var(name).ok()),
            bars: !output.json && !output.quiet && std::io::stderr().is_terminal(),
            threads: output.threads,
            cancel,
            memory,
            running: Mutex::new(None),
            laps: Mutex::new(Laps { last: Instant::now(), seconds: Vec::new() }),
        }
    }

    /// A job that this terminal hears of and that Ctrl-C stops. Error: `--threads 0`.
    pub fn job(&self) -> Result<Job<'_>> {
        let job = Job::new(self).cancelled_by(self.cancel.clone()).limited_by(self.memory.clone());
        match self.threads {
            Some(threads) => job.on_threads(threads),
            None => Ok(job),
        }
    }

    /// Wall seconds of the parts done so far, in order, as `timing.json` has them.
    pub fn timing(&self) -> serde_json::Value {
        let laps = self.laps.lock().expect("no thread panics with this lock");
        laps.seconds.iter().map(|(part, s)| (format!("{part}_s"), json!(s))).collect()
    }

    /// A line of the result, for people; silent with `--json` and `--quiet`.
    pub fn say(&self, line: impl AsRef<str>) {
        if !self.json && !self.quiet {
            print_line(&self.language.line(line.as_ref()));
        }
    }

    /// A result for machines; silent without `--json`.
    pub fn emit(&self, kind: &str, value: &impl Serialize) {
        if self.json {
            // Through text, so that an f32 keeps its own digits.
            let value = tsumu::json_value(value).unwrap_or_default();
            print_line(&json!({ "event": kind, "value": value }).to_string());
        }
    }

    /// The error that ends the program.
    pub(crate) fn failed(&self, error: &Error, code: u8) {
        self.clear();
        let message = error.line();
        if self.json {
            let id = error.lines().iter().find_map(|line| language::code(line));
            let event = json!({ "event": "failed", "code": code, "id": id, "message": message });
            print_line(&event.to_string());
        }
        for line in error.lines() {
            to_stderr(&format!("tsumu: {}", self.language.line(&line)));
        }
    }

    /// A part is done: its wall time, and that it was kept or is kept from now on.
    fn part(&self, part: JobPart, state: PartState) {
        let mut laps = self.laps.lock().expect("no thread panics with this lock");
        let seconds = laps.last.elapsed().as_secs_f64();
        laps.seconds.push((part, seconds));
        laps.last = Instant::now();
        match state {
            PartState::Done => {}
            PartState::Keeping => self.emit("keeping", &json!({ "part": part })),
            PartState::Kept => {
                self.emit("kept", &json!({ "part": part }));
                self.say(format!("{part}: kept from the run that was interrupted"));
            }
        }
    }

    fn clear(&self) {
        if let Some(running) = self.running.lock().expect("no thread panics with this lock").take()
            && let Some(bar) = running.bar
        {
            bar.finish_and_clear();
        }
    }

    fn above_bar(&self, line: &str) {
        let line = &self.language.line(line);
        match self
            .running
            .lock()
            .expect("no thread panics with this lock")
            .as_ref()
            .and_then(|r| r.bar.as_ref())
        {
            Some(bar) => bar.suspend(|| to_stderr(line)),
            None => to_stderr(line),
        }
    }
}

impl Observer for Terminal {
    fn event(&self, event: Event) {
        if self.json && !matches!(event, Event::Part { .. }) {
            print_line(&serde_json::to_string(&event).unwrap_or_default());
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
            Event::Part { part, state } => self.part(part, state),
            Event::Warned(warning) if !self.quiet && !self.json => {
                self.above_bar(&format!("warning: {warning}"));
            }
            Event::Noted { stage, message } if self.verbose > 0 && !self.json => {
                self.above_bar(&format!("{stage}: {message}"));
            }
            _ => {}
        }
    }

    fn cancelled(&self) -> bool {
        self.cancel.is_cancelled()
    }
}

fn bar(stage: Stage, total: u64) -> ProgressBar {
    let template = if total > 0 {
        "{msg:>10} {bar:32} {pos}/{len}  {elapsed} gone, {eta} left"
    } else {
        "{msg:>10} {spinner} {pos}  {elapsed} gone"
    };
    let style = ProgressStyle::with_template(template).expect("the template is constant");
    let bar =
        ProgressBar::with_draw_target((total > 0).then_some(total), ProgressDrawTarget::stderr());
    bar.set_style(style);
    bar.set_message(stage.word());
    bar
}

/// A line for people. Where it cannot be written, the disk behind it being full, the work counts more than its warnings.
pub(crate) fn to_stderr(line: &str) {
    let _ = writeln!(std::io::stderr(), "{line}");
}

/// What kept a line from standard output.
static LOST: Mutex<Option<String>> = Mutex::new(None);

/// A reader that has gone away (`| head`) is no error.
fn print_line(line: &str) {
    if let Err(error) = writeln!(std::io::stdout(), "{line}")
        && error.kind() != std::io::ErrorKind::BrokenPipe
        && let Ok(mut lost) = LOST.lock()
    {
        lost.get_or_insert(error.to_string());
    }
}

/// Why lines are missing from standard output; `None`: none are.
pub(crate) fn lost_lines() -> Option<String> {
    LOST.lock().ok().and_then(|mut lost| lost.take())
}
