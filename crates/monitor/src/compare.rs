//! The comparison of two epochs: register, match, test, look.

use crate::body::{Body, Difference, difference};
use crate::breakage::{BreakageConfig, Faces, broken, gone_by_itself_m2, gone_m2};
use crate::change::{Change, Class};
use crate::common_error::{CommonError, Scales};
use crate::dense::{cholesky, distance2, part, sum, zeros};
use crate::detection::{DetectionConfig, Tested, discovery_limit, judge};
use crate::matching::{MatchConfig, Pair};
use crate::motion::{Motion, covariance_at};
use crate::registering::{Frame, Registered, register};
use crate::registration::{Basis, CommonMovement, MovedAlike, Registration, RegistrationConfig};
use crate::rivals::doubt_rivals;
use crate::room::Room;
use crate::single::{Only, Single, SingleConfig, Solids, solids};
use crate::stable::StableGround;
use crate::surface_samples::{Samples, samples};
use crate::view::View;
use crate::{Epoch, MonitorError};
use geom::{Observer, PointGrid, Vec3};
use rayon::prelude::*;
use scene::{Catalog, Survey};
use serde::{Deserialize, Serialize};

/// Settings of a comparison; `Default` is the method's.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct CompareConfig {
    /// Where the later survey lies.
    pub registration: RegistrationConfig,
    /// Which block is which.
    pub matching: MatchConfig,
    /// When a difference is a change.
    pub detection: DetectionConfig,
    /// When a block is missing or new.
    pub single: SingleConfig,
    /// When a block is possibly broken.
    pub breakage: BreakageConfig,
}

impl CompareConfig {
    /// Which block may be which: two heights of coordinates that are left as they are may lie apart.
    pub(crate) fn matching(&self) -> MatchConfig {
        let gate_blocks = self.matching.gate_blocks;
        match self.registration.fixed {
            true => MatchConfig { rise_blocks: gate_blocks, ..self.matching },
            false => self.matching,
        }
    }
}

/// What happened between two epochs. Places are in the earlier epoch's local frame.
#[derive(Clone, Debug)]
pub struct Comparison {
    /// One entry a block of either epoch: those of the earlier one in its order, then those seen later only.
    pub changes: Vec<Change>,
    /// The registration the changes refer to.
    pub reference: Registration,
    /// The registration on the blocks that did not move among themselves; `None` where too few agree.
    pub on_blocks: Option<Registration>,
    /// The registration on ground.
    pub on_ground: Option<Registration>,
    /// What the blocks did together against the ground.
    pub common_movement: Option<CommonMovement>,
    /// Blocks that moved alike, beside those that stood still; empty: there are none.
    pub moved_alike: Vec<MovedAlike>,
    /// What both sensors do to every block.
    pub common_error: CommonError,
    /// The later survey's points, registered.
    pub later_points: Vec<Vec3>,
}

impl Comparison {
    /// Blocks of a class.
    pub fn count(&self, class: Class) -> usize {
        self.changes.iter().filter(|c| c.class == class).count()
    }

    /// Whether the blocks as a whole went up or down against the ground, beyond what both registrations leave open.
    pub fn common_settlement_m(&self) -> Option<f64> {
        self.common_movement.filter(|m| m.settled).map(|m| m.shift_m[2])
    }
}

/// Compares two epochs of one site. `stable` names ground that does not move; where it is given, movements are absolute, else
/// relative to the blocks that did not move among themselves.
///
/// Errors: [`MonitorError`]; a pair of epochs without any change is no error.
pub fn compare(
    earlier: &Epoch,
    later: &Epoch,
    catalog: &Catalog,
    stable: &StableGround,
    config: &CompareConfig,
    observer: &dyn Observer,
) -> Result<Comparison, MonitorError> {
    config.check()?;
    check(earlier, later, catalog)?;
    stable.check(earlier, later)?;
    let frame = Frame::of(earlier, later, catalog);
    let registered = register(&frame, earlier, later, catalog, stable, config)?;
    stop(observer)?;
    let mut out = detect(&frame, registered, earlier, later, catalog, config, observer)?;
    number(&mut out.changes);
    Ok(out)
}

fn stop(observer: &dyn Observer) -> Result<(), MonitorError> {
    if observer.cancelled() { Err(MonitorError::Stopped) } else { Ok(()) }
}

fn check(earlier: &Epoch, later: &Epoch, catalog: &Catalog) -> Result<(), MonitorError> {
    let (a, b) = (&earlier.survey.frame, &later.survey.frame);
    if a.crs != b.crs {
        return Err(MonitorError::OtherCrs { earlier: a.crs.clone(), later: b.crs.clone() });
    }
    for (epoch, name) in [(earlier, "earlier"), (later, "later")] {
        if epoch.survey.cloud.is_empty() {
            return Err(MonitorError::NoPoints { epoch: name });
        }
        if let Some(block) = epoch.blocks.iter().find(|b| usize::from(b.model.0) >= catalog.len()) {
            return Err(MonitorError::UnknownModel {
                block: block.id,
                model: block.model.0,
                known: catalog.len(),
            });
        }
    }
    let bounds = |s: &Survey| {
        let b = s.cloud.bounds();
        [s.frame.site_from_local(b.min), s.frame.site_from_local(b.max)]
    };
    let ([a0, a1], [b0, b1]) = (bounds(earlier.survey), bounds(later.survey));
    let gap = |i: usize| (b0[i] - a1[i]).max(a0[i] - b1[i]).max(0.0);
    let gap_m = gap(0).hypot(gap(1));
    if gap_m > 0.0 { Err(MonitorError::NoOverlap { gap_m }) } else { Ok(()) }
}

fn detect(
    frame: &Frame,
    registered: Registered,
    earlier: &Epoch,
    later: &Epoch,
    catalog: &Catalog,
    config: &CompareConfig,
    observer: &dyn Observer,
) -> Result<Comparison, MonitorError> {
    let Registered { reference, pairs, common_error, .. } = &registered;
    let motion = &reference.motion;
    let moved: Vec<Body> = frame.later.iter().map(|b| b.moved(motion)).collect();
    let tested =
        tested(frame, &moved, registered.pairs.as_slice(), reference, common_error, catalog);
    let p: Vec<f64> = tested.iter().map(|t| t.p).collect();
    let limit = discovery_limit(&p, config.detection.false_discovery);

    let later_points: Vec<Vec3> =
        frame.points.par_iter().map(|p| motion.apply(p.as_dvec3()).as_vec3()).collect();
    let views = views(frame, motion, earlier.survey, later.survey, &later_points, catalog);
    let solids = solids(catalog);
    let room = Room::new(
        catalog,
        &solids,
        [&frame.earlier, &moved],
        &moved,
        &later_points,
        views[1].near_m,
        config.matching.gate_blocks as f32,
    );
    let judged = Judged {
        catalog,
        epochs: [earlier, later],
        fine: samples(catalog, config.breakage.samples),
        coarse: samples(catalog, config.single.samples),
        solids: &solids,
        room: &room,
        unexplained: [
            unexplained(earlier, &earlier.survey.cloud.position_m, views[0].near_m),
            unexplained(later, &later_points, views[1].near_m),
        ],
        views,
        limit,
        config,
    };
    let one = |t: &Tested| judged.pair(t, &frame.earlier[t.pair.earlier], &moved[t.pair.later]);
    let mut changes: Vec<Change> = tested.par_iter().flat_map_iter(one).collect();
    broken(&mut changes, catalog, &config.breakage);
    stop(observer)?;
    let lost = alone(&frame.earlier, pairs.iter().map(|p| p.earlier));
    let come = alone(&moved, pairs.iter().map(|p| p.later));
    changes.extend(judged.single(Only::Earlier).judge_all(&lost, &earlier.blocks, Only::Earlier));
    changes.extend(judged.single(Only::Later).judge_all(&come, &later.blocks, Only::Later));
    let unsure = tested.iter().filter(|t| t.pair.margin < config.detection.least_margin);
    let unsure = unsure.map(|t| later.blocks[moved[t.pair.later].index].id).collect();
    doubt_rivals(&mut changes, &unsure, catalog, &config.matching());
    Ok(Comparison {
        changes,
        reference: registered.reference,
        on_blocks: registered.on_blocks,
        on_ground: registered.on_ground,
        common_movement: registered.common_movement,
        moved_alike: registered.moved_alike,
        common_error: registered.common_error,
        later_points,
    })
}

/// Bodies that no pair uses.
fn alone(bodies: &[Body], used: impl Iterator<Item = usize>) -> Vec<&Body> {
    let mut taken = vec![false; bodies.len()];
    used.for_each(|i| taken[i] = true);
    bodies.iter().zip(taken).filter(|(_, t)| !t).map(|(b, _)| b).collect()
}

/// Everything the blocks are judged by.
struct Judged<'a> {
    catalog: &'a Catalog,
    epochs: [&'a Epoch<'a>; 2],
    fine: Vec<Samples>,
    coarse: Vec<Samples>,
    solids: &'a Solids,
    room: &'a Room<'a>,
    views: [View; 2],
    /// Points of each epoch that none of its blocks explains.
    unexplained: [PointGrid; 2],
    limit: f64,
    config: &'a CompareConfig,
}

/// From this turn on nobody can say which leg is which.
const ROLLED_RAD: f64 = 0.15;
/// From this many block lengths on a pair that moved must have left its old place, or it is two blocks.
const LEAVES_BLOCKS: f64 = 0.3;

impl Judged<'_> {
    fn single(&self, only: Only) -> Single<'_> {
        let (own, other) = match only {
            Only::Earlier => (0, 1),
            Only::Later => (1, 0),
        };
        Single {
            catalog: self.catalog,
            samples: &self.coarse,
            solids: self.solids,
            room: Some(self.room),
            own: &self.views[own],
            other: &self.views[other],
            unexplained: &self.unexplained[other],
            config: &self.config.single,
        }
    }

    /// What became of a matched block: one change, or two where the pair is none.
    fn pair(&self, tested: &Tested, a: &Body, b: &Body) -> Vec<Change> {
        let (seen_a, seen_b) = (&self.epochs[0].blocks[a.index], &self.epochs[1].blocks[b.index]);
        let mut change = judge(tested, a, b, self.catalog, self.limit, &self.config.detection);
        let size_m = f64::from(self.catalog.get(a.model).d_box_m);
        let went = matches!(change.class, Class::Moved | Class::Doubtful | Class::Sunk);
        if went && change.distance_m > LEAVES_BLOCKS * size_m {
            let old = self.single(Only::Earlier).judge(a, seen_a, Only::Earlier);
            // Its old place is covered, or shows it still: what was found elsewhere is another block.
            if old.class == Class::Hidden {
                return vec![old, self.single(Only::Later).judge(b, seen_b, Only::Later)];
            }
        }
        change.earlier_id = Some(seen_a.id);
        change.later_id = Some(seen_b.id);
        change.occlusion_earlier = Some(seen_a.occlusion.into());
        change.occlusion_later = Some(seen_b.occlusion.into());
        if change.class != Class::Doubtful {
            let views = [&self.views[0], &self.views[1]];
            let cloud = &self.epochs[0].survey.cloud.position_m;
            let own: Vec<Vec3> =
                seen_a.points.iter().filter_map(|&i| cloud.get(i as usize).copied()).collect();
            let breakage = &self.config.breakage;
            change.gone_m2 = gone_m2(a, b, self.catalog, &self.fine, &own, views, breakage);
            if change.turn_rad > ROLLED_RAD {
                let alone = gone_by_itself_m2(a, b, self.catalog, &self.fine, views, breakage);
                change.gone_m2 = change.gone_m2.max(alone);
            }
            let faces = Faces {
                catalog: self.catalog,
                samples: &self.fine,
                solids: self.solids,
                views,
                unexplained: [&self.unexplained[0], &self.unexplained[1]],
                config: breakage,
            };
            change.face_m2 = faces.area_m2(a, b);
        }
        vec![change]
    }
}

/// Points of an epoch that none of its blocks explains; none where the blocks do not say which they explain.
fn unexplained(epoch: &Epoch, points: &[Vec3], cell_m: f32) -> PointGrid {
    let mut taken = vec![epoch.blocks.iter().all(|b| b.points.is_empty()); points.len()];
    for &i in epoch.blocks.iter().flat_map(|b| &b.points) {
        if let Some(taken) = taken.get_mut(i as usize) {
            *taken = true;
        }
    }
    let open: Vec<Vec3> = points.iter().zip(taken).filter(|(_, t)| !t).map(|(p, _)| *p).collect();
    PointGrid::new(&open, cell_m.max(1e-3))
}

fn tested(
    frame: &Frame,
    moved: &[Body],
    pairs: &[Pair],
    reference: &Registration,
    error: &CommonError,
    catalog: &Catalog,
) -> Vec<Tested> {
    let common = error.covariance();
    // What the blocks were laid on each other by shows in their own spread; what ground says does not.
    let own = reference.basis == Basis::Blocks;
    let of_pair = |p: &Pair| {
        let (a, b) = (&frame.earlier[p.earlier], &moved[p.later]);
        let delta = difference(a, b, catalog);
        let of_motion = covariance_at(frame.pivot, b.centre, &reference.covariance);
        let of_pair = sum(&delta.covariance, &common);
        let all = sum(&of_pair, &of_motion);
        let d2 = cholesky(&all).map_or(f64::INFINITY, |l| distance2(&l, &delta.d));
        let covariance = if own { all } else { of_pair };
        (Difference { covariance, ..delta }, d2)
    };
    let differences: Vec<(Difference, f64)> = pairs.iter().map(of_pair).collect();
    let scales = Scales::of(&differences);
    let one = |(p, (delta, _)): (&Pair, &(Difference, f64))| {
        let rest = if own {
            zeros::<6>()
        } else {
            covariance_at(frame.pivot, moved[p.later].centre, &reference.covariance)
        };
        let of_change = sum(&scales.change(&delta.covariance), &rest);
        let of_level = sum(&scales.level(&delta.covariance), &part(&rest, 0));
        Tested::of(*p, *delta, of_change, of_level)
    };
    pairs.iter().zip(&differences).map(one).collect()
}

fn views(
    frame: &Frame,
    motion: &Motion,
    earlier: &Survey,
    later: &Survey,
    later_points: &[Vec3],
    catalog: &Catalog,
) -> [View; 2] {
    let view = |points: &[Vec3], sensors: Vec<Vec3>, survey: &Survey| {
        let noise = survey.sensor.noise_sd_m(catalog.d_max_m());
        View::new(points, sensors, survey.sensor, noise, frame.size_m as f32)
    };
    let sensors = frame.sensors.iter().map(|s| motion.apply(s.as_dvec3()).as_vec3()).collect();
    [
        view(&earlier.cloud.position_m, earlier.sensor_positions.clone(), earlier),
        view(later_points, sensors, later),
    ]
}

/// Earlier blocks keep their numbers; those seen later only get numbers after the last.
fn number(changes: &mut [Change]) {
    changes.sort_by_key(|c| (c.earlier_id.is_none(), c.earlier_id, c.later_id));
    let mut next = changes.iter().filter_map(|c| c.earlier_id).max().unwrap_or(0);
    for change in changes {
        change.block_id = change.earlier_id.unwrap_or_else(|| {
            next += 1;
            next
        });
    }
}
