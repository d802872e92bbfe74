//! A block the program found, with what it says of it and what it leaves open.

use crate::{BlockModel, Catalog, InstanceId, ModelId, PlacedBlock, PosedModel};
use geom::{Pose, Vec3};
use serde::{Deserialize, Serialize};

/// One block, or one place that may be one.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Recognised {
    /// Number of the block, from 1 in the result's order.
    pub block: InstanceId,
    /// Indices of the survey points it explains, ascending.
    pub points: Vec<u32>,
    /// What is said of it.
    pub verdict: Verdict,
}

/// What the pose stage, a reviewer or a file says of a block.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Verdict {
    /// Pose and type are stated, and the block counts.
    Stated(Fit),
    /// Too little evidence for a statement; reported, never counted.
    NotJudged(Guess),
}

/// What is known of a block that is not judged.
#[expect(clippy::large_enum_variant, reason = "blocks are few, and a place alone is the exception")]
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Guess {
    /// The likeliest pose and type.
    Fit(Fit),
    /// No type fits; a block's centre may be here, local frame, metres.
    Place(Vec3),
}

/// A pose with its type and how sure one is. What nobody worked out or wrote down is `None`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Fit {
    /// Type.
    pub model: ModelId,
    /// Pose: block (mesh file, metres) to local frame; symmetry-canonical.
    pub site_from_block: Pose,
    /// Whether the points tell this type from the others; where not, `model` is only the likeliest.
    pub type_judged: bool,
    /// Calibrated probability that what is stated is right, in [0, 1]: the pose, and the type where that is judged.
    pub confidence: Option<f32>,
    /// Mean nearest distance scene → model, metres (Eq. 3.10).
    pub fitness_m: Option<f32>,
    /// Second-best type and its fitness; `None` with one model.
    pub runner_up: Option<(ModelId, f32)>,
    /// 1 − visible model points / all model points (Eq. 3.14).
    pub occlusion: Option<f32>,
    /// How well the points hold the pose.
    pub covariance: Option<Covariance>,
    /// What was seen of its legs; `None` for compact blocks and where nobody looked.
    #[serde(default)]
    pub legs: Option<Legs>,
}

/// What was seen of the legs of a block.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Legs {
    /// Legs whose surface was measured.
    pub seen: u8,
    /// Legs that lie behind something, or where nothing was measured.
    pub hidden: u8,
    /// Legs that a sensor looked through: broken off, most likely.
    pub missing: u8,
}

/// Covariance of a pose: (tx, ty, tz, rx, ry, rz), m and rad, row-major 6×6, symmetric; a shift of the block's centre along
/// the site's axes and a small turn about them.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Vec<f32>", into = "Vec<f32>")]
pub struct Covariance([f32; 36]);

impl Recognised {
    /// A stated block.
    pub fn of_fit(block: InstanceId, points: Vec<u32>, fit: Fit) -> Self {
        Self { block, points, verdict: Verdict::Stated(fit) }
    }

    /// Pose and type, where they are stated.
    pub fn stated(&self) -> Option<&Fit> {
        match &self.verdict {
            Verdict::Stated(fit) => Some(fit),
            Verdict::NotJudged(_) => None,
        }
    }

    /// Whether pose and type are stated.
    pub fn is_stated(&self) -> bool {
        self.stated().is_some()
    }

    /// The stated or, where nothing is, the likeliest pose and type.
    pub fn fit(&self) -> Option<&Fit> {
        match &self.verdict {
            Verdict::Stated(fit) | Verdict::NotJudged(Guess::Fit(fit)) => Some(fit),
            Verdict::NotJudged(Guess::Place(_)) => None,
        }
    }

    /// The block as a part of a pile, where it is stated.
    pub fn placed(&self) -> Option<PlacedBlock> {
        let Fit { model, site_from_block, .. } = *self.stated()?;
        Some(PlacedBlock { block: self.block, model, site_from_block })
    }

    /// Where its centre of mass is, or may be, local frame.
    pub fn centre(&self, catalog: &Catalog) -> Vec3 {
        match &self.verdict {
            Verdict::Stated(fit) | Verdict::NotJudged(Guess::Fit(fit)) => {
                fit.centre(catalog.get(fit.model))
            }
            Verdict::NotJudged(Guess::Place(place)) => *place,
        }
    }
}

/// Those that are stated, with their numbers.
pub fn stated(blocks: &[Recognised]) -> impl Iterator<Item = (&Recognised, &Fit)> {
    blocks.iter().filter_map(|block| Some((block, block.stated()?)))
}

impl Fit {
    /// A type in a pose of which nothing else is known.
    pub fn of_pose(model: ModelId, site_from_block: Pose) -> Self {
        Self {
            model,
            site_from_block,
            type_judged: true,
            confidence: None,
            fitness_m: None,
            runner_up: None,
            occlusion: None,
            covariance: None,
            legs: None,
        }
    }

    /// With its type's model.
    pub fn posed<'a>(&self, catalog: &'a Catalog) -> PosedModel<'a> {
        PosedModel::new(catalog.get(self.model), self.site_from_block)
    }

    /// Centre of mass in the local frame; `model` is its type's.
    pub fn centre(&self, model: &BlockModel) -> Vec3 {
        self.site_from_block * model.centre
    }
}

impl Covariance {
    /// From a matrix; its upper triangle counts, the lower mirrors it.
    pub fn new(mut row_major: [f32; 36]) -> Self {
        for row in 0..6 {
            for column in 0..row {
                row_major[6 * row + column] = row_major[6 * column + row];
            }
        }
        Self(row_major)
    }

    /// The matrix, row-major.
    pub fn row_major(&self) -> &[f32; 36] {
        &self.0
    }

    /// One entry.
    pub fn at(&self, row: usize, column: usize) -> f32 {
        self.0[6 * row + column]
    }

    /// Standard deviation along or about one axis, metres or radians.
    pub fn sd(&self, axis: usize) -> f32 {
        self.at(axis, axis).max(0.0).sqrt()
    }
}

impl From<Covariance> for Vec<f32> {
    fn from(covariance: Covariance) -> Self {
        covariance.0.to_vec()
    }
}

impl TryFrom<Vec<f32>> for Covariance {
    type Error = String;

    fn try_from(values: Vec<f32>) -> Result<Self, String> {
        <[f32; 36]>::try_from(values)
            .map(Self::new)
            .map_err(|v| format!("a covariance has 36 numbers, not {}", v.len()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_covariance_is_symmetric_and_comes_back_whole() {
        let mut raw = [0.0; 36];
        raw.iter_mut().enumerate().for_each(|(i, v)| *v = i as f32);
        let covariance = Covariance::new(raw);
        assert!((0..6).all(|i| (0..6).all(|k| covariance.at(i, k) == covariance.at(k, i))));
        assert_eq!(Covariance::try_from(Vec::from(covariance)), Ok(covariance));
        assert!(Covariance::try_from(vec![0.0; 35]).is_err());
    }

    #[test]
    fn what_is_not_judged_counts_nowhere() {
        let fit = Fit::of_pose(ModelId(0), Pose::IDENTITY);
        let block = |verdict| Recognised { block: InstanceId(1), points: Vec::new(), verdict };
        let guess = block(Verdict::NotJudged(Guess::Fit(fit.clone())));
        assert!(guess.stated().is_none() && guess.fit().is_some() && guess.placed().is_none());
        let place = block(Verdict::NotJudged(Guess::Place(Vec3::ONE)));
        assert!(place.stated().is_none() && place.fit().is_none() && place.placed().is_none());
        assert_eq!(place.centre(&Catalog::new(Vec::new())), Vec3::ONE);
        let all = [guess, place, Recognised::of_fit(InstanceId(2), Vec::new(), fit)];
        assert_eq!(stated(&all).map(|(b, _)| b.block.0).collect::<Vec<_>>(), [2]);
    }
}
