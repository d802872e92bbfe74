//! What belongs to the survey and not to a block: order, lines laid onto each other, noise, working cloud, templates.

use crate::canonical::Canonical;
use crate::ground::Bed;
use crate::levelling::level;
use crate::measured::{Measured, noise_of_m};
use crate::pile_facts::PileFacts;
use crate::template::{Template, templates};
use crate::{PoseConfig, PoseError};
use geom::{Event, Observer, SeedTree};
use scene::{Catalog, Segmentation, Survey};
use std::sync::Arc;

/// A survey made ready for its blocks to be recognised in. Everything in it is of the survey as a whole.
pub struct Prepared<'a> {
    pub(crate) templates: Arc<Vec<Template<'a>>>,
    pub(crate) config: &'a PoseConfig,
    pub(crate) measured: Measured,
    /// Chance has no say in what is found: the same draws whatever the user's seed.
    pub(crate) seed: SeedTree,
    pub(crate) canonical: Canonical,
    /// The survey with its lines laid onto each other; `None` when its file tells no lines apart.
    levelled: Option<Survey>,
    /// Facts of the whole, where this is a part of it.
    pub(crate) facts: Option<&'a PileFacts>,
}

/// Block types made ready once, for many surveys: distance fields, samples of surfaces, rotations.
pub struct Templates<'a> {
    pub(crate) catalog: &'a Catalog,
    pub(crate) config: PoseConfig,
    all: Arc<Vec<Template<'a>>>,
}

impl<'a> Templates<'a> {
    /// Makes all types of a catalogue ready. Errors: settings that make no sense, a mesh that is no solid.
    pub fn new(catalog: &'a Catalog, config: &PoseConfig) -> Result<Self, PoseError> {
        config.check()?;
        let all = Arc::new(templates(catalog, config, seed())?);
        Ok(Self { catalog, config: config.clone(), all })
    }

    /// Whether they were made with these settings.
    pub fn are_of(&self, config: &PoseConfig) -> bool {
        self.config == *config
    }
}

/// The same draws whatever the user's seed.
fn seed() -> SeedTree {
    SeedTree::new(0).child("pose", 0)
}

/// Makes a survey ready; `None` for one without points. `segmentation` is of the same points.
/// Errors: [`PoseError`] for settings, labels, points or a catalogue that cannot be used.
pub fn prepare<'a>(
    survey: &Survey,
    segmentation: &Segmentation,
    catalog: &'a Catalog,
    config: &'a PoseConfig,
    observer: &dyn Observer,
) -> Result<Option<Prepared<'a>>, PoseError> {
    prepare_with(survey, segmentation, catalog, config, None, observer)
}

/// The same for a part of a larger survey, with facts of the whole.
pub(crate) fn prepare_with<'a>(
    survey: &Survey,
    segmentation: &Segmentation,
    catalog: &'a Catalog,
    config: &'a PoseConfig,
    facts: Option<&'a PileFacts>,
    observer: &dyn Observer,
) -> Result<Option<Prepared<'a>>, PoseError> {
    config.check()?;
    check_input(survey, segmentation, catalog)?;
    let templates = Arc::new(templates(catalog, config, seed())?);
    prepare_survey(survey, segmentation, config, templates, facts, observer)
}

/// The same with block types that are ready.
pub(crate) fn prepare_ready<'a>(
    survey: &Survey,
    segmentation: &Segmentation,
    ready: &'a Templates,
    observer: &dyn Observer,
) -> Result<Option<Prepared<'a>>, PoseError> {
    check_input(survey, segmentation, ready.catalog)?;
    prepare_survey(survey, segmentation, &ready.config, ready.all.clone(), None, observer)
}

fn prepare_survey<'a>(
    survey: &Survey,
    segmentation: &Segmentation,
    config: &'a PoseConfig,
    templates: Arc<Vec<Template<'a>>>,
    facts: Option<&'a PileFacts>,
    observer: &dyn Observer,
) -> Result<Option<Prepared<'a>>, PoseError> {
    let seed = seed();
    if survey.cloud.is_empty() {
        return Ok(None);
    }
    let level_part = facts.and_then(|f| f.lines.as_ref()).map(|lines| lines.taken_out_of(survey));
    let canonical = Canonical::new(level_part.as_ref().unwrap_or(survey), segmentation);
    let own_lines = config.levelling && facts.is_none();
    let levelled =
        own_lines.then(|| levelled(&canonical.survey, &templates, config, observer)).flatten();
    let (survey, noise_sd_m) = match &levelled {
        Some((survey, noise_sd_m)) => (survey, Some(*noise_sd_m)),
        None => (&canonical.survey, None),
    };
    let measured = measure(survey, &templates, config, noise_sd_m, facts)?;
    let levelled = levelled.map(|l| l.0);
    Ok(Some(Prepared { templates, config, measured, seed, canonical, levelled, facts }))
}

impl Prepared<'_> {
    /// The survey that is looked at: sorted, its lines laid onto each other.
    pub(crate) fn survey(&self) -> &Survey {
        self.levelled.as_ref().unwrap_or(&self.canonical.survey)
    }
}

fn check_input(
    survey: &Survey,
    segmentation: &Segmentation,
    catalog: &Catalog,
) -> Result<(), PoseError> {
    let points = survey.cloud.len();
    if catalog.is_empty() {
        return Err(PoseError::NoModels);
    }
    if segmentation.instance.len() != points {
        return Err(PoseError::LabelCount { labels: segmentation.instance.len(), points });
    }
    if let Some(point) = survey.cloud.position_m.iter().position(|p| !p.is_finite()) {
        return Err(PoseError::NotFinite { point });
    }
    for (hypothesis, h) in segmentation.hypotheses.iter().enumerate() {
        if let Some(&point) = h.points.iter().find(|&&i| i as usize >= points) {
            return Err(PoseError::BadPoint { hypothesis, point, points });
        }
    }
    Ok(())
}

/// The survey with its lines laid onto each other, and the noise left; `None` when its file tells no lines apart.
fn levelled(
    survey: &Survey,
    templates: &[Template],
    config: &PoseConfig,
    observer: &dyn Observer,
) -> Option<(Survey, f32)> {
    let d_max_m = templates.iter().map(|t| t.model.d_max_m).fold(f32::INFINITY, f32::min);
    let noise_sd_m = config.noise_sd_m.unwrap_or_else(|| survey.sensor.noise_sd_m(d_max_m));
    let levelled = level(&survey.cloud.position_m, &survey.line, d_max_m, noise_sd_m)?;
    let message = format!(
        "{} survey lines laid onto each other, {:.0} mm off before; points scatter by {:.0} mm about each",
        levelled.lines,
        1e3 * levelled.shift_m,
        1e3 * levelled.scatter_m
    );
    observer.event(Event::Noted { stage: geom::Stage::Pose, message });
    let mut part = survey.clone();
    part.cloud.position_m = levelled.position;
    Some((part, levelled.scatter_m))
}

/// The working cloud. Error: [`PoseError::WrongScale`] when points are farther apart than a block is long.
fn measure(
    survey: &Survey,
    templates: &[Template],
    config: &PoseConfig,
    scatter_m: Option<f32>,
    facts: Option<&PileFacts>,
) -> Result<Measured, PoseError> {
    let smallest = templates.iter().min_by(|a, b| a.model.d_max_m.total_cmp(&b.model.d_max_m));
    let model = smallest.expect("templates are made of a catalogue that is not empty").model;
    let noise_sd_m = config
        .noise_sd_m
        .or(facts.map(|f| f.noise_sd_m))
        .or(scatter_m)
        .unwrap_or_else(|| noise_of_m(survey, model.d_max_m));
    let cell_m = config.search.working_cell * model.d_max_m;
    let survey_m = survey.cloud.bounds().size().max_element();
    let wrong =
        || PoseError::WrongScale { name: model.name.clone(), d_box_m: model.d_box_m, survey_m };
    if model.d_box_m > 10.0 * survey_m || model.d_box_m * 1e4 < survey_m {
        return Err(wrong());
    }
    let stated = config.bed.map(|plane| Bed { plane: plane.into(), relief_m: 0.1 * model.d_max_m });
    Ok(Measured::new(survey, cell_m, model.d_max_m, noise_sd_m, stated, facts))
}
