//! An epoch: one survey of the site with the blocks recognised in it.

use geom::Pose;
use scene::{ModelId, Recognised, Survey};

/// One survey and what was recognised in it.
#[derive(Clone, Debug)]
pub struct Epoch<'a> {
    /// Points, sensor and frame.
    pub survey: &'a Survey,
    /// Blocks whose pose is stated.
    pub blocks: Vec<SeenBlock>,
}

/// A block with a stated pose in one epoch.
#[derive(Clone, Debug, PartialEq)]
pub struct SeenBlock {
    /// Number in its epoch.
    pub id: u32,
    /// Type.
    pub model: ModelId,
    /// Whether the points tell the type, or `model` is only the likeliest.
    pub type_judged: bool,
    /// Block to the local frame of its survey.
    pub site_from_block: Pose,
    /// (tx, ty, tz, rx, ry, rz) about the block's centre, site axes, m and rad, row-major; `None`: unknown.
    pub covariance: Option<[f32; 36]>,
    /// Probability that pose (and type, where judged) are right.
    pub confidence: f32,
    /// Share of the surface that is not seen.
    pub occlusion: f32,
    /// Indices of the survey's points that it explains; may be empty.
    pub points: Vec<u32>,
}

impl SeenBlock {
    /// A recognised block; `None` where nothing is stated.
    pub fn of(block: &Recognised) -> Option<Self> {
        let fit = block.stated()?;
        Some(Self {
            id: block.block.0,
            model: fit.model,
            type_judged: fit.type_judged,
            site_from_block: fit.site_from_block,
            covariance: fit.covariance.map(|c| *c.row_major()),
            // What nobody stated a doubt of, a reviewer's block, is certain.
            confidence: fit.confidence.unwrap_or(1.0),
            occlusion: fit.occlusion.unwrap_or(0.0),
            points: block.points.clone(),
        })
    }
}

impl<'a> Epoch<'a> {
    /// An epoch of the blocks whose pose is stated.
    pub fn of(survey: &'a Survey, recognised: &[Recognised]) -> Self {
        Self { survey, blocks: recognised.iter().filter_map(SeenBlock::of).collect() }
    }
}
