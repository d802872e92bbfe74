//! One side of a comparison: a run, or a site that is recognised first.

use crate::planning::Planned;
use crate::recognition::RecogniseOptions;
use crate::run::Run;
use crate::{Error, Job, Result, RunFolder, Site, version};
use anyhow::anyhow;
use geom::{Event, Observer, Stage, Warning};
use io::manifest::{Entry, Manifest, entry};
use monitor::Epoch;
use scene::Recognised;
use std::path::{Path, PathBuf};

/// A site with the blocks recognised in its survey.
pub struct EpochRun {
    /// The site with its survey.
    pub site: Site,
    /// Its blocks.
    pub blocks: Vec<Recognised>,
    /// Its plan, where there is one.
    pub planned: Option<Planned>,
    /// What it is called: the path as given.
    pub name: String,
    /// Folders that a result must not be written over.
    pub(crate) folders: Vec<PathBuf>,
    /// The blocks' file, as it was read.
    pub(crate) blocks_file: Option<Entry>,
}

impl EpochRun {
    /// A run folder in its site, a site folder with its run, or a site alone, which is recognised first.
    pub fn open(path: &Path, options: &RecogniseOptions, job: &Job) -> Result<Self> {
        let (site, run) = match path.join("site.toml").is_file() {
            true => (path.to_path_buf(), path.join("run")),
            false => (site_of(path)?, path.to_path_buf()),
        };
        let name = path.display().to_string();
        let run = RunFolder::existing(&run);
        if run.blocks().is_file() {
            Self::of_run(name, &site, &run, job)
        } else if begun(run.root()) {
            Err(Error::bad_input(anyhow!(
                "{}: a run was begun there and is not whole, its recognise/blocks.csv is missing; `tsumu run` goes on with it",
                run.root().display()
            )))
        } else {
            Self::of_site(name, &site, options, job)
        }
    }

    fn of_site(name: String, folder: &Path, options: &RecogniseOptions, job: &Job) -> Result<Self> {
        let site = Site::load(folder, job)?;
        let blocks = site.recognise(options, job)?.blocks;
        let folders = vec![folder.to_path_buf()];
        Ok(Self { site, blocks, planned: None, name, folders, blocks_file: None })
    }

    fn of_run(name: String, folder: &Path, run: &RunFolder, job: &Job) -> Result<Self> {
        let manifest = Manifest::load(run.root()).map_err(Error::bad_input)?;
        let site = Run::settled(run.root(), Site::load(folder, job)?, job)?;
        unchanged(&manifest, &site, &name)?;
        if manifest.version != version::STAMP {
            let message = format!(
                "{name} was made by tsumu {}, this is {}",
                manifest.version,
                version::STAMP
            );
            job.event(Event::Warned(Warning { stage: Stage::Compare, message }));
        }
        let Run { recognition, planned, .. } = Run::open(run.root(), &site)?;
        let blocks_file = entry(&run.blocks())?;
        if manifest.outputs.get(BLOCKS).is_some_and(|written| *written != blocks_file) {
            let message = format!(
                "{name}: {BLOCKS} is not the one that the run wrote; its {} blocks are taken as corrected by hand",
                recognition.blocks.len()
            );
            job.event(Event::Warned(Warning { stage: Stage::Compare, message }));
        }
        Ok(Self {
            site,
            blocks: recognition.blocks,
            planned,
            name,
            folders: vec![folder.to_path_buf(), run.root().to_path_buf()],
            blocks_file: Some(blocks_file),
        })
    }

    pub(crate) fn epoch(&self) -> Epoch<'_> {
        Epoch::of(&self.site.survey, &self.blocks)
    }

    /// Refuses an epoch of no blocks: everything would be missing or new, most likely for a fault of recognition.
    pub(crate) fn needs_blocks(&self) -> Result<()> {
        match self.blocks.iter().any(Recognised::is_stated) {
            true => Ok(()),
            false => Err(Error::bad_input(anyhow!(
                "{}: no block was recognised there, so there is nothing to compare",
                self.name
            ))),
        }
    }

    /// What people call it: the day of its survey where the site says it, else its path.
    pub fn title(&self) -> String {
        match self.site.survey_date.as_str() {
            "" => self.name.clone(),
            date => date.into(),
        }
    }

    /// Refuses an epoch that was surveyed after the one given behind it. Sites without a day are taken in the order given.
    pub(crate) fn not_after(&self, later: &Self) -> Result<()> {
        let (first, second) = (&self.site.survey_date, &later.site.survey_date);
        if first.is_empty() || second.is_empty() || first <= second {
            return Ok(());
        }
        Err(Error::bad_input(anyhow!(
            "{} was surveyed on {first} (`survey_date` of its site.toml), after {} on {second}: name the earlier survey first",
            self.name,
            later.name
        )))
    }

    pub(crate) fn needed_plan(&self) -> Result<&Planned> {
        self.planned.as_ref().filter(|p| !p.plan.placements.is_empty()).ok_or_else(|| {
            Error::bad_input(anyhow!(
                "{}: holds no planned blocks; name a run with a plan (`tsumu run` of a site with a [design])",
                self.name
            ))
        })
    }

    /// Refuses an epoch that was recognised with other block types.
    pub(crate) fn same_catalogue(&self, other: &Self) -> Result<()> {
        let list = |r: &Self| -> Vec<String> {
            let types = r.site.catalog.iter();
            types.map(|(_, m)| format!("{} ({:.3} m³)", m.name, m.volume_m3)).collect()
        };
        let (a, b) = (list(self), list(other));
        if a == b {
            return Ok(());
        }
        Err(Error::bad_input(anyhow!(
            "{} has the catalogue {}, {} has {}; recognise all epochs with one catalogue",
            self.name,
            a.join(", "),
            other.name,
            b.join(", ")
        )))
    }
}

/// The blocks' file as a manifest names it.
const BLOCKS: &str = "recognise/blocks.csv";

/// Whether a run has left anything there.
fn begun(run: &Path) -> bool {
    std::fs::read_dir(run).is_ok_and(|mut files| files.next().is_some())
}

/// The site that a run lies in.
fn site_of(run: &Path) -> Result<PathBuf> {
    if !run.join("recognise/blocks.csv").is_file() {
        return Err(Error::bad_input(anyhow!(
            "{}: neither a site folder (site.toml) nor a run folder (recognise/blocks.csv)",
            run.display()
        )));
    }
    let beside = run.canonicalize().ok().and_then(|p| p.parent().map(Path::to_path_buf));
    beside.filter(|p| p.join("site.toml").is_file()).ok_or_else(|| {
        Error::bad_input(anyhow!(
            "{}: does not lie in its site folder, whose survey a comparison needs too; move the run into it",
            run.display()
        ))
    })
}

/// Blocks of one survey must not be held against another.
fn unchanged(manifest: &Manifest, site: &Site, name: &str) -> Result<()> {
    let own = |file: &&String| !["site.toml", io::review::FILE].contains(&file.as_str());
    for file in manifest.inputs.keys().filter(own) {
        if site.inputs.get(file) != manifest.inputs.get(file) {
            return Err(Error::bad_input(anyhow!(
                "{name}: {file} is not the one it was run with; run the site again"
            )));
        }
    }
    Ok(())
}
