//! What is wrong, or worth knowing, about an input: which file, where in it, what was read and what to do.

use serde::Serialize;
use std::fmt;

/// How much a complaint matters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Severity {
    /// Worth knowing; nothing has to be done.
    Note,
    /// The answer may be wrong.
    Warning,
    /// No answer can be given before this is put right.
    Refusal,
}

/// One finding. Its text is one line.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Complaint {
    /// Short name of the kind of finding, the same in every language: `crs-differs`.
    pub code: &'static str,
    /// How much it matters.
    pub severity: Severity,
    /// The file.
    pub file: String,
    /// Key or line in it; empty for the whole file.
    pub place: String,
    /// What was read.
    pub found: String,
    /// What to do; empty for a note.
    pub advice: String,
}

impl Complaint {
    /// A finding that rules an answer out.
    pub fn refusal(
        code: &'static str,
        file: impl Into<String>,
        found: impl Into<String>,
        advice: impl Into<String>,
    ) -> Self {
        let (file, found, advice) = (file.into(), found.into(), advice.into());
        Self { code, severity: Severity::Refusal, file, place: String::new(), found, advice }
    }

    /// The same that only casts doubt on the answer.
    pub fn warning(
        code: &'static str,
        file: impl Into<String>,
        found: impl Into<String>,
        advice: impl Into<String>,
    ) -> Self {
        Self { severity: Severity::Warning, ..Self::refusal(code, file, found, advice) }
    }

    /// A finding that asks for nothing.
    pub fn note(code: &'static str, file: impl Into<String>, found: impl Into<String>) -> Self {
        Self { severity: Severity::Note, ..Self::refusal(code, file, found, "") }
    }

    /// The same at a key or line of the file.
    #[must_use]
    pub fn at(mut self, place: impl Into<String>) -> Self {
        self.place = place.into();
        self
    }
}

impl fmt::Display for Complaint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.file)?;
        if !self.place.is_empty() {
            write!(f, ", {}", self.place)?;
        }
        write!(f, ": {}", self.found)?;
        if self.advice.is_empty() { Ok(()) } else { write!(f, "; {}", self.advice) }
    }
}
