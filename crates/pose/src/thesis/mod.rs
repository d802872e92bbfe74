//! The thesis' own way (METHOD §4, §3.7): point pair features, voting, pose clusters, ICP, fitness.
//!
//! Kept whole for comparison and as a second source of hypotheses; without the traps of its usual implementations:
//! pairs in one plane and pairs never visible together are left out, normals face the sensor, poses cluster modulo
//! the block's symmetry.

mod hash_table;
mod icp;
mod voting;
mod windows;

pub use hash_table::PairTable;
pub use windows::windows;

use crate::PpfConfig;
use crate::fit::CentredPose;
use crate::measured::Measured;
use crate::search::{FEWEST_POINTS, Proposal, Task};
use crate::template::Template;
use geom::thin_from_lowest;

/// Poses of one block type for one segment, best fitness first.
pub fn propose(
    task: &Task,
    template: &Template,
    entry: usize,
    measured: &Measured,
    config: &PpfConfig,
) -> Vec<Proposal> {
    let Some(table) = &template.pairs else { return Vec::new() };
    let all: Vec<_> = task
        .points
        .iter()
        .map(|&i| measured.fit_point(i))
        .filter(|p| p.normal != geom::Vec3::ZERO)
        .collect();
    // About the model's resolution, as §3.5.1 asks.
    let position: Vec<_> = all.iter().map(|p| p.position).collect();
    let scene: Vec<_> = thin_from_lowest(&position, table.distance_step_m())
        .kept
        .into_iter()
        .map(|i| all[i as usize])
        .collect();
    if scene.len() < FEWEST_POINTS {
        return Vec::new();
    }
    let voted = voting::vote(&scene, table, template, config);
    let mut ranked: Vec<(f32, CentredPose)> = voting::clusters(voted, template, config)
        .into_iter()
        .take(config.refined)
        .map(|at| icp::refine(&all, template, at, config.icp, table.distance_step_m()))
        .map(|at| (fitness_m(&task.points, template, &at, measured), at))
        .collect();
    ranked.sort_by(|a, b| a.0.total_cmp(&b.0));
    ranked.into_iter().map(|(_, at)| Proposal { template: entry, at }).collect()
}

/// B: mean distance from the points to the model (Eq. 3.10), metres.
pub fn fitness_m(
    points: &[u32],
    template: &Template,
    at: &CentredPose,
    measured: &Measured,
) -> f32 {
    let block_from_site = at.pose(template.model.centre).inverse();
    let sum: f64 = points
        .iter()
        .map(|&i| {
            f64::from(
                template.field.distance_m(block_from_site * measured.position[i as usize]).abs(),
            )
        })
        .sum();
    (sum / points.len().max(1) as f64) as f32
}
