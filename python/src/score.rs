//! Any result against any truth.

use crate::errors::bad_input;
use crate::work::{Asked, work};
use pyo3::prelude::*;
use std::path::PathBuf;
use tsumu::Evaluation;

/// Scores a result folder against a truth folder; JSON text of the figures.
#[pyfunction]
pub fn evaluate(
    py: Python<'_>,
    truth: PathBuf,
    result: PathBuf,
    catalog: Option<PathBuf>,
    occlusion_limit: f32,
    asked: Asked,
) -> PyResult<String> {
    let mut order = Evaluation { truth, result, catalog, ..Evaluation::default() };
    order.criteria.occlusion_limit = occlusion_limit;
    let scores = work(py, asked, move |job| tsumu::evaluate(&order, job))?;
    serde_json::to_string(&scores).map_err(bad_input)
}
