//! The sensors: how a pile becomes a cloud with labels.
//!
//! A label is the block whose surface made the point; it is decided while the point is made, never afterwards.

mod depth_camera;
mod gaussian;
mod mbes;
mod scanner;
mod uav;
mod views;

pub use depth_camera::DepthCamera;
pub use gaussian::Gaussian;
pub use mbes::Mbes;
pub use scanner::{Scanner, Stand};
pub use uav::Uav;
pub use views::{Ring, Waterline};

use crate::SynthError;
use crate::recipe::{Resolved, Visibility};
use crate::targets::Targets;
use geom::{SeedTree, Vec3};
use scene::SensorKind;
use serde::{Deserialize, Serialize};

/// A sensor and its parameters.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum Sensor {
    /// White noise on the visible surface: the thesis' model.
    Gaussian(Gaussian),
    /// Photogrammetry from a drone.
    Uav(Uav),
    /// Multibeam echo sounder.
    Mbes(Mbes),
    /// Depth camera above a bin.
    DepthCamera(DepthCamera),
    /// Laser scanner beside the pile.
    Scanner(Scanner),
}

/// What a sensor measured.
#[derive(Clone, Debug, Default)]
pub(crate) struct Scan {
    /// Points and the block of each (0 = bed or artefact).
    pub points: Vec<(Vec3, u32)>,
    /// Pass of each point, from 1; empty for sensors without passes.
    pub line: Vec<u16>,
    /// Occlusion of each block (Eq. 3.14).
    pub occlusion: Vec<f32>,
    /// Where the sensor was.
    pub positions: Vec<Vec3>,
}

impl Sensor {
    /// Checks every range.
    pub fn check(&self) -> Result<(), SynthError> {
        match self {
            Self::Gaussian(s) => s.check(),
            Self::Uav(s) => s.check(),
            Self::Mbes(s) => s.check(),
            Self::DepthCamera(s) => s.check(),
            Self::Scanner(s) => s.check(),
        }
    }

    /// How later stages should take the points.
    pub fn kind(&self) -> SensorKind {
        match self {
            Self::Gaussian(s) => s.measured_as,
            Self::Uav(_) | Self::Scanner(_) => SensorKind::Uav,
            Self::Mbes(_) => SensorKind::Mbes,
            Self::DepthCamera(_) => SensorKind::DepthCamera,
        }
    }

    pub(crate) fn scan(
        &self,
        targets: &Targets,
        resolved: &Resolved,
        visibility: Visibility,
        seed: SeedTree,
    ) -> Result<Scan, SynthError> {
        match self {
            Self::Gaussian(s) => s.scan(targets, resolved, visibility, seed),
            Self::Uav(s) => s.scan(targets, resolved, visibility, seed),
            Self::Mbes(s) => s.scan(targets, resolved, seed),
            Self::DepthCamera(s) => s.scan(targets, resolved, seed),
            Self::Scanner(s) => s.scan(targets, resolved, seed),
        }
    }
}

/// A range check that names the key.
pub(crate) fn within(
    key: &'static str,
    value: f32,
    [low, high]: [f32; 2],
    why: &'static str,
) -> Result<(), SynthError> {
    if (low..=high).contains(&value) {
        Ok(())
    } else {
        Err(SynthError::BadValue { key, value: value.into(), why })
    }
}
