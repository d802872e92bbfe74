//! The size of the blocks, asked of a survey before anything is recognised.

pub use pose::size::{REFUSED_FROM, Scale, WARNED_FROM};
pub use pose::size_search::{SizeProposal, SizeSearch};
pub use pose::size_windows::{fit_sizes, relief_m, windows};

use crate::{Config, PipelineError, as_points};
use geom::Observer;
use scene::{BlockModel, Catalog, Segmentation, Survey};

/// How many blocks of this type are stated when nothing but the search looks for them: what a proposed size is worth. Waves, stones
/// and slopes have a size that fits best as well, and few of its blocks are sure.
pub fn stated_blocks(
    survey: &Survey,
    model: &BlockModel,
    config: &Config,
    observer: &dyn Observer,
) -> Result<usize, PipelineError> {
    let catalog = Catalog::new(vec![model.clone()]);
    let (survey, config) = as_points(survey, &catalog, config);
    let none = Segmentation::of_nothing(survey.cloud.len());
    let found = pose::recognise_pile(&survey, &none, &catalog, &config.pose, observer)?;
    Ok(found.blocks.iter().filter(|b| b.0.is_stated()).count())
}
