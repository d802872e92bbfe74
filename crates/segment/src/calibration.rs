//! From the density of votes to a probability: a logistic curve fitted to scenes the network was not trained on.
//!
//! A hypothesis is right when a true centre lies within a quarter of d_max. The curve belongs to the weights — another
//! network votes more or less sharply — and travels in their file.

use crate::stage::{SegmentConfig, hypotheses};
use crate::tile::LabelledScene;
use crate::{SegmentError, SegmentModel};
use geom::{Observer, PointCloud, SeedTree};
use serde::{Deserialize, Serialize};

/// Distance to a true centre below which a hypothesis is right, d_max.
const RIGHT: f32 = 0.25;

/// Probability that a hypothesis of a vote density is a block's centre.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Confidence {
    /// Vote density at which half of the hypotheses are right.
    pub density_at_half: f32,
    /// Steepness per e-fold of density.
    pub slope: f32,
}

impl Default for Confidence {
    /// Of the first shipped weights, for files that state none.
    fn default() -> Self {
        Self { density_at_half: 17.5, slope: 2.13 }
    }
}

impl Confidence {
    /// The probability.
    pub fn of(&self, density: f32) -> f32 {
        let x = (density.max(1e-6).ln() - self.density_at_half.ln()) * self.slope;
        1.0 / (1.0 + (-x).exp())
    }

    /// The curve that makes what was seen most likely; `None` when nothing, or only one of right and wrong, was seen.
    pub fn fit(seen: &[(f32, bool)]) -> Option<Self> {
        if seen.iter().all(|s| s.1) || seen.iter().all(|s| !s.1) {
            return None;
        }
        // Newton's method for p = 1 / (1 + exp(−(a x + b))), x = ln density, with a weak pull towards small a.
        let (mut a, mut b) = (0.0_f64, 0.0_f64);
        for _ in 0..50 {
            let mut g = [-1e-3 * a, 0.0];
            let mut h = [[1e-3, 0.0], [0.0, 1e-9]];
            for &(density, right) in seen {
                let x = f64::from(density.max(1e-6).ln());
                let p = 1.0 / (1.0 + (-(a * x + b)).exp());
                let (r, w) = (f64::from(u8::from(right)) - p, p * (1.0 - p));
                g[0] += r * x;
                g[1] += r;
                h[0][0] += w * x * x;
                h[0][1] += w * x;
                h[1][1] += w;
            }
            h[1][0] = h[0][1];
            let determinant = h[0][0] * h[1][1] - h[0][1] * h[1][0];
            let step =
                [(h[1][1] * g[0] - h[0][1] * g[1]) / determinant, (h[0][0] * g[1] - h[1][0] * g[0]) / determinant];
            // Newton's full step can leap where the classes hardly overlap.
            let shorter = (2.0 / step[0].abs().max(step[1].abs())).min(1.0);
            a += step[0] * shorter;
            b += step[1] * shorter;
        }
        let curve = Self { density_at_half: (-b / a).exp() as f32, slope: a as f32 };
        (curve.slope > 0.0 && curve.density_at_half.is_finite() && curve.density_at_half > 0.0).then_some(curve)
    }
}

/// Density and rightness of every hypothesis the network makes on the scenes.
pub fn density_and_truth(
    model: &SegmentModel,
    scene: &LabelledScene,
    seed: SeedTree,
    observer: &dyn Observer,
) -> Result<Vec<(f32, bool)>, SegmentError> {
    let cloud = PointCloud::from_positions(scene.position_m.clone());
    let found = hypotheses(&cloud, scene.unit_m, model, &SegmentConfig::default(), seed, observer)?;
    let right = |p: &geom::Vec3| scene.centre_m.iter().any(|c| (*c - *p).length() < RIGHT * scene.unit_m);
    Ok(found.iter().map(|(at, density)| (*density, right(at))).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::RngExt;

    #[test]
    fn a_fit_finds_the_curve_its_data_came_from() {
        let truth = Confidence { density_at_half: 12.0, slope: 1.7 };
        let mut rng = SeedTree::new(4).rng();
        let seen: Vec<(f32, bool)> = (0..20_000)
            .map(|_| {
                let density = rng.random_range(0.0_f32..5.0).exp();
                (density, rng.random::<f32>() < truth.of(density))
            })
            .collect();
        let fit = Confidence::fit(&seen).unwrap();
        assert!((fit.density_at_half / 12.0 - 1.0).abs() < 0.05 && (fit.slope - 1.7).abs() < 0.1, "{fit:?}");
    }

    #[test]
    fn nothing_to_learn_from_is_no_curve() {
        assert_eq!(Confidence::fit(&[]), None);
        assert_eq!(Confidence::fit(&[(3.0, true), (4.0, true)]), None);
        // Separable data: steep, but a curve.
        let steep = Confidence::fit(&[(1.0, false), (2.0, false), (50.0, true), (60.0, true)]).unwrap();
        assert!(steep.of(1.0) < 0.1 && steep.of(60.0) > 0.9);
    }
}
