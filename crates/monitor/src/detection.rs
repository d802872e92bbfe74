//! Which differences of matched blocks are changes.
//!
//! In: pairs with their differences and covariances. Out: a class for each pair. Two gates: the joint test of shift and turn
//! over all pairs at a false discovery rate (Benjamini and Hochberg 1995), and the level of detection of the part itself;
//! nothing below its level is called a change.

use crate::body::{Body, Difference, readings_rad};
use crate::change::{Change, Class};
use crate::dense::{Matrix, along, cholesky, distance2, part};
use crate::matching::Pair;
use geom::DVec3;
use scene::Catalog;
use serde::{Deserialize, Serialize};

/// When a difference is a change.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct DetectionConfig {
    /// Share of false ones among the changes that are called.
    pub false_discovery: f64,
    /// Largest share of the shift that a sunk block moved sideways.
    pub sunk_sideways: f64,
    /// Largest turn of a sunk block, radians.
    pub sunk_turn_rad: f64,
    /// Confidence of both poses together below which a change is doubtful.
    pub least_confidence: f64,
    /// Nats by which the best assignment without the pair must be worse.
    pub least_margin: f64,
}

impl Default for DetectionConfig {
    fn default() -> Self {
        Self {
            false_discovery: 0.01,
            sunk_sideways: 0.6,
            sunk_turn_rad: 0.2,
            least_confidence: 0.5,
            least_margin: 1.0,
        }
    }
}

/// 99 % of χ² with three degrees of freedom.
const PART: f64 = 11.345;
/// Level of detection in standard deviations.
pub(crate) const LEVEL: f64 = 1.96;

/// A pair with everything the test needs.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Tested {
    pub pair: Pair,
    pub difference: Difference,
    /// Of the difference, both poses, common errors and registration, for calling a change.
    pub covariance: Matrix<6>,
    /// Of the shift, for its stated level.
    pub shift_level: Matrix<3>,
    /// Probability of this much without change.
    pub p: f64,
}

impl Tested {
    /// Tests one pair.
    pub fn of(
        pair: Pair,
        difference: Difference,
        covariance: Matrix<6>,
        shift_level: Matrix<3>,
    ) -> Self {
        let d2 = cholesky(&covariance).map_or(0.0, |l| distance2(&l, &difference.d));
        Self { pair, difference, covariance, shift_level, p: survival6(d2) }
    }
}

/// P(χ²₆ > x).
fn survival6(x: f64) -> f64 {
    let h = 0.5 * x;
    ((-h).exp() * (1.0 + h + 0.5 * h * h)).min(1.0)
}

/// Largest p that is still a discovery at this rate; negative when there is none.
pub(crate) fn discovery_limit(p: &[f64], rate: f64) -> f64 {
    let mut sorted = p.to_vec();
    sorted.sort_by(f64::total_cmp);
    let n = sorted.len() as f64;
    let passes = |(i, p): (usize, &f64)| *p <= rate * (i + 1) as f64 / n;
    sorted.iter().enumerate().rev().find(|(i, p)| passes((*i, p))).map_or(-1.0, |(_, p)| *p)
}

/// The change of a pair, as far as poses tell.
pub(crate) fn judge(
    tested: &Tested,
    earlier: &Body,
    later: &Body,
    catalog: &Catalog,
    limit: f64,
    config: &DetectionConfig,
) -> Change {
    let (shift, turn) = (tested.difference.shift(), tested.difference.turn());
    let (distance_m, turn_rad) = (shift.length(), turn.length());
    let (of_shift, of_turn) = (part(&tested.covariance, 0), part(&tested.covariance, 3));
    let level_along = |c: &Matrix<3>, v: DVec3| {
        let direction = v.try_normalize().unwrap_or(DVec3::Z);
        LEVEL * along(c, direction.to_array()).max(0.0).sqrt()
    };
    let stated = &tested.shift_level;
    let level_axes_m = std::array::from_fn(|i| LEVEL * stated[i][i].max(0.0).sqrt());
    let (level_m, level_rad) = (level_along(stated, shift), level_along(&of_turn, turn));
    let beyond =
        |c: &Matrix<3>, v: DVec3| cholesky(c).is_some_and(|l| distance2(&l, &v.to_array()) > PART);
    let shifted = beyond(&of_shift, shift) && distance_m > level_m;
    let turned = beyond(&of_turn, turn) && turn_rad > level_rad;
    let sideways = shift.x.hypot(shift.y);
    let goes_down = shift.z < -level_axes_m[2]
        && sideways < config.sunk_sideways * -shift.z
        && turn_rad < config.sunk_turn_rad.max(level_rad);
    let class = match (tested.p <= limit, shifted, turned) {
        (true, true, _) if goes_down => Class::Sunk,
        (true, true, _) => Class::Moved,
        (true, false, true) => Class::Turned,
        _ => Class::Unchanged,
    };
    let model = catalog.get(earlier.model);
    // A block that rolls without sliding turns by its way over its radius, at most.
    let allowed_rad = distance_m / (0.3 * f64::from(model.d_box_m));
    let readings = if class == Class::Moved {
        readings_rad(earlier, later, catalog)
            .iter()
            .filter(|a| **a <= allowed_rad.max(turn_rad + 1e-9))
            .count()
            .max(1)
    } else {
        1
    };
    let confidence = earlier.confidence * later.confidence;
    let mut change = Change {
        shift_m: shift.to_array(),
        distance_m,
        turn_rad,
        axis: turn.try_normalize().unwrap_or(DVec3::ZERO).to_array(),
        level_m,
        level_axes_m,
        level_rad,
        significance: tested.p,
        confidence,
        centre_earlier: Some(earlier.centre.as_vec3()),
        centre_later: Some(later.centre.as_vec3()),
        readings,
        ..Change::blank(earlier.model, class, String::new())
    };
    if readings > 1 {
        change.note = format!(
            "turn is ambiguous: the block may have rolled by one of its {} symmetries",
            model.symmetry.order()
        );
    }
    if class != Class::Unchanged {
        if confidence < config.least_confidence {
            change.doubt("one of its poses is uncertain");
        } else if tested.pair.margin < config.least_margin {
            change.doubt("another block could be the same one");
        }
    }
    change
}

impl Change {
    /// Calls the change doubtful and says why.
    pub(crate) fn doubt(&mut self, why: &str) {
        let was = self.class.word();
        self.class = Class::Doubtful;
        self.say(&format!("{why}; otherwise {was}"));
    }

    /// Adds to the note.
    pub(crate) fn say(&mut self, what: &str) {
        if !self.note.is_empty() {
            self.note.push_str("; ");
        }
        self.note.push_str(what);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tail_of_chi_squared_is_the_tables() {
        assert!((survival6(12.592) - 0.05).abs() < 1e-4);
        assert!((survival6(16.812) - 0.01).abs() < 1e-5);
    }

    #[test]
    fn discoveries_follow_benjamini_and_hochberg() {
        // Their own example: 15 p-values at 5 % give four discoveries.
        let p = [
            0.0001, 0.0004, 0.0019, 0.0095, 0.0201, 0.0278, 0.0298, 0.0344, 0.0459, 0.3240, 0.4262,
            0.5719, 0.6528, 0.7590, 1.0,
        ];
        let limit = discovery_limit(&p, 0.05);
        assert_eq!(p.iter().filter(|v| **v <= limit).count(), 4);
        assert!(discovery_limit(&[0.9, 0.8], 0.05) < 0.0);
    }
}
