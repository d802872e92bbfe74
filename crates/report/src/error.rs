//! Why a report cannot be written.

/// Names the value that does not fit.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReportError {
    /// A column that must match the points does not.
    #[error("report: `{column}` has {found} values for {need} points")]
    Column {
        /// Name of the column.
        column: &'static str,
        /// Values found.
        found: usize,
        /// Values needed.
        need: usize,
    },
    /// A block or placement of a type that is not in the catalogue.
    #[error(
        "report: block type {model} is not in the catalogue of {count} types; use the run's own catalogue"
    )]
    UnknownModel {
        /// Number of the type.
        model: u16,
        /// Types in the catalogue.
        count: usize,
    },
    /// A coordinate that is not a number.
    #[error("report: {what} {number} has a coordinate that is not a number")]
    NotFinite {
        /// Point, block or placement.
        what: &'static str,
        /// Its number, from 0.
        number: usize,
    },
    /// An alignment that is no line.
    #[error("report: the alignment needs at least two points")]
    Line,
    /// Compression or encoding failed.
    #[error("report: the page's data could not be packed: {0}")]
    Pack(String),
}
