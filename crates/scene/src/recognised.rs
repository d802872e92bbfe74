//! A block the program found.

use crate::{InstanceId, ModelId};
use geom::Pose;
use serde::{Deserialize, Deserializer, Serialize, Serializer, de};

/// What the pose stage says of a segment.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Judgement {
    /// Pose and type are stated.
    Accepted,
    /// Too little evidence for a statement; reported, never counted.
    NotJudged,
}

/// One block with pose, type and how sure the program is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Recognised {
    /// Number of the block, from 1 in the result's order.
    pub block: InstanceId,
    /// Type.
    pub model: ModelId,
    /// Pose: block (mesh file, metres) to local frame; symmetry-canonical.
    pub site_from_block: Pose,
    /// Accepted or not judged.
    pub judgement: Judgement,
    /// Whether the points tell this type from the others; where not, `model` is only the likeliest.
    #[serde(default = "told")]
    pub type_judged: bool,
    /// Calibrated probability that what is stated is right, in [0, 1]: the pose, and the type where that is judged.
    pub confidence: f32,
    /// Mean nearest distance scene → model, metres (Eq. 3.10).
    pub fitness_m: f32,
    /// Second-best type and its fitness; `None` with one model.
    pub runner_up: Option<(ModelId, f32)>,
    /// 1 − visible model points / all model points (Eq. 3.14).
    pub occlusion: f32,
    /// Indices of the survey points it explains, ascending.
    pub points: Vec<u32>,
    /// Covariance of the pose from the fit: (tx, ty, tz, rx, ry, rz), m and rad, row-major 6×6; about the block's centre, site axes.
    #[serde(serialize_with = "write_matrix", deserialize_with = "read_matrix")]
    pub covariance: [f32; 36],
}

/// Results written before types could be left open state them all.
fn told() -> bool {
    true
}

/// Serde knows arrays of up to 32.
fn write_matrix<S: Serializer>(matrix: &[f32; 36], to: S) -> Result<S::Ok, S::Error> {
    matrix.as_slice().serialize(to)
}

fn read_matrix<'de, D: Deserializer<'de>>(from: D) -> Result<[f32; 36], D::Error> {
    let values = Vec::<f32>::deserialize(from)?;
    values.try_into().map_err(|v: Vec<f32>| de::Error::invalid_length(v.len(), &"36 numbers"))
}
