//! How far a network's answers lie from the best drops that generate-and-test found (Table 4.1).

use crate::model::Answer;
use crate::{GoodPose, PlacementModel, Sample};
use scene::SymmetryGroup;
use serde::{Deserialize, Serialize};

/// Errors against the best drop of each window, means over the windows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Errors {
    /// Windows.
    pub windows: usize,
    /// Rotation error of the surest answer modulo symmetry, radians.
    pub rotation_rad: f32,
    /// Displacement of the surest answer, block lengths.
    pub displacement: f32,
    /// The same of the answer nearest in rotation among all modes.
    pub nearest_rotation_rad: f32,
    /// Its displacement.
    pub nearest_displacement: f32,
}

/// How far each answer to a window lies from a pose, the surest first: rotation modulo symmetry (radians) and displacement
/// (block lengths). `depth` is the stored image; it is shown at each of the turns.
pub fn offsets(
    model: &PlacementModel,
    depth: &[f32],
    turns_rad: &[f32],
    pose: &GoodPose,
    symmetry: &SymmetryGroup,
) -> Vec<(f32, f32)> {
    let off = |a: Answer| {
        (symmetry.rotation_error_rad(a.rotation, pose.rotation), (a.centre - pose.centre).length())
    };
    model.answers(depth, turns_rad).into_iter().map(off).collect()
}

/// Judges every window, unturned.
pub fn errors(model: &PlacementModel, samples: &[Sample], symmetry: &SymmetryGroup) -> Errors {
    let mut sum = Errors::default();
    for sample in samples {
        let Some(best) = sample.good.first() else { continue };
        let answers = offsets(model, &sample.depth(), &[0.0], best, symmetry);
        let Some(&first) = answers.first() else { continue };
        let nearest = answers.iter().fold(first, |n, &e| if e.0 < n.0 { e } else { n });
        sum.windows += 1;
        sum.rotation_rad += first.0;
        sum.displacement += first.1;
        sum.nearest_rotation_rad += nearest.0;
        sum.nearest_displacement += nearest.1;
    }
    let n = sum.windows.max(1) as f32;
    Errors {
        windows: sum.windows,
        rotation_rad: sum.rotation_rad / n,
        displacement: sum.displacement / n,
        nearest_rotation_rad: sum.nearest_rotation_rad / n,
        nearest_displacement: sum.nearest_displacement / n,
    }
}
