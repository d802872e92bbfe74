//! A site: a folder, or a cloud in memory.

use crate::catalog::Catalog;
use crate::columns::{bytes, numbers, rows};
use crate::errors::{bad_input, raised};
use crate::planned::Planned;
use crate::recognition::{Recognition, Segments};
use crate::work::{Asked, work};
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use scene::SensorKind;
use serde::de::DeserializeOwned;
use std::path::PathBuf;
use std::sync::Arc;
use tsumu::{Arrays, PlanOptions, RecogniseOptions, Settings};

/// What there is to recognise and to plan on.
#[pyclass(frozen)]
pub struct Site(pub Arc<tsumu::Site>);

/// Settings as Python gives them.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct Given {
    /// JSON text of tables.
    tables: Option<String>,
    /// A TOML file.
    file: Option<PathBuf>,
    /// Root of all random choices.
    seed: Option<u64>,
}

impl Given {
    pub fn settings(self) -> PyResult<Settings> {
        let tables = self.tables.as_deref().unwrap_or("{}");
        let settings = Settings::of_json(tables).map_err(|e| raised(&e))?;
        Ok(Settings { file: self.file, seed: self.seed, ..settings })
    }
}

/// A cloud as columns of bytes, and what is said of it.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct Columns {
    points: Py<PyBytes>,
    normals: Option<Py<PyBytes>>,
    lines: Option<Py<PyBytes>>,
    sensor_positions: Option<Py<PyBytes>>,
    sensor: String,
    crs: String,
    vertical_datum: String,
    name: String,
    design: Option<String>,
    ground: Option<String>,
}

impl Columns {
    pub fn arrays(&self, py: Python<'_>) -> PyResult<Arrays> {
        fn held<'a>(py: Python<'a>, column: &'a Option<Py<PyBytes>>) -> &'a [u8] {
            column.as_ref().map_or(&[], |c| c.as_bytes(py))
        }
        Ok(Arrays {
            points: rows("points", self.points.as_bytes(py))?,
            normals: rows("normals", held(py, &self.normals))?,
            lines: numbers(held(py, &self.lines)).collect(),
            sensor: json("sensor", &format!("{:?}", self.sensor))?,
            sensor_positions: rows("sensor_positions", held(py, &self.sensor_positions))?,
            crs: self.crs.clone(),
            vertical_datum: self.vertical_datum.clone(),
            name: self.name.clone(),
            design: self.design.as_ref().map(|text| json("design", text)).transpose()?,
            ground: self.ground.as_ref().map(|text| json("ground", text)).transpose()?,
        })
    }
}

fn json<T: DeserializeOwned>(name: &str, text: &str) -> PyResult<T> {
    serde_json::from_str(text).map_err(|e| bad_input(format!("{name}: {e}")))
}

#[pymethods]
impl Site {
    /// Reads a site folder.
    #[staticmethod]
    fn load(py: Python<'_>, folder: PathBuf, given: Given, asked: Asked) -> PyResult<Self> {
        let settings = given.settings()?;
        let site = work(py, asked, move |job| tsumu::Site::load_with(&folder, &settings, job))?;
        Ok(Self(Arc::new(site)))
    }

    /// A cloud in memory. The bytes are let go of before the work.
    #[staticmethod]
    fn of_arrays(
        py: Python<'_>,
        columns: Columns,
        catalog: &Catalog,
        given: Given,
        asked: Asked,
    ) -> PyResult<Self> {
        let (arrays, settings) = (columns.arrays(py)?, given.settings()?);
        drop(columns);
        let catalog = scene::Catalog::clone(&catalog.0);
        let site =
            work(py, asked, move |job| tsumu::Site::of_arrays(arrays, catalog, &settings, job))?;
        Ok(Self(Arc::new(site)))
    }

    /// Finds the blocks.
    fn recognise(
        &self,
        py: Python<'_>,
        weights: Option<PathBuf>,
        asked: Asked,
    ) -> PyResult<Recognition> {
        let (site, options) =
            (self.0.clone(), RecogniseOptions { weights, ..RecogniseOptions::default() });
        let found = work(py, asked, move |job| site.recognise(&options, job))?;
        Ok(Recognition { site: self.0.clone(), found: Arc::new(found) })
    }

    /// Labels the points with the network alone.
    fn segment(
        &self,
        py: Python<'_>,
        weights: Option<PathBuf>,
        asked: Asked,
    ) -> PyResult<Segments> {
        let (site, options) =
            (self.0.clone(), RecogniseOptions { weights, ..RecogniseOptions::default() });
        let (found, origin) = work(py, asked, move |job| site.segmentation(&options, job))?;
        Ok(Segments { site: self.0.clone(), found, weights: origin.line })
    }

    /// Plans the blocks to add. `proposer`: a placement network for policy `network`.
    fn plan(
        &self,
        py: Python<'_>,
        recognition: &Recognition,
        proposer: Option<PathBuf>,
        asked: Asked,
    ) -> PyResult<Planned> {
        self.is_of_this_survey(&recognition.site)?;
        let (site, found) = (self.0.clone(), recognition.found.clone());
        let options = PlanOptions { proposer, ..PlanOptions::default() };
        let planned = work(py, asked, move |job| site.plan(&found, &options, job))?;
        Ok(Planned { site: self.0.clone(), found: recognition.found.clone(), planned })
    }

    /// The points, site coordinates, as float64 bytes of rows of three.
    fn points<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let survey = &self.0.survey;
        let site = |p: &geom::Vec3| survey.frame.site_from_local(*p).to_array();
        bytes(py, 3 * survey.cloud.len(), survey.cloud.position_m.iter().flat_map(site))
    }

    /// How many points there are.
    fn len(&self) -> usize {
        self.0.survey.cloud.len()
    }

    /// Its block types.
    fn catalog(&self) -> Catalog {
        Catalog(Arc::new(self.0.catalog.clone()))
    }

    /// Its settings as JSON text.
    fn config(&self) -> PyResult<String> {
        serde_json::to_string(&self.0.config).map_err(bad_input)
    }

    #[getter]
    fn name(&self) -> &str {
        &self.0.name
    }

    #[getter]
    fn crs(&self) -> &str {
        &self.0.survey.frame.crs
    }

    #[getter]
    fn vertical_datum(&self) -> &str {
        &self.0.survey.frame.vertical_datum
    }

    #[getter]
    fn survey_date(&self) -> &str {
        &self.0.survey_date
    }

    #[getter]
    fn folder(&self) -> Option<PathBuf> {
        self.0.folder.clone()
    }

    #[getter]
    fn seed(&self) -> u64 {
        self.0.seed
    }

    #[getter]
    fn origin(&self) -> [f64; 3] {
        self.0.survey.frame.origin
    }

    #[getter]
    fn sensor(&self) -> &'static str {
        match self.0.survey.sensor {
            SensorKind::Uav => "uav",
            SensorKind::Mbes => "mbes",
            SensorKind::DepthCamera => "depth-camera",
        }
    }

    #[getter]
    fn has_design(&self) -> bool {
        self.0.design.is_some()
    }
}

impl Site {
    /// Refuses blocks of another survey or catalogue: their points and types would be taken for others.
    fn is_of_this_survey(&self, other: &tsumu::Site) -> PyResult<()> {
        let (own, theirs) = (&self.0.survey, &other.survey);
        let names = |site: &tsumu::Site| -> Vec<String> {
            site.catalog.iter().map(|(_, model)| model.name.clone()).collect()
        };
        if own.cloud.position_m != theirs.cloud.position_m
            || own.frame.origin != theirs.frame.origin
        {
            return Err(bad_input("recognition: is of another survey than this site's"));
        }
        if names(&self.0) != names(other) {
            return Err(bad_input("recognition: is of another catalogue than this site's"));
        }
        Ok(())
    }
}
