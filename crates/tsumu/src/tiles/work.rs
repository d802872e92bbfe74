//! One tile: its points are read, its blocks recognised, its result kept once and for all.
//!
//! In: a plan and the name of a tile. Out: `tiles/<key>/`: a result named by its own hash, and `done.json`, written last and only if
//! nobody else was first. Working on a tile twice, at once or after being killed, does no harm.

use super::facts::Quiet;
use super::plan::{Tile, TilePlan};
use crate::resume::{read_hashed, write_hashed};
use crate::whole_run::this_program;
use crate::{Error, Job, Result, weights};
use anyhow::{Context, anyhow};
use geom::{DVec2, SeedTree, Vec3};
use io::atomic;
use pipeline::{Part, PartRecognition, Recogniser};
use scene::{Catalog, MemoryBound, Recognised, Survey};
use serde::{Deserialize, Serialize};
use std::fs;
use std::path::{Path, PathBuf};

/// Folder of the results in a plan's.
pub(crate) const TILES: &str = "tiles";
/// Says that a tile is done, and which file is its result.
const DONE: &str = "done.json";
/// Blocks are told so far beyond the core, in d_max: what two tiles see of one block differs by millimetres.
pub(crate) const SEAM: f32 = 0.25;

/// What a call may say of a tile's work.
#[derive(Clone, Debug, Default)]
pub struct TileRequest {
    /// The site folder, where it is not where the plan was made.
    pub site: Option<PathBuf>,
    /// Memory that may be used; `None`: what the plan was made for.
    pub memory: Option<MemoryBound>,
}

/// What became of a tile.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TileDone {
    /// Its name.
    pub key: String,
    /// It was done before.
    pub kept: bool,
    /// Blocks it tells of, those at its seams too.
    pub blocks: usize,
}

/// `done.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Done {
    /// The plan it was done for.
    plan: String,
    /// The program that did it.
    pub program: String,
    /// Its result.
    pub result: String,
    /// Blocks it tells of.
    blocks: usize,
}

/// A block a tile tells of.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Claim {
    /// Its points are numbers of the whole survey.
    pub block: Recognised,
    /// Its centre, local frame of the plan.
    pub centre: Vec3,
    /// That lies in the tile's core.
    pub own: bool,
}

/// Points of an instance whose middle is the tile's.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Instance {
    /// Numbers of the whole survey.
    pub points: Vec<u32>,
    /// Confidence of each label.
    pub confidence: Vec<f32>,
}

/// What a tile says.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct TileResult {
    pub claims: Vec<Claim>,
    pub instances: Vec<Instance>,
    /// Places of its core where a block's centre may be.
    pub hypotheses: usize,
    /// Places of its core that are no block.
    pub not_a_block: usize,
    /// Points of its core that stand above the bed, and how many of them blocks explain.
    pub standing: usize,
    pub explained: usize,
}

impl TilePlan {
    /// Works on a tile, unless it is done already. Errors: the plan or the tile is not there, another plan's result lies in its place,
    /// it needs more memory than allowed; everything that a second try may mend is [`Kind::TryAgain`](crate::Kind::TryAgain).
    pub fn work_on(&self, key: &str, request: &TileRequest, job: &Job) -> Result<TileDone> {
        self.worked_on(key, request, job).map_err(Error::worth_another_try)
    }

    fn worked_on(&self, key: &str, request: &TileRequest, job: &Job) -> Result<TileDone> {
        let tile = self.tile(key)?;
        if let Some(done) = self.done(key)? {
            return Ok(TileDone { key: key.into(), kept: true, blocks: done.blocks });
        }
        if let Some(memory) = request.memory.filter(|m| m.bytes() < tile.memory_bytes) {
            return Err(Error::bad_input(anyhow!(
                "tile `{key}` reads {} points and needs {:.1} GB, more than --memory {memory}; make the plan with that --memory",
                tile.read_points,
                tile.memory_bytes as f64 / 1e9
            )));
        }
        let catalog = self.catalog(request.site.as_deref(), job)?;
        let result = job.install(|| self.result_of(tile, &catalog, job))?;
        self.keep(key, &result)
    }

    fn folder_of(&self, key: &str) -> PathBuf {
        self.folder().join(TILES).join(key)
    }

    /// What is done of a tile. Error: it was done for another plan.
    pub(crate) fn done(&self, key: &str) -> Result<Option<Done>> {
        let file = self.folder_of(key).join(DONE);
        let text = match fs::read_to_string(&file) {
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(None),
            other => other.with_context(|| format!("cannot read {}", file.display()))?,
        };
        let done: Done = serde_json::from_str(&text).map_err(|e| damaged(&file, &e.to_string()))?;
        if done.plan != self.id() {
            return Err(Error::bad_input(anyhow!(
                "{}: the tile was worked on for another plan (the plan was changed since); remove the folder {} and work on the tile again",
                file.display(),
                self.folder_of(key).display()
            )));
        }
        Ok(Some(done))
    }

    /// Keeps a result, unless somebody was first.
    fn keep(&self, key: &str, result: &TileResult) -> Result<TileDone> {
        let folder = self.folder_of(key);
        let (name, bytes) = write_hashed(result)?;
        let name = format!("result-{name}.cbor");
        atomic::write_bytes(&folder.join(&name), &bytes)?;
        let done = Done {
            plan: self.id().into(),
            program: this_program()?,
            result: name,
            blocks: result.claims.len(),
        };
        let mut text = serde_json::to_string_pretty(&done)?;
        text.push('\n');
        let first = atomic::write_if_absent(&folder.join(DONE), text.as_bytes())?;
        Ok(TileDone { key: key.into(), kept: !first, blocks: result.claims.len() })
    }

    /// The result of a tile that is done. Errors: it is not there, or not what was written.
    pub(crate) fn result(&self, key: &str, done: &Done) -> Result<TileResult> {
        let file = self.folder_of(key).join(&done.result);
        let bytes = fs::read(&file).map_err(|e| damaged(&file, &e.to_string()))?;
        let (name, result) =
            read_hashed(&bytes).ok_or_else(|| damaged(&file, "its hash differs"))?;
        match done.result == format!("result-{name}.cbor") {
            true => Ok(result),
            false => Err(damaged(&file, "it is another result than done.json says")),
        }
    }

    /// Results of a tile beside the one that counts: two programs worked on it and did not agree.
    pub(crate) fn other_results(&self, key: &str, done: &Done) -> Vec<String> {
        let Ok(entries) = fs::read_dir(self.folder_of(key)) else { return Vec::new() };
        let names = entries.flatten().map(|e| e.file_name().to_string_lossy().into_owned());
        let mut other: Vec<String> =
            names.filter(|n| n.starts_with("result-") && *n != done.result).collect();
        other.sort();
        other
    }

    fn result_of(&self, tile: &Tile, catalog: &Catalog, job: &Job) -> Result<TileResult> {
        let core = tile.core();
        let part = self.points_of().read(&[(core, self.grid().bounds(core, self.halo_m()))])?;
        if !may_hold_blocks(&part.survey, catalog) {
            return Ok(TileResult::default());
        }
        let chosen = weights::choose(self.weights(), catalog, job)?;
        let config = self.config()?;
        let quiet = Quiet(job);
        let recogniser = Recogniser {
            catalog,
            model: &chosen.model,
            config: &config,
            seed: SeedTree::new(self.seed()),
            observer: &quiet,
        };
        let frame = self.frame();
        let plan = |p: Vec3| frame.site_from_local(p).truncate();
        let owns = |p: Vec3| self.grid().holds(core, plan(p));
        let told = Part { facts: self.facts(), owns: &owns };
        let found = recogniser.recognise_part(&part.survey, Some(&told))?;
        let seam_m = f64::from(SEAM * catalog.d_max_m());
        let [low, high] = self.grid().bounds(core, seam_m);
        let near = |p: DVec2| p.cmpge(low).all() && p.cmple(high).all();
        Ok(told_of(found, &part.number, catalog, &owns, |p| near(plan(p))))
    }
}

/// A handful of points at a tile's edge is no survey.
fn may_hold_blocks(survey: &Survey, catalog: &Catalog) -> bool {
    const FEWEST: usize = 30;
    let largest_m = catalog.iter().map(|(_, m)| m.d_box_m).fold(0.0, f32::max);
    survey.cloud.len() >= FEWEST && survey.cloud.bounds().size().max_element() >= 0.2 * largest_m
}

/// What is the tile's, in numbers of the whole survey.
fn told_of(
    found: PartRecognition,
    number: &[u32],
    catalog: &Catalog,
    owns: &(dyn Fn(Vec3) -> bool + Sync),
    near: impl Fn(Vec3) -> bool,
) -> TileResult {
    let whole = |i: &u32| number[*i as usize];
    let claims = found.blocks.into_iter().filter_map(|mut block| {
        let centre = block.centre(catalog);
        if !near(centre) {
            return None;
        }
        block.points = block.points.iter().map(whole).collect();
        Some(Claim { block, centre, own: owns(centre) })
    });
    let claims = claims.collect();
    let segments = &found.segmentation;
    let mut members: Vec<Vec<u32>> = vec![Vec::new(); segments.instances];
    for (i, &label) in segments.instance.iter().enumerate().filter(|(_, l)| **l > 0) {
        members[label as usize - 1].push(i as u32);
    }
    let instances = members
        .into_iter()
        .zip(&segments.hypotheses)
        .filter(|(_, hypothesis)| owns(hypothesis.centre))
        .map(|(own, _)| Instance {
            confidence: own.iter().map(|i| segments.confidence[*i as usize]).collect(),
            points: own.iter().map(whole).collect(),
        });
    TileResult {
        claims,
        instances: instances.collect(),
        hypotheses: segments.hypotheses.iter().filter(|h| owns(h.centre)).count(),
        not_a_block: found.pile.not_a_block,
        standing: found.standing,
        explained: (found.pile.explained * found.standing as f32).round() as usize,
    }
}

fn damaged(file: &Path, why: &str) -> Error {
    let folder = file.parent().unwrap_or(file);
    Error::bad_input(anyhow!(
        "{}: is damaged ({why}); remove the folder {} and work on the tile again",
        file.display(),
        folder.display()
    ))
}
