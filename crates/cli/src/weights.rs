//! Which weights a run uses.

use crate::exit::{Exit, OrBadInput};
use crate::progress::Terminal;
use geom::{Event, Observer};
use scene::Catalog;
use segment::SegmentModel;
use std::path::Path;

/// The user's weights, or the shipped ones that suit the catalogue; says which.
pub fn choose(model: Option<&Path>, catalog: &Catalog, terminal: &Terminal) -> Result<SegmentModel, Exit> {
    let model = match model {
        Some(path) => SegmentModel::load(path).or_bad_input()?,
        None => SegmentModel::shipped(catalog).or_bad_input()?,
    };
    terminal.event(Event::Noted { stage: "segment", message: format!("weights: {}", model.describe()) });
    Ok(model)
}
