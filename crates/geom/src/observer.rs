//! Progress and warnings as typed events: libraries never print.

use crate::{JobPart, Stage};

/// What a running stage has to say.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
#[serde(tag = "event", rename_all = "lowercase")]
#[non_exhaustive]
pub enum Event {
    /// A stage begins; `total` units of work are expected (0: unknown).
    Started {
        /// Which.
        stage: Stage,
        /// Units of work expected.
        total: u64,
    },
    /// `done` units of the running stage are finished.
    Advanced {
        /// Which stage.
        stage: Stage,
        /// Units finished so far.
        done: u64,
    },
    /// A stage has ended.
    Finished {
        /// Which stage.
        stage: Stage,
    },
    /// A part of a longer job is done.
    Part {
        /// Which.
        part: JobPart,
        /// Where it came from and whether it stays.
        state: PartState,
    },
    /// Something the user should know; the work goes on.
    #[serde(rename = "warning")]
    Warned(Warning),
    /// A detail for `-v`.
    #[serde(rename = "note")]
    Noted {
        /// Which stage.
        stage: Stage,
        /// One line.
        message: String,
    },
}

/// What became of a part of a longer job.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum PartState {
    /// Done now.
    Done,
    /// Done now, and kept from now on in case the job is interrupted.
    Keeping,
    /// Taken over from a job that was interrupted.
    Kept,
}

/// A partial failure that did not stop the work.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Warning {
    /// Who warns.
    pub stage: Stage,
    /// One line: what happened, with values, and what to do about it.
    pub message: String,
}

impl std::fmt::Display for Warning {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}: {}", self.stage, self.message)
    }
}

/// Hears events; called from any thread.
pub trait Observer: Sync {
    /// One event.
    fn event(&self, event: Event);

    /// True when the user asked to stop; long loops ask between units of work.
    fn cancelled(&self) -> bool {
        false
    }
}

/// Hears nothing and never cancels.
#[derive(Clone, Copy, Debug, Default)]
pub struct Silent;

impl Observer for Silent {
    fn event(&self, _event: Event) {}
}
