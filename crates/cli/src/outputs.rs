//! What the stages found, as the files of `docs/guide/formats.md`.

use crate::exit::Exit;
use crate::result_folder::RunFolder;
use geom::DVec3;
use io::blocks_csv::BlockRow;
use io::not_judged_csv::NotJudgedRow;
use io::placements_csv::PlacementRow;
use io::{IoError, RawCloud};
use pipeline::{Recognition, Works};
use scene::{Catalog, Plan, Recognised, SiteFrame, Survey};
use serde_json::{Value, json};
use std::path::Path;

/// Pretty JSON with a newline at its end, whole or not at all.
pub fn write_json(path: &Path, value: &Value) -> Result<(), IoError> {
    let mut text = serde_json::to_string_pretty(value).expect("a JSON value can be printed");
    text.push('\n');
    io::atomic::write_bytes(path, text.as_bytes())
}

/// A value as JSON with the fewest digits that say it: an f32 of 0.1 is 0.1, not 0.10000000149.
pub fn short_digits(value: &impl serde::Serialize) -> Result<Value, serde_json::Error> {
    serde_json::from_str(&serde_json::to_string(value)?)
}

/// Site coordinates of a survey's points, with its CRS.
fn site_cloud(survey: &Survey) -> RawCloud {
    let position: Vec<DVec3> =
        survey.cloud.position_m.iter().map(|&p| survey.frame.site_from_local(p)).collect();
    let crs = Some(survey.frame.crs.clone()).filter(|c| c.starts_with("EPSG:"));
    let line = (!survey.line.is_empty()).then(|| survey.line.clone());
    RawCloud { position, line, crs, ..RawCloud::default() }
}

/// The survey with the instance of every point.
pub fn labelled_cloud(survey: &Survey, recognition: &scene::Segmentation) -> RawCloud {
    RawCloud {
        instance: Some(recognition.instance.clone()),
        confidence: Some(recognition.confidence.clone()),
        ..site_cloud(survey)
    }
}

/// The survey with the recognised block, its type and confidence for every point.
pub fn explained_cloud(survey: &Survey, blocks: &[Recognised]) -> RawCloud {
    let n = survey.cloud.len();
    let (mut instance, mut model, mut confidence) = (vec![0; n], vec![0; n], vec![0.0; n]);
    for (block, fit) in scene::stated(blocks) {
        for &point in &block.points {
            let i = point as usize;
            (instance[i], model[i]) = (block.block.0, fit.model.0 + 1);
            confidence[i] = fit.confidence.unwrap_or(0.0);
        }
    }
    RawCloud {
        instance: Some(instance),
        model: Some(model),
        confidence: Some(confidence),
        ..site_cloud(survey)
    }
}

/// Rows of `blocks.csv`: stated blocks; those not judged follow in `not_judged.csv`.
pub fn block_rows(blocks: &[Recognised], catalog: &Catalog, frame: &SiteFrame) -> Vec<BlockRow> {
    scene::stated(blocks).map(|(b, fit)| BlockRow::of_fit(b.block, fit, catalog, frame)).collect()
}

/// Fit of the recognised blocks to the survey, computed from the files' own values.
pub fn recognise_summary(survey: &Survey, recognition: &Recognition, catalog: &Catalog) -> Value {
    let blocks = pipeline::placed_blocks(&recognition.blocks);
    let threshold_m = fitting_threshold_m(catalog);
    let distance =
        metrics::model_distances_m(&survey.cloud.position_m, &blocks, catalog, threshold_m);
    let on_blocks: Vec<f32> = scene::stated(&recognition.blocks)
        .flat_map(|(b, _)| &b.points)
        .map(|&i| distance[i as usize])
        .collect();
    let all = metrics::fitting(&distance, threshold_m);
    let own = metrics::fitting(&on_blocks, threshold_m);
    let by_type: serde_json::Map<String, Value> = catalog
        .iter()
        .map(|(id, m)| (m.name.clone(), json!(blocks.iter().filter(|b| b.model == id).count())))
        .collect();
    json!({
        "points": survey.cloud.len(),
        "instances": recognition.segmentation.instances,
        "centre_hypotheses": recognition.segmentation.hypotheses.len(),
        "recognised_blocks": blocks.len(),
        "recognised_by_type": by_type,
        "types_not_judged":
            scene::stated(&recognition.blocks).filter(|(_, fit)| !fit.type_judged).count(),
        "not_judged_blocks": recognition.blocks.len() - blocks.len(),
        "fitting_threshold_m": (f64::from(threshold_m) * 1e6).round() / 1e6,
        "fitting_error_m": all.error_m,
        "matching_rate": all.matching_rate,
        "explained_points": on_blocks.len(),
        "fitting_error_of_explained_points_m": own.error_m,
    })
}

/// The thesis takes 0.1 m for its 2–3 m blocks: a twentieth of the largest edge.
pub fn fitting_threshold_m(catalog: &Catalog) -> f32 {
    catalog.iter().map(|(_, m)| m.d_box_m * 0.05).fold(f32::INFINITY, f32::min)
}

/// Writes `segment/` of a run.
pub fn write_segment(
    run: &RunFolder,
    survey: &Survey,
    recognition: &Recognition,
) -> Result<(), Exit> {
    io::points::write(&run.segment_cloud(), &labelled_cloud(survey, &recognition.segmentation))?;
    Ok(())
}

/// Writes `recognise/` of a run; returns its summary.
pub fn write_recognise(
    run: &RunFolder,
    survey: &Survey,
    recognition: &Recognition,
    catalog: &Catalog,
) -> Result<Value, Exit> {
    let (blocks, frame) = (&recognition.blocks, &survey.frame);
    io::blocks_csv::write_blocks(&run.blocks(), &block_rows(blocks, catalog, frame))?;
    let open: Vec<_> = blocks.iter().filter_map(|b| NotJudgedRow::of(b, catalog, frame)).collect();
    io::not_judged_csv::write(&run.not_judged(), &open)?;
    io::covariance_csv::write(&run.covariance(), blocks)?;
    io::points::write(&run.recognise_cloud(), &explained_cloud(survey, &recognition.blocks))?;
    let summary = recognise_summary(survey, recognition, catalog);
    write_json(&run.recognise_summary(), &summary)?;
    Ok(summary)
}

/// Writes `plan/` of a run; returns its summary.
pub fn write_plan(
    run: &RunFolder,
    works: &Works,
    plan: &Plan,
    range: Option<Value>,
) -> Result<Value, Exit> {
    let frame = &works.survey.frame;
    let rows: Vec<_> = plan
        .placements
        .iter()
        .chain(&plan.removed)
        .map(|p| PlacementRow::of(p, works.catalog, frame))
        .collect();
    io::placements_csv::write(&run.placements(), &rows)?;
    let mut summary = short_digits(&plan.summary)?;
    if let Some(range) = range {
        summary["count_range"] = range;
    }
    write_json(&run.plan_summary(), &summary)?;
    Ok(summary)
}
