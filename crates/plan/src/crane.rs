//! What the crane can do: which places it reaches with this load, and in which order it works.

use crate::{PlanError, assortment::lies_in};
use geom::Vec2;
use scene::{BlockModel, SiteFrame};
use serde::{Deserialize, Serialize};

/// From hook to block, in block lengths, where nobody says.
const SLING: f32 = 1.5;

/// A crane with one or more places to stand.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CraneConfig {
    /// Where it stands, site coordinates (east, north).
    pub stand: Vec<[f64; 2]>,
    /// Rated load: rows of radius (m) and capacity (kg), radii ascending.
    pub capacity: Vec<[f32; 2]>,
    /// Highest level of the hook, in the site's datum; left out: never too low.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hook_level_m: Option<f64>,
    /// From hook to the block's centre of mass; left out: one and a half block lengths.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sling_m: Option<f32>,
}

/// The crane for one load, in the local frame.
#[derive(Clone, Debug)]
pub(crate) struct Reach {
    stands: Vec<Vec2>,
    radius_m: f32,
    /// Highest level, local frame, at which a block's centre of mass can be let go.
    highest_m: f32,
}

impl CraneConfig {
    /// Number, from 1, of the stand nearest to a place, and its distance.
    pub(crate) fn nearest_stand(&self, place: Vec2, frame: &SiteFrame) -> Option<(u32, f32)> {
        let away = |p: &[f64; 2]| {
            let stand = Vec2::new((p[0] - frame.origin[0]) as f32, (p[1] - frame.origin[1]) as f32);
            (stand - place).length()
        };
        let all = self.stand.iter().map(away).enumerate();
        all.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(i, m)| (i as u32 + 1, m))
    }

    /// How far this load can be carried from each stand. Between two rows the smaller capacity counts.
    pub(crate) fn reach(&self, block: &BlockModel, frame: &SiteFrame) -> Result<Reach, PlanError> {
        let (mass_kg, d_box_m) = (block.mass_kg(), block.d_box_m);
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
            let (name, most_kg) = (block.name.clone(), self.capacity[0][1]);
            return Err(PlanError::TooHeavy { name, mass_kg, most_kg });
        };
        let local = |p: &[f64; 2]| {
            Vec2::new((p[0] - frame.origin[0]) as f32, (p[1] - frame.origin[1]) as f32)
        };
        let sling_m = self.sling_m.unwrap_or(SLING * d_box_m);
        if !(sling_m >= 0.0 && sling_m.is_finite()) {
            return bad("crane.sling_m", sling_m, "it must not be negative");
        }
        let highest_m = match self.hook_level_m {
            Some(hook_m) if hook_m.is_finite() => (hook_m - frame.origin[2]) as f32 - sling_m,
            Some(hook_m) => return bad("crane.hook_level_m", hook_m as f32, "it must be a number"),
            None => f32::INFINITY,
        };
        Ok(Reach { stands: self.stand.iter().map(local).collect(), radius_m: row[0], highest_m })
    }
}

impl Reach {
    /// Highest level, local frame, at which a block's centre of mass can be let go; infinite without a hook's level.
    pub fn highest_m(&self) -> f32 {
        self.highest_m
    }

    /// Distance to the nearest stand.
    pub fn distance_m(&self, place: Vec2) -> f32 {
        self.stands.iter().map(|s| (*s - place).length()).fold(f32::INFINITY, f32::min)
    }

    /// How far this load can be carried from a stand.
    pub fn radius_m(&self) -> f32 {
        self.radius_m
    }

    /// Whether a block can be set down there.
    pub fn covers(&self, place: Vec2) -> bool {
        self.distance_m(place) <= self.radius_m
    }
}

/// Where a type may be set down.
#[derive(Clone, Debug, Default)]
pub(crate) struct Allowed {
    /// The crane with this load; `None`: everywhere.
    pub reach: Option<Reach>,
    /// Zones that ask for heavier blocks.
    pub closed: Vec<Vec<Vec2>>,
}

impl Allowed {
    /// Whether the crane gets there and the block is heavy enough for the place.
    pub fn covers(&self, place: Vec2) -> bool {
        self.within_reach(place) && self.heavy_enough(place)
    }

    /// Whether the crane gets there.
    pub fn within_reach(&self, place: Vec2) -> bool {
        self.reach.as_ref().is_none_or(|r| r.covers(place))
    }

    /// Whether the hook is high enough to let a block go with its centre of mass at this level, local frame.
    pub fn hook_high_enough(&self, level_m: f32) -> bool {
        self.reach.as_ref().is_none_or(|r| level_m <= r.highest_m())
    }

    /// Whether no zone asks for a heavier block.
    pub fn heavy_enough(&self, place: Vec2) -> bool {
        !self.closed.iter().any(|zone| lies_in(zone, place))
    }
}
