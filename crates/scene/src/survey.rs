//! Where the site is and what was measured there.

use geom::{DVec3, Plane, PointCloud, Vec3};
use serde::{Deserialize, Serialize};

/// Which way the axes of the survey's file run. Inside the program x is east and y north, always.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum AxisOrder {
    /// First column east, second north.
    #[default]
    EastNorth,
    /// First column north, second east (JGD2011 plane rectangular, as surveyors write it).
    NorthEast,
}

impl AxisOrder {
    /// A point of the survey's file as (east, north, up).
    pub fn east_north_up(self, p: DVec3) -> DVec3 {
        match self {
            Self::EastNorth => p,
            Self::NorthEast => DVec3::new(p.y, p.x, p.z),
        }
    }
}

/// The frame between local f32 metres and projected f64 coordinates (east, north, up).
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SiteFrame {
    /// Site coordinates of the local origin: east, north, up, metres.
    pub origin: [f64; 3],
    /// Coordinate reference system, e.g. `EPSG:6679`; empty when the data have none (a bin).
    pub crs: String,
    /// Vertical datum in words, e.g. `T.P. (JGD2011 vertical, EPSG:6695)`.
    pub vertical_datum: String,
}

impl SiteFrame {
    /// Local coordinates of a site point.
    pub fn local_from_site(&self, p: DVec3) -> Vec3 {
        (p - DVec3::from_array(self.origin)).as_vec3()
    }

    /// Site coordinates of a local point.
    pub fn site_from_local(&self, p: Vec3) -> DVec3 {
        p.as_dvec3() + DVec3::from_array(self.origin)
    }
}

/// How the points were measured; decides noise, shadows and the default sensor position.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SensorKind {
    /// Photogrammetry or lidar from the air.
    #[default]
    Uav,
    /// Multibeam echo sounder.
    Mbes,
    /// A depth camera above a bin.
    DepthCamera,
}

impl SensorKind {
    /// Standard deviation of a point, metres, for a block of the given size (a bin's parts are small).
    pub fn noise_sd_m(self, d_max_m: f32) -> f32 {
        match self {
            Self::Uav => 0.01,
            Self::Mbes => 0.03,
            Self::DepthCamera => 0.02 * d_max_m,
        }
    }
}

/// One cloud in the local frame with what is known of its making.
#[derive(Clone, Debug, Default)]
pub struct Survey {
    /// Points, local frame.
    pub cloud: PointCloud,
    /// The frame they are in.
    pub frame: SiteFrame,
    /// How they were measured.
    pub sensor: SensorKind,
    /// Sensor positions, local frame; empty when unknown (then: straight above).
    pub sensor_positions: Vec<Vec3>,
    /// Survey line (pass) of each point, 0 = unknown; empty when the file does not say. Lines have errors of their own.
    pub line: Vec<u16>,
    /// Planes that no block reaches through, normals towards the blocks, local frame: floor and walls of a bin.
    pub walls: Vec<Plane>,
}
