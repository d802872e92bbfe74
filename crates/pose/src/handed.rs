//! Whether the blocks lie there mirrored.
//!
//! A mesh whose file has an axis turned round, or coordinates that are left-handed, fit none of the blocks and much of each.
//! The mirror image of a block fits points as well as the block fits their mirror image: a block's own points are mirrored
//! and its pose is fitted to them anew. A block that is its own mirror image fits both alike.

use crate::finish::Accepted;
use crate::fit::{CentredPose, FitPoint, fit};
use crate::measured::Measured;
use crate::rivals::some_points;
use crate::rotation_grid::rotation_grid;
use crate::template::Template;
use geom::Quat;
use rayon::prelude::*;

/// Blocks lie mirrored when the mirror image fits most of them better than this factor: of blocks that are not, 0.6 to 0.9.
const CLEARLY: f32 = 1.0;
/// Fewest blocks that tell.
const FEWEST: usize = 3;
/// Blocks that are asked, the best supported first.
const ASKED: usize = 16;
/// A block whose whole surface its mirror image fits this well is its own mirror image.
const ITS_OWN: f32 = 0.95;
/// Points of the surface looked at for that.
const SURFACE: usize = 240;
/// Turns tried: so far apart, at most so many; the best of them are fitted in full.
const SPACING_RAD: f32 = 0.6;
const MOST_TURNS: usize = 400;
const FITTED: usize = 6;

/// Whether the blocks for which `counts` holds fit their mirror image better than themselves. `points` are each block's own.
pub fn mirrored(
    blocks: &[Accepted],
    points: &[Vec<u32>],
    counts: impl Fn(usize) -> bool + Sync,
    templates: &[Template],
    measured: &Measured,
) -> bool {
    let fine = |t: &Template| (2.5 * measured.noise_sd_m).max(0.03 * t.model.d_max_m);
    let handed: Vec<bool> = templates.par_iter().map(|t| is_handed(t, fine(t))).collect();
    let asked: Vec<usize> = (0..blocks.len())
        .filter(|&entry| handed[blocks[entry].template] && counts(entry))
        .take(ASKED)
        .collect();
    let mut told: Vec<f32> = asked
        .into_par_iter()
        .filter_map(|entry| {
            let (block, template) = (&blocks[entry], &templates[blocks[entry].template]);
            let own = some_points(measured, &measured.working(&points[entry]))?;
            Some(advantage(&block.at, &own, template, fine(template)))
        })
        .collect();
    told.sort_by(f32::total_cmp);
    told.len() >= FEWEST && told[told.len() / 2] > CLEARLY
}

/// Whether a block and its mirror image are two shapes.
fn is_handed(template: &Template, fine_m: f32) -> bool {
    let centre = template.model.centre;
    let stride = template.surface.len().div_ceil(SURFACE).max(1);
    let whole: Vec<FitPoint> = template
        .surface
        .iter()
        .step_by(stride)
        .map(|&(p, normal)| FitPoint { position: p, normal, to_sensor: normal })
        .collect();
    let at = CentredPose { rotation: Quat::IDENTITY, centre };
    advantage(&at, &whole, template, fine_m) < ITS_OWN
}

/// How well the mirror image fits points over how well the block does at its pose.
fn advantage(at: &CentredPose, own: &[FitPoint], template: &Template, fine_m: f32) -> f32 {
    let (model, d) = (template.fit_model(), template.model.d_max_m);
    // Any mirror will do: the others follow from it by a turn.
    let mirror = |p: &FitPoint| FitPoint {
        position: at.centre - (p.position - at.centre),
        normal: -p.normal,
        to_sensor: -p.to_sensor,
    };
    let mirrored: Vec<FitPoint> = own.iter().map(mirror).collect();
    let turns = rotation_grid(&template.model.symmetry, SPACING_RAD, MOST_TURNS);
    let mut coarse: Vec<(f32, CentredPose)> = turns
        .into_iter()
        .map(|rotation| {
            let start = CentredPose { rotation, centre: at.centre };
            let (found, score) = fit(&model, &mirrored, start, &[0.3 * d, 0.15 * d]);
            (score, found)
        })
        .collect();
    coarse.sort_by(|a, b| b.0.total_cmp(&a.0));
    let steps = [0.1 * d, 0.06 * d, fine_m, fine_m];
    let score = |points: &[FitPoint], start: CentredPose| {
        let (found, _) = fit(&model, points, start, &steps);
        fit(&model, points, found, &[fine_m]).1
    };
    let best = coarse.iter().take(FITTED).map(|c| score(&mirrored, c.1)).fold(0.0, f32::max);
    best / score(own, *at).max(f32::MIN_POSITIVE)
}
