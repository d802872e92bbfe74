//! Two epochs laid on each other: match, register, see what the sensors do, again.
//!
//! In: both epochs and the catalogue. Out: the registration that changes refer to, its rivals and the pairs. Where many blocks moved
//! alike, they are a group of their own beside those that stood still ([`crate::alike`]); the larger group is taken for
//! the still one where it holds three of five blocks, and where none does the ground is asked.

use crate::alike::{Groups, OwnWay, groups};
use crate::body::{Body, Difference, difference};
use crate::common_error::CommonError;
use crate::dense::{Matrix, cholesky, distance2, sum};
use crate::matching::{Pair, matched};
use crate::motion::Motion;
use crate::registration::{
    self, Basis, CommonMovement, Decided, MovedAlike, Registration, RegistrationConfig,
};
use crate::stable::{self, StableGround};
use crate::{CompareConfig, Epoch, MonitorError};
use geom::{Bounds, DVec3, Vec3};
use scene::Catalog;

/// Both epochs in the earlier one's local frame, not yet registered.
pub(crate) struct Frame {
    pub earlier: Vec<Body>,
    pub later: Vec<Body>,
    /// The later survey's points and sensors.
    pub points: Vec<Vec3>,
    pub sensors: Vec<Vec3>,
    pub pivot: DVec3,
    pub size_m: f64,
}

impl Frame {
    pub fn of(earlier: &Epoch, later: &Epoch, catalog: &Catalog) -> Self {
        let origin = DVec3::from_array(later.survey.frame.origin)
            - DVec3::from_array(earlier.survey.frame.origin);
        let moved = |p: &Vec3| (p.as_dvec3() + origin).as_vec3();
        let bodies = (Body::all(earlier, catalog, DVec3::ZERO), Body::all(later, catalog, origin));
        let bounds = Bounds::of(bodies.0.iter().map(|b| b.centre.as_vec3()));
        let pivot = if bounds.is_empty() {
            earlier.survey.cloud.bounds().centre()
        } else {
            bounds.centre()
        };
        Self {
            earlier: bodies.0,
            later: bodies.1,
            points: later.survey.cloud.position_m.iter().map(moved).collect(),
            sensors: later.survey.sensor_positions.iter().map(moved).collect(),
            pivot: pivot.as_dvec3(),
            size_m: catalog.iter().map(|(_, m)| f64::from(m.d_box_m)).fold(0.0, f64::max),
        }
    }
}

/// Registrations and pairs.
pub(crate) struct Registered {
    pub reference: Registration,
    pub on_blocks: Option<Registration>,
    pub on_ground: Option<Registration>,
    pub common_movement: Option<CommonMovement>,
    pub moved_alike: Vec<MovedAlike>,
    pub common_error: CommonError,
    pub pairs: Vec<Pair>,
}

/// What both epochs are registered with.
struct Registering<'a> {
    frame: &'a Frame,
    catalog: &'a Catalog,
    usual: CommonError,
    own_way: OwnWay,
    config: &'a CompareConfig,
}

pub(crate) fn register(
    frame: &Frame,
    earlier: &Epoch,
    later: &Epoch,
    catalog: &Catalog,
    stable: &StableGround,
    config: &CompareConfig,
) -> Result<Registered, MonitorError> {
    let usual = CommonError::usual(earlier.survey.sensor, later.survey.sensor, frame.size_m / 2.0);
    let symmetries = catalog.iter().map(|(_, m)| m.symmetry.order()).max().unwrap_or(1) as f64;
    let shift_sd_m = config.matching.move_sd_blocks * frame.size_m;
    let own_way = OwnWay { shift_sd_m, symmetries };
    let how = Registering { frame, catalog, usual, own_way, config };
    let few = frame.earlier.len().min(frame.later.len());
    let mut on_blocks = if few >= 3 { how.blocks()? } else { None };
    let start = on_blocks.as_ref().map_or(Motion::none(frame.pivot), |b| b.registration.motion);
    let on_ground = stable::registered(
        [earlier, later],
        &frame.points,
        stable,
        frame.size_m,
        start,
        config.registration.cluster_blocks * frame.size_m,
    );
    if let Some(blocks) = on_blocks.take() {
        on_blocks = Some(how.decided(blocks, on_ground.as_ref())?);
    }
    let blocks_only = on_blocks.as_ref().map(|b| b.registration);
    let common_movement = match (&blocks_only, &on_ground) {
        (Some(b), Some(g)) => Some(registration::common_movement(b, g)),
        _ => None,
    };
    let reference = reference(&how, blocks_only, on_ground);
    within_limits(&reference, &config.registration)?;
    let moved_alike = on_blocks.as_ref().map_or(Vec::new(), OnBlocks::moved_alike);
    let found = on_blocks.map(|b| (b.error, b.pairs));
    let (common_error, pairs) = match found {
        // Fixed coordinates and absolute heights ask for their own pairs.
        Some((error, _)) if reference.basis != Basis::Blocks => {
            (error, how.pairs_at(&reference.motion, &error)?)
        }
        Some(found) => found,
        None => (usual, how.pairs_at(&reference.motion, &usual)?),
    };
    Ok(Registered {
        reference,
        on_blocks: blocks_only,
        on_ground,
        common_movement,
        moved_alike,
        common_error,
        pairs,
    })
}

fn reference(
    how: &Registering,
    blocks: Option<Registration>,
    ground: Option<Registration>,
) -> Registration {
    let fixed = Registration::fixed(how.frame.pivot);
    if how.config.registration.fixed {
        return fixed;
    }
    let absolute = ground.filter(|g| g.basis == Basis::StableGround);
    let joined = match (absolute, blocks) {
        (Some(g), Some(b)) => registration::joined(&b, &g),
        (absolute, _) => absolute,
    };
    joined.or(blocks).unwrap_or(fixed)
}

/// Rounds of matching, registering and estimating what the sensors do.
const ROUNDS: usize = 4;
/// Blocks that must agree on a shift, of the smaller epoch.
const AGREEING: f64 = 0.2;
/// Share of the pairs from which on a group is the still one, whatever the others did.
const MAJORITY: f64 = 0.6;
/// From this difference of squared distances on, in variances, the ground tells which group stood still.
const GROUND_TELLS: f64 = 9.0;

/// The registration on the blocks, and what it is made of.
struct OnBlocks {
    registration: Registration,
    error: CommonError,
    pairs: Vec<Pair>,
    groups: Groups,
    /// The group that stands still.
    still: usize,
    decided: Decided,
}

/// Which group stands still.
#[derive(Clone, Copy, PartialEq)]
enum Still {
    Largest,
    /// The one the motion is begun at.
    Nearest,
}

impl OnBlocks {
    /// The groups that do not stand still.
    fn moved_alike(&self) -> Vec<MovedAlike> {
        let pairs = self.pairs.len();
        let count = |share: f64| (share * pairs as f64).round() as usize;
        let one = |k: usize| MovedAlike {
            blocks: count(self.groups.share[k]),
            still: count(self.groups.share[self.still]),
            pairs,
            shift_m: (self.groups.shift_m[k] - self.groups.shift_m[self.still]).to_array(),
            decided: self.decided,
        };
        (0..self.groups.share.len()).filter(|k| *k != self.still).map(one).collect()
    }
}

impl Registering<'_> {
    fn pairs_at(&self, motion: &Motion, error: &CommonError) -> Result<Vec<Pair>, MonitorError> {
        let later: Vec<Body> = self.frame.later.iter().map(|b| b.moved(motion)).collect();
        let covariance = error.covariance();
        let matching = self.config.matching();
        matched(&self.frame.earlier, &later, self.catalog, &covariance, &matching)
    }

    fn blocks(&self) -> Result<Option<OnBlocks>, MonitorError> {
        let frame = self.frame;
        let mut motion = Motion::none(frame.pivot);
        if !self.config.registration.fixed {
            let reach_m = self.config.registration.most_shift_m.max(0.5 * frame.size_m);
            let bin_m = 0.06 * frame.size_m;
            let (shift, agreeing) =
                registration::common_shift(&frame.earlier, &frame.later, reach_m, bin_m);
            let blocks = frame.earlier.len().min(frame.later.len());
            if (agreeing as f64) < (AGREEING * blocks as f64).max(3.0) {
                return if blocks < 10 {
                    Ok(None)
                } else {
                    Err(MonitorError::NoCommonBlocks { agreeing, blocks })
                };
            }
            motion.shift_m = (-shift).to_array();
        }
        self.rounds(motion, Still::Largest)
    }

    fn rounds(&self, mut motion: Motion, which: Still) -> Result<Option<OnBlocks>, MonitorError> {
        let mut error = self.usual;
        let mut found = None;
        for _ in 0..ROUNDS {
            let pairs = self.pairs_at(&motion, &error)?;
            let Some((registration, groups)) = self.registered(&pairs, motion, &error, which)
            else {
                return Ok(None);
            };
            motion = registration.motion;
            let still = groups.nearest();
            error =
                self.spread(&pairs, &motion, &groups.weights(still), groups.share.len(), &error);
            let decided = Decided::Majority;
            found = Some(OnBlocks { registration, error, pairs, groups, still, decided });
        }
        Ok(found)
    }

    /// The registration on all pairs or on those of the still group, whichever explains the pairs better.
    fn registered(
        &self,
        pairs: &[Pair],
        start: Motion,
        error: &CommonError,
        which: Still,
    ) -> Option<(Registration, Groups)> {
        let all = vec![1.0; pairs.len()];
        let on = |start: Motion, weights: &[f64], tilts: bool| {
            let common = error.covariance();
            let cluster_m = self.config.registration.cluster_blocks * self.frame.size_m;
            registration::on_blocks(
                [&self.frame.earlier, &self.frame.later],
                pairs,
                weights,
                self.catalog,
                &common,
                start,
                tilts,
                cluster_m,
            )
        };
        let groups_at =
            |motion: &Motion| groups(&self.differences(pairs, motion), &self.usual, &self.own_way);
        let single = on(start, &all, true).map(|r| (r, groups_at(&r.motion)));
        let mut best = single.clone().filter(|(_, g)| g.share.len() < 2);
        // Groups are looked for from where the pairs were, and from where all of them together would be.
        let together =
            [on(start, &all, false).map(|r| r.motion), single.as_ref().map(|s| s.0.motion)];
        let begins = std::iter::once(start)
            .chain(together.into_iter().flatten().filter(|_| which == Still::Largest));
        for begin in begins {
            let at = groups_at(&begin);
            if at.share.len() < 2 {
                continue;
            }
            let still = if which == Still::Largest { 0 } else { at.nearest() };
            let mut from = begin;
            from.shift_m = (begin.shift() - at.shift_m[still]).to_array();
            let Some(r) = on(from, &at.weights(still), true) else { continue };
            let after = groups_at(&r.motion);
            if best.as_ref().is_none_or(|(_, b)| after.score > b.score) {
                best = Some((r, after));
            }
        }
        best.or(single)
    }

    fn differences(&self, pairs: &[Pair], motion: &Motion) -> Vec<Difference> {
        let one = |p: &Pair| {
            let later = self.frame.later[p.later].moved(motion);
            difference(&self.frame.earlier[p.earlier], &later, self.catalog)
        };
        pairs.iter().map(one).collect()
    }

    /// The common error that the pairs of the still group show after registration.
    fn spread(
        &self,
        pairs: &[Pair],
        motion: &Motion,
        weights: &[f64],
        groups: usize,
        error: &CommonError,
    ) -> CommonError {
        let common = error.covariance();
        let one = |(delta, weight): (Difference, &f64)| {
            let d2 = cholesky(&sum(&delta.covariance, &common))
                .map_or(f64::INFINITY, |l| distance2(&l, &delta.d));
            (groups < 2 || *weight > 0.5).then_some((delta, d2))
        };
        let differences = self.differences(pairs, motion).into_iter().zip(weights);
        let differences: Vec<_> = differences.filter_map(one).collect();
        CommonError::estimated(&differences, self.usual)
    }

    /// Asks the ground which group stood still where no group holds most of the blocks, and where ground is named as stable.
    fn decided(
        &self,
        mut blocks: OnBlocks,
        ground: Option<&Registration>,
    ) -> Result<OnBlocks, MonitorError> {
        let groups = &blocks.groups;
        let named = ground.is_some_and(|g| g.basis == Basis::StableGround);
        let share = groups.share[blocks.still];
        if groups.share.len() < 2 || (share >= MAJORITY && !named) {
            return Ok(blocks);
        }
        let tells = ground.and_then(|g| told_by(g, &blocks, &self.usual));
        let Some(still) = tells else {
            if share < MAJORITY {
                blocks.decided = Decided::Nobody;
            }
            return Ok(blocks);
        };
        if still != blocks.still {
            let mut motion = blocks.registration.motion;
            motion.shift_m = (motion.shift() - groups.shift_m[still]).to_array();
            if let Some(other) = self.rounds(motion, Still::Nearest)? {
                blocks = other;
            }
        }
        blocks.decided = Decided::Ground;
        Ok(blocks)
    }
}

/// The group whose stillness agrees with the ground; `None` where two agree about as well.
fn told_by(ground: &Registration, blocks: &OnBlocks, usual: &CommonError) -> Option<usize> {
    let pivot = blocks.registration.motion.pivot();
    let went = ground.motion.apply(blocks.registration.motion.undo(pivot)) - pivot;
    let sensors = [usual.level_sd_m, usual.level_sd_m, usual.height_sd_m];
    let mut variance: Matrix<3> = [[0.0; 3]; 3];
    for i in 0..3 {
        for k in 0..3 {
            variance[i][k] = ground.covariance[i][k] + blocks.registration.covariance[i][k];
        }
        variance[i][i] += (0.5 * sensors[i]).powi(2);
    }
    let l = cholesky(&variance)?;
    // If a group stood still, the blocks' registration is off by its shift, and the ground shows that.
    let off = |shift: &DVec3| distance2(&l, &(went + *shift).to_array());
    let mut all: Vec<(f64, usize)> =
        blocks.groups.shift_m.iter().enumerate().map(|(k, s)| (off(s), k)).collect();
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    (all[1].0 - all[0].0 > GROUND_TELLS).then_some(all[0].1)
}

fn within_limits(r: &Registration, limits: &RegistrationConfig) -> Result<(), MonitorError> {
    let shift = r.motion.shift().length();
    let turn = DVec3::from_array(r.motion.turn_rad).length();
    let checks = [
        ("shifted by", shift, "m", limits.most_shift_m, "most_shift_m"),
        ("turned by", turn, "rad", limits.most_turn_rad, "most_turn_rad"),
        ("scaled by", r.motion.scale.abs(), "of its size", limits.most_scale, "most_scale"),
    ];
    for (what, value, unit, limit, key) in checks {
        if value > limit {
            return Err(MonitorError::TooFarOff { what, value, unit, limit, key });
        }
    }
    Ok(())
}
