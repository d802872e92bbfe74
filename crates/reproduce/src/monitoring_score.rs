//! Claims of a comparison against what really happened.

use crate::markdown::percent;
use crate::monitoring::{EpochPair, shown};
use geom::Vec3;
use monitor::{Change, Class, Comparison};
use scene::{Catalog, PlacedBlock, Recognised, stated};
use std::collections::HashMap;
use synth::then::{TrueChange, What};

/// Counts of several scenes.
#[derive(Clone, Debug, Default)]
pub(crate) struct Score {
    unmoved: Share,
    unmoved_doubtful: usize,
    moved: Share,
    missing: Share,
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
    seconds: f64,
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

/// Truth below this is no movement.
const STILL: (f32, f32) = (0.002, 0.001);
/// A recognised block is this one when its centre and rotation are this near, in block lengths and radians.
const SAME: (f32, f32) = (0.1, 0.0873);
/// A block is well seen when at most this share of it is hidden.
const WELL_SEEN: f64 = 0.6;
/// Surface of a broken leg's end that the first survey must show, in squares of the block length.
const SHOWN_BLOCKS2: f32 = 0.02;

impl Score {
    pub const HEADS: [&'static str; 10] = [
        "surveys",
        "moves ≥ 3 levels found",
        "false of unmoved",
        "doubtful of unmoved",
        "missing R",
        "missing P",
        "new R",
        "new P",
        "broken found",
        "broken false",
    ];

    pub const CALIBRATION_HEADS: [&'static str; 7] = [
        "surveys",
        "unmoved within 95 % level (axes)",
        "unmoved with p > 5 %",
        "level, well seen, mm (median)",
        "level, well seen, ° (median)",
        "datum error mm (median, worst)",
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
            self.claim(pair, &truth, change);
        }
        let pivot = found.reference.motion.pivot().as_vec3();
        let back = found.reference.motion.apply(shown(&pair.datum, pivot).as_dvec3()).as_vec3();
        self.datum_m.push((back - pivot).length().into());
    }

    fn claim(&mut self, pair: &EpochPair, truth: &Truth, change: &Change) {
        let of_earlier = change.earlier_id.and_then(|id| truth.earlier.get(&id));
        let of_later = change.later_id.and_then(|id| truth.later.get(&id));
        match (change.earlier_id, change.later_id) {
            (Some(_), Some(_)) => {
                if let (Some(a), Some(b)) = (of_earlier, of_later)
                    && std::ptr::eq(*a, *b)
                {
                    self.matched(pair, change, a);
                }
            }
            (Some(_), None) => {
                let Some(event) = of_earlier else { return };
                let gone = event.what == What::Missing;
                if gone {
                    self.missing.count(change.class == Class::Missing);
                }
                if change.class == Class::Missing {
                    self.missing_claims.count(gone || truth.went_far(pair, event));
                }
                if event.what != What::Missing && truth.went_far(pair, event) {
                    self.moved.count(change.class == Class::Missing);
                }
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
            self.missing.text(),
            self.missing_claims.text(),
            self.new.text(),
            self.new_claims.text(),
            self.broken.text(),
            self.broken_false.text(),
        ]
    }

    pub fn calibration_row(&self, name: &str) -> Vec<String> {
        let (level, turn) = (median(&self.levels_m), median(&self.levels_rad));
        let worst = self.datum_m.iter().copied().fold(0.0, f64::max);
        vec![
            name.into(),
            self.inside_level.text(),
            self.inside_joint.text(),
            format!("{:.1}", 1e3 * level),
            format!("{:.2}", turn.to_degrees()),
            format!("{:.1}, {:.1}", 1e3 * median(&self.datum_m), 1e3 * worst),
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

/// Whether the first survey shows enough of the end that is gone.
fn shows_end(pair: &EpochPair, event: &TrueChange) -> bool {
    let (Some(cut), Some(id)) = (event.cut, event.earlier) else { return false };
    let Some(block) = pair.before.scene.blocks.iter().find(|b| b.block == id) else { return false };
    let survey = &pair.before.survey;
    let bounds = survey.cloud.bounds().size();
    let per_m2 = survey.cloud.len() as f32 / (bounds.x * bounds.y);
    let gone = |(p, i): (&Vec3, &u32)| {
        *i == id.0 && cut.distance_m(block.site_from_block.inverse_transform_point(*p)) > 0.0
    };
    let points =
        survey.cloud.position_m.iter().zip(&pair.before.instance).filter(|p| gone(*p)).count();
    let size = pair.catalog.get(event.model).d_box_m;
    points as f32 / per_m2 >= SHOWN_BLOCKS2 * size * size
}
