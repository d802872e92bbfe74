//! What the stages found, as the files of `docs/guide/formats.md`.

use crate::error::OrBadInput;
use crate::planning::Planned;
use crate::recognition::{Recognition, Segments};
use crate::run_folder::RunFolder;
use crate::summary::RecogniseSummary;
use crate::written::Written;
use crate::{Result, Site, choices, lifts, ratings, unfilled};
use geom::DVec3;
use io::RawCloud;
use io::blocks_csv::BlockRow;
use io::not_judged_csv::NotJudgedRow;
use io::placements_csv::PlacementRow;
use scene::{Recognised, Survey};
use serde::Serialize;
use std::path::Path;

/// Pretty JSON with sorted keys and a newline at its end, with the fewest digits that say each number: an f32 of 0.1 is
/// 0.1, not 0.10000000149. Whole or not at all.
pub(crate) fn write_json(path: &Path, value: &impl Serialize) -> Result<()> {
    Ok(io::atomic::write_bytes(path, json_text(value)?.as_bytes())?)
}

/// The same where somebody has named the file.
pub(crate) fn write_named_json(path: &Path, value: &impl Serialize) -> Result<()> {
    io::atomic::write_over_own_kind(path, json_text(value)?.as_bytes()).or_bad_input()
}

fn json_text(value: &impl Serialize) -> Result<String> {
    Ok(serde_json::to_string_pretty(&json_value(value)?)? + "\n")
}

/// A value as JSON with the fewest digits that say it.
pub fn json_value(value: &impl Serialize) -> Result<serde_json::Value> {
    Ok(serde_json::from_str(&serde_json::to_string(value)?)?)
}

/// Site coordinates of a survey's points, with its CRS.
fn site_cloud(survey: &Survey) -> RawCloud {
    let position: Vec<DVec3> =
        survey.cloud.position_m.iter().map(|&p| survey.frame.site_from_local(p)).collect();
    let crs = Some(survey.frame.crs.clone()).filter(|c| c.starts_with("EPSG:"));
    let line = (!survey.line.is_empty()).then(|| survey.line.clone());
    RawCloud { position, line, crs, ..RawCloud::default() }
}

/// What was found of every point of a survey.
pub(crate) struct Columns {
    /// Block of each point, 0 = none.
    pub instance: Vec<u32>,
    /// Type of its block, from 1; 0 = none.
    pub model: Vec<u16>,
    /// Confidence of the label, in [0, 1].
    pub confidence: Vec<f32>,
}

/// Writes the survey with the instance of every point.
pub(crate) fn write_labelled(path: &Path, site: &Site, segments: &Segments) -> Result<()> {
    let columns = Columns {
        instance: segments.instance.clone(),
        model: vec![0; segments.instance.len()],
        confidence: segments.confidence.clone(),
    };
    if let Some(own) = site.records.as_ref().filter(|own| own.fit(path)) {
        return own.write(path, &columns, &site.survey.frame.crs);
    }
    let cloud = RawCloud {
        instance: Some(columns.instance),
        confidence: Some(columns.confidence),
        ..site_cloud(&site.survey)
    };
    Ok(io::points::write(path, &cloud)?)
}

/// Writes the survey with the recognised block, its type and confidence for every point.
fn write_explained(path: &Path, site: &Site, blocks: &[Recognised]) -> Result<()> {
    let n = site.survey.cloud.len();
    let (mut instance, mut model, mut confidence) = (vec![0; n], vec![0; n], vec![0.0; n]);
    for (block, fit) in scene::stated(blocks) {
        for &point in &block.points {
            let i = point as usize;
            (instance[i], model[i]) = (block.block.0, fit.model.0 + 1);
            confidence[i] = fit.confidence.unwrap_or(0.0);
        }
    }
    let columns = Columns { instance, model, confidence };
    if let Some(own) = site.records.as_ref().filter(|own| own.fit(path)) {
        return own.write(path, &columns, &site.survey.frame.crs);
    }
    let cloud = RawCloud {
        instance: Some(columns.instance),
        model: Some(columns.model),
        confidence: Some(columns.confidence),
        ..site_cloud(&site.survey)
    };
    Ok(io::points::write(path, &cloud)?)
}

/// Writes `segment/` and `recognise/` of a run.
pub(crate) fn write_recognition(
    run: &RunFolder,
    site: &Site,
    found: &Recognition,
    written: &Written,
) -> Result<()> {
    let (survey, catalog, blocks) = (&site.survey, &site.catalog, &found.blocks);
    written.put(&run.segment_cloud(), |p| write_labelled(p, site, &found.segments))?;
    let stated: Vec<BlockRow> = scene::stated(blocks)
        .map(|(b, fit)| BlockRow::of_fit(b.block, fit, catalog, &survey.frame))
        .collect();
    written.put(&run.blocks(), |p| io::blocks_csv::write_blocks(p, &stated))?;
    let open: Vec<NotJudgedRow> =
        blocks.iter().filter_map(|b| NotJudgedRow::of(b, catalog, &survey.frame)).collect();
    written.put(&run.not_judged(), |p| io::not_judged_csv::write(p, &open))?;
    let open = blocks.iter().filter(|b| !b.is_stated());
    let points = open.map(|b| (b.block.0, b.points.as_slice()));
    written.put(&run.not_judged_points(), |p| io::block_points_csv::write(p, points))?;
    written.put(&run.covariance(), |p| io::covariance_csv::write(p, blocks))?;
    written.put(&run.recognise_cloud(), |p| write_explained(p, site, blocks))?;
    let summary = RecogniseSummary::of(survey, found, catalog);
    written.put(&run.recognise_summary(), |p| write_json(p, &summary))
}

/// Writes `plan/` of a run.
pub(crate) fn write_plan(
    run: &RunFolder,
    site: &Site,
    planned: &Planned,
    written: &Written,
) -> Result<()> {
    let rows: Vec<PlacementRow> = planned
        .plan
        .placements
        .iter()
        .chain(&planned.plan.removed)
        .map(|p| PlacementRow::of(p, &site.catalog, &site.survey.frame))
        .collect();
    written.put(&run.placements(), |p| io::placements_csv::write(p, &rows))?;
    written.put(&run.unfilled(), |p| unfilled::write(p, site, &planned.unfilled))?;
    written.put(&run.lifts(), |p| lifts::write(p, site, &planned.plan, &planned.lifts))?;
    if !planned.choices.is_empty() {
        choices::write(run, site, &planned.choices, written)?;
    }
    if let Some(learned) = &site.learned {
        written.put(&run.weights(), |p| ratings::write(p, learned))?;
    }
    written.put(&run.plan_summary(), |p| write_json(p, &planned.summary()))
}
