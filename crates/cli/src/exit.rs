//! How a command ends: 0, 1 (failed) or 2 (bad usage or input), with one line that says what to do.

/// A command that did not succeed.
#[derive(Debug)]
pub struct Exit {
    code: u8,
    error: anyhow::Error,
}

impl Exit {
    /// The user's files or words are wrong.
    pub fn bad_input(error: impl Into<anyhow::Error>) -> Self {
        Self { code: 2, error: error.into() }
    }

    /// The work failed for another reason: disk, interruption, no result.
    pub fn failed(error: impl Into<anyhow::Error>) -> Self {
        Self { code: 1, error: error.into() }
    }

    /// Exit status.
    pub fn code(&self) -> u8 {
        self.code
    }

    /// The whole chain of causes on one line.
    pub fn line(&self) -> String {
        // A library's message often ends with its cause already: say each thing once.
        let mut line = String::new();
        for cause in self.error.chain() {
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

/// What the stages refuse is the fault of what they were given, unless the user stopped them; anything else is a
/// failure of the work.
impl<E: Into<anyhow::Error>> From<E> for Exit {
    fn from(error: E) -> Self {
        let error = error.into();
        match error.downcast_ref::<pipeline::PipelineError>() {
            Some(refused) if !refused.is_interruption() => Self::bad_input(error),
            _ => Self::failed(error),
        }
    }
}

/// Marks an error as the fault of what the user gave.
pub trait OrBadInput<T> {
    /// Exit status 2 on error.
    fn or_bad_input(self) -> Result<T, Exit>;
}

impl<T, E: Into<anyhow::Error>> OrBadInput<T> for Result<T, E> {
    fn or_bad_input(self) -> Result<T, Exit> {
        self.map_err(Exit::bad_input)
    }
}
