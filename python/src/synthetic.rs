//! Synthetic piles with known truth.

use crate::catalog::Catalog;
use crate::columns::{bytes, matrix};
use crate::errors::raised;
use crate::work::{Asked, work};
use geom::Silent;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use scene::PlacedBlock;
use std::path::PathBuf;
use std::sync::Arc;
use tsumu::{DatasetOptions, RecipeInputs, Shard};

/// A recipe with its block types.
#[pyclass(frozen)]
pub struct Recipe(Arc<RecipeInputs>);

/// Reads a recipe and the catalogue it, or the file if one is given, names.
#[pyfunction]
pub fn read_recipe(file: PathBuf, catalog: Option<PathBuf>) -> PyResult<Recipe> {
    let read = tsumu::read_recipe(&file, catalog.as_deref(), &Silent).map_err(|e| raised(&e))?;
    Ok(Recipe(Arc::new(read)))
}

#[pymethods]
impl Recipe {
    /// Its block types.
    fn catalog(&self) -> Catalog {
        Catalog(Arc::new(self.0.catalog.clone()))
    }

    /// One scene as columns by name.
    fn scene<'py>(
        &self,
        py: Python<'py>,
        seed: u64,
        index: u32,
        asked: Asked,
    ) -> PyResult<Bound<'py, PyDict>> {
        let inputs = self.0.clone();
        let made = work(py, asked, move |job| {
            let made = job.install(|| tsumu::make_scene(&inputs, seed, index))?;
            match job.is_stopped() {
                true => Err(tsumu::Error::stopped(anyhow::anyhow!("stopped"))),
                false => Ok(made),
            }
        })?;
        let (cloud, frame) = (&made.survey.cloud, &made.survey.frame);
        let columns = PyDict::new(py);
        let site = |p: &geom::Vec3| frame.site_from_local(*p).to_array();
        let points = cloud.position_m.iter().flat_map(site);
        columns.set_item("points", bytes(py, 3 * cloud.len(), points)?)?;
        columns.set_item("labels", bytes(py, cloud.len(), made.instance.iter().copied())?)?;
        let line = &made.survey.line;
        columns.set_item("lines", bytes(py, line.len(), line.iter().copied())?)?;
        let seen_from = &made.survey.sensor_positions;
        let places = seen_from.iter().flat_map(site);
        columns.set_item("sensor_positions", bytes(py, 3 * seen_from.len(), places)?)?;
        let blocks = &made.scene.blocks;
        let pose = |b: &PlacedBlock| matrix(&b.site_from_block, frame);
        columns.set_item("pose", bytes(py, 16 * blocks.len(), blocks.iter().flat_map(pose))?)?;
        columns.set_item("id", bytes(py, blocks.len(), blocks.iter().map(|b| b.block.0))?)?;
        columns.set_item("type", bytes(py, blocks.len(), blocks.iter().map(|b| b.model.0))?)?;
        let hidden = made.occlusion.iter().copied();
        columns.set_item("occlusion", bytes(py, made.occlusion.len(), hidden)?)?;
        Ok(columns)
    }

    /// A dataset folder; scenes made now, scenes that were there.
    #[expect(clippy::too_many_arguments, reason = "they are the command's")]
    fn dataset(
        &self,
        py: Python<'_>,
        out: PathBuf,
        scenes: u32,
        seed: u64,
        index: u32,
        count: u32,
        split: [f64; 3],
        preview: bool,
        asked: Asked,
    ) -> PyResult<(usize, usize)> {
        let inputs = self.0.clone();
        let shard = Shard { index, count };
        let options = DatasetOptions { scenes, seed, shard, split, preview };
        let made = work(py, asked, move |job| tsumu::make_dataset(&out, &inputs, &options, job))?;
        Ok((made.made, made.there))
    }
}
