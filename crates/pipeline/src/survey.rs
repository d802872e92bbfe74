//! What no file alone tells: whether blocks, cloud and design belong together.

use crate::PipelineError;
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
    Ok(())
}
