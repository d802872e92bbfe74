//! Segments without a verdict: which of them a person should look at, and which are bed, wall or stone.

use crate::acceptance::Candidate;
use crate::ground::Ground;
use crate::measured::Measured;
use crate::search::Task;
use geom::{Plane, Vec3};

/// A segment that may hold a block has a pose that explains so much of a block's visible surface …
const LEAST_AREA: f32 = 0.05;
/// … of which so much of what ought to be seen is.
const LEAST_AGREEMENT: f32 = 0.4;
/// Of a segment that is bed or wall so many points lie on one plane.
const FLAT_SHARE: f32 = 0.8;
/// Points lie on a plane within so many standard deviations and this part of d_max.
const FLAT_SD: f32 = 3.0;
const FLAT_D_MAX: f32 = 0.03;
/// Accepted blocks this unlikely are no blocks either.
pub const LEAST_CONFIDENCE: f32 = 0.1;

/// Whether a segment with this best pose may hold a block.
pub fn may_hold_a_block(
    task: &Task,
    best: Option<&Candidate>,
    ground: Option<&Ground>,
    measured: &Measured,
) -> bool {
    let Some(best) = best else { return false };
    let area = best.evidence.explained.iter().map(|e| e.1).sum::<f32>()
        * best.evidence.point_area_m2
        / best.evidence.unit_m2;
    if area < LEAST_AREA || best.evidence.agreement < LEAST_AGREEMENT {
        return false;
    }
    let all = task.points.len() as f32;
    let bed = |&&i: &&u32| ground.is_some_and(|g| g.skipped[i as usize]);
    if task.points.iter().filter(bed).count() as f32 > 0.5 * all {
        return false;
    }
    let position: Vec<Vec3> = task.points.iter().map(|&i| measured.position[i as usize]).collect();
    let near_m = (FLAT_SD * measured.noise_sd_m).max(FLAT_D_MAX * measured.smallest_d_max_m);
    let flat = Plane::through(&position).is_some_and(|plane| {
        let on = position.iter().filter(|p| plane.distance_m(**p).abs() < near_m).count();
        on as f32 > FLAT_SHARE * all
    });
    !flat
}
