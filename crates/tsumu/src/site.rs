//! A site: everything its folder holds, read, checked and hashed once.

use crate::before;
use crate::block_size::{entry_sizes_m, length_text};
use crate::error::OrBadInput;
use crate::memory::{self, Need};
use crate::own_records::OwnRecords;
use crate::ratings::{self, RatingsRecord};
use crate::surveys::{self, Clouds, Joined};
use crate::{Error, Job, Recognition, Result, Settings, catalogue, settings};
use anyhow::{Context, anyhow};
use geom::{Event, Observer, Stage, Warning};
use io::crs::FileCrs;
use io::design_file::DesignOptions;
use io::manifest::{Entry, entry, portable};
use pipeline::Config;
use scene::{Catalog, DesignSurface, Ground, MemoryBound, Ratings, Review, SiteFrame, Survey};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// What there is to recognise and to plan on.
///
/// ```no_run
/// use tsumu::{Job, RecogniseOptions, Settings, Site};
/// let settings = Settings { plans: Some(0), seed: Some(7), ..Settings::default() };
/// let job = Job::silent().on_threads(2)?;
/// let site = Site::load_with("examples/breakwater".as_ref(), &settings, &job)?;
/// let found = site.recognise(&RecogniseOptions::default(), &job)?;
/// println!("{} instances, {} blocks", found.segments.instances, found.blocks.len());
/// # Ok::<(), tsumu::Error>(())
/// ```
pub struct Site {
    /// Name for reports.
    pub name: String,
    /// The site folder; `None` for clouds without one.
    pub folder: Option<PathBuf>,
    /// Day of the survey, `YYYY-MM-DD`; empty when the site does not state it.
    pub survey_date: String,
    /// Block types.
    pub catalog: Catalog,
    /// All surveys in one local frame.
    pub survey: Survey,
    /// How high the finished works should stand; `None`: there is nothing to plan.
    pub design: Option<DesignSurface>,
    /// The bed as stated, local frame; `None`: to be estimated.
    pub ground: Option<Ground>,
    /// What a reviewer decided of an earlier run.
    pub review: Option<Review>,
    /// What people think of the blocks of earlier plans.
    pub ratings: Option<Ratings>,
    /// What was learned from that.
    pub learned: Option<RatingsRecord>,
    /// Settings of all stages.
    pub config: Config,
    /// Root of all random choices.
    pub seed: u64,
    /// How much memory a run may take; `None`: as much as it needs. No result depends on it.
    pub memory: Option<MemoryBound>,
    /// Size and hash of every input file as it was before it was read, by its path in the site folder.
    pub inputs: BTreeMap<String, Entry>,
    /// Where those files lie.
    pub(crate) input_files: Vec<PathBuf>,
    /// The measure that each entry of the catalogue states, metres: a shape's `size`, a mesh's longest edge.
    pub(crate) entry_sizes_m: Vec<f32>,
    /// The points' places in their file, where one file with records is the whole survey.
    pub(crate) records: Option<OwnRecords>,
}

/// Warns when what a method's word promises does not stand.
fn tell_departures(config: &Config, job: &Job) -> Result<()> {
    let departures = settings::departures(config)?;
    if !departures.is_empty() {
        let message = format!("not as the method has it: {}", departures.join(", "));
        job.event(Event::Warned(Warning { stage: Stage::Read, message }));
    }
    Ok(())
}

impl Site {
    /// Reads a site folder with its own settings. Errors: everything that is wrong with its files, by file, key or line.
    pub fn load(folder: &Path, job: &Job) -> Result<Self> {
        Self::load_with(folder, &Settings::default(), job)
    }

    /// Reads a site folder (or its `site.toml`); `settings` count before the site's own.
    pub fn load_with(folder: &Path, settings: &Settings, job: &Job) -> Result<Self> {
        let files = io::site::load(folder).or_bad_input()?;
        Self::read(files, settings, job, |files, job| surveys::of_site(files, job))
    }

    /// The same, checked as by [`check_first`](crate::check_first) while it is read: one pass over each survey. Error: no answer can be
    /// given; every reason is a line of it.
    pub fn load_checked(folder: &Path, settings: &Settings, job: &Job) -> Result<Self> {
        let Ok(files) = io::site::load(folder) else {
            crate::check_first(folder, job)?;
            return Self::load_with(folder, settings, job);
        };
        Self::read(files, settings, job, |files, job| {
            let (found, joined) = job.install(|| surveys::of_site_checked(files, job));
            before::tell(&found, job)?;
            joined.unwrap_or_else(|| surveys::of_site(files, job))
        })
    }

    fn read(
        files: io::site::Site,
        settings: &Settings,
        job: &Job,
        surveys_of: impl FnOnce(&io::site::Site, &Job) -> Result<Joined>,
    ) -> Result<Self> {
        let config = settings.of_site(&files.spec)?;
        tell_departures(&config, job)?;
        let memory = settings.memory.or(files.spec.memory);
        bound_memory(memory, &files.survey_files, files.spec.area.is_some(), job)?;
        let mut inputs = BTreeMap::new();
        let mut input_files = Vec::new();
        for name in files.inputs() {
            let file = files.folder.join(&name);
            inputs.insert(portable(&name), entry(&file).or_bad_input()?);
            input_files.push(file);
        }
        let review_file = files.folder.join(io::review::FILE);
        if review_file.exists() {
            inputs.insert(io::review::FILE.into(), entry(&review_file).or_bad_input()?);
            input_files.push(review_file.clone());
        }
        let review = io::review::read(&review_file).or_bad_input()?;
        let ratings = ratings::read(&files.folder)?;
        if ratings.is_some() {
            let file = files.folder.join(io::ratings::FILE);
            inputs.insert(io::ratings::FILE.into(), entry(&file).or_bad_input()?);
            input_files.push(file);
        }
        let catalog = catalogue::models(&files.catalog, &files.catalog_file, job)?;
        let entry_sizes_m = entry_sizes_m(&files.catalog, &catalog);
        let Joined { survey, mut references, steps_m, records } = surveys_of(&files, job)?;
        surveys::fine_enough(&steps_m, &catalog)?;
        let design = design(&files, &mut references, job)?;
        surveys::agree(&files.spec.crs, &references, job)?;
        let ground = ground(&files, &survey.frame);
        let mut site = Self {
            name: files.spec.name.clone(),
            survey_date: files.spec.survey_date.clone(),
            design,
            seed: settings.seed.unwrap_or(files.spec.seed),
            memory,
            folder: Some(files.folder),
            catalog,
            survey,
            review,
            ratings,
            learned: None,
            config: config.with_ground(ground.as_ref()),
            ground,
            inputs,
            input_files,
            entry_sizes_m,
            records,
        };
        site.check()?;
        site.learn(job)?;
        Ok(site)
    }

    /// Clouds without a site folder: blocks can be recognised, nothing is planned. `review`: decisions that stand.
    pub fn of_clouds(
        clouds: &Clouds,
        catalog: &Path,
        review: Option<&Path>,
        settings: &Settings,
        job: &Job,
    ) -> Result<Self> {
        let config = settings.alone()?;
        tell_departures(&config, job)?;
        bound_memory(settings.memory, &clouds.files, clouds.area.is_some(), job)?;
        let (mut inputs, mut input_files) = (BTreeMap::new(), Vec::new());
        for file in clouds.files.iter().map(PathBuf::as_path).chain([catalog]).chain(review) {
            let name = file.file_name().map_or(file, Path::new);
            inputs.insert(portable(name), entry(file).or_bad_input()?);
            input_files.push(file.to_path_buf());
        }
        let spec = io::site::load_catalog(catalog).or_bad_input()?;
        let catalog = catalogue::models(&spec, catalog, job)?;
        let entry_sizes_m = entry_sizes_m(&spec, &catalog);
        let Joined { survey, steps_m, records, .. } = clouds.survey(job)?;
        surveys::fine_enough(&steps_m, &catalog)?;
        let site = Self {
            name: String::new(),
            survey_date: String::new(),
            folder: None,
            catalog,
            survey,
            design: None,
            ground: None,
            review: review.map(named_review).transpose()?,
            ratings: None,
            learned: None,
            config,
            seed: settings.seed.unwrap_or_default(),
            memory: settings.memory,
            inputs,
            input_files,
            entry_sizes_m,
            records,
        };
        site.check()?;
        Ok(site)
    }

    /// The site folder a run belongs to: the named one, or the folder the run lies in.
    pub fn folder_of_run(run: &Path, named: Option<&Path>) -> Result<PathBuf> {
        let beside = run.canonicalize().ok().and_then(|p| p.parent().map(Path::to_path_buf));
        let lies_in = beside.filter(|p| p.join("site.toml").is_file());
        named.map(Path::to_path_buf).or(lies_in).ok_or_else(|| {
            Error::bad_input(anyhow!(
                "{}: does not lie in its site folder; name that with --site",
                run.display()
            ))
        })
    }

    /// What no file alone tells: the unit of the blocks, the place of the design.
    pub(crate) fn check(&self) -> Result<()> {
        pipeline::survey::check_scale(&self.survey, &self.catalog)?;
        if let Some(design) = &self.design {
            self.check_heights(design)?;
            pipeline::survey::check_design(&self.survey, design)?;
            // Before hours of work, not after them.
            plan::check_extent(design, &self.catalog, &self.config.plan)
                .map_err(pipeline::PipelineError::from)?;
        }
        self.need().check(self.memory)
    }

    /// What a run of it holds at once.
    fn need(&self) -> Need {
        let raster_bytes = self.design.as_ref().map_or(0, |design| {
            plan::raster_bytes(design, &self.catalog, &self.config.plan).unwrap_or(0)
        });
        Need { points: self.survey.cloud.len() as u64, raster_bytes }
    }

    /// Refuses to write where an input lies. Errors: the file is one of them.
    pub(crate) fn refuse_input(&self, out: &Path) -> Result<()> {
        let real = |path: &Path| path.canonicalize().ok();
        let Some(place) = real(out) else { return Ok(()) };
        match self.input_files.iter().find(|file| real(file).as_ref() == Some(&place)) {
            Some(_) => Err(Error::bad_input(anyhow!(
                "{}: is an input, which is never overwritten; choose another --out",
                out.display()
            ))),
            None => Ok(()),
        }
    }

    /// The same for a whole folder that is going to be written.
    pub(crate) fn refuse_inputs_below(&self, folder: &Path) -> Result<()> {
        let Ok(place) = folder.canonicalize() else { return Ok(()) };
        let below = |file: &&PathBuf| file.canonicalize().is_ok_and(|f| f.starts_with(&place));
        match self.input_files.iter().find(below) {
            Some(file) => Err(Error::bad_input(anyhow!(
                "{}: is an input and lies in the folder of the results, where it could be overwritten; choose another --out",
                file.display()
            ))),
            None => Ok(()),
        }
    }

    /// A design hundreds of metres above or below everything surveyed is another unit's or another datum's.
    fn check_heights(&self, design: &DesignSurface) -> Result<()> {
        let heights = || self.survey.cloud.position_m.iter().map(|p| f64::from(p.z));
        let up_m = self.survey.frame.origin[2];
        let low_m = up_m + heights().fold(f64::INFINITY, f64::min);
        let high_m = up_m + heights().fold(f64::NEG_INFINITY, f64::max);
        match design.heights_objection(low_m, high_m) {
            None => Ok(()),
            Some(objection) => {
                let file = self.folder.as_deref().unwrap_or(Path::new("")).join("site.toml");
                Err(Error::bad_input(anyhow!("{}: {objection}", file.display())))
            }
        }
    }

    /// `fits 2.79 ± 0.01 m; the catalogue says 2.00`, or, with several types, the same as a share; `None`: too few blocks tell.
    pub fn size_sentence(&self, found: &Recognition) -> Option<String> {
        let size = found.pile.size?;
        let over = format!("over {} blocks", size.blocks);
        let mut found = scene::stated(&found.blocks).map(|(_, fit)| fit.model);
        let first = found.next().or_else(|| self.catalog.iter().next().map(|(id, _)| id))?;
        let alone = found.all(|model| model == first) && self.catalog.len() == 1;
        let entry_m = self.entry_sizes_m.get(usize::from(first.0)).filter(|_| alone);
        Some(match entry_m {
            Some(entry_m) => format!(
                "`{}` fits {} ± {} m {over}; the catalogue says {}",
                self.catalog.get(first).name,
                length_text(entry_m * size.factor, *entry_m),
                length_text(entry_m * size.factor_sd, *entry_m),
                length_text(*entry_m, *entry_m)
            ),
            None => format!(
                "the blocks fit {:.1} ± {:.1} % of the catalogue's sizes {over}",
                100.0 * size.factor,
                100.0 * size.factor_sd
            ),
        })
    }

    /// Where a run of this site is kept unless another folder is named.
    pub fn run_folder(&self) -> PathBuf {
        self.folder.as_deref().unwrap_or(Path::new(".")).join("run")
    }

    /// The design. Error: there is none.
    pub fn needed_design(&self) -> Result<&DesignSurface> {
        self.design.as_ref().ok_or_else(|| {
            let file = self.folder.as_deref().unwrap_or(Path::new("")).join("site.toml");
            Error::bad_input(anyhow!(
                "{}: has no [design], so there is nothing to plan",
                file.display()
            ))
        })
    }
}

/// Tells the job of its bound, and holds what the surveys' headers state against it before they are read.
pub(crate) fn bound_memory(
    memory: Option<MemoryBound>,
    surveys: &[PathBuf],
    partly: bool,
    job: &Job,
) -> Result<()> {
    let Some(bound) = memory else { return Ok(()) };
    job.memory().set(bound);
    // Of a part of a survey no header knows how many points it has.
    let files = surveys.iter().filter(|_| !partly).map(PathBuf::as_path);
    Need { points: memory::stated_points(files), raster_bytes: 0 }.check(memory)
}

fn named_review(file: &Path) -> Result<Review> {
    let review = io::review::read(file).or_bad_input()?;
    review.ok_or_else(|| {
        Error::bad_input(anyhow!("cannot read {}: there is no such file", file.display()))
    })
}

/// The design surface of a site, checked; `None` when it has none. What its files say of their coordinates joins the references.
fn design(
    site: &io::site::Site,
    references: &mut Vec<(String, FileCrs)>,
    observer: &dyn Observer,
) -> Result<Option<DesignSurface>> {
    let spec = &site.spec;
    if let (Some(file), Some(own)) = (&site.design_file, &spec.design_file) {
        let options = DesignOptions {
            cell_m: own.cell_m,
            axis_order: spec.axis_order,
            surface: own.surface.as_deref(),
            unit: own.unit,
        };
        let read = io::design_file::read_with(file, &options, observer).or_bad_input()?;
        references.push((file.display().to_string(), read.reference));
        return Ok(Some(read.surface));
    }
    let Some(mut design) = spec.design.clone() else { return Ok(None) };
    if let (Some(file), Some(own)) = (&site.alignment_file, &spec.alignment_file) {
        let (name, axes) = (own.name.as_deref(), spec.axis_order);
        let (points, reference) =
            io::alignment_file::read(file, name, axes, observer).or_bad_input()?;
        references.push((file.display().to_string(), reference));
        design = design.along(points);
    }
    design
        .check()
        .with_context(|| site.folder.join("site.toml").display().to_string())
        .or_bad_input()?;
    Ok(Some(design))
}

/// The bed as the site states it, in the local frame; `None`: to be estimated.
pub(crate) fn ground(site: &io::site::Site, frame: &SiteFrame) -> Option<Ground> {
    site.spec.ground.as_ref().map(|ground| surveys::ground_of(ground, frame))
}
