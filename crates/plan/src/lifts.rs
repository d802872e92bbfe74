//! The plan as the crane works it off: from which stand, how far, which leg up, on which day at what time.
//!
//! In: a plan in placing order, the crane, working hours, rate and tides. Out: one lift a block, and how many days they take.

use crate::{CraneConfig, PlanError};
use geom::{Pose, Vec3};
use scene::{BlockModel, Catalog, Plan, SiteFrame};
use serde::{Deserialize, Serialize};

/// Parts whose middle lies farther than this from the centre of mass, in d_box, are legs. Free choice: the legs of a tetrapod lie
/// at 0.35.
const LEG: f32 = 0.1;
/// Days after which a tide that never gives time for a lift is given up: a whole spring-neap cycle.
const PATIENCE_DAYS: u32 = 30;
const DAY_H: f32 = 24.0;

/// When and how fast blocks are placed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct WorksConfig {
    /// Time for a block, from hook to hook.
    pub minutes_a_block: f32,
    /// Working hours, from and to, of a day of 24 hours.
    pub hours: [f32; 2],
    /// Most blocks a day.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub most_a_day: Option<u32>,
    /// When the tide lets one work, hours of the first day, from and to; none: always.
    pub tides: Vec<[f32; 2]>,
    /// How much later the tides are each day.
    pub tide_shift_minutes: f32,
}

impl Default for WorksConfig {
    fn default() -> Self {
        let (hours, tides) = ([7.0, 17.0], Vec::new());
        Self { minutes_a_block: 15.0, hours, most_a_day: None, tides, tide_shift_minutes: 50.0 }
    }
}

/// How a block hangs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Attitude {
    /// Whether it is told by its legs; if not, by the axes of its mesh.
    pub legs: bool,
    /// Angle of the highest leg (or axis) from the vertical, degrees.
    pub tilt_deg: f32,
    /// Where it leans to, degrees clockwise from north.
    pub bearing_deg: f32,
    /// Where the second highest points, degrees clockwise from north.
    pub second_bearing_deg: f32,
}

/// One lift.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lift {
    /// Place in the order of the plan.
    pub order: u32,
    /// Number of the crane's stand, from 1, and distance from it; `None` without a crane.
    pub stand: Option<(u32, f32)>,
    /// Day, from 1, and hour of its start; `None` without working hours.
    pub start: Option<(u32, f32)>,
    /// How it hangs.
    pub attitude: Attitude,
}

/// The lifts of a plan, in its order. Errors: hours or a rate that cannot be, tides that never give time for a lift.
pub fn lifts(
    plan: &Plan,
    catalog: &Catalog,
    frame: &SiteFrame,
    crane: Option<&CraneConfig>,
    works: Option<&WorksConfig>,
) -> Result<Vec<Lift>, PlanError> {
    let starts = works.map(|w| w.starts(plan.placements.len())).transpose()?;
    let lift = |(i, p): (usize, &scene::Placement)| {
        let block = catalog.get(p.model);
        let place = p.rest * block.centre;
        Lift {
            order: p.order,
            stand: crane.and_then(|c| c.nearest_stand(place.truncate(), frame)),
            start: starts.as_ref().map(|s| s[i]),
            attitude: attitude(block, &p.rest),
        }
    };
    Ok(plan.placements.iter().enumerate().map(lift).collect())
}

/// Which way the two highest legs of a posed block point; of a block without legs its axes.
pub fn attitude(block: &BlockModel, pose: &Pose) -> Attitude {
    let middle = |corners: &[Vec3]| corners.iter().sum::<Vec3>() / corners.len().max(1) as f32;
    let out = |part: &scene::ConvexPart| middle(&part.corners) - block.centre;
    let mut arms: Vec<Vec3> =
        block.parts.iter().map(out).filter(|v| v.length() > LEG * block.d_box_m).collect();
    let legs = arms.len() > 2;
    if !legs {
        arms = [Vec3::X, Vec3::Y, Vec3::Z].into_iter().flat_map(|v| [v, -v]).collect();
    }
    let mut arms: Vec<Vec3> =
        arms.into_iter().map(|v| pose.rotation * v.normalize_or_zero()).collect();
    arms.sort_by(|a, b| b.z.total_cmp(&a.z));
    let bearing_deg = |v: Vec3| v.x.atan2(v.y).to_degrees().rem_euclid(360.0);
    Attitude {
        legs,
        tilt_deg: arms[0].z.clamp(-1.0, 1.0).acos().to_degrees(),
        bearing_deg: bearing_deg(arms[0]),
        second_bearing_deg: bearing_deg(arms[1]),
    }
}

impl WorksConfig {
    /// Day and hour at which each of so many blocks begins.
    fn starts(&self, count: usize) -> Result<Vec<(u32, f32)>, PlanError> {
        self.check()?;
        let hours = self.minutes_a_block / 60.0;
        let most = self.most_a_day.unwrap_or(u32::MAX) as usize;
        let mut starts: Vec<(u32, f32)> = Vec::with_capacity(count);
        let (mut day, mut idle) = (1, 0);
        while starts.len() < count {
            let before = starts.len();
            for [from, to] in self.workable(day) {
                let fit = ((to - from) / hours + 1e-4).floor().max(0.0) as usize;
                let room = (most - (starts.len() - before)).min(count - starts.len());
                starts.extend((0..fit.min(room)).map(|k| (day, from + k as f32 * hours)));
            }
            idle = if starts.len() == before { idle + 1 } else { 0 };
            if idle > PATIENCE_DAYS {
                return Err(PlanError::BadSetting {
                    key: "works.minutes_a_block",
                    value: self.minutes_a_block,
                    why: "no tide within working hours is that long; give longer hours or tides",
                });
            }
            day += 1;
        }
        Ok(starts)
    }

    /// Parts of the working hours of a day in which the tide lets one work, in order.
    fn workable(&self, day: u32) -> Vec<[f32; 2]> {
        let [open, close] = self.hours;
        if self.tides.is_empty() {
            return vec![[open, close]];
        }
        let later_h = (day - 1) as f32 * self.tide_shift_minutes / 60.0;
        let mut parts: Vec<[f32; 2]> = Vec::new();
        for [from, to] in &self.tides {
            let start = (from + later_h).rem_euclid(DAY_H);
            let end = start + (to - from);
            // One over midnight reaches into the morning as well.
            for wrapped in [0.0, -DAY_H] {
                let part = [(start + wrapped).max(open), (end + wrapped).min(close)];
                if part[0] < part[1] {
                    parts.push(part);
                }
            }
        }
        parts.sort_by(|a, b| a[0].total_cmp(&b[0]));
        // Tides that overlap are one.
        let mut joined: Vec<[f32; 2]> = Vec::new();
        for part in parts {
            match joined.last_mut() {
                Some(last) if part[0] <= last[1] => last[1] = last[1].max(part[1]),
                _ => joined.push(part),
            }
        }
        joined
    }

    fn check(&self) -> Result<(), PlanError> {
        let bad = |key, value, why| Err(PlanError::BadSetting { key, value, why });
        let [open, close] = self.hours;
        if !(self.minutes_a_block > 0.0 && self.minutes_a_block.is_finite()) {
            return bad("works.minutes_a_block", self.minutes_a_block, "it must be above 0");
        }
        if !(0.0 <= open && open < close && close <= DAY_H) {
            return bad("works.hours", open, "give [from, to] within 0 and 24, from before to");
        }
        if self.most_a_day == Some(0) {
            return bad("works.most_a_day", 0.0, "it must be at least 1");
        }
        if let Some([from, _]) =
            self.tides.iter().find(|[from, to]| !(from < to && to - from <= DAY_H && *from >= 0.0))
        {
            return bad("works.tides", *from, "give [from, to] in hours, from before to");
        }
        if !self.tide_shift_minutes.is_finite() {
            return bad("works.tide_shift_minutes", self.tide_shift_minutes, "it must be a number");
        }
        if self.minutes_a_block / 60.0 > close - open {
            let why = "a block takes longer than the working hours of a day";
            return bad("works.minutes_a_block", self.minutes_a_block, why);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use geom::Quat;

    #[test]
    fn blocks_follow_hours_rate_and_tides() {
        let day = WorksConfig { minutes_a_block: 60.0, hours: [8.0, 12.0], ..Default::default() };
        let starts = day.starts(6).unwrap();
        assert_eq!(starts[3], (1, 11.0));
        assert_eq!(starts[4], (2, 8.0));
        let slow = WorksConfig { most_a_day: Some(2), ..day.clone() };
        assert_eq!(slow.starts(5).unwrap()[4], (3, 8.0));
        // 23:00 to 02:00 and 9:00 to 10:30 on the first day, an hour later on the second.
        let tide = WorksConfig {
            hours: [0.0, 24.0],
            tides: vec![[9.0, 10.5], [23.0, 26.0]],
            tide_shift_minutes: 60.0,
            ..day.clone()
        };
        let starts = tide.starts(6).unwrap();
        assert_eq!(starts[..4], [(1, 0.0), (1, 1.0), (1, 9.0), (1, 23.0)]);
        assert_eq!(starts[4..], [(2, 0.0), (2, 1.0)]);
    }

    #[test]
    fn hours_that_cannot_be_are_named() {
        let said = |works: WorksConfig| works.starts(3).unwrap_err().to_string();
        let day = WorksConfig::default;
        assert!(said(WorksConfig { minutes_a_block: 0.0, ..day() }).contains("minutes_a_block"));
        assert!(said(WorksConfig { hours: [17.0, 7.0], ..day() }).contains("works.hours"));
        assert!(said(WorksConfig { minutes_a_block: 900.0, ..day() }).contains("longer than"));
        assert!(said(WorksConfig { most_a_day: Some(0), ..day() }).contains("most_a_day"));
        let short = WorksConfig { tides: vec![[8.0, 8.1]], ..day() };
        assert!(said(short).contains("no tide"), "a tide of six minutes");
    }

    #[test]
    fn the_sheet_says_which_leg_is_up() {
        let shape = scene::Shape::Tetrapod { size: 2.0 };
        let block = blocks::shape_model("t", shape, 2300.0).unwrap();
        let middle = |c: &[Vec3]| c.iter().sum::<Vec3>() / c.len() as f32 - block.centre;
        let leg = middle(&block.parts[0].corners).normalize();
        let upright = Quat::from_rotation_arc(leg, Vec3::Z);
        let standing = attitude(&block, &Pose::from_parts(Vec3::ZERO, upright));
        assert!(standing.legs && standing.tilt_deg < 1.0, "{standing:?}");
        // Leaned 20° to the east.
        let leaned = Quat::from_rotation_y(20.0_f32.to_radians()) * upright;
        let found = attitude(&block, &Pose::from_parts(Vec3::ZERO, leaned));
        assert!((found.tilt_deg - 20.0).abs() < 1.0, "{found:?}");
        assert!((found.bearing_deg - 90.0).abs() < 2.0, "{found:?}");
        let cube = blocks::shape_model("c", scene::Shape::Cube { size: 1.0 }, 2300.0).unwrap();
        let flat = attitude(&cube, &Pose::IDENTITY);
        assert!(!flat.legs && flat.tilt_deg < 0.1, "{flat:?}");
    }
}
