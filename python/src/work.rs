//! A long call: the work goes on in a thread of its own without the interpreter's lock; the caller's thread hears of progress,
//! calls back and looks for Ctrl-C.

use crate::errors::{of_class, raised};
use geom::{Event, Observer, Stage};
use pyo3::prelude::*;
use std::sync::Mutex;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread::{Builder, JoinHandle};
use std::time::{Duration, Instant};
use tsumu::{Cancel, Job, Result};

/// How often the caller's thread looks for Ctrl-C, and at most calls back.
const TICK: Duration = Duration::from_millis(50);
/// Deep meshes and trees are walked on the worker's own stack, as large as a main thread's.
pub const STACK_BYTES: usize = 8 << 20;

/// What a caller says of how the work is done.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct Asked {
    /// Called with (stage, done, total) on the caller's thread, or None.
    progress: Option<Py<PyAny>>,
    /// How many threads; None: one a core.
    threads: Option<usize>,
}

impl Asked {
    /// Who hears of progress.
    pub fn progress(&self) -> Option<&Py<PyAny>> {
        self.progress.as_ref()
    }
}

/// What the worker says.
pub struct Said {
    stage: Stage,
    done: Option<u64>,
    total: Option<u64>,
}

/// Hears the stages for the caller's thread.
pub struct Teller(Mutex<(Sender<Said>, u64)>);

impl Teller {
    /// Tells this caller.
    pub fn new(tell: Sender<Said>) -> Self {
        Self(Mutex::new((tell, 0)))
    }
}

impl Observer for Teller {
    fn event(&self, event: Event) {
        let mut held = self.0.lock().expect("no thread panics with this lock");
        let said = match event {
            Event::Started { stage, total } => {
                held.1 = total;
                Said { stage, done: Some(0), total: Some(total).filter(|&n| n > 0) }
            }
            Event::Advanced { stage, done } => {
                Said { stage, done: Some(done), total: Some(held.1).filter(|&n| n > 0) }
            }
            Event::Finished { stage } => Said { stage, done: None, total: None },
            _ => return,
        };
        // Nobody listens any more once the caller gave up.
        let _ = held.0.send(said);
    }
}

/// Does the work; with it come the warnings, which are also raised as `tsumu.TsumuWarning`.
pub fn work<T: Send + 'static>(
    py: Python<'_>,
    asked: Asked,
    task: impl FnOnce(&Job) -> Result<T> + Send + 'static,
) -> PyResult<T> {
    let cancel = Cancel::default();
    let (tell, hear) = channel();
    let worker = start(asked.threads, cancel.clone(), tell, task)?;
    let interrupted = listen(py, hear, asked.progress.as_ref(), &cancel);
    let ended = py.detach(|| worker.join());
    // What Python raised counts before what its stop made of the work.
    interrupted?;
    let Ok((result, warnings)) = ended else {
        return Err(fault());
    };
    let result = result.map_err(|e| raised(&e))?;
    warn(py, warnings)?;
    Ok(result)
}

/// Raises warnings at the place that called the package.
pub fn warn(py: Python<'_>, warnings: Vec<String>) -> PyResult<()> {
    if !warnings.is_empty() {
        py.import("tsumu.errors")?.getattr("warn")?.call1((warnings,))?;
    }
    Ok(())
}

/// A fault of ours, as an exception.
pub fn fault() -> PyErr {
    of_class("Failed", "the program has a fault: please report this with its input")
}

type Ended<T> = (Result<T>, Vec<String>);

fn start<T: Send + 'static>(
    threads: Option<usize>,
    cancel: Cancel,
    tell: Sender<Said>,
    task: impl FnOnce(&Job) -> Result<T> + Send + 'static,
) -> PyResult<JoinHandle<Ended<T>>> {
    let body = move || {
        let teller = Teller::new(tell);
        let job = Job::new(&teller).cancelled_by(cancel);
        let job = match threads {
            None => job,
            Some(n) => match job.on_threads(n) {
                Ok(job) => job,
                Err(error) => return (Err(error), Vec::new()),
            },
        };
        let result = task(&job);
        (result, job.warnings())
    };
    let started = Builder::new().name("tsumu".into()).stack_size(STACK_BYTES).spawn(body);
    started.map_err(|e| of_class("Failed", &format!("cannot start a thread: {e}")))
}

/// Until the worker has nothing more to say. What Python raises meanwhile asks it to stop, and comes back.
pub fn listen(
    py: Python<'_>,
    mut hear: Receiver<Said>,
    progress: Option<&Py<PyAny>>,
    cancel: &Cancel,
) -> PyResult<()> {
    let mut raised = Ok(());
    let mut last: Option<Instant> = None;
    loop {
        let (back, heard) = py.detach(move || {
            let heard = hear.recv_timeout(TICK);
            (hear, heard)
        });
        hear = back;
        let step = match heard {
            Ok(said) => {
                let between = said.done.is_some_and(|d| d > 0) && said.done != said.total;
                let too_soon = between && last.is_some_and(|at| at.elapsed() < TICK);
                match progress.filter(|_| raised.is_ok() && !too_soon) {
                    Some(call) => {
                        last = Some(Instant::now());
                        call.call1(py, (said.stage.word(), said.done, said.total)).map(|_| ())
                    }
                    None => Ok(()),
                }
            }
            Err(RecvTimeoutError::Timeout) => Ok(()),
            Err(RecvTimeoutError::Disconnected) => return raised,
        };
        if let Err(error) = step.and_then(|()| py.check_signals()) {
            cancel.cancel();
            raised = raised.and(Err(error));
        }
    }
}
