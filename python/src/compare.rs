//! What happened between surveys.

use crate::work::{Asked, work};
use pyo3::prelude::*;
use serde_json::{Value, json};
use std::path::PathBuf;
use tsumu::{CompareOptions, Compared, ComparisonFolder, EpochRun};

/// Compares epochs in order of time (run or site folders), or one with the plan of an earlier run. JSON text: the summary and
/// a table of changes for each step. `out`: a folder for everything the command leaves.
#[pyfunction]
pub fn compare(
    py: Python<'_>,
    epochs: Vec<PathBuf>,
    plan: Option<PathBuf>,
    fixed: bool,
    stable: Option<PathBuf>,
    out: Option<PathBuf>,
    asked: Asked,
) -> PyResult<String> {
    let found = work(py, asked, move |job| {
        let mut options = CompareOptions::default();
        options.config.registration.fixed = fixed;
        if let Some(file) = &stable {
            options.stable = tsumu::read_stable_ground(file)?;
        }
        let folder = out.as_deref().map(ComparisonFolder::begin).transpose()?;
        let paths = plan.iter().chain(&epochs);
        let opened = paths.map(|path| EpochRun::open(path, &options.recognise, job));
        let opened = opened.collect::<tsumu::Result<Vec<_>>>()?;
        let epochs: Vec<&EpochRun> = opened.iter().collect();
        if let Some(folder) = &folder {
            folder.is_none_of(&epochs)?;
        }
        let found = match (&plan, epochs.as_slice()) {
            (Some(_), &[planned, later]) => {
                tsumu::compare_with_plan(planned, later, &options, job)?
            }
            (Some(_), _) => {
                return Err(tsumu::Error::bad_input(anyhow::anyhow!(
                    "plan: is held against one later survey; give one"
                )));
            }
            (None, epochs) => tsumu::compare_series(epochs, &options, job)?,
        };
        let said = told(&found)?;
        folder.map(|folder| found.write(folder, &options)).transpose()?;
        Ok(said)
    })?;
    Ok(found.to_string())
}

fn told(found: &Compared) -> tsumu::Result<Value> {
    let steps: Vec<_> = (0..found.steps.len()).map(|step| changes(found, step)).collect();
    Ok(json!({ "summary": tsumu::json_value(&found.summary())?, "steps": steps }))
}

fn changes(found: &Compared, step: usize) -> Vec<Value> {
    let rows = found.rows(step).into_iter().map(|r| {
        json!({
            "block_id": r.block_id,
            "earlier_id": r.earlier_id,
            "later_id": r.later_id,
            "model": r.model,
            "class": r.class,
            "shift_m": r.shift_m,
            "distance_m": r.distance_m,
            "turn_deg": r.turn_deg,
            "axis": r.axis,
            "level_m": r.level_m,
            "level_deg": r.level_deg,
            "significance": r.significance,
            "confidence": r.confidence,
            "occlusion_earlier": r.occlusion_earlier,
            "occlusion_later": r.occlusion_later,
            "note": r.note,
            "centre_earlier": r.centre_earlier,
            "centre_later": r.centre_later,
        })
    });
    rows.collect()
}
