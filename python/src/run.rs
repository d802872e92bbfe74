//! Run folders: made in one call, opened, verified.

use crate::errors::raised;
use crate::planned::Planned;
use crate::recognition::Recognition;
use crate::site::Site;
use crate::work::{Asked, work};
use pyo3::prelude::*;
use std::path::PathBuf;
use std::sync::Arc;
use tsumu::{PlanOptions, RecogniseOptions, RunOptions};

/// An opened run: its site, its blocks and, where it has one, its plan.
type Opened = (Site, Recognition, Option<Planned>);

/// Everything for one site in one call; an interrupted run goes on.
#[pyfunction]
pub fn run(
    py: Python<'_>,
    site: &Site,
    folder: PathBuf,
    weights: Option<PathBuf>,
    proposer: Option<PathBuf>,
    asked: Asked,
) -> PyResult<PathBuf> {
    let site = site.0.clone();
    let options = RunOptions {
        recognise: RecogniseOptions { weights, ..RecogniseOptions::default() },
        plan: PlanOptions { proposer, ..PlanOptions::default() },
    };
    let done = work(py, asked, move |job| tsumu::run(&site, &folder, &options, job))?;
    Ok(done.root().to_path_buf())
}

/// Files of a run that are not as they were, each as a line.
#[pyfunction]
pub fn verify(py: Python<'_>, folder: PathBuf, site: Option<PathBuf>) -> PyResult<Vec<String>> {
    let found = py.detach(|| tsumu::Run::verify(&folder, site.as_deref()));
    Ok(found.map_err(|e| raised(&e))?.iter().map(ToString::to_string).collect())
}

/// Opens the run of a site, with the settings it was made with.
#[pyfunction]
pub fn open_run(
    py: Python<'_>,
    folder: PathBuf,
    site: Option<PathBuf>,
    asked: Asked,
) -> PyResult<Opened> {
    let (site, run) = work(py, asked, move |job| {
        let (place, run) = tsumu::folders_of(&folder, site.as_deref())?;
        let site = tsumu::Run::settled(run.root(), tsumu::Site::load(&place, job)?, job)?;
        let run = tsumu::Run::open(run.root(), &site)?;
        Ok((Arc::new(site), run))
    })?;
    let found = Arc::new(run.recognition);
    let of = |planned| Planned { site: site.clone(), found: found.clone(), planned };
    let planned = run.planned.map(of);
    Ok((Site(site.clone()), Recognition { site, found }, planned))
}

/// Writes the page and the exports of a run of this site.
#[pyfunction]
pub fn present(
    py: Python<'_>,
    site: &Site,
    run: PathBuf,
    page: Option<PathBuf>,
    exports: Option<PathBuf>,
    asked: Asked,
) -> PyResult<()> {
    let site = site.0.clone();
    work(py, asked, move |job| {
        let run = tsumu::Run::open(&run, &site)?;
        if let Some(page) = page {
            run.report(&site, job)?.write_html(&page)?;
        }
        exports.map_or(Ok(()), |folder| run.export(&site, &folder))
    })
}
