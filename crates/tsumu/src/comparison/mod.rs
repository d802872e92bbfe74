//! What happened between the surveys of one site: epochs in, a folder of changes out, whole or not at all.

mod epochs;
mod files;
mod folder;
mod page;
mod pictures;
mod rows;
mod settings;
mod stable;

pub use epochs::EpochRun;
pub use folder::ComparisonFolder;
pub use stable::read as read_stable_ground;

use crate::recognition::RecogniseOptions;
use crate::{Error, Job, Result};
use anyhow::anyhow;
use monitor::{
    AsBuilt, AsBuiltConfig, CompareConfig, Comparison, MonitorError, Series, Span, SpanConfig,
    StableGround, SurfaceChange, SurfaceConfig,
};

/// What a comparison may be told.
#[derive(Clone, Debug, Default)]
pub struct CompareOptions {
    /// Ground that does not move; none: movements are relative to the blocks that stayed.
    pub stable: StableGround,
    /// Settings of the comparison.
    pub config: CompareConfig,
    /// How the structure is cut and graded.
    pub spans: SpanConfig,
    /// For sites that have no run yet.
    pub recognise: RecogniseOptions,
}

/// Epochs with what happened between them.
pub struct Compared<'a> {
    /// In order of time.
    pub epochs: Vec<&'a EpochRun>,
    /// One for each two epochs that follow each other.
    pub steps: Vec<Comparison>,
    /// Every block through all epochs; `None` of works against their plan.
    pub series: Option<Series>,
    /// What became of the plan, where works are held against one.
    pub as_built: Option<AsBuilt>,
    /// What the surface did in the last step.
    pub surface: Vec<SurfaceChange>,
    /// The roll-up of the last step along the structure.
    pub spans: Vec<Span>,
}

impl Compared<'_> {
    /// The last step.
    pub fn last(&self) -> &Comparison {
        self.steps.last().expect("two epochs at least make a step")
    }
}

/// Compares two epochs of one site. Errors: epochs that cannot be compared, by name; the same survey twice is none.
pub fn compare<'a>(
    earlier: &'a EpochRun,
    later: &'a EpochRun,
    options: &CompareOptions,
    job: &Job,
) -> Result<Compared<'a>> {
    compare_series(&[earlier, later], options, job)
}

/// The same for two or more epochs in order of time: a block keeps its number through all of them.
pub fn compare_series<'a>(
    epochs: &[&'a EpochRun],
    options: &CompareOptions,
    job: &Job,
) -> Result<Compared<'a>> {
    let [first, others @ ..] = epochs else { return Err(too_few()) };
    if others.is_empty() {
        return Err(too_few());
    }
    for epoch in epochs {
        first.same_catalogue(epoch)?;
        epoch.needs_blocks()?;
    }
    for pair in epochs.windows(2) {
        pair[0].not_after(pair[1])?;
    }
    let catalog = &first.site.catalog;
    let mut series = Series::start(&first.epoch(), catalog);
    let mut steps = Vec::new();
    for pair in epochs.windows(2) {
        let (before, next) = (pair[0].epoch(), pair[1].epoch());
        let (stable, config) = (&options.stable, &options.config);
        let step = job.install(|| series.add(&before, &next, catalog, stable, config, job));
        steps.push(step.map_err(|e| refused(e, pair[0], pair[1]))?);
    }
    Ok(rolled_up(epochs, steps, Some(series), None, options, job))
}

/// Holds what was built against the plan of an earlier run.
pub fn compare_with_plan<'a>(
    planned: &'a EpochRun,
    later: &'a EpochRun,
    options: &CompareOptions,
    job: &Job,
) -> Result<Compared<'a>> {
    let plan = planned.needed_plan()?;
    planned.same_catalogue(later)?;
    planned.not_after(later)?;
    later.needs_blocks()?;
    let config = AsBuiltConfig::default();
    let registration = options.config.registration;
    let config =
        AsBuiltConfig { compare: CompareConfig { registration, ..config.compare }, ..config };
    let (before, next) = (planned.epoch(), later.epoch());
    let (catalog, stable) = (&planned.site.catalog, &options.stable);
    let built = job
        .install(|| monitor::as_built(&before, &plan.plan, &next, catalog, stable, &config, job))
        .map_err(|e| refused(e, planned, later))?;
    let steps = vec![built.comparison.clone()];
    Ok(rolled_up(&[planned, later], steps, None, Some(built), options, job))
}

fn rolled_up<'a>(
    epochs: &[&'a EpochRun],
    steps: Vec<Comparison>,
    series: Option<Series>,
    as_built: Option<AsBuilt>,
    options: &CompareOptions,
    job: &Job,
) -> Compared<'a> {
    let mut out = Compared {
        epochs: epochs.to_vec(),
        steps,
        series,
        as_built,
        surface: Vec::new(),
        spans: Vec::new(),
    };
    let (earlier, last) = (&epochs[epochs.len() - 2].site, out.last());
    let own = &earlier.survey.cloud.position_m;
    let (catalog, frame, design) =
        (&earlier.catalog, &earlier.survey.frame, earlier.design.as_ref());
    let (surface, spans) = job.install(|| {
        let size_m = files::largest_edge_m(catalog);
        let config = SurfaceConfig::default();
        let surface =
            monitor::surface_changes(own, &last.later_points, size_m, &last.reference, &config);
        (surface, monitor::spans(last, own, frame, catalog, design, &options.spans))
    });
    (out.surface, out.spans) = (surface, spans);
    out
}

fn too_few() -> Error {
    Error::bad_input(anyhow!("a comparison needs two runs or sites at least, the earliest first"))
}

fn refused(error: MonitorError, earlier: &EpochRun, later: &EpochRun) -> Error {
    match error {
        MonitorError::Stopped => Error::stopped(error),
        other => Error::bad_input(
            anyhow!(other).context(format!("{} against {}", later.name, earlier.name)),
        ),
    }
}
