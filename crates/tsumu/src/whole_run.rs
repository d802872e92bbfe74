//! A whole run of a site, in parts that are kept until it is whole: a run that was killed goes on from the last.

use crate::planning::{ChosenProposer, PlanOptions, Planned};
use crate::recognition::{RecogniseOptions, Recognition};
use crate::resume::Parts;
use crate::run::{NewRun, Run};
use crate::weights::{self, Chosen};
use crate::written::Written;
use crate::{
    Job, Result, RunFolder, Site, TileOptions, TilePlan, TileRequest, TiledSite, stored, version,
};
use geom::{Event, JobPart, Observer, Stage};
use serde_json::json;
use std::path::{Path, PathBuf};

/// What a run may be told beside the site's settings.
#[derive(Clone, Debug, Default)]
pub struct RunOptions {
    /// For recognition.
    pub recognise: RecogniseOptions,
    /// For planning.
    pub plan: PlanOptions,
}

/// Everything for one site: recognise, plan where there is a design, exports, report. Leaves a run folder.
pub fn run(site: &Site, folder: &Path, options: &RunOptions, job: &Job) -> Result<RunFolder> {
    let whole = WholeRun::begin(site, folder, options, job)?;
    let recognition = whole.recognise()?;
    let planned = whole.plan(&recognition)?;
    whole.finish(&recognition, planned.as_ref())
}

/// The steps of [`run`], for callers that say something between them.
pub struct WholeRun<'a> {
    site: &'a Site,
    options: &'a RunOptions,
    folder: RunFolder,
    weights: Chosen,
    proposer: Option<ChosenProposer>,
    tiles: Option<TilePlan>,
    written: Written,
    parts: Parts<'a>,
}

impl<'a> WholeRun<'a> {
    /// Locks the folder and finds what an interrupted run has left in it.
    pub fn begin(
        site: &'a Site,
        folder: &Path,
        options: &'a RunOptions,
        job: &'a Job,
    ) -> Result<Self> {
        let weights = weights::choose(options.recognise.weights.as_deref(), &site.catalog, job)?;
        let proposer = site.proposer(&options.plan, job)?;
        let mut new = Run::prepare(folder, site)?;
        weights.origin.record(&mut new.manifest);
        if let Some(file) = proposer.as_ref().and_then(ChosenProposer::file) {
            new.note(stored::PROPOSER_NOTE, json!(file));
        }
        let key = new.manifest.key(&this_program()?);
        let parts = Parts::kept(new.folder.root(), key, job)?;
        job.done(JobPart::Read);
        Ok(Self {
            site,
            options,
            folder: new.folder,
            weights,
            proposer,
            tiles: None,
            // What lies there is known for certain once the folder is locked.
            written: Written::begin(folder),
            parts,
        })
    }

    /// The same with the blocks from a plan of tiles that are all done.
    pub fn of_tiles(
        plan: &TilePlan,
        site: &'a Site,
        folder: &Path,
        options: &'a RunOptions,
        job: &'a Job,
    ) -> Result<Self> {
        let whole = Self::begin(site, folder, options, job)?;
        Ok(Self { tiles: Some(plan.clone()), ..whole })
    }

    /// The blocks, written.
    pub fn recognise(&self) -> Result<Recognition> {
        let job = self.parts.job();
        let found = match (&self.tiles, self.tiles_folder()) {
            (Some(plan), _) => plan.recognition(self.site, job)?,
            (None, Some(folder)) => self.recognise_in_tiles(&folder)?,
            (None, None) => job.install(|| {
                let options = &self.options.recognise;
                self.site.recognise_in_parts(&self.weights, options, &self.parts)
            })?,
        };
        self.new_run()?.keep(&found)?;
        job.done(JobPart::WriteRecognise);
        Ok(found)
    }

    /// Where a site is cut into tiles that is too large to be recognised as one.
    fn tiles_folder(&self) -> Option<PathBuf> {
        self.parts.folder(JobPart::Tiles).filter(|_| self.site.is_cut())
    }

    fn recognise_in_tiles(&self, folder: &Path) -> Result<Recognition> {
        let job = self.parts.job();
        let tiles = TileOptions {
            memory: self.site.memory.unwrap_or(TileOptions::default().memory),
            ..TileOptions::default()
        };
        let recognise = self.options.recognise.clone();
        let what = TiledSite { recognise, tiles, ..TiledSite::default() };
        let plan = TilePlan::make_for(self.site, &what, folder, job)?;
        let stage = Stage::Segment;
        let tiles = plan.tiles();
        job.event(Event::Started { stage, total: tiles.len() as u64 });
        for (at, tile) in tiles.iter().enumerate() {
            plan.work_on(&tile.key, &TileRequest::default(), job)?;
            job.event(Event::Advanced { stage, done: at as u64 + 1 });
        }
        job.event(Event::Finished { stage });
        plan.recognition(self.site, job)
    }

    /// The plan, written; `None` for a site without a design.
    pub fn plan(&self, recognition: &Recognition) -> Result<Option<Planned>> {
        if self.site.design.is_none() {
            return Ok(None);
        }
        let previous = self.options.plan.previous.as_ref();
        let planned = self.parts.job().install(|| {
            self.site.plan_in_parts(recognition, self.proposer.as_ref(), previous, &self.parts)
        })?;
        self.new_run()?.keep(&planned)?;
        Ok(Some(planned))
    }

    /// Exports, report, settings and manifest: the run is whole.
    pub fn finish(self, recognition: &Recognition, planned: Option<&Planned>) -> Result<RunFolder> {
        let job = self.parts.job();
        let mut new = self.new_run()?;
        new.holds(recognition, planned);
        let folder = new.present(job)?.seal()?;
        job.done(JobPart::Manifest);
        self.parts.finish()?;
        Ok(folder)
    }

    fn new_run(&self) -> Result<NewRun<'_>> {
        let mut new = Run::prepare(self.folder.root(), self.site)?;
        // One record for all parts: what earlier runs left was known when this one began.
        new.written = self.written.clone();
        Ok(new)
    }
}

/// What tells this build from another of the same version: the program file's own hash.
pub(crate) fn this_program() -> Result<String> {
    let file = version::program_file()?;
    Ok(file.map_or_else(|| version::STAMP.into(), |file| file.blake3.clone()))
}
