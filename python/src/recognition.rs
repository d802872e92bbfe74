//! Blocks and labels as columns.

use crate::columns::{bytes, matrix, quaternion};
use crate::errors::{bad_input, raised};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use scene::{Fit, Recognised, Segmentation};
use std::path::PathBuf;
use std::sync::Arc;
use tsumu::{RecogniseSummary, Run};

/// Which block every point belongs to, and the blocks.
#[pyclass(frozen)]
pub struct Recognition {
    pub site: Arc<tsumu::Site>,
    pub found: Arc<tsumu::Recognition>,
}

/// The type number of a block of no type.
const NO_TYPE: u16 = u16::MAX;

impl Recognition {
    fn of_point<T: Copy>(&self, none: T, of: impl Fn(&Recognised, &Fit) -> T) -> Vec<T> {
        let mut column = vec![none; self.site.survey.cloud.len()];
        for (block, fit) in scene::stated(&self.found.blocks) {
            let value = of(block, fit);
            block.points.iter().for_each(|&i| column[i as usize] = value);
        }
        column
    }

    fn fits(&self) -> impl Iterator<Item = Option<&Fit>> {
        self.found.blocks.iter().map(Recognised::fit)
    }
}

#[pymethods]
impl Recognition {
    /// Block of each point as uint32 bytes, 0 = none.
    fn labels<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let labels = self.of_point(0, |block, _| block.block.0);
        bytes(py, labels.len(), labels.into_iter())
    }

    /// Confidence of each point's block as float32 bytes, 0 = none.
    fn label_confidence<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let confidence = self.of_point(0.0, |_, fit| fit.confidence.unwrap_or(0.0));
        bytes(py, confidence.len(), confidence.into_iter())
    }

    /// Columns of the blocks, stated and not judged, by name.
    fn blocks<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let (blocks, frame) = (&self.found.blocks, &self.site.survey.frame);
        let n = blocks.len();
        let nan = |of: fn(&Fit) -> Option<f32>| {
            self.fits().map(move |fit| fit.and_then(of).unwrap_or(f32::NAN))
        };
        let columns = PyDict::new(py);
        columns.set_item("id", bytes(py, n, blocks.iter().map(|b| b.block.0))?)?;
        let types = self.fits().map(|f| f.map_or(NO_TYPE, |f| f.model.0));
        columns.set_item("type", bytes(py, n, types)?)?;
        let stated = blocks.iter().map(|b| u8::from(b.is_stated()));
        columns.set_item("stated", bytes(py, n, stated)?)?;
        let judged = self.fits().map(|f| u8::from(f.is_some_and(|f| f.type_judged)));
        columns.set_item("type_judged", bytes(py, n, judged)?)?;
        let pose =
            |f: Option<&Fit>| f.map_or([f64::NAN; 16], |f| matrix(&f.site_from_block, frame));
        columns.set_item("pose", bytes(py, 16 * n, self.fits().flat_map(pose))?)?;
        let turn = |f: Option<&Fit>| f.map_or([f64::NAN; 4], |f| quaternion(&f.site_from_block));
        columns.set_item("quaternion", bytes(py, 4 * n, self.fits().flat_map(turn))?)?;
        let catalog = &self.site.catalog;
        let centre = |b: &Recognised| frame.site_from_local(b.centre(catalog)).to_array();
        columns.set_item("centre", bytes(py, 3 * n, blocks.iter().flat_map(centre))?)?;
        columns.set_item("confidence", bytes(py, n, nan(|f| f.confidence))?)?;
        columns.set_item("occlusion", bytes(py, n, nan(|f| f.occlusion))?)?;
        columns.set_item("fitness_m", bytes(py, n, nan(|f| f.fitness_m))?)?;
        let held = |f: Option<&Fit>| {
            let covariance = f.and_then(|f| f.covariance);
            covariance.map_or([f32::NAN; 36], |c| *c.row_major())
        };
        columns.set_item("covariance", bytes(py, 36 * n, self.fits().flat_map(held))?)?;
        let counts = blocks.iter().map(|b| b.points.len() as u32);
        columns.set_item("points", bytes(py, n, counts)?)?;
        Ok(columns)
    }

    /// Indices of the points of the block in a row of the table, as uint32 bytes.
    fn points_of<'py>(&self, py: Python<'py>, row: usize) -> PyResult<Bound<'py, PyBytes>> {
        let block = self.found.blocks.get(row);
        let points = &block.ok_or_else(|| bad_input(format!("there is no block {row}")))?.points;
        bytes(py, points.len(), points.iter().copied())
    }

    /// What the network alone said: instance of each point (uint32 bytes), confidence (float32 bytes), instances.
    fn instances<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<(Bound<'py, PyBytes>, Bound<'py, PyBytes>, usize)> {
        let s = &self.found.segments;
        let instance = bytes(py, s.instance.len(), s.instance.iter().copied())?;
        Ok((instance, bytes(py, s.confidence.len(), s.confidence.iter().copied())?, s.instances))
    }

    /// The figures of `recognise/summary.json`.
    fn summary(&self) -> PyResult<String> {
        let summary = RecogniseSummary::of(&self.site.survey, &self.found, &self.site.catalog);
        serde_json::to_string(&summary).map_err(bad_input)
    }

    /// Which weights were used.
    #[getter]
    fn weights(&self) -> &str {
        &self.found.weights.line
    }

    /// Leaves what `tsumu recognise` leaves.
    fn save(&self, py: Python<'_>, folder: PathBuf) -> PyResult<()> {
        let keep = || {
            let run = Run::create(&folder, &self.site)?.keep(&*self.found)?;
            run.picture()?;
            run.seal().map(|_| ())
        };
        py.detach(keep).map_err(|e| raised(&e))
    }

    /// Writes the survey with the network's instances: .laz, .las or .ply.
    fn write_labelled(&self, py: Python<'_>, file: PathBuf) -> PyResult<()> {
        let (segments, weights) = (&self.found.segments, &self.found.weights);
        let write = || self.site.write_labelled(&file, segments, weights);
        py.detach(write).map_err(|e| raised(&e))
    }
}

/// What the network says of the points, before any pose.
#[pyclass(frozen)]
pub struct Segments {
    pub site: Arc<tsumu::Site>,
    pub found: Segmentation,
    pub weights: String,
}

#[pymethods]
impl Segments {
    /// Instance of each point as uint32 bytes, 0 = none.
    fn labels<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        bytes(py, self.found.instance.len(), self.found.instance.iter().copied())
    }

    /// Confidence of each label as float32 bytes.
    fn confidence<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        bytes(py, self.found.confidence.len(), self.found.confidence.iter().copied())
    }

    /// Centre hypotheses: places (float64 bytes, rows of three, site coordinates) and scores (float32 bytes).
    fn centres<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<(Bound<'py, PyBytes>, Bound<'py, PyBytes>)> {
        let (all, frame) = (&self.found.hypotheses, &self.site.survey.frame);
        let places = all.iter().flat_map(|h| frame.site_from_local(h.centre).to_array());
        Ok((bytes(py, 3 * all.len(), places)?, bytes(py, all.len(), all.iter().map(|h| h.score))?))
    }

    #[getter]
    fn instances(&self) -> usize {
        self.found.instances
    }

    #[getter]
    fn weights(&self) -> &str {
        &self.weights
    }
}
