//! Where the later survey lies against the earlier one.
//!
//! Two registrations, both reported. *On the blocks*: the majority that did not move among themselves; precise, but blind to
//! what all of them did together. *On stable ground*: point to plane on surfaces that do not move; it shows the common
//! settlement. Their difference beyond both covariances is a finding of its own.

use crate::body::{Body, difference};
use crate::dense::{Matrix, cholesky, forward, sum};
use crate::matching::Pair;
use crate::motion::{Motion, PARAMETERS, exact, jacobian};
use crate::robust::{Solution, Tie, fit};
use geom::{DVec3, PointGrid, Vec3};
use rayon::prelude::*;
use scene::Catalog;
use serde::{Deserialize, Serialize};

/// Limits of a registration.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RegistrationConfig {
    /// Leaves coordinates as they are.
    pub fixed: bool,
    /// Largest shift that is taken for an error of the datum, metres.
    pub most_shift_m: f64,
    /// Largest turn or tilt, radians.
    pub most_turn_rad: f64,
    /// Largest relative scale.
    pub most_scale: f64,
    /// Radius within which blocks and ground share the errors of a survey, in block lengths.
    pub cluster_blocks: f64,
}

impl Default for RegistrationConfig {
    fn default() -> Self {
        Self {
            fixed: false,
            most_shift_m: 2.0,
            most_turn_rad: 0.035,
            most_scale: 0.003,
            cluster_blocks: 2.5,
        }
    }
}

/// What a registration rests on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Basis {
    /// Coordinates as they are.
    Fixed,
    /// Blocks that did not move among themselves.
    Blocks,
    /// Ground that the site names as stable.
    StableGround,
    /// Whatever is no block in either survey.
    UnexplainedGround,
}

/// One registration.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Registration {
    /// What it rests on.
    pub basis: Basis,
    /// Later frame to earlier frame.
    pub motion: Motion,
    /// Covariance of shift, turn and scale, row by row.
    pub covariance: Matrix<PARAMETERS>,
    /// Blocks or points it could rest on.
    pub ties: usize,
    /// Those that agree with it.
    pub inliers: usize,
    /// Whether tilt and scale are estimated (they stand out of their error) or held at none.
    pub tilt_and_scale: bool,
}

impl Registration {
    /// Coordinates as they are, without error.
    pub fn fixed(pivot: DVec3) -> Self {
        Self {
            basis: Basis::Fixed,
            motion: Motion::none(pivot),
            covariance: exact(),
            ties: 0,
            inliers: 0,
            tilt_and_scale: false,
        }
    }

    /// Standard deviations of shift (m), turn (rad) and scale.
    pub fn sd(&self) -> [f64; PARAMETERS] {
        std::array::from_fn(|i| self.covariance[i][i].max(0.0).sqrt())
    }
}

const LEVEL: [bool; PARAMETERS] = [true, true, true, false, false, true, false];
const ALL: [bool; PARAMETERS] = [true; PARAMETERS];

/// Shift and yaw first; tilt and scale, where `tilts` lets them, only where they stand out of their error.
fn fitted(
    basis: Basis,
    start: Motion,
    count: usize,
    tilts: bool,
    ties: impl Fn(&Motion) -> Vec<Tie>,
) -> Option<Registration> {
    let level = fit(start, LEVEL, &ties)?;
    let full = if tilts { fit(level.motion, ALL, &ties) } else { None };
    let stands_out = |s: &Solution| {
        let value = s.motion.parameters();
        [3, 4, 6].iter().any(|&i| value[i].abs() > 4.0 * s.covariance[i][i].sqrt())
    };
    let full = full.filter(stands_out);
    let tilt_and_scale = full.is_some();
    let Solution { motion, covariance, inliers } = full.unwrap_or(level);
    Some(Registration { basis, motion, covariance, ties: count, inliers, tilt_and_scale })
}

/// The shift on which most neighbouring centres agree, and how many do.
pub(crate) fn common_shift(
    earlier: &[Body],
    later: &[Body],
    reach_m: f64,
    bin_m: f64,
) -> (DVec3, usize) {
    let centres: Vec<Vec3> = later.iter().map(|b| b.centre.as_vec3()).collect();
    let grid = PointGrid::new(&centres, reach_m as f32);
    let mut shifts: Vec<Vec3> = Vec::new();
    for a in earlier {
        grid.for_each_within(a.centre.as_vec3(), reach_m as f32, |j, _, _| {
            shifts.push((later[j as usize].centre - a.centre).as_vec3());
        });
    }
    // Enough to find the peak; all of them would cost their square.
    let every = shifts.len().div_ceil(4000).max(1);
    let grid = PointGrid::new(&shifts, bin_m as f32);
    let count = |s: &Vec3| {
        let mut n = 0_usize;
        grid.for_each_within(*s, bin_m as f32, |_, _, _| n += 1);
        n
    };
    let candidates: Vec<Vec3> = shifts.iter().step_by(every).copied().collect();
    let counts: Vec<usize> = candidates.par_iter().map(count).collect();
    // Of equal peaks the one nearest to no shift.
    let best = (0..candidates.len()).max_by(|&a, &b| {
        let near = |i: usize| -candidates[i].length();
        counts[a].cmp(&counts[b]).then(near(a).total_cmp(&near(b)))
    });
    let Some(best) = best else { return (DVec3::ZERO, 0) };
    let (mut mean, mut n) = (DVec3::ZERO, 0);
    grid.for_each_within(candidates[best], bin_m as f32, |_, s, _| {
        mean += s.as_dvec3();
        n += 1;
    });
    (mean / f64::from(n.max(1)), counts[best])
}

/// On matched blocks of both epochs, each with the probability that it stood still. `common` is what both sensors do to a
/// block beyond its own covariance.
#[allow(clippy::too_many_arguments)] // each is one of the stage's own values
pub(crate) fn on_blocks(
    [earlier, later]: [&[Body]; 2],
    pairs: &[Pair],
    weights: &[f64],
    catalog: &Catalog,
    common: &Matrix<6>,
    start: Motion,
    tilts: bool,
    cluster_m: f64,
) -> Option<Registration> {
    let ties = |motion: &Motion| -> Vec<Tie> {
        let tie = |(pair, &weight): (&Pair, &f64)| {
            let (a, b) = (&earlier[pair.earlier], later[pair.later].moved(motion));
            let delta = difference(a, &b, catalog);
            let l = cholesky(&sum(&delta.covariance, common))?;
            let j = jacobian(motion.pivot(), b.centre);
            let left = forward(&l, &delta.d);
            let mut whitened = [[0.0; PARAMETERS]; 6];
            for k in 0..PARAMETERS {
                let column = forward(&l, &std::array::from_fn(|i| j[i][k]));
                (0..6).for_each(|i| whitened[i][k] = column[i]);
            }
            let rows = (0..6).map(|i| (whitened[i], left[i])).collect();
            Some(Tie { rows, weight, cluster: cluster(a.centre, cluster_m) })
        };
        pairs.par_iter().zip(weights).filter_map(tie).collect()
    };
    fitted(Basis::Blocks, start, pairs.len(), tilts, ties)
}

/// Patches of a surface: positions with normals.
pub(crate) struct Patches {
    pub position: Vec<Vec3>,
    pub normal: Vec<Vec3>,
}

/// On ground: every later point against the plane of the earlier patch next to it.
pub(crate) fn on_ground(
    basis: Basis,
    earlier: &Patches,
    later: &[Vec3],
    reach_m: f32,
    noise_sd_m: f64,
    start: Motion,
    cluster_m: f64,
) -> Option<Registration> {
    let grid = PointGrid::new(&earlier.position, reach_m);
    let ties = |motion: &Motion| -> Vec<Tie> {
        let tie = |p: &Vec3| {
            let p = motion.apply(p.as_dvec3());
            let (i, _) = grid.nearest_within(p.as_vec3(), reach_m)?;
            let normal = earlier.normal[i as usize].as_dvec3();
            if normal == DVec3::ZERO {
                return None;
            }
            let left = normal.dot(p - earlier.position[i as usize].as_dvec3());
            let j = jacobian(motion.pivot(), p);
            let row = std::array::from_fn(|k| {
                (0..3).map(|m| normal[m] * j[m][k]).sum::<f64>() / noise_sd_m
            });
            let rows = vec![(row, left / noise_sd_m)];
            Some(Tie { rows, weight: 1.0, cluster: cluster(p, cluster_m) })
        };
        later.par_iter().filter_map(tie).collect()
    };
    fitted(basis, start, later.len(), true, ties)
}

fn cluster(p: DVec3, size_m: f64) -> [i32; 2] {
    [p.x, p.y].map(|v| (v / size_m).floor() as i32)
}

/// What the blocks did together against the ground.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct CommonMovement {
    /// Shift of all blocks at the pivot, later less earlier, metres.
    pub shift_m: [f64; 3],
    /// 1.96 standard deviations of it.
    pub level_m: [f64; 3],
    /// Whether the height changed beyond its level.
    pub settled: bool,
}

/// Who says which blocks stood still.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Decided {
    /// They are three of five blocks, or more.
    Majority,
    /// The ground lies where they say.
    Ground,
    /// Nobody: they are merely the most.
    Nobody,
}

/// Blocks that moved by one shift against those that are taken for still. If they are the still ones, the others moved by the
/// opposite.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct MovedAlike {
    /// So many.
    pub blocks: usize,
    /// Blocks taken for still.
    pub still: usize,
    /// All blocks seen in both epochs.
    pub pairs: usize,
    /// Their shift, later less earlier, metres.
    pub shift_m: [f64; 3],
    /// Who says that the others are still.
    pub decided: Decided,
}

/// Difference of the two registrations at the blocks' pivot: where the ground says the blocks went.
pub(crate) fn common_movement(blocks: &Registration, ground: &Registration) -> CommonMovement {
    // A block at the pivot in the earlier epoch is seen where the blocks' motion came from; the ground says where that is.
    let pivot = blocks.motion.pivot();
    let shift = ground.motion.apply(blocks.motion.undo(pivot)) - pivot;
    let level = std::array::from_fn(|i| {
        1.96 * (blocks.covariance[i][i] + ground.covariance[i][i]).max(0.0).sqrt()
    });
    CommonMovement {
        shift_m: shift.to_array(),
        level_m: level,
        settled: shift.z.abs() > level[2] && shift.z.abs() > 1e-4,
    }
}

/// The ground's registration where the ground holds it, the blocks' where it does not (a flat bed says nothing of
/// shifts along it).
pub(crate) fn joined(blocks: &Registration, ground: &Registration) -> Option<Registration> {
    let level = {
        // Heights and tilts of the blocks would hide what the blocks did together: they are given no weight.
        let mut information = crate::dense::inverse(&regular(&blocks.covariance))?;
        for i in [2, 3, 4, 6] {
            for k in 0..PARAMETERS {
                information[i][k] = 0.0;
                information[k][i] = 0.0;
            }
        }
        information
    };
    let own = crate::dense::inverse(&regular(&ground.covariance))?;
    let total = sum(&own, &level);
    let covariance = crate::dense::inverse(&total)?;
    let (g, b) = (ground.motion.parameters(), blocks.motion.parameters());
    let pull: [f64; PARAMETERS] =
        std::array::from_fn(|i| (0..PARAMETERS).map(|k| level[i][k] * (b[k] - g[k])).sum());
    let step: [f64; PARAMETERS] =
        std::array::from_fn(|i| (0..PARAMETERS).map(|k| covariance[i][k] * pull[k]).sum());
    let value: [f64; PARAMETERS] = std::array::from_fn(|i| g[i] + step[i]);
    let mut out = *ground;
    out.motion.shift_m = [value[0], value[1], value[2]];
    out.motion.turn_rad = [value[3], value[4], value[5]];
    out.motion.scale = value[6];
    out.covariance = covariance;
    for i in 0..PARAMETERS {
        for k in 0..PARAMETERS {
            // Parameters that are held have no error of their own.
            if ground.covariance[i][i] == 0.0 || ground.covariance[k][k] == 0.0 {
                out.covariance[i][k] = 0.0;
            }
        }
    }
    Some(out)
}

/// Positive definite: parameters that are held get a tiny variance.
fn regular(covariance: &Matrix<PARAMETERS>) -> Matrix<PARAMETERS> {
    let mut out = *covariance;
    for (i, row) in out.iter_mut().enumerate() {
        if row[i] <= 0.0 {
            row[i] = 1e-16;
        }
    }
    out
}
