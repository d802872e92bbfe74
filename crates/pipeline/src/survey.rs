//! What no file alone tells: whether blocks, cloud and design belong together.

use crate::PipelineError;
use geom::{Event, Observer, Stage, Warning};
pub use pose::survey_facts::{Limit, SurveyFacts, not_judgeable};
use scene::{Catalog, DesignSurface, Survey};

/// Refuses a catalogue whose blocks cannot be in this cloud: a wrong unit is the usual reason.
pub fn check_scale(survey: &Survey, catalog: &Catalog) -> Result<(), PipelineError> {
    let extent_m = survey.cloud.bounds().size().max_element();
    for (_, model) in catalog.iter() {
        if model.d_box_m > 2.0 * extent_m {
            return Err(PipelineError::BlockTooLarge {
                block: model.name.clone(),
                block_m: model.d_box_m,
                cloud_m: extent_m,
            });
        }
        if model.d_box_m < extent_m * 1e-4 {
            return Err(PipelineError::BlockTooSmall {
                block: model.name.clone(),
                block_m: model.d_box_m,
                cloud_m: extent_m,
            });
        }
    }
    Ok(())
}

/// Says what the survey is like, warns of what makes blocks doubtful in it, and refuses one in which none of the catalogue can
/// be judged: numbers in another unit, cells too wide to hold a block.
pub fn check_facts(
    survey: &Survey,
    catalog: &Catalog,
    observer: &dyn Observer,
) -> Result<(), PipelineError> {
    let smallest_m = catalog.iter().map(|(_, m)| m.d_max_m).fold(f32::INFINITY, f32::min);
    if survey.cloud.is_empty() || !smallest_m.is_finite() {
        return Ok(());
    }
    let facts = SurveyFacts::of(survey, smallest_m);
    observer.event(Event::Noted { stage: Stage::Segment, message: facts.sentence() });
    let doubtful = not_judgeable(&facts, catalog);
    let hopeless = |limits: &[Limit]| {
        limits.iter().find(|l| matches!(l, Limit::Unit(_) | Limit::Cell { .. })).cloned()
    };
    let stops: Vec<_> = doubtful.iter().filter_map(|(m, l)| Some((m, hopeless(l)?))).collect();
    if stops.len() == catalog.len()
        && let Some((model, limit)) = stops.first()
    {
        return Err(PipelineError::CannotBeJudged {
            block: model.name.clone(),
            why: limit.to_string(),
        });
    }
    for (model, limits) in doubtful {
        for limit in limits {
            let message = format!("`{}` can hardly be judged: {limit}", model.name);
            observer.event(Event::Warned(Warning { stage: Stage::Segment, message }));
        }
    }
    Ok(())
}

/// Refuses a design that lies away from everything surveyed, before anything is computed.
pub fn check_design(survey: &Survey, design: &DesignSurface) -> Result<(), PipelineError> {
    let bounds = survey.cloud.bounds();
    let (low, high) =
        (survey.frame.site_from_local(bounds.min), survey.frame.site_from_local(bounds.max));
    let [design_low, design_high] = design.extent();
    let gap =
        |axis: usize| (design_low[axis] - high[axis]).max(low[axis] - design_high[axis]).max(0.0);
    let away_m = gap(0).hypot(gap(1));
    if away_m > 0.0 {
        return Err(PipelineError::DesignElsewhere { away_m, crs: survey.frame.crs.clone() });
    }
    let beyond = |axis: usize| (low[axis] - design_low[axis]).max(design_high[axis] - high[axis]);
    let (axis, beyond_m) =
        if beyond(0) > beyond(1) { ("east-west", beyond(0)) } else { ("north-south", beyond(1)) };
    let surveyed_m = f64::from(bounds.size().truncate().max_element());
    if beyond_m > FAR_M + FAR * surveyed_m {
        return Err(PipelineError::DesignFar { beyond_m, axis, surveyed_m });
    }
    Ok(())
}

/// A design may reach this far beyond what is surveyed: a works of which one end was surveyed. A corner farther off is a slip of
/// the coordinates, for nothing can be planned where nothing was seen.
const FAR_M: f64 = 1_000.0;
/// And this many times the extent of the survey more.
const FAR: f64 = 10.0;
