//! Claims of a comparison against what really happened.

use crate::markdown::percent;
use crate::monitoring::{EpochPair, shown, unshown};
use crate::survey_offset::survey_offset_m;
use geom::{MeshQuery, Vec3};
use monitor::{Change, Class, Comparison};
use scene::{Catalog, InstanceId, PlacedBlock, Recognised, stated};
use std::collections::HashMap;
use synth::SynthScene;
use synth::then::{TrueChange, What};

/// Counts of several scenes.
#[derive(Clone, Debug, Default)]
pub(crate) struct Score {
    unmoved: Share,
    unmoved_doubtful: usize,
    moved: Share,
    mistaken: Share,
    missing: Share,
    missing_at_all: Share,
    missing_claims: Share,
    new: Share,
    new_claims: Share,
    broken: Share,
    broken_false: Share,
    inside_level: Share,
    inside_joint: Share,
    levels_m: Vec<f64>,
    levels_rad: Vec<f64>,
    datum_m: Vec<f64>,
    /// The same against what both surveys are off by as a whole, their sensors' errors included.
    offset_m: Vec<f64>,
    seconds: f64,
    /// What went wrong, a line of `monitoring_wrong.csv` each.
    pub wrong: Vec<String>,
}

/// So many of so many.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Share {
    pub hits: usize,
    pub of: usize,
}

impl Share {
    pub fn count(&mut self, hit: bool) {
        self.hits += usize::from(hit);
        self.of += 1;
    }

    pub fn text(&self) -> String {
        let share = (self.of > 0).then(|| self.hits as f64 / self.of as f64);
        format!("{} ({}/{})", percent(share), self.hits, self.of)
    }
}

/// Names of what [`Score::errors`] counts.
const ERRORS: [&str; 8] = [
    "move not found",
    "false change",
    "another block",
    "missing not found",
    "false missing",
    "new not found",
    "breakage not found",
    "false breakage",
];
/// Columns of a line of what went wrong.
pub(crate) const WRONG_HEAD: &str = "scene,error,what,shift_m,turn_deg,class,model,earlier_id,later_id,distance_m,level_m,claimed_turn_deg,level_deg,p,occlusion_earlier,occlusion_later,gone_m2,note";

/// Truth below this is no movement.
const STILL: (f32, f32) = (0.002, 0.001);
/// A block recognised twice that moved or turned by more is one whose move is to be found, whatever its level would be.
const APART: (f32, f32) = (0.2, 0.1);
/// Share of what the first survey shows of a block from which the second one has a free line, for its place to be in view.
const IN_VIEW: f64 = 0.5;
/// Points asked for that.
const LINES: usize = 100;
/// A recognised block is this one when its centre and rotation are this near, in block lengths and radians.
const SAME: (f32, f32) = (0.1, 0.0873);
/// A block is well seen when at most this share of it is hidden.
const WELL_SEEN: f64 = 0.6;
/// Surface of a broken leg's end that the first survey must show, in squares of the block length.
const SHOWN_BLOCKS2: f32 = 0.02;
/// How near the face where it broke off points lie, in block lengths, and how much of it the second survey must show.
const FACE_BLOCKS: f32 = 0.03;
const FACE_BLOCKS2: f32 = 0.005;

impl Score {
    pub const HEADS: [&'static str; 12] = [
        "surveys",
        "moves ≥ 3 levels found",
        "false of unmoved",
        "doubtful of unmoved",
        "pairs of two blocks",
        "missing R, place in view",
        "missing R, all",
        "missing P",
        "new R",
        "new P",
        "broken found",
        "broken false",
    ];

    pub const CALIBRATION_HEADS: [&'static str; 8] = [
        "surveys",
        "unmoved within 95 % level (axes)",
        "unmoved with p > 5 %",
        "level, well seen, mm (median)",
        "level, well seen, ° (median)",
        "step put in, error mm (median, worst)",
        "surveys' own offsets with it, error mm",
        "s a scene",
    ];

    pub fn add(
        &mut self,
        pair: &EpochPair,
        earlier: &[Recognised],
        later: &[Recognised],
        found: &Comparison,
        seconds: f64,
    ) {
        self.seconds += seconds;
        let truth = Truth::of(pair, earlier, later);
        for change in &found.changes {
            let before = self.errors();
            self.claim(pair, &truth, change);
            let after = self.errors();
            for (kind, _) in
                ERRORS.iter().zip(before.iter().zip(&after)).filter(|(_, (b, a))| b != a)
            {
                self.wrong.push(truth.line(pair, kind, change));
            }
        }
        let pivot = found.reference.motion.pivot().as_vec3();
        let back = found.reference.motion.apply(shown(&pair.datum, pivot).as_dvec3()).as_vec3();
        self.datum_m.push((back - pivot).length().into());
        let broken = |id: InstanceId| {
            pair.after.changes.iter().any(|c| c.later == Some(id) && c.cut.is_some())
        };
        let own = [
            survey_offset_m(&pair.before, &pair.catalog, |p| p, |_| true),
            survey_offset_m(
                &pair.after.scene,
                &pair.catalog,
                |p| unshown(&pair.datum, p),
                |id| !broken(id),
            ),
        ];
        let seen = shown(&pair.datum, pivot + own[1]);
        let back = found.reference.motion.apply(seen.as_dvec3()).as_vec3();
        self.offset_m.push((back - pivot - own[0]).length().into());
    }

    /// How many errors there are of each of [`ERRORS`].
    fn errors(&self) -> [usize; 8] {
        let missed = |s: &Share| s.of - s.hits;
        [
            missed(&self.moved),
            self.unmoved.hits,
            self.mistaken.hits,
            missed(&self.missing),
            missed(&self.missing_claims),
            missed(&self.new),
            missed(&self.broken),
            self.broken_false.hits,
        ]
    }

    fn claim(&mut self, pair: &EpochPair, truth: &Truth, change: &Change) {
        let of_earlier = change.earlier_id.and_then(|id| truth.earlier.get(&id));
        let of_later = change.later_id.and_then(|id| truth.later.get(&id));
        match (change.earlier_id, change.later_id) {
            (Some(_), Some(_)) => {
                let (Some(a), Some(b)) = (of_earlier, of_later) else { return };
                let same = std::ptr::eq(*a, *b);
                let stated = !matches!(change.class, Class::Doubtful | Class::Hidden);
                self.mistaken.count(!same && stated);
                if same {
                    self.matched(pair, change, a);
                }
            }
            (Some(_), None) => {
                let Some(event) = of_earlier else { return };
                self.seen_first_only(pair, truth, change, event);
            }
            (None, Some(_)) => {
                let Some(event) = of_later else { return };
                let came = event.what == What::Added;
                if came {
                    self.new.count(change.class == Class::New);
                }
                if change.class == Class::New {
                    self.new_claims.count(came || truth.went_far(pair, event));
                }
            }
            (None, None) => {}
        }
    }

    fn seen_first_only(
        &mut self,
        pair: &EpochPair,
        truth: &Truth,
        change: &Change,
        event: &TrueChange,
    ) {
        let gone = event.what == What::Missing;
        let called = change.class == Class::Missing;
        if gone && !truth.is_taken(pair, event) {
            self.missing_at_all.count(called);
            if place_in_view(pair, event) {
                self.missing.count(called);
            }
        }
        if called {
            self.missing_claims.count(gone || truth.went_far(pair, event));
        }
        if gone {
            return;
        }
        let recognised_again = truth.later.values().any(|e| std::ptr::eq(*e, event));
        let moved = event.shift_m.length() > APART.0 || event.turn_rad > APART.1;
        if truth.went_far(pair, event) {
            self.moved.count(called);
        } else if recognised_again && moved {
            self.moved.count(false);
        }
    }

    fn matched(&mut self, pair: &EpochPair, change: &Change, event: &TrueChange) {
        let calls = matches!(change.class, Class::Moved | Class::Turned | Class::Sunk);
        let (shift, turn) = (event.shift_m.length(), event.turn_rad);
        let still = shift < STILL.0 && turn < STILL.1;
        let seen = [change.occlusion_earlier, change.occlusion_later]
            .iter()
            .all(|o| o.is_some_and(|o| o <= WELL_SEEN));
        if seen {
            self.levels_m.push(change.level_axes_m.iter().copied().fold(0.0, f64::max));
            self.levels_rad.push(change.level_rad);
        }
        if still {
            self.unmoved.count(calls);
            self.unmoved_doubtful += usize::from(change.class == Class::Doubtful);
            for i in 0..3 {
                self.inside_level.count(change.shift_m[i].abs() <= change.level_axes_m[i]);
            }
            self.inside_joint.count(change.significance > 0.05);
        } else if f64::from(shift) >= 3.0 * change.level_m
            || f64::from(turn) >= 3.0 * change.level_rad
        {
            self.moved.count(calls || change.class == Class::PossiblyBroken);
        }
        let broken = change.class == Class::PossiblyBroken;
        if event.what == What::Broken {
            if shows_end(pair, event) {
                self.broken.count(broken);
            }
        } else {
            self.broken_false.count(broken);
        }
    }

    pub fn row(&self, name: &str) -> Vec<String> {
        vec![
            name.into(),
            self.moved.text(),
            self.unmoved.text(),
            self.unmoved_doubtful.to_string(),
            self.mistaken.text(),
            self.missing.text(),
            self.missing_at_all.text(),
            self.missing_claims.text(),
            self.new.text(),
            self.new_claims.text(),
            self.broken.text(),
            self.broken_false.text(),
        ]
    }

    pub fn calibration_row(&self, name: &str) -> Vec<String> {
        let (level, turn) = (median(&self.levels_m), median(&self.levels_rad));
        let text = |all: &[f64]| {
            let worst = all.iter().copied().fold(0.0, f64::max);
            format!("{:.1}, {:.1}", 1e3 * median(all), 1e3 * worst)
        };
        vec![
            name.into(),
            self.inside_level.text(),
            self.inside_joint.text(),
            format!("{:.1}", 1e3 * level),
            format!("{:.2}", turn.to_degrees()),
            text(&self.datum_m),
            text(&self.offset_m),
            format!("{:.2}", self.seconds / self.datum_m.len().max(1) as f64),
        ]
    }
}

/// Middle value; NaN of nothing.
pub(crate) fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied().unwrap_or(f64::NAN)
}

/// Recognised blocks by number, each with what really happened to it; those with a wrong pose are left out.
struct Truth<'a> {
    earlier: HashMap<u32, &'a TrueChange>,
    later: HashMap<u32, &'a TrueChange>,
}

impl<'a> Truth<'a> {
    fn of(pair: &'a EpochPair, earlier: &[Recognised], later: &[Recognised]) -> Self {
        let changes = &pair.after.changes;
        let before = |block: &PlacedBlock| changes.iter().find(|c| c.earlier == Some(block.block));
        let after = |block: &PlacedBlock| changes.iter().find(|c| c.later == Some(block.block));
        let (first, second) = (&pair.before.scene.blocks, &pair.after.scene.scene.blocks);
        Self {
            earlier: known(earlier, first, &pair.catalog, before, |p| p),
            later: known(later, second, &pair.catalog, after, |p| shown(&pair.datum, p)),
        }
    }

    /// Whether another block came to rest where a missing one was: no survey shows then that it is gone.
    fn is_taken(&self, pair: &EpochPair, event: &TrueChange) -> bool {
        let centre = |b: &PlacedBlock| b.site_from_block * pair.catalog.get(b.model).centre;
        let old = pair.before.scene.blocks.iter().find(|b| Some(b.block) == event.earlier);
        let near_m = 0.5 * pair.catalog.get(event.model).d_box_m;
        old.is_some_and(|old| {
            let after = &pair.after.scene.scene.blocks;
            after.iter().any(|b| (centre(b) - centre(old)).length() < near_m)
        })
    }

    /// A wrong claim with its truth.
    fn line(&self, pair: &EpochPair, error: &str, change: &Change) -> String {
        let of = |id: Option<u32>, map: &HashMap<u32, &'a TrueChange>| {
            id.and_then(|id| map.get(&id).copied())
        };
        let event = of(change.earlier_id, &self.earlier).or(of(change.later_id, &self.later));
        let event = event.map_or(",,".into(), |e| {
            format!("{:?},{:.3},{:.2}", e.what, e.shift_m.length(), e.turn_rad.to_degrees())
        });
        let id = |v: Option<u32>| v.map_or(String::new(), |v| v.to_string());
        let share = |v: Option<f64>| v.map_or(String::new(), |v| format!("{v:.2}"));
        format!(
            "{},{error},{event},{},{},{},{},{:.3},{:.3},{:.2},{:.2},{:.2e},{},{},{:.3},\"{}\"",
            pair.key(),
            change.class.word(),
            pair.catalog.get(change.model).name,
            id(change.earlier_id),
            id(change.later_id),
            change.distance_m,
            change.level_m,
            change.turn_rad.to_degrees(),
            change.level_rad.to_degrees(),
            change.significance,
            share(change.occlusion_earlier),
            share(change.occlusion_later),
            change.gone_m2,
            change.note
        )
    }

    /// Whether the block moved farther than any pair may.
    fn went_far(&self, pair: &EpochPair, event: &TrueChange) -> bool {
        let size = pair.catalog.get(event.model).d_box_m;
        event.earlier.is_some() && event.later.is_some() && event.shift_m.length() > 0.5 * size
    }
}

/// Recognised blocks with their true pose, each with its event.
pub(crate) fn known<'a>(
    recognised: &[Recognised],
    truth: &[PlacedBlock],
    catalog: &Catalog,
    event: impl Fn(&PlacedBlock) -> Option<&'a TrueChange>,
    shown: impl Fn(Vec3) -> Vec3,
) -> HashMap<u32, &'a TrueChange> {
    let mut out = HashMap::new();
    for (block, found) in stated(recognised) {
        let model = catalog.get(found.model);
        let centre = found.centre(model);
        let same = |t: &&PlacedBlock| {
            let at = shown(t.site_from_block * catalog.get(t.model).centre);
            let turn = model
                .symmetry
                .rotation_error_rad(found.site_from_block.rotation, t.site_from_block.rotation);
            t.model == found.model
                && (at - centre).length() < SAME.0 * model.d_box_m
                && turn < SAME.1
        };
        if let Some(event) = truth.iter().find(same).and_then(&event) {
            out.insert(block.block.0, event);
        }
    }
    out
}

/// Whether the second survey has a free line to most of what the first one shows of a block: from each of these points straight
/// to the sensor that passed nearest over it, past the blocks as they really lie then.
fn place_in_view(pair: &EpochPair, event: &TrueChange) -> bool {
    let Some(id) = event.earlier else { return false };
    let (before, after) = (&pair.before, &pair.after.scene);
    let own = before.survey.cloud.position_m.iter().zip(&before.instance);
    let own: Vec<Vec3> = own.filter(|(_, i)| **i == id.0).map(|(p, _)| *p).collect();
    let sensors: Vec<Vec3> =
        after.survey.sensor_positions.iter().map(|s| unshown(&pair.datum, *s)).collect();
    let solids: Vec<Option<MeshQuery>> =
        pair.catalog.iter().map(|(_, m)| MeshQuery::new(&m.mesh).ok()).collect();
    let free = |p: &Vec3| {
        let across = |s: &&Vec3| (s.truncate() - p.truncate()).length();
        let nearest = sensors.iter().min_by(|a, b| across(a).total_cmp(&across(b)));
        let to = nearest.map_or(Vec3::Z, |s| (*s - *p).normalize_or(Vec3::Z));
        !after.scene.blocks.iter().any(|b| {
            let model = pair.catalog.get(b.model);
            let pose = b.site_from_block;
            let centre = pose * model.centre - *p;
            let beside_m = (centre - to * centre.dot(to)).length();
            let local = pose.rotation.inverse() * to;
            beside_m < model.d_max_m
                && solids[usize::from(b.model.0)].as_ref().is_some_and(|solid| {
                    solid.cast_ray(pose.inverse_transform_point(*p), local, FAR_M).is_some()
                })
        })
    };
    let asked: Vec<&Vec3> = own.iter().step_by(own.len().div_ceil(LINES).max(1)).collect();
    let seen = asked.iter().filter(|p| free(p)).count();
    seen as f64 >= IN_VIEW * asked.len().max(1) as f64
}

/// Farther than any pile is high.
const FAR_M: f32 = 50.0;

/// Whether the first survey shows enough of the end that is gone, and the second one the face where it broke off: a block that
/// fell on its broken leg shows neither.
fn shows_end(pair: &EpochPair, event: &TrueChange) -> bool {
    let (Some(cut), Some(id), Some(later)) = (event.cut, event.earlier, event.later) else {
        return false;
    };
    let size = pair.catalog.get(event.model).d_box_m;
    let (before, after) = (&pair.before, &pair.after.scene);
    let back = |p: Vec3| unshown(&pair.datum, p);
    let end = points_where(before, id, |p| p, |p| cut.distance_m(p) > 0.0);
    let face = points_where(after, later, back, |p| cut.distance_m(p).abs() < FACE_BLOCKS * size);
    end >= SHOWN_BLOCKS2 * size * size && face >= FACE_BLOCKS2 * size * size
}

/// Surface that a survey shows of a block where `holds` (block coordinates), m². `true_place` undoes the survey's datum.
fn points_where(
    scene: &SynthScene,
    id: InstanceId,
    true_place: impl Fn(Vec3) -> Vec3,
    holds: impl Fn(Vec3) -> bool,
) -> f32 {
    let Some(block) = scene.scene.blocks.iter().find(|b| b.block == id) else { return 0.0 };
    let cloud = &scene.survey.cloud;
    let bounds = cloud.bounds().size();
    let per_m2 = cloud.len() as f32 / (bounds.x * bounds.y);
    let own = cloud.position_m.iter().zip(&scene.instance).filter(|(_, i)| **i == id.0);
    let there = |p: Vec3| holds(block.site_from_block.inverse_transform_point(true_place(p)));
    own.filter(|(p, _)| there(**p)).count() as f32 / per_m2
}
