//! What a STORM.toml or WORKS.toml says.

use crate::SynthError;
use crate::sensor::Sensor;
use serde::{Deserialize, Serialize};

/// What happens between two surveys.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum Then {
    /// Waves.
    Storm(Storm),
    /// A crane builds a plan.
    Works(Works),
}

/// Waves: shares are of all blocks; each block suffers one thing at most.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Storm {
    /// Share of the blocks that are thrown.
    pub kicked: f32,
    /// How far they would slide on a level bed, in block lengths: least and most.
    pub kick_blocks: [f32; 2],
    /// Share that is turned about its centre.
    pub turned: f32,
    /// By how much, degrees: least and most.
    pub turn_deg: [f32; 2],
    /// Share that is taken away.
    pub missing: f32,
    /// Share that loses the end of a leg.
    pub broken: f32,
    /// How much of the leg (from the block's centre to its tip): least and most.
    pub broken_leg: [f32; 2],
    /// Share that is turned by a rotation that maps it onto itself.
    pub rolled: f32,
    /// Blocks that come from elsewhere, as a share of those that were there.
    pub added: f32,
    /// A hollow in the bed with the blocks on it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sinking: Option<Sinking>,
    /// Error of the second survey's datum.
    pub datum: Datum,
    /// Sensor of the second survey; the recipe's when left out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sensor: Option<Sensor>,
    /// Points per square metre of the second survey; the recipe's when left out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub density_per_m2: Option<f32>,
}

impl Default for Storm {
    fn default() -> Self {
        Self {
            kicked: 0.05,
            kick_blocks: [0.1, 0.8],
            turned: 0.05,
            turn_deg: [5.0, 30.0],
            missing: 0.04,
            broken: 0.04,
            broken_leg: [0.25, 0.6],
            rolled: 0.02,
            added: 0.03,
            sinking: None,
            datum: Datum::default(),
            sensor: None,
            density_per_m2: None,
        }
    }
}

/// A round hollow: `depth_m` in its middle, nothing from `radius_m` on.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sinking {
    /// Middle, scene coordinates.
    pub middle_m: [f32; 2],
    /// Radius.
    pub radius_m: f32,
    /// Depth in the middle.
    pub depth_m: f32,
    /// Share of the radius that goes down as one.
    #[serde(default)]
    pub flat: f32,
}

impl Sinking {
    /// How far the bed goes down at a place.
    pub fn depth_at_m(&self, x: f32, y: f32) -> f32 {
        let r = (x - self.middle_m[0]).hypot(y - self.middle_m[1]) / self.radius_m;
        let u = ((r - self.flat) / (1.0 - self.flat)).clamp(0.0, 1.0);
        self.depth_m * 0.5 * (1.0 + (std::f32::consts::PI * u).cos())
    }
}

/// An error of a survey's coordinates: a point p is measured at scale · turn · p + shift.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Datum {
    /// East, north, up.
    pub shift_m: [f32; 3],
    /// Turn about the vertical.
    pub yaw_deg: f32,
    /// Tilt about east and about north.
    pub tilt_deg: [f32; 2],
    /// Scale, parts in a million.
    pub scale_ppm: f32,
}

/// A crane builds a plan.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Works {
    /// Standard deviation of where the crane lets go, along each horizontal axis.
    pub crane_shift_sd_m: f32,
    /// Standard deviation of the attitude, about each axis.
    pub crane_turn_sd_deg: f32,
    /// Share of the planned blocks that is not placed.
    pub skipped: f32,
    /// Blocks that nobody planned, as a share of those planned.
    pub extra: f32,
    /// Error of the second survey's datum.
    pub datum: Datum,
    /// Sensor of the second survey; the recipe's when left out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sensor: Option<Sensor>,
    /// Points per square metre of the second survey; the recipe's when left out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub density_per_m2: Option<f32>,
}

impl Default for Works {
    fn default() -> Self {
        Self {
            crane_shift_sd_m: 0.15,
            crane_turn_sd_deg: 10.0,
            skipped: 0.05,
            extra: 0.03,
            datum: Datum::default(),
            sensor: None,
            density_per_m2: None,
        }
    }
}

impl Then {
    /// Reads a STORM.toml or WORKS.toml; unknown keys are errors with their line.
    pub fn parse(text: &str) -> Result<Self, SynthError> {
        toml::from_str(text)
            .map_err(|e| SynthError::Happening { message: e.to_string().trim_end().to_owned() })
    }

    /// Sensor and density of the second survey, where they differ from the first's.
    pub(super) fn survey(&self) -> (Option<&Sensor>, Option<f32>) {
        match self {
            Self::Storm(s) => (s.sensor.as_ref(), s.density_per_m2),
            Self::Works(w) => (w.sensor.as_ref(), w.density_per_m2),
        }
    }

    /// Error of the second survey's datum.
    pub(super) fn datum(&self) -> &Datum {
        match self {
            Self::Storm(s) => &s.datum,
            Self::Works(w) => &w.datum,
        }
    }

    /// Checks every range.
    pub fn check(&self) -> Result<(), SynthError> {
        let within = |key, value: f32, low: f32, high: f32, why| {
            if (low..=high).contains(&value) {
                Ok(())
            } else {
                Err(SynthError::BadHappening { key, value: value.into(), why })
            }
        };
        let range = |key, [low, high]: [f32; 2], most: f32, why| {
            within(key, low, 0.0, most, why)?;
            within(key, high, low, most, why)
        };
        let datum = self.datum();
        for shift in datum.shift_m {
            within("datum.shift_m", shift, -1000.0, 1000.0, "-1000 to 1000 m")?;
        }
        for turn in [datum.yaw_deg, datum.tilt_deg[0], datum.tilt_deg[1]] {
            within("datum.yaw_deg and datum.tilt_deg", turn, -45.0, 45.0, "-45 to 45 degrees")?;
        }
        within("datum.scale_ppm", datum.scale_ppm, -1e5, 1e5, "-100000 to 100000")?;
        match self {
            Self::Storm(s) => {
                let shares = [
                    ("kicked", s.kicked),
                    ("turned", s.turned),
                    ("missing", s.missing),
                    ("broken", s.broken),
                    ("rolled", s.rolled),
                    ("added", s.added),
                ];
                for (key, share) in shares {
                    within(key, share, 0.0, 1.0, "a share, 0 to 1")?;
                }
                let all = s.kicked + s.turned + s.missing + s.broken + s.rolled;
                let why = "each block suffers one thing at most: the shares add up to 1 at most";
                within("kicked + turned + missing + broken + rolled", all, 0.0, 1.0, why)?;
                range("kick_blocks", s.kick_blocks, 20.0, "least and most, 0 to 20 block lengths")?;
                range("turn_deg", s.turn_deg, 180.0, "least and most, 0 to 180 degrees")?;
                range("broken_leg", s.broken_leg, 0.9, "least and most, 0 to 0.9 of the leg")?;
                let Some(sinking) = s.sinking else { return Ok(()) };
                within("sinking.radius_m", sinking.radius_m, 1e-3, 1e5, "above 0")?;
                within("sinking.depth_m", sinking.depth_m, 0.0, 100.0, "0 to 100 m")?;
                within("sinking.flat", sinking.flat, 0.0, 0.95, "a share, 0 to 0.95")
            }
            Self::Works(w) => {
                within("crane_shift_sd_m", w.crane_shift_sd_m, 0.0, 10.0, "0 to 10 m")?;
                within("crane_turn_sd_deg", w.crane_turn_sd_deg, 0.0, 90.0, "0 to 90 degrees")?;
                within("skipped", w.skipped, 0.0, 1.0, "a share, 0 to 1")?;
                within("extra", w.extra, 0.0, 10.0, "0 to 10")
            }
        }
    }
}
