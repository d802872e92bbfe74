//! A stacking plan as columns.

use crate::columns::{bytes, matrix};
use crate::errors::{bad_input, raised};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::path::PathBuf;
use std::sync::Arc;
use tsumu::{Job, Run};

/// A plan and what it stands on.
#[pyclass(frozen)]
pub struct Planned {
    pub site: Arc<tsumu::Site>,
    pub found: Arc<tsumu::Recognition>,
    pub planned: tsumu::Planned,
}

#[pymethods]
impl Planned {
    /// Columns of the placements, those that stay first.
    fn placements<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let (plan, frame) = (&self.planned.plan, &self.site.survey.frame);
        let all = || plan.placements.iter().chain(&plan.removed);
        let n = all().count();
        let columns = PyDict::new(py);
        columns.set_item("order", bytes(py, n, all().map(|p| p.order))?)?;
        columns.set_item("round", bytes(py, n, all().map(|p| p.round))?)?;
        columns.set_item("type", bytes(py, n, all().map(|p| p.model.0))?)?;
        let drops = all().flat_map(|p| matrix(&p.drop, frame));
        columns.set_item("drop", bytes(py, 16 * n, drops)?)?;
        let rests = all().flat_map(|p| matrix(&p.rest, frame));
        columns.set_item("rest", bytes(py, 16 * n, rests)?)?;
        columns.set_item("filled_m3", bytes(py, n, all().map(|p| p.filled_m3))?)?;
        columns.set_item("contacts", bytes(py, n, all().map(|p| p.contacts))?)?;
        let states: Vec<&str> = all().map(|p| p.state.word()).collect();
        columns.set_item("state", states)?;
        Ok(columns)
    }

    /// The figures of `plan/summary.json`.
    fn summary(&self) -> PyResult<String> {
        serde_json::to_string(&self.planned.summary()).map_err(bad_input)
    }

    /// Leaves the whole run folder: blocks, plan, report, exports.
    fn save(&self, py: Python<'_>, folder: PathBuf) -> PyResult<()> {
        let keep = || {
            let run = Run::create(&folder, &self.site)?.keep(&*self.found)?.keep(&self.planned)?;
            run.present(&Job::silent())?.seal().map(|_| ())
        };
        py.detach(keep).map_err(|e| raised(&e))
    }
}
