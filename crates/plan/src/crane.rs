//! What the crane can do: which places it reaches with this load, and in which order it works.

use crate::PlanError;
use geom::Vec2;
use scene::SiteFrame;
use serde::{Deserialize, Serialize};

/// A crane with one or more places to stand.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CraneConfig {
    /// Where it stands, site coordinates (east, north).
    pub stand: Vec<[f64; 2]>,
    /// Rated load: rows of radius (m) and capacity (kg), radii ascending.
    pub capacity: Vec<[f32; 2]>,
}

/// The crane for one load, in the local frame.
#[derive(Clone, Debug)]
pub(crate) struct Reach {
    stands: Vec<Vec2>,
    radius_m: f32,
}

impl CraneConfig {
    /// How far this load can be carried from each stand. Between two rows the smaller capacity counts.
    pub(crate) fn reach(&self, mass_kg: f32, frame: &SiteFrame) -> Result<Reach, PlanError> {
        let bad = |key, value, why| Err(PlanError::BadSetting { key, value, why });
        if self.stand.is_empty() {
            return bad("crane.stand", 0.0, "give at least one place [east, north] to stand");
        }
        if self.capacity.is_empty() {
            return bad("crane.capacity", 0.0, "give at least one row [radius_m, capacity_kg]");
        }
        if let Some(w) = self.capacity.windows(2).find(|w| !(w[0][0] < w[1][0])) {
            return bad("crane.capacity", w[1][0], "radii must ascend");
        }
        let carried = self.capacity.iter().take_while(|row| row[1] >= mass_kg).last();
        let Some(row) = carried else {
            return bad(
                "crane.capacity",
                self.capacity[0][1],
                "the crane cannot lift this block at any radius",
            );
        };
        let local = |p: &[f64; 2]| {
            Vec2::new((p[0] - frame.origin[0]) as f32, (p[1] - frame.origin[1]) as f32)
        };
        Ok(Reach { stands: self.stand.iter().map(local).collect(), radius_m: row[0] })
    }
}

impl Reach {
    /// Distance to the nearest stand.
    pub fn distance_m(&self, place: Vec2) -> f32 {
        self.stands.iter().map(|s| (*s - place).length()).fold(f32::INFINITY, f32::min)
    }

    /// Whether a block can be set down there.
    pub fn covers(&self, place: Vec2) -> bool {
        self.distance_m(place) <= self.radius_m
    }
}
