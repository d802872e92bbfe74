//! Work of the program as child processes: each is told to speak JSON, listened to, and can be ended.

use crate::names::shown;
use crate::order::Command;
use crate::refusal::{Answer, Refusal};
use crate::snapshot::{Snapshot, State};
use std::collections::BTreeMap;
use std::ffi::OsString;
use std::path::PathBuf;
use std::process::Stdio;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;
use tokio::io::{AsyncBufReadExt, AsyncRead, BufReader};
use tokio::process::Child;
use tokio::sync::{Semaphore, watch};

/// Work that is over and still listed.
const MOST_LISTED: usize = 100;
/// How long a request waits for news.
const PATIENCE: Duration = Duration::from_secs(20);

/// All work since the program was started.
pub struct Jobs {
    program: PathBuf,
    root: PathBuf,
    all: Mutex<BTreeMap<u64, Arc<Job>>>,
    last: AtomicU64,
    /// Work of minutes is done one after the other: it takes all cores.
    heavy: Semaphore,
}

struct Job {
    now: watch::Sender<Snapshot>,
    stop: watch::Sender<bool>,
}

impl Jobs {
    pub fn new(program: PathBuf, root: PathBuf) -> Self {
        Self {
            program,
            root,
            all: Mutex::default(),
            last: AtomicU64::new(0),
            heavy: Semaphore::new(1),
        }
    }

    /// A number for one more job.
    pub fn new_id(&self) -> u64 {
        self.last.fetch_add(1, Ordering::Relaxed) + 1
    }

    /// Begins a piece of work. Error: the same folder is being written already.
    pub fn begin(self: &Arc<Self>, id: u64, command: Command) -> Answer<()> {
        let out = match command.out.as_os_str().is_empty() {
            true => String::new(),
            false => shown(&self.root, &command.out),
        };
        let mut all = self.listed();
        let busy = all.values().find(|job| {
            let now = job.now.borrow();
            !now.state.is_over() && !out.is_empty() && now.out == out
        });
        if busy.is_some() {
            return Err(Refusal::conflict("at-work", out));
        }
        let snapshot = Snapshot::new(id, command.kind, command.site.clone(), out);
        let job =
            Arc::new(Job { now: watch::Sender::new(snapshot), stop: watch::Sender::new(false) });
        all.insert(id, Arc::clone(&job));
        forget_old(&mut all);
        drop(all);
        let jobs = Arc::clone(self);
        tokio::spawn(async move { jobs.work(&job, command).await });
        Ok(())
    }

    /// What all work has told so far, the latest first.
    pub fn list(&self) -> Vec<Snapshot> {
        self.listed().values().rev().map(|job| job.now.borrow().clone()).collect()
    }

    /// The state of a job as soon as it is newer than `version`, or after a while.
    pub async fn news(&self, id: u64, version: u64) -> Answer<Snapshot> {
        let job = self.job(id)?;
        let mut hears = job.now.subscribe();
        let newer = hears.wait_for(|now| now.version > version);
        let _ = tokio::time::timeout(PATIENCE, newer).await;
        Ok(job.now.borrow().clone())
    }

    /// Asks a job to end; its finished parts stay.
    pub fn stop(&self, id: u64) -> Answer<()> {
        self.job(id)?.stop.send_replace(true);
        Ok(())
    }

    /// Asks all of them.
    pub fn stop_all(&self) {
        for job in self.listed().values() {
            job.stop.send_replace(true);
        }
    }

    fn listed(&self) -> std::sync::MutexGuard<'_, BTreeMap<u64, Arc<Job>>> {
        self.all.lock().expect("no thread panics with this lock")
    }

    fn job(&self, id: u64) -> Answer<Arc<Job>> {
        let found = self.listed().get(&id).cloned();
        found.ok_or_else(|| Refusal::gone(format!("job {id}")))
    }

    async fn work(&self, job: &Job, command: Command) {
        let mut stop = job.stop.subscribe();
        let state = tokio::select! {
            biased;
            () = asked(&mut stop) => State::Stopped,
            state = self.run(job, command) => state,
        };
        job.now.send_modify(|now| now.end(state));
    }

    /// Dropped before its end, it takes the child with it.
    async fn run(&self, job: &Job, command: Command) -> State {
        let _turn = match command.heavy {
            true => Some(self.heavy.acquire().await.expect("never closed")),
            false => None,
        };
        job.now.send_modify(|now| {
            now.state = State::Running;
            now.started_ms = crate::snapshot::now_ms();
            now.version += 1;
        });
        match self.spawn(command.args) {
            Ok(child) => listen(job, child).await,
            Err(e) => {
                let line = format!("cannot start {}: {e}", self.program.display());
                job.now.send_modify(|now| now.hear_error(&line));
                State::Failed
            }
        }
    }

    fn spawn(&self, args: Vec<OsString>) -> std::io::Result<Child> {
        let mut command = tokio::process::Command::new(&self.program);
        command.arg("--json").args(args).current_dir(&self.root);
        command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
        command.kill_on_drop(true);
        // No black window for each piece of work.
        #[cfg(windows)]
        command.creation_flags(0x0800_0000);
        command.spawn()
    }
}

async fn asked(stop: &mut watch::Receiver<bool>) {
    let _ = stop.wait_for(|stop| *stop).await;
}

async fn listen(job: &Job, mut child: Child) -> State {
    let (out, err) = (child.stdout.take(), child.stderr.take());
    let said = lines(out, |line| job.now.send_modify(|now| now.hear(line)));
    let complained = lines(err, |line| job.now.send_modify(|now| now.hear_error(line)));
    let (_, _, ended) = tokio::join!(said, complained, child.wait());
    match ended.ok().and_then(|status| status.code()) {
        Some(0) => State::Done,
        Some(_) => State::Failed,
        None => State::Died,
    }
}

async fn lines(from: Option<impl AsyncRead + Unpin>, mut hear: impl FnMut(&str)) {
    let Some(from) = from else { return };
    let mut lines = BufReader::new(from).split(b'\n');
    while let Ok(Some(line)) = lines.next_segment().await {
        hear(String::from_utf8_lossy(&line).trim_end());
    }
}

fn forget_old(all: &mut BTreeMap<u64, Arc<Job>>) {
    while all.len() > MOST_LISTED {
        let over = |job: &Arc<Job>| job.now.borrow().state.is_over();
        let Some(old) = all.iter().find(|(_, job)| over(job)).map(|(id, _)| *id) else { return };
        all.remove(&old);
    }
}
