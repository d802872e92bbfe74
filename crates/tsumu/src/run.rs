//! A run folder: written whole, opened whole.

use crate::drawings::{Drawings, export};
use crate::error::OrBadInput;
use crate::lock::FolderLock;
use crate::page::{self, Page, PageInput};
use crate::planning::Planned;
use crate::recognition::Recognition;
use crate::run_folder::{RunFolder, SHEETS};
use crate::written::Written;
use crate::{Error, Job, Result, Site, outputs, resume, review, settings, stored, version};
use anyhow::anyhow;
use geom::{Event, JobPart, Observer, Stage, Warning};
use io::manifest::{Difference, Manifest, entry, verify};
use serde_json::json;
use std::path::{Path, PathBuf};

/// Something a run keeps.
pub trait Part {
    /// Writes it and notes where it came from.
    fn keep<'a>(&'a self, run: &mut NewRun<'a>) -> Result<()>;
}

impl Part for Recognition {
    fn keep<'a>(&'a self, run: &mut NewRun<'a>) -> Result<()> {
        outputs::write_recognition(&run.folder, run.site, self, &run.written)?;
        run.holds(self, None);
        Ok(())
    }
}

impl Part for Planned {
    fn keep<'a>(&'a self, run: &mut NewRun<'a>) -> Result<()> {
        outputs::write_plan(&run.folder, run.site, self, &run.written)?;
        run.holds_plan(self);
        Ok(())
    }
}

/// A run folder that is being written.
pub struct NewRun<'a> {
    pub(crate) folder: RunFolder,
    pub(crate) site: &'a Site,
    pub(crate) manifest: Manifest,
    /// What it has written, and what earlier runs have left there.
    pub(crate) written: Written,
    recognition: Option<&'a Recognition>,
    planned: Option<&'a Planned>,
    /// Nobody else writes there; `None`: whoever began the run holds the lock.
    _lock: Option<FolderLock>,
}

impl<'a> NewRun<'a> {
    /// Writes a part.
    pub fn keep(mut self, part: &'a impl Part) -> Result<Self> {
        self.written.invalidate()?;
        part.keep(&mut self)?;
        Ok(self)
    }

    /// Takes over what is written already.
    pub(crate) fn holds(&mut self, recognition: &'a Recognition, planned: Option<&'a Planned>) {
        recognition.weights.record(&mut self.manifest);
        recognition.review.iter().for_each(|r| r.record(&mut self.manifest));
        self.recognition = Some(recognition);
        planned.into_iter().for_each(|p| self.holds_plan(p));
    }

    fn holds_plan(&mut self, planned: &'a Planned) {
        if let Some(file) = &planned.proposer {
            self.note(stored::PROPOSER_NOTE, json!(file));
        }
        self.planned = Some(planned);
    }

    /// Notes a fact about where the run comes from.
    pub fn note(&mut self, key: &str, value: serde_json::Value) {
        self.manifest.notes.insert(key.into(), value);
    }

    /// Notes which blocks, and which earlier plan, a plan was made from. Errors: it would be written over one of them.
    pub fn note_source(&mut self, run: &RunFolder, plan: Option<&Path>) -> Result<()> {
        self.refuse_own_source([Some(run.root()), plan])?;
        for (key, file) in [("blocks", run.blocks()), ("not_judged", run.not_judged())] {
            if file.is_file() {
                self.note(key, json!(entry(&file)?));
            }
        }
        if let Some(plan) = plan {
            let inside = plan.join("plan/placements.csv");
            self.note(
                "previous_plan",
                json!(entry(if inside.is_file() { &inside } else { plan })?),
            );
        }
        Ok(())
    }

    /// Nothing is made out of what it then takes the place of.
    fn refuse_own_source(&self, sources: [Option<&Path>; 2]) -> Result<()> {
        let Ok(place) = self.folder.root().canonicalize() else { return Ok(()) };
        let own = |source: &&Path| source.canonicalize().is_ok_and(|s| s.starts_with(&place));
        match sources.into_iter().flatten().find(own) {
            Some(source) => Err(Error::bad_input(anyhow!(
                "{}: is what the plan is made from, which is never overwritten; choose another --out",
                source.display()
            ))),
            None => Ok(()),
        }
    }

    /// Writes exports and report of what is kept.
    pub fn present(mut self, job: &Job) -> Result<Self> {
        let Some(recognition) = self.recognition else { return Ok(self) };
        let drawings = drawn(self.site, recognition, self.planned)?;
        let planned = self.planned.zip(drawings.as_ref());
        for file in export(&self.folder.exports(), self.site, recognition, planned)? {
            self.written.record(&file)?;
        }
        job.done(JobPart::Exports);
        self.note("warnings", json!(job.warnings()));
        let page = page::page(&PageInput {
            site: self.site,
            recognition,
            planned,
            review: self.site.review.as_ref(),
            manifest: Some(&self.manifest),
            warnings: job.warnings(),
        })?;
        self.put_bytes(&self.folder.report(), page.html.as_bytes())?;
        self.put_bytes(&self.folder.picture(), &page.png)?;
        self.put_bytes(&self.folder.sheets(), &page.sheets)?;
        job.done(JobPart::Report);
        Ok(self)
    }

    /// Writes the picture alone.
    pub fn picture(&self) -> Result<()> {
        let blocks = self.recognition.map_or(&[][..], |r| &r.blocks);
        let png = page::picture(&self.site.survey, &self.site.catalog, blocks)?;
        self.put_bytes(&self.folder.picture(), &png)
    }

    fn put_bytes(&self, file: &Path, bytes: &[u8]) -> Result<()> {
        self.written.put(file, |p| io::atomic::write_bytes(p, bytes))
    }

    /// Writes the settings and vouches for every file it wrote; from now on the run is whole.
    pub fn seal(mut self) -> Result<RunFolder> {
        let settings = toml::to_string(&self.site.config)?;
        self.put_bytes(&self.folder.config(), settings.as_bytes())?;
        if let Some(folder) = &self.site.folder {
            self.manifest.check_inputs(folder).or_bad_input()?;
        }
        self.written.seal(&mut self.manifest)?;
        Ok(self.folder)
    }
}

/// A run folder as it was kept, or as it was corrected by hand since.
///
/// ```no_run
/// # fn main() -> tsumu::Result<()> {
/// use tsumu::{Job, Run, Site};
/// let (folder, job) = ("examples/breakwater".as_ref(), Job::silent());
/// let site = Run::settled("out".as_ref(), Site::load(folder, &job)?, &job)?;
/// let run = Run::open("out".as_ref(), &site)?;
/// println!("{} blocks", scene::stated(&run.recognition.blocks).count());
/// run.report(&site, &job)?.write_html("page.html".as_ref())?;
/// # Ok(()) }
/// ```
pub struct Run {
    /// Where its files lie.
    pub folder: RunFolder,
    /// What made it; `None` for a folder that was put together by hand.
    pub manifest: Option<Manifest>,
    /// Its blocks.
    pub recognition: Recognition,
    /// Its plan; `None` where there is none.
    pub planned: Option<Planned>,
}

impl Run {
    /// Begins a run folder and locks it. Errors: the folder holds something else than an earlier run, a link, or an input of the
    /// site; somebody else is writing there.
    pub fn create<'a>(folder: &Path, site: &'a Site) -> Result<NewRun<'a>> {
        let mut new = Self::prepare(folder, site)?;
        new._lock = Some(FolderLock::take(folder)?);
        // What lies there is known for certain once nobody else writes there.
        new.written = Written::begin(folder);
        Ok(new)
    }

    /// The same without a lock.
    pub(crate) fn prepare<'a>(folder: &Path, site: &'a Site) -> Result<NewRun<'a>> {
        let config = serde_json::to_value(&site.config)?;
        let mut manifest = Manifest::new(version::STAMP, site.seed, config);
        manifest.inputs = site.inputs.clone();
        manifest.notes.insert("processor".into(), json!(version::processor()));
        if let Some(file) = version::program_file()? {
            manifest.notes.insert("program_file".into(), json!(file));
        }
        if let Some(learned) = &site.learned {
            manifest.notes.insert("ratings".into(), json!(learned));
        }
        site.refuse_inputs_below(folder)?;
        let folder = RunFolder::for_writing(folder)?;
        let written = Written::begin(folder.root());
        Ok(NewRun {
            folder,
            site,
            manifest,
            written,
            recognition: None,
            planned: None,
            _lock: None,
        })
    }

    /// Reads a run of this site. Equal to what was kept, where nobody has changed its files.
    pub fn open(folder: &Path, site: &Site) -> Result<Self> {
        let folder = RunFolder::existing(folder);
        let manifest = whole(folder.root())?;
        manifest.as_ref().map_or(Ok(()), |manifest| is_of_one_run(&folder, manifest))?;
        let recognition = stored::recognition(&folder, site, manifest.as_ref())?;
        let planned = stored::planned(&folder, site, &recognition, manifest.as_ref())?;
        Ok(Self { folder, manifest, recognition, planned })
    }

    /// Reads the blocks of a run alone, as corrected by hand perhaps; warns of a review that came after it.
    pub fn open_recognition(folder: &Path, site: &Site, job: &Job) -> Result<Recognition> {
        let folder = RunFolder::existing(folder);
        let manifest = whole(folder.root())?;
        if let Some(manifest) = &manifest {
            is_of_one_run(&folder, manifest)?;
            review::is_of_run(site.folder.as_deref(), manifest, job)?;
        }
        stored::recognition(&folder, site, manifest.as_ref())
    }

    /// The site with the seed and the settings this run was made with, where its folder has them; warns of settings that it
    /// cannot read, those of another version say.
    pub fn settled(folder: &Path, mut site: Site, job: &Job) -> Result<Site> {
        let folder = RunFolder::existing(folder);
        match folder.config().is_file().then(|| settings::read(&folder.config())) {
            Some(Ok(config)) => site.config = config,
            Some(Err(error)) => {
                let message = format!("{}; the site's settings are taken instead", error.line());
                job.event(Event::Warned(Warning { stage: Stage::Run, message }));
            }
            None => {}
        }
        if let Ok(manifest) = Manifest::load(folder.root()) {
            site.seed = manifest.seed;
        }
        Ok(site)
    }

    /// Its page: the one it was made with, unless its files were corrected since; then the figures follow the files.
    pub fn report(&self, site: &Site, job: &Job) -> Result<Page> {
        let drawings = drawn(site, &self.recognition, self.planned.as_ref())?;
        let review = match &self.manifest {
            Some(manifest) => review::is_of_run(site.folder.as_deref(), manifest, job)?,
            None => false,
        };
        page::page(&PageInput {
            site,
            recognition: &self.recognition,
            planned: self.planned.as_ref().zip(drawings.as_ref()),
            review: site.review.as_ref().filter(|_| review),
            manifest: self.manifest.as_ref(),
            warnings: self.warnings(job)?,
        })
    }

    /// Puts a page of it in its place in the folder; returns that place. Errors: somebody else is writing there.
    pub fn put_report(&self, page: &Page) -> Result<PathBuf> {
        let _lock = FolderLock::take(self.folder.root())?;
        let place = self.folder.report();
        io::atomic::write_bytes(&place, page.html.as_bytes())?;
        Ok(place)
    }

    /// What the run warned of, and that its blocks were corrected.
    fn warnings(&self, job: &Job) -> Result<Vec<String>> {
        let Some(manifest) = &self.manifest else { return Ok(job.warnings()) };
        let noted = manifest.notes.get("warnings").cloned().unwrap_or_default();
        let mut warnings: Vec<String> = serde_json::from_value(noted).unwrap_or_default();
        let name = "recognise/blocks.csv";
        let as_made = manifest.outputs.get(name);
        if as_made.is_some() && as_made != Some(&entry(&self.folder.blocks())?) {
            let mut message = format!(
                "{name} was corrected after the run: the figures of recognition are those of the file as it is"
            );
            if self.planned.is_some() {
                message +=
                    ", the plan is still the run's; `tsumu plan` plans on the corrected blocks";
            }
            job.event(Event::Warned(Warning { stage: Stage::Run, message: message.clone() }));
            warnings.push(format!("run: {message}"));
        }
        Ok(warnings)
    }

    /// Writes the exports of its blocks and plan into a folder.
    pub fn export(&self, site: &Site, folder: &Path) -> Result<()> {
        let drawings = drawn(site, &self.recognition, self.planned.as_ref())?;
        export(folder, site, &self.recognition, self.planned.as_ref().zip(drawings.as_ref()))?;
        let page = self.report(site, &Job::silent())?;
        Ok(io::atomic::write_bytes(&folder.join(SHEETS), &page.sheets)?)
    }

    /// Makes a pair of keys for [`sign`](Self::sign): the secret one at `file`; the place of the public one comes back.
    pub fn new_keys(file: &Path) -> Result<PathBuf> {
        io::signature::new_keys(file).or_bad_input()
    }

    /// Signs the manifest of a whole run with a secret key file.
    pub fn sign(folder: &Path, key: &Path) -> Result<()> {
        whole(folder)?;
        io::signature::sign(folder, key).or_bad_input()
    }

    /// Checks the signature with a public key, or a file of one. Error: the run was changed after it was signed, or signed by
    /// somebody else, or not at all.
    pub fn check_signature(folder: &Path, key: &str) -> Result<()> {
        Ok(io::signature::check(folder, key)?)
    }

    /// Files of a run folder, and its inputs when the site folder is given, that are not as they were; empty: all are.
    pub fn verify(folder: &Path, site: Option<&Path>) -> Result<Vec<Difference>> {
        verify(folder, site).or_bad_input()
    }
}

/// The manifest of a run; `None` for a folder that was put together by hand. Errors: the run is not whole, or its manifest is
/// damaged: its files may be of two runs.
fn whole(folder: &Path) -> Result<Option<Manifest>> {
    if folder.join(io::manifest::FILE).symlink_metadata().is_ok() {
        return Manifest::load(folder).map(Some).or_bad_input();
    }
    if resume::is_unfinished(folder) {
        return Err(Error::bad_input(anyhow!(
            "{}: the run in it is not finished, its files may be of two runs; give its command again, it goes on from there",
            folder.display()
        )));
    }
    Ok(None)
}

/// Tables that may be corrected by hand; the figures follow them.
const CORRECTED: [&str; 3] =
    ["recognise/blocks.csv", "recognise/not_judged.csv", "plan/placements.csv"];

/// Refuses a folder with files of two runs: everything that is read from it is as its manifest says, but for the tables that
/// may be corrected by hand. Errors: the file that is not.
fn is_of_one_run(folder: &RunFolder, manifest: &Manifest) -> Result<()> {
    let read = |name: &str| {
        name.starts_with("recognise/") || name.starts_with("segment/") || name.starts_with("plan/")
    };
    for (name, stated) in manifest.outputs.iter().filter(|(name, _)| read(name)) {
        let file = folder.root().join(name);
        let is_own = entry(&file).or_bad_input()? == *stated;
        if !is_own && !CORRECTED.contains(&name.as_str()) {
            return Err(Error::bad_input(anyhow!(
                "{}: is not the file that its run wrote, so that the folder holds files of two runs or a damaged one; `tsumu verify` names all of them, `tsumu run` makes them anew",
                file.display()
            )));
        }
    }
    for file in [folder.placements(), folder.not_judged()].into_iter().filter(|f| f.exists()) {
        let name = io::manifest::portable(file.strip_prefix(folder.root()).unwrap_or(&file));
        if !manifest.outputs.contains_key(&name) {
            return Err(Error::bad_input(anyhow!(
                "{}: was not made by the run of this folder; take it away, or run again",
                file.display()
            )));
        }
    }
    Ok(())
}

fn drawn(
    site: &Site,
    recognition: &Recognition,
    planned: Option<&Planned>,
) -> Result<Option<Drawings>> {
    planned.map(|planned| Drawings::of(site, recognition, planned)).transpose()
}

/// The run behind a path: that of a site folder, or the folder itself. Error: there is none.
pub fn folders_of(site_or_run: &Path, named_site: Option<&Path>) -> Result<(PathBuf, RunFolder)> {
    let has_blocks = |run: &RunFolder| run.blocks().is_file();
    if site_or_run.join("site.toml").is_file() {
        let run = RunFolder::existing(&site_or_run.join("run"));
        return match has_blocks(&run) {
            true => Ok((site_or_run.to_path_buf(), run)),
            false => Err(Error::bad_input(anyhow!(
                "{}: has no run yet; `tsumu run` recognises and plans in one go",
                site_or_run.display()
            ))),
        };
    }
    let run = RunFolder::existing(site_or_run);
    if !has_blocks(&run) {
        return Err(Error::bad_input(anyhow!(
            "{}: neither a site folder (site.toml) nor a run folder (recognise/blocks.csv)",
            site_or_run.display()
        )));
    }
    Ok((Site::folder_of_run(site_or_run, named_site)?, run))
}
