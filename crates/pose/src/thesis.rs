//! The thesis' own way (METHOD §4).

use crate::measured::Measured;
use crate::search::{Proposal, Task};
use crate::template::Template;
use crate::{PpfConfig, fit::CentredPose};
use geom::SeedTree;

/// Proposals by point pair features.
pub fn propose(
    _task: &Task,
    _template: &Template,
    _entry: usize,
    _measured: &Measured,
    _config: &PpfConfig,
    _seed: SeedTree,
) -> Vec<Proposal> {
    Vec::new()
}

/// B: mean distance from the points to the model (Eq. 3.10), metres.
pub fn fitness_m(points: &[u32], template: &Template, at: &CentredPose, measured: &Measured) -> f32 {
    let block_from_site = at.pose(template.model.centre).inverse();
    let sum: f64 = points
        .iter()
        .map(|&i| f64::from(template.field.distance_m(block_from_site * measured.position[i as usize]).abs()))
        .sum();
    (sum / points.len().max(1) as f64) as f32
}
