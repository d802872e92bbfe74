//! What a run folder holds, as the values that were kept in it.

use crate::error::OrBadInput;
use crate::planning::Planned;
use crate::recognition::{Recognition, Segments};
use crate::review::ReviewRecord;
use crate::run_folder::RunFolder;
use crate::summary::{PlannedSummary, RecogniseSummary};
use crate::weights::WeightsOrigin;
use crate::{Error, Result, Site};
use anyhow::anyhow;
use geom::Silent;
use io::blocks_csv::BlockRow;
use io::manifest::{Entry, Manifest};
use io::not_judged_csv::NotJudgedRow;
use io::{RawCloud, ReadOptions};
use scene::{Catalog, Covariance, Fit, Guess, InstanceId, Recognised, Scene, SiteFrame, Verdict};
use serde::de::DeserializeOwned;
use std::collections::BTreeMap;
use std::path::Path;

/// Reads `segment/` and `recognise/` of a run.
pub(crate) fn recognition(
    run: &RunFolder,
    site: &Site,
    manifest: Option<&Manifest>,
) -> Result<Recognition> {
    // A folder put together by hand may hold blocks alone.
    let whole = manifest.is_some();
    let (segments, summary) = segments(run, site, whole)?;
    let labels = cloud(&run.recognise_cloud(), site, whole)?;
    Ok(Recognition {
        segments,
        blocks: blocks(run, site, labels)?,
        pile: summary.as_ref().map(|s| s.pile.clone()).unwrap_or_default(),
        self_check: summary.and_then(|s| s.self_check),
        weights: manifest.map(WeightsOrigin::of).unwrap_or_default(),
        review: manifest.and_then(ReviewRecord::of),
    })
}

fn segments(
    run: &RunFolder,
    site: &Site,
    whole: bool,
) -> Result<(Segments, Option<RecogniseSummary>)> {
    if !whole && !run.recognise_summary().exists() {
        return Ok(Default::default());
    }
    let cloud = cloud(&run.segment_cloud(), site, whole)?;
    let summary: RecogniseSummary = json_file(&run.recognise_summary())?;
    let segments = Segments {
        instance: cloud.instance.unwrap_or_default(),
        confidence: cloud.confidence.unwrap_or_default(),
        instances: summary.instances,
        centre_hypotheses: summary.centre_hypotheses,
    };
    Ok((segments, Some(summary)))
}

/// A cloud with one label for every point of the site's surveys.
fn cloud(file: &Path, site: &Site, needed: bool) -> Result<RawCloud> {
    if !needed && !file.exists() {
        return Ok(RawCloud::default());
    }
    let mut cloud =
        io::points::read_with(file, &ReadOptions::every_point(), &Silent).or_bad_input()?;
    let points = site.survey.cloud.len();
    // The survey's own file comes back whole, with what was left out of the survey.
    let own = site.records.as_ref().filter(|own| own.fit(file));
    if let Some(own) = own.and_then(|own| own.of_survey(&cloud)) {
        cloud = own;
    }
    if cloud.len() != points {
        return Err(Error::bad_input(anyhow!(
            "{}: has {} points, the site's surveys {points}; run the site again",
            file.display(),
            cloud.len()
        )));
    }
    Ok(cloud)
}

/// Stated blocks, as corrected by hand perhaps, and those not judged, by their numbers.
fn blocks(run: &RunFolder, site: &Site, labels: RawCloud) -> Result<Vec<Recognised>> {
    let (catalog, frame) = (&site.catalog, &site.survey.frame);
    let mut points: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    for (i, &label) in labels.instance.unwrap_or_default().iter().enumerate() {
        points.entry(label).or_default().push(i as u32);
    }
    let covariance: BTreeMap<u32, Covariance> =
        if_there(&run.covariance(), io::covariance_csv::read)?.into_iter().collect();
    let mut blocks = Vec::new();
    let file = run.blocks();
    for row in io::blocks_csv::read(&file).or_bad_input()? {
        let covariance = covariance.get(&row.block_id).copied();
        let fit = Fit { covariance, ..fit(&row, catalog, frame, &file)? };
        let own = points.remove(&row.block_id).unwrap_or_default();
        blocks.push(Recognised::of_fit(InstanceId(row.block_id), own, fit));
    }
    blocks.extend(not_judged(run, site, &covariance)?);
    blocks.sort_by_key(|b| b.block);
    match blocks.windows(2).find(|pair| pair[0].block == pair[1].block) {
        Some(pair) => Err(Error::bad_input(anyhow!(
            "{}: block {} is in not_judged.csv too; take it out of one of them",
            file.display(),
            pair[0].block.0
        ))),
        None => Ok(blocks),
    }
}

fn not_judged(
    run: &RunFolder,
    site: &Site,
    covariance: &BTreeMap<u32, Covariance>,
) -> Result<Vec<Recognised>> {
    let (catalog, frame, file) = (&site.catalog, &site.survey.frame, run.not_judged());
    let count = site.survey.cloud.len();
    let mut points = if_there(&run.not_judged_points(), |f| io::block_points_csv::read(f, count))?;
    let block = |row: NotJudgedRow| {
        let number = row.block_id();
        let guess = match row {
            NotJudgedRow::Fit(row) => Guess::Fit(Fit {
                covariance: covariance.get(&number).copied(),
                ..fit(&row, catalog, frame, &file)?
            }),
            NotJudgedRow::Place { position_m, .. } => {
                Guess::Place(frame.local_from_site(position_m.into()))
            }
        };
        let points = points.remove(&number).unwrap_or_default();
        Ok(Recognised { block: InstanceId(number), points, verdict: Verdict::NotJudged(guess) })
    };
    if_there(&file, io::not_judged_csv::read)?.into_iter().map(block).collect()
}

/// What a file holds; nothing where there is none, as in results of other programs.
fn if_there<T: Default>(
    file: &Path,
    read: impl FnOnce(&Path) -> std::result::Result<T, io::IoError>,
) -> Result<T> {
    if file.exists() { read(file).or_bad_input() } else { Ok(T::default()) }
}

/// A row of `blocks.csv` or `truth.csv`.
pub(crate) fn fit(
    row: &BlockRow,
    catalog: &Catalog,
    frame: &SiteFrame,
    file: &Path,
) -> Result<Fit> {
    let model = catalog.find(&row.model).ok_or_else(|| {
        let known: Vec<_> = catalog.iter().map(|(_, m)| m.name.as_str()).collect();
        Error::bad_input(anyhow!(
            "{}: block {} is a `{}`, but the catalogue has {}",
            file.display(),
            row.block_id,
            row.model,
            known.join(", ")
        ))
    })?;
    let second = row.runner_up.as_deref().and_then(|name| catalog.find(name));
    Ok(Fit {
        type_judged: row.type_judged.unwrap_or(true),
        confidence: row.confidence.map(|v| v as f32),
        fitness_m: row.fitness_m.map(|v| v as f32),
        runner_up: second.zip(row.runner_up_fitness_m.map(|v| v as f32)),
        occlusion: row.occlusion.map(|v| v as f32),
        legs: row.legs,
        ..Fit::of_pose(model, row.pose.local(frame))
    })
}

/// Reads `plan/` of a run; `None` where there is none.
pub(crate) fn planned(
    run: &RunFolder,
    site: &Site,
    recognition: &Recognition,
    manifest: Option<&Manifest>,
) -> Result<Option<Planned>> {
    let Some(design) = site.design.as_ref().filter(|_| run.placements().is_file()) else {
        return Ok(None);
    };
    let works = site.works(&recognition.blocks, design);
    let PlannedSummary { plan: summary, count_range, types, .. } = json_file(&run.plan_summary())?;
    let mut plan = site.read_plan(&run.placements())?;
    plan.summary = summary;
    let pile = Scene {
        blocks: pipeline::placed_blocks(&recognition.blocks),
        // What it warns of was said when the run was made.
        ground: pipeline::ground_of(&works, &site.config, &Silent),
    };
    let proposer = manifest.and_then(|m| m.notes.get(PROPOSER_NOTE)).cloned();
    let proposer: Option<Entry> = proposer.and_then(|v| serde_json::from_value(v).ok());
    let unfilled = site.unfilled(&works, &pile, &plan)?;
    let (lifts, choices) = (site.lifts(&plan)?, Vec::new());
    Ok(Some(Planned { pile, plan, range: count_range, types, unfilled, lifts, choices, proposer }))
}

/// Where a manifest names the user's placement network.
pub(crate) const PROPOSER_NOTE: &str = "placement_network_file";

/// Figures of a run.
const MOST_BYTES: u64 = 64 << 20;

fn json_file<T: DeserializeOwned>(path: &Path) -> Result<T> {
    let text = io::read_text(path, MOST_BYTES)
        .map_err(|e| Error::bad_input(anyhow!("{e}; run the stage before first")))?;
    serde_json::from_str(&text)
        .map_err(|e| Error::bad_input(anyhow!(e).context(path.display().to_string())))
}
