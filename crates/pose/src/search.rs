//! From an expected centre and its points to a few poses that could explain them.
//!
//! All rotations of the grid start at the expected centre, take a few annealed Gauss-Newton steps on a sample of the
//! points, and lose to better ones; the survivors are refined on every working point near the block, not only those
//! of the segment: a segment is an opinion, the points are not.

use crate::SearchConfig;
use crate::fit::{CentredPose, FitModel, FitPoint, fit};
use crate::measured::Measured;
use crate::template::Template;
use geom::{SeedTree, Vec3};
use rand::seq::SliceRandom;

/// A place to search.
#[derive(Clone, Debug)]
pub struct Task {
    /// Expected centre of mass.
    pub centre: Vec3,
    /// Working points thought to belong to the block, ascending.
    pub points: Vec<u32>,
    /// How far the centre may be off, metres.
    pub centre_sd_m: f32,
    /// Whether it is a segment that deserves an answer, not only a hint.
    pub is_segment: bool,
}

/// A pose that could explain some points.
#[derive(Clone, Copy, Debug)]
pub struct Proposal {
    /// Entry in the list of templates.
    pub template: usize,
    /// The pose.
    pub at: CentredPose,
}

impl Template<'_> {
    /// The target the fit needs.
    pub fn fit_model(&self) -> FitModel<'_> {
        FitModel { field: &self.field, centre: self.model.centre, d_max_m: self.model.d_max_m }
    }

    /// Whether two poses are the same physical pose within these limits.
    pub fn same(
        &self,
        a: &CentredPose,
        b: &CentredPose,
        displacement_m: f32,
        rotation_rad: f32,
    ) -> bool {
        (a.centre - b.centre).length() < displacement_m
            && self.model.symmetry.rotation_error_rad(a.rotation, b.rotation) < rotation_rad
    }
}

/// Fewest points a search makes sense with.
pub const FEWEST_POINTS: usize = 12;

/// The best different poses of one block type for one place, best first.
pub fn propose(
    task: &Task,
    template: &Template,
    entry: usize,
    measured: &Measured,
    config: &SearchConfig,
    seed: SeedTree,
) -> Vec<Proposal> {
    if task.points.len() < FEWEST_POINTS {
        return Vec::new();
    }
    let model = template.fit_model();
    let d = model.d_max_m;
    let sample = sample(task, measured, config.points * 2, seed);
    let coarse = &sample[..sample.len().min(config.points)];
    let mut ranked: Vec<(f32, CentredPose)> = Vec::new();
    for centre in centres(task, config.centre_offset * d) {
        for &rotation in &template.rotations {
            let (at, score) = fit(
                &model,
                coarse,
                CentredPose { rotation, centre },
                &[0.30 * d, 0.22 * d, 0.17 * d],
            );
            ranked.push((off_centre(task, &at) * score, at));
        }
    }
    best_first(&mut ranked);
    let mut kept = step(
        ranked,
        3 * config.keep_coarse,
        template,
        task,
        coarse,
        &[0.15 * d, 0.12 * d, 0.1 * d],
    );
    kept = step(kept, config.keep_coarse, template, task, &sample, &[0.08 * d, 0.06 * d, 0.05 * d]);
    let fine = (2.5 * measured.noise_sd_m).max(0.03 * d);
    let refined = kept
        .into_iter()
        .map(|(_, at)| {
            let near = nearby(measured, at.centre, d + 3.0 * fine, 600);
            // Scores of different neighbourhoods do not compare: the segment's own points rank them.
            let (at, _) = fit(&model, &near, at, &[0.05 * d, fine, fine]);
            let (_, score) = fit(&model, &sample, at, &[0.05 * d]);
            (score, at)
        })
        .collect();
    distinct(refined, config.keep, template)
        .into_iter()
        .map(|(_, at)| Proposal { template: entry, at })
        .collect()
}

/// Fits the best `keep` different poses further.
fn step(
    ranked: Vec<(f32, CentredPose)>,
    keep: usize,
    template: &Template,
    task: &Task,
    points: &[FitPoint],
    scales_m: &[f32],
) -> Vec<(f32, CentredPose)> {
    let model = template.fit_model();
    let mut next: Vec<_> = distinct(ranked, keep, template)
        .into_iter()
        .map(|(_, at)| {
            let (at, score) = fit(&model, points, at, scales_m);
            (off_centre(task, &at) * score, at)
        })
        .collect();
    best_first(&mut next);
    next
}

/// A wide bell around the expected centre: keeps the search from wandering to a neighbour.
fn off_centre(task: &Task, at: &CentredPose) -> f32 {
    let off = (at.centre - task.centre).length() / (2.0 * task.centre_sd_m).max(1e-6);
    1.0 / (1.0 + 0.3 * off * off)
}

fn centres(task: &Task, offset_m: f32) -> Vec<Vec3> {
    let mut centres = vec![task.centre];
    if offset_m > 0.0 {
        for axis in [Vec3::X, Vec3::Y, Vec3::Z] {
            centres.extend([task.centre + axis * offset_m, task.centre - axis * offset_m]);
        }
    }
    centres
}

fn best_first(ranked: &mut [(f32, CentredPose)]) {
    ranked.sort_by(|a, b| b.0.total_cmp(&a.0));
}

/// The first `keep` poses that are not the same as a better one.
fn distinct(
    mut ranked: Vec<(f32, CentredPose)>,
    keep: usize,
    template: &Template,
) -> Vec<(f32, CentredPose)> {
    best_first(&mut ranked);
    let mut kept: Vec<(f32, CentredPose)> = Vec::with_capacity(keep);
    for candidate in ranked {
        if kept.len() == keep {
            break;
        }
        let d = template.model.d_max_m;
        if !kept.iter().any(|k| template.same(&k.1, &candidate.1, 0.06 * d, 0.1)) {
            kept.push(candidate);
        }
    }
    kept
}

/// A random sample of the task's points in random order, so that every prefix is a fair sample.
fn sample(task: &Task, measured: &Measured, count: usize, seed: SeedTree) -> Vec<FitPoint> {
    let mut index = task.points.clone();
    let mut rng = seed.rng();
    index.shuffle(&mut rng);
    index.truncate(count);
    index.into_iter().map(|i| measured.fit_point(i)).collect()
}

/// Working points within a radius, thinned to about `most`.
pub fn nearby(measured: &Measured, centre: Vec3, radius_m: f32, most: usize) -> Vec<FitPoint> {
    let index = measured.grid.within(centre, radius_m);
    let stride = index.len().div_ceil(most).max(1);
    index.into_iter().step_by(stride).map(|i| measured.fit_point(i)).collect()
}
