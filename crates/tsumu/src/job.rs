//! What goes with every longer call: who hears of it, who may stop it, on how many threads it works.

use crate::{Error, MemoryLimit, Result};
use anyhow::{Context, anyhow};
use geom::{Event, JobPart, Observer, PartState, Silent, Warning};
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};

/// More of them than any machine has cores; each holds memory of its own before it does anything.
const MOST_THREADS: usize = 1024;

/// Asks a job to stop, from any thread. Clones are of the same job.
///
/// ```
/// use geom::Observer;
/// use tsumu::{Cancel, Job};
/// let stop = Cancel::default();
/// let job = Job::silent().cancelled_by(stop.clone());
/// assert!(!job.cancelled());
/// stop.cancel();
/// assert!(job.cancelled());
/// ```
#[derive(Clone, Debug, Default)]
pub struct Cancel(Arc<AtomicBool>);

impl Cancel {
    /// Asks to stop after the work in hand; whether it had been asked before.
    pub fn cancel(&self) -> bool {
        self.0.swap(true, Ordering::SeqCst)
    }

    /// Whether somebody asked to stop.
    pub fn is_cancelled(&self) -> bool {
        self.0.load(Ordering::SeqCst)
    }
}

/// One piece of work: hears the stages, remembers what they warned of, and knows whether it is to stop.
pub struct Job<'a> {
    observer: &'a dyn Observer,
    cancel: Cancel,
    threads: Option<ThreadPool>,
    memory: MemoryLimit,
    warnings: Mutex<Vec<Warning>>,
}

impl Job<'static> {
    /// Nobody hears.
    pub fn silent() -> Self {
        Job::new(&Silent)
    }
}

impl<'a> Job<'a> {
    /// Work on all cores that `observer` hears of.
    pub fn new(observer: &'a dyn Observer) -> Self {
        let warnings = Mutex::default();
        let (cancel, memory) = (Cancel::default(), MemoryLimit::default());
        Self { observer, cancel, threads: None, memory, warnings }
    }

    /// The same, stopped by `cancel`.
    pub fn cancelled_by(self, cancel: Cancel) -> Self {
        Self { cancel, ..self }
    }

    /// The same, its bound on memory told to whoever watches the program.
    pub fn limited_by(self, memory: MemoryLimit) -> Self {
        Self { memory, ..self }
    }

    /// What bounds its memory.
    pub(crate) fn memory(&self) -> &MemoryLimit {
        &self.memory
    }

    /// The same on so many threads; results do not depend on it. Errors: none at all, or so many that starting them takes the memory.
    pub fn on_threads(self, threads: usize) -> Result<Self> {
        if threads == 0 {
            return Err(Error::bad_input(anyhow!("--threads 0: give at least 1")));
        }
        if threads > MOST_THREADS {
            return Err(Error::bad_input(anyhow!(
                "--threads {threads}: more than {MOST_THREADS}, from which no machine gains; give about as many as it has cores"
            )));
        }
        let pool = ThreadPoolBuilder::new().num_threads(threads).build();
        Ok(Self { threads: Some(pool.context("starting threads")?), ..self })
    }

    /// What was warned of so far, in order, each as `stage: message`.
    pub fn warnings(&self) -> Vec<String> {
        self.warned().iter().map(Warning::to_string).collect()
    }

    /// What was warned of so far, in order.
    pub(crate) fn warned(&self) -> Vec<Warning> {
        self.warnings.lock().expect("no thread panics with this lock").clone()
    }

    /// A part is done.
    pub(crate) fn done(&self, part: JobPart) {
        self.event(Event::Part { part, state: PartState::Done });
    }

    /// Whether somebody asked it to stop.
    pub fn is_stopped(&self) -> bool {
        self.cancelled()
    }

    /// Does the work on the job's threads.
    pub fn install<R: Send>(&self, work: impl FnOnce() -> R + Send) -> R {
        match &self.threads {
            Some(pool) => pool.install(work),
            None => work(),
        }
    }
}

impl Observer for Job<'_> {
    fn event(&self, event: Event) {
        if let Event::Warned(warning) = &event {
            self.warnings.lock().expect("no thread panics with this lock").push(warning.clone());
        }
        self.observer.event(event);
    }

    fn cancelled(&self) -> bool {
        self.cancel.is_cancelled() || self.observer.cancelled()
    }
}
