//! Which point belongs to which block, before anybody knows its pose.

use geom::{PointCloud, Vec3};
use serde::{Deserialize, Serialize};

/// Number of an instance; 0 in a label column means *none*.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct InstanceId(pub u32);

/// A cloud with the instance of each point (0 = none).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LabelledCloud {
    /// Points.
    pub cloud: PointCloud,
    /// As long as the cloud.
    pub instance: Vec<u32>,
}

/// A place where the network expects the centre of a block. There are about two per block; the pose stage accepts or rejects.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CentreHypothesis {
    /// Expected centre of mass, local frame.
    pub centre: Vec3,
    /// Confidence in (0, 1].
    pub score: f32,
    /// Indices into the survey's cloud of the points that voted here, ascending.
    pub points: Vec<u32>,
}

/// What segmentation hands on: every input point comes back with a label.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Segmentation {
    /// Instance of each point, 0 = none; `n` here is hypothesis `n − 1`.
    pub instance: Vec<u32>,
    /// Confidence of each point's label, in [0, 1].
    pub confidence: Vec<f32>,
    /// Over-complete list of centres; those that became instances come first, in instance order.
    pub hypotheses: Vec<CentreHypothesis>,
    /// How many hypotheses are instances.
    pub instances: usize,
}

impl Segmentation {
    /// One that knows nothing of so many points.
    pub fn of_nothing(points: usize) -> Self {
        Self { instance: vec![0; points], confidence: vec![0.0; points], ..Self::default() }
    }
}
