//! Block types.

use crate::columns::{bytes, rows};
use crate::errors::{bad_input, raised};
use geom::{Silent, TriMesh, Vec3};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use scene::CatalogSpec;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

/// The block types of a site, in order.
#[pyclass(frozen)]
pub struct Catalog(pub Arc<scene::Catalog>);

/// A mesh as Python gives it: name, corners (float32 bytes), triangles (uint32 bytes).
type Mesh<'py> = (String, Bound<'py, PyBytes>, Bound<'py, PyBytes>);

/// From JSON text of `[[block]]` entries and the meshes they name; other meshes lie beside `file`.
#[pyfunction]
pub fn catalog_of(spec: &str, meshes: Vec<Mesh<'_>>, file: Option<PathBuf>) -> PyResult<Catalog> {
    let spec: CatalogSpec =
        serde_json::from_str(spec).map_err(|e| bad_input(format!("catalog: {e}")))?;
    let mut all = BTreeMap::new();
    for (name, vertices, triangles) in meshes {
        let corners = rows::<f32, 3>("vertices", vertices.as_bytes())?;
        let mesh = TriMesh {
            vertices: corners.into_iter().map(Vec3::from_array).collect(),
            triangles: rows::<u32, 3>("triangles", triangles.as_bytes())?,
        };
        all.insert(name, mesh);
    }
    let made = tsumu::catalog_of(&spec, &all, file.as_deref(), &Silent).map_err(|e| raised(&e))?;
    Ok(Catalog(Arc::new(made)))
}

/// Reads `catalog.toml` with the meshes beside it.
#[pyfunction]
pub fn read_catalog(path: PathBuf) -> PyResult<Catalog> {
    let read = tsumu::read_catalog(&path, &Silent).map_err(|e| raised(&e))?;
    Ok(Catalog(Arc::new(read)))
}

#[pymethods]
impl Catalog {
    /// What is known of each type.
    fn types<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyDict>>> {
        let one = |model: &scene::BlockModel| {
            let facts = PyDict::new(py);
            facts.set_item("name", &model.name)?;
            facts.set_item("volume_m3", f64::from(model.volume_m3))?;
            facts.set_item("mass_kg", f64::from(model.mass_kg()))?;
            facts.set_item("density_kg_m3", f64::from(model.density_kg_m3))?;
            facts.set_item("longest_edge_m", f64::from(model.d_box_m))?;
            facts.set_item("reach_m", f64::from(model.d_max_m))?;
            let [x, y, z] = model.centre.to_array().map(f64::from);
            facts.set_item("centre", (x, y, z))?;
            facts.set_item("symmetries", model.symmetry.order())?;
            Ok(facts)
        };
        self.0.iter().map(|(_, model)| one(model)).collect()
    }

    /// Corners (float32 bytes) and triangles (uint32 bytes) of a type's surface.
    fn mesh<'py>(
        &self,
        py: Python<'py>,
        index: usize,
    ) -> PyResult<(Bound<'py, PyBytes>, Bound<'py, PyBytes>)> {
        let found = self.0.iter().nth(index);
        let (_, model) = found.ok_or_else(|| bad_input(format!("there is no type {index}")))?;
        let TriMesh { vertices, triangles } = &model.mesh;
        let corners = vertices.iter().flat_map(|v| v.to_array());
        let of_triangles = triangles.iter().flatten().copied();
        Ok((bytes(py, 3 * vertices.len(), corners)?, bytes(py, 3 * triangles.len(), of_triangles)?))
    }

    /// The types of both. Error: a name of both.
    fn joined(&self, other: &Self) -> PyResult<Self> {
        for (_, model) in other.0.iter() {
            if self.0.find(&model.name).is_some() {
                return Err(bad_input(format!("catalog: both have a type `{}`", model.name)));
            }
        }
        let models = self.0.iter().chain(other.0.iter()).map(|(_, model)| model.clone());
        Ok(Self(Arc::new(scene::Catalog::new(models.collect()))))
    }
}
