//! Places to search again: points that no accepted block explains.
//!
//! The network merges, splits and misses blocks; what it misses shows as points nobody explains, off the bed
//! and away from accepted surfaces. They are cut into neighbourhoods of about half a block, each a new hypothesis
//! whose centre is guessed half a d_max behind the surface.

use crate::evidence::reach_m;
use crate::ground::Ground;
use crate::measured::Measured;
use crate::search::Task;
use crate::template::Template;
use crate::{EvidenceConfig, acceptance::Candidate};
use geom::Vec3;
use geom::thin_from_lowest;

/// Working points that still want an explanation, ascending.
pub fn unexplained(
    measured: &Measured,
    taken: &[f32],
    accepted: &[&Candidate],
    templates: &[Template],
    ground: Option<&Ground>,
    config: &EvidenceConfig,
) -> Vec<u32> {
    let of_the_bed = |i: usize| ground.is_some_and(|ground| ground.skipped[i]);
    let mut open: Vec<bool> =
        (0..measured.position.len()).map(|i| taken[i] < 0.05 && !of_the_bed(i)).collect();
    for block in accepted {
        let template = &templates[block.template];
        let reach = 2.0 * reach_m(measured, template, config);
        let block_from_site = block.at.pose(template.model.centre).inverse();
        measured.grid.for_each_within(
            block.at.centre,
            template.model.d_max_m + reach,
            |i, p, _| {
                if template.field.distance_m(block_from_site * p) < reach {
                    open[i as usize] = false;
                }
            },
        );
    }
    (0..open.len() as u32).filter(|&i| open[i as usize]).collect()
}

/// Hypotheses from points without an explanation; `d_max_m` is the largest block's.
pub fn tasks(measured: &Measured, open: &[u32], d_max_m: f32) -> Vec<Task> {
    let position: Vec<Vec3> = open.iter().map(|&i| measured.position[i as usize]).collect();
    let grid = geom::PointGrid::new(&position, 0.4 * d_max_m);
    let fewest = (0.08 * d_max_m * d_max_m / measured.point_area_m2).max(20.0) as usize;
    thin_from_lowest(&position, 0.6 * d_max_m)
        .kept
        .into_iter()
        .filter_map(|k| {
            let near = grid.within(position[k as usize], 0.6 * d_max_m);
            if near.len() < fewest {
                return None;
            }
            let points: Vec<u32> = near.iter().map(|&j| open[j as usize]).collect();
            Some(Task {
                centre: behind(measured, &points, d_max_m),
                points,
                centre_sd_m: 0.4 * d_max_m,
                is_segment: false,
            })
        })
        .collect()
}

/// A guess of the centre: behind the mean of the surface, away from where it faces.
pub fn behind(measured: &Measured, points: &[u32], d_max_m: f32) -> Vec3 {
    let n = points.len().max(1) as f32;
    let mean = points.iter().map(|&i| measured.position[i as usize]).sum::<Vec3>() / n;
    let facing =
        points.iter().map(|&i| measured.normal[i as usize] + 0.5 * measured.to_sensor[i as usize]);
    mean - facing.sum::<Vec3>().normalize_or(Vec3::Z) * (0.4 * d_max_m)
}
