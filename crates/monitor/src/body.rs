//! Blocks of both epochs in one frame, and how two of them differ.

use crate::dense::{Matrix, sum, zeros};
use crate::motion::Motion;
use crate::{Epoch, SeenBlock};
use geom::{DQuat, DVec3, Pose};
use scene::{BlockModel, Catalog, ModelId};

/// Standard deviation assumed of a pose whose covariance nobody states, in block lengths and radians.
const UNKNOWN: (f64, f64) = (0.05, 0.09);
/// No pose is known better than this, in block lengths and radians.
const FLOOR: f64 = 1e-4;
/// Standard deviation about the axis of a body of revolution, whose turn nobody can see.
const FREE_TURN_RAD: f64 = 10.0;

/// A block by the place of its centre and its rotation, frame of the earlier epoch.
#[derive(Clone, Debug)]
pub(crate) struct Body {
    /// Place in its epoch's list.
    pub index: usize,
    pub model: ModelId,
    pub type_judged: bool,
    pub centre: DVec3,
    pub rotation: DQuat,
    pub covariance: Matrix<6>,
    pub confidence: f64,
}

impl Body {
    /// Blocks of an epoch, shifted by `origin` (its frame's origin less the earlier one's).
    pub fn all(epoch: &Epoch, catalog: &Catalog, origin: DVec3) -> Vec<Self> {
        epoch.blocks.iter().enumerate().map(|(i, b)| Self::of(i, b, catalog, origin)).collect()
    }

    fn of(index: usize, block: &SeenBlock, catalog: &Catalog, origin: DVec3) -> Self {
        let model = catalog.get(block.model);
        Self {
            index,
            model: block.model,
            type_judged: block.type_judged,
            centre: (block.site_from_block * model.centre).as_dvec3() + origin,
            rotation: block.site_from_block.rotation.as_dquat().normalize(),
            covariance: covariance(block, model),
            confidence: block.confidence.into(),
        }
    }

    /// The body where the motion takes it.
    pub fn moved(&self, motion: &Motion) -> Self {
        Self {
            centre: motion.apply(self.centre),
            rotation: (motion.rotation() * self.rotation).normalize(),
            ..self.clone()
        }
    }

    /// The pose of its mesh.
    pub fn pose(&self, model: &BlockModel) -> Pose {
        let rotation = self.rotation.as_quat();
        Pose::from_parts(self.centre.as_vec3() - rotation * model.centre, rotation)
    }
}

fn covariance(block: &SeenBlock, model: &BlockModel) -> Matrix<6> {
    let size = f64::from(model.d_box_m);
    let mut out = zeros::<6>();
    let stated = block
        .covariance
        .filter(|c| c.iter().all(|v| v.is_finite()) && (0..6).all(|i| c[7 * i] > 0.0));
    for i in 0..6 {
        let unit = if i < 3 { size } else { 1.0 };
        match &stated {
            Some(c) => {
                for k in 0..6 {
                    // Symmetric to the last bit, or its factor is not.
                    out[i][k] = 0.5 * f64::from(c[6 * i + k] + c[6 * k + i]);
                }
                out[i][i] += (FLOOR * unit).powi(2);
            }
            None => {
                let sd = if i < 3 { UNKNOWN.0 * size } else { UNKNOWN.1 };
                out[i][i] = sd * sd;
            }
        }
    }
    out
}

/// What two bodies differ by.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Difference {
    /// Later less earlier: shift of the centre and the least turn over the symmetry, rotation vector.
    pub d: [f64; 6],
    /// Covariance of both poses together.
    pub covariance: Matrix<6>,
}

impl Difference {
    pub fn shift(&self) -> DVec3 {
        DVec3::new(self.d[0], self.d[1], self.d[2])
    }

    pub fn turn(&self) -> DVec3 {
        DVec3::new(self.d[3], self.d[4], self.d[5])
    }
}

/// Later less earlier, the turn the least over the block's symmetry.
pub(crate) fn difference(earlier: &Body, later: &Body, catalog: &Catalog) -> Difference {
    let symmetry = &catalog.get(earlier.model).symmetry;
    let back = earlier.rotation.inverse();
    let shift = later.centre - earlier.centre;
    let mut covariance = sum(&earlier.covariance, &later.covariance);
    let turn = match symmetry.axis() {
        None => symmetry
            .rotations()
            .iter()
            .map(|g| log(later.rotation * g.as_dquat() * back))
            .min_by(|a, b| a.length_squared().total_cmp(&b.length_squared()))
            .expect("a group has at least the identity"),
        Some(axis) => {
            let axis = axis.as_dvec3();
            let from = earlier.rotation * axis;
            let turn = symmetry
                .rotations()
                .iter()
                .map(|g| {
                    log(DQuat::from_rotation_arc(from, later.rotation * (g.as_dquat() * axis)))
                })
                .min_by(|a, b| a.length_squared().total_cmp(&b.length_squared()))
                .expect("a group has at least the identity");
            for i in 0..3 {
                for k in 0..3 {
                    covariance[3 + i][3 + k] += FREE_TURN_RAD * FREE_TURN_RAD * from[i] * from[k];
                }
            }
            turn
        }
    };
    Difference { d: [shift.x, shift.y, shift.z, turn.x, turn.y, turn.z], covariance }
}

/// Angles of every reading of the turn over the symmetry, ascending, radians.
pub(crate) fn readings_rad(earlier: &Body, later: &Body, catalog: &Catalog) -> Vec<f64> {
    let symmetry = &catalog.get(earlier.model).symmetry;
    let back = earlier.rotation.inverse();
    let mut angles: Vec<f64> = symmetry
        .rotations()
        .iter()
        .map(|g| log(later.rotation * g.as_dquat() * back).length())
        .collect();
    angles.sort_by(f64::total_cmp);
    angles
}

/// Rotation vector, angle in [0, π].
fn log(q: DQuat) -> DVec3 {
    let q = if q.w < 0.0 { -q } else { q };
    let v = DVec3::new(q.x, q.y, q.z);
    let s = v.length();
    if s < 1e-12 { 2.0 * v } else { v * (2.0 * s.atan2(q.w) / s) }
}
