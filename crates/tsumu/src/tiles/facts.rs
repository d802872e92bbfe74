//! What every tile must know of the whole, from a part that stands for it.
//!
//! In: a survey that was cut. Out: its facts. Survey lines are laid onto each other over places where each of them measured; the rest
//! is what recognition measures on four places along the works, or on all of a small site.

use super::grid::{Cell, Core, Grid};
use super::part::{PartReader, PartSurvey};
use super::scan::Scanned;
use crate::{Job, Result};
use geom::{Event, Observer, SeedTree, Stage};
use pipeline::{Config, LineShifts, PileFacts, Recogniser};
use scene::{Catalog, Survey};
use segment::SegmentModel;
use std::collections::BTreeSet;

/// So many places are looked at.
const PLACES: usize = 4;
/// Sites with fewer blocks than this stand for themselves.
const FEW_BLOCKS: u64 = 300;
/// Surveys with fewer points are levelled whole.
const FEW_POINTS: u64 = 3_000_000;
/// The places hold at most so many points together; of a denser survey the middle of each is looked at.
const MOST_POINTS: f64 = 4e6;
/// A place has at least so much of the most blocks any cell has.
const FULL: f64 = 0.6;
/// Around a place so much of the halo is seen.
const AROUND: f64 = 0.5;

/// What is asked.
pub(crate) struct Asked<'a> {
    pub found: &'a Scanned,
    pub grid: Grid,
    pub catalog: &'a Catalog,
    pub model: &'a SegmentModel,
    pub config: &'a Config,
    pub seed: u64,
    pub halo_m: f64,
}

/// Estimates the facts. Errors: the survey does not suit the blocks, as for a run of the whole.
pub(crate) fn estimate(asked: &Asked, job: &Job) -> Result<PileFacts> {
    let places = places(asked);
    let lines = line_shifts(asked, &places)?;
    let mut config = asked.config.clone();
    let mut sample = read(asked, &places, around_m(asked, &places))?.survey;
    if let Some(lines) = &lines {
        sample = lines.taken_out_of(&sample);
        config.pose.noise_sd_m.get_or_insert(lines.scatter_m);
    }
    check(asked, &sample, job)?;
    let quiet = Quiet(job);
    let recogniser = Recogniser {
        catalog: asked.catalog,
        model: asked.model,
        config: &config,
        seed: SeedTree::new(asked.seed),
        observer: &quiet,
    };
    let found = recogniser.recognise_part(&sample, None)?;
    let message = format!(
        "facts of the whole from {} places, {} blocks: noise {:.0} mm",
        places.len(),
        found.pile.stated,
        1e3 * found.facts.noise_sd_m
    );
    job.event(Event::Noted { stage: Stage::Pose, message });
    Ok(PileFacts { lines, ..found.facts })
}

/// What `run` asks of a whole survey.
fn check(asked: &Asked, sample: &Survey, job: &Job) -> Result<()> {
    pipeline::survey::check_scale(sample, asked.catalog)?;
    Ok(pipeline::survey::check_facts(sample, asked.catalog, job)?)
}

/// Cells that stand for the site: full ones, evenly along the works.
fn places(asked: &Asked) -> Vec<Cell> {
    let counts = &asked.found.counts;
    let all: u64 = counts.values().map(|c| c.blocks()).sum();
    if all <= FEW_BLOCKS {
        return counts.iter().filter(|(_, c)| c.points() > 0).map(|(cell, _)| *cell).collect();
    }
    let most = counts.values().map(|c| c.blocks()).max().unwrap_or(0) as f64;
    let full = counts.iter().filter(|(_, c)| c.blocks() as f64 >= FULL * most);
    let full: Vec<Cell> = full.map(|(cell, _)| *cell).collect();
    let at = |k: usize| full[(2 * k + 1) * full.len() / (2 * PLACES)];
    let chosen: BTreeSet<Cell> = (0..PLACES).map(at).collect();
    chosen.into_iter().collect()
}

/// How far around each place points are read; negative: so much less of it.
fn around_m(asked: &Asked, places: &[Cell]) -> f64 {
    let points: u64 = places.iter().map(|cell| asked.found.counts[cell].points()).sum();
    if points as f64 <= MOST_POINTS {
        return AROUND * asked.halo_m;
    }
    let share = (MOST_POINTS / points as f64).sqrt();
    -0.5 * asked.grid.edge_m * (1.0 - share)
}

fn read(asked: &Asked, cells: &[Cell], around_m: f64) -> Result<PartSurvey> {
    let found = asked.found;
    let sensors: Vec<[f64; 3]> = found.sensor_positions.iter().map(|p| p.to_array()).collect();
    let reader = PartReader {
        files: found.files.clone(),
        cells: &found.in_file,
        frame: &found.frame,
        sensor: found.sensor,
        sensor_positions: &sensors,
        strays: &found.strays,
        silent_lines: &found.silent_lines,
    };
    let boxes = cells.iter().map(|&corner| {
        let core = Core { corner, cells: 1 };
        (core, asked.grid.bounds(core, around_m))
    });
    reader.read(&boxes.collect::<Vec<_>>())
}

fn line_shifts(asked: &Asked, places: &[Cell]) -> Result<Option<LineShifts>> {
    let found = asked.found;
    if !asked.config.pose.levelling || found.line_cell.len() < 2 {
        return Ok(None);
    }
    let mut cells: BTreeSet<Cell> = places.iter().copied().collect();
    if found.points <= FEW_POINTS {
        cells.extend(found.in_file.keys());
    } else {
        cells.extend(found.line_cell.values());
    }
    let cells: Vec<Cell> = cells.into_iter().collect();
    let survey = read(asked, &cells, 0.0)?.survey;
    let d_max_m = asked.catalog.iter().map(|(_, m)| m.d_max_m).fold(f32::INFINITY, f32::min);
    let stated = asked.config.pose.noise_sd_m;
    let noise_sd_m = stated.unwrap_or_else(|| survey.sensor.noise_sd_m(d_max_m));
    Ok(LineShifts::of(&survey, d_max_m, noise_sd_m))
}

/// Passes on the wish to stop and nothing else: what a part looks like by itself is nobody's concern.
pub(crate) struct Quiet<'a>(pub &'a Job<'a>);

impl Observer for Quiet<'_> {
    fn event(&self, _: Event) {}

    fn cancelled(&self) -> bool {
        self.0.cancelled()
    }
}
