//! Why something was not done: whose fault it is, and the whole chain of causes.

use std::fmt;

/// Whose fault it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// What the user gave is wrong; the message names file, key or line and says what to do.
    BadInput,
    /// The work failed for another reason: disk, rights, no result.
    Failed,
    /// The user asked to stop.
    Stopped,
    /// What failed or was stopped may well go the next time: a disk, a network, a machine that was taken away.
    TryAgain,
}

/// An error of any stage or file with its causes.
#[derive(Debug)]
pub struct Error {
    kind: Kind,
    cause: anyhow::Error,
}

/// Complaints, one a line.
#[derive(Debug, thiserror::Error)]
#[error("{}", .0.join("\n"))]
struct Several(Vec<String>);

/// What all calls of this crate return.
pub type Result<T> = std::result::Result<T, Error>;

impl Error {
    /// The user's files or words are wrong.
    pub fn bad_input(cause: impl Into<anyhow::Error>) -> Self {
        Self { kind: Kind::BadInput, cause: cause.into() }
    }

    /// The work failed for another reason.
    pub fn failed(cause: impl Into<anyhow::Error>) -> Self {
        Self { kind: Kind::Failed, cause: cause.into() }
    }

    /// The user asked to stop.
    pub fn stopped(cause: impl Into<anyhow::Error>) -> Self {
        Self { kind: Kind::Stopped, cause: cause.into() }
    }

    /// The same where a second try costs little and may mend what is not the fault of what was given.
    pub(crate) fn worth_another_try(self) -> Self {
        match self.kind {
            Kind::Failed | Kind::Stopped => Self { kind: Kind::TryAgain, ..self },
            Kind::BadInput | Kind::TryAgain => self,
        }
    }

    /// Several complaints about the user's files, one a line; `None` without any.
    pub(crate) fn of_lines(lines: Vec<String>) -> Option<Self> {
        let lines: Vec<_> = lines.iter().map(|line| line.replace('\n', " ")).collect();
        (!lines.is_empty()).then(|| Self::bad_input(Several(lines)))
    }

    /// One line for each thing that is wrong: several complaints come at once.
    pub fn lines(&self) -> Vec<String> {
        if let Some(Several(lines)) = self.cause.downcast_ref() {
            return lines.clone();
        }
        match self.cause.downcast_ref::<io::IoError>() {
            Some(all @ io::IoError::Several { .. }) => {
                all.each().iter().map(|e| e.to_string().replace('\n', " ")).collect()
            }
            _ => vec![self.line()],
        }
    }

    /// Whose fault it is.
    pub fn kind(&self) -> Kind {
        self.kind
    }

    /// The whole chain of causes on one line.
    pub fn line(&self) -> String {
        // A library's message often ends with its cause already: say each thing once.
        let mut line = String::new();
        for cause in self.cause.chain() {
            let text = cause.to_string();
            if !line.contains(&text) {
                if !line.is_empty() {
                    line.push_str(": ");
                }
                line.push_str(&text);
            }
        }
        line.replace('\n', " ")
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.cause.fmt(f)
    }
}

impl std::error::Error for Error {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        self.cause.source()
    }
}

/// What the stages refuse is the fault of what they were given, unless the user stopped them.
impl From<pipeline::PipelineError> for Error {
    fn from(error: pipeline::PipelineError) -> Self {
        if error.is_interruption() { Self::stopped(error) } else { Self::bad_input(error) }
    }
}

/// Errors that are nobody's fault where `?` meets them; a reader of the user's files says `or_bad_input` instead.
macro_rules! fails {
    ($($error:ty),+) => {
        $(impl From<$error> for Error {
            fn from(error: $error) -> Self {
                Self::failed(error)
            }
        })+
    };
}

fails!(
    anyhow::Error,
    io::IoError,
    report::ReportError,
    serde_json::Error,
    toml::ser::Error,
    ciborium::ser::Error<std::io::Error>,
    metrics::MetricsError
);

/// Marks an error as the fault of what the user gave.
pub(crate) trait OrBadInput<T> {
    /// [`Kind::BadInput`] on error.
    fn or_bad_input(self) -> Result<T>;
}

impl<T, E: Into<anyhow::Error>> OrBadInput<T> for std::result::Result<T, E> {
    fn or_bad_input(self) -> Result<T> {
        self.map_err(Error::bad_input)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::error::Error as _;

    #[test]
    fn every_cause_is_kept_and_said_once() {
        let file = io::IoError::Os {
            path: "a.laz".into(),
            doing: "read",
            source: std::io::Error::other("the disk is gone"),
        };
        let error = Error::bad_input(anyhow::Error::new(file).context("site.toml"));
        assert_eq!(error.kind(), Kind::BadInput);
        let line = error.line();
        assert!(line.starts_with("site.toml: ") && line.matches("a.laz").count() == 1, "{line}");
        let mut source = error.source();
        let mut depth = 0;
        while let Some(cause) = source {
            (source, depth) = (cause.source(), depth + 1);
        }
        assert!(depth >= 2, "the chain ends after {depth}");
    }
}
