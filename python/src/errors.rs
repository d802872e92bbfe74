//! The library's errors as the package's exceptions, by whose fault it is.

use pyo3::prelude::*;
use tsumu::{Error, Kind};

/// An exception of `tsumu.errors`.
pub fn raised(error: &Error) -> PyErr {
    let class = match error.kind() {
        Kind::BadInput => "BadInput",
        Kind::Failed => "Failed",
        Kind::Stopped => "Stopped",
        Kind::TryAgain => "TryAgain",
    };
    of_class(class, &error.lines().join("\n"))
}

/// What an argument has wrong.
pub fn bad_input(message: impl std::fmt::Display) -> PyErr {
    raised(&Error::bad_input(anyhow::anyhow!("{message}")))
}

/// An exception by the name of its class.
pub fn of_class(class: &str, message: &str) -> PyErr {
    Python::attach(|py| {
        let made = py.import("tsumu.errors").and_then(|m| m.getattr(class)?.call1((message,)));
        made.map_or_else(|other| other, PyErr::from_value)
    })
}
