//! How a network's votes are read, learned from scenes it was not trained on: the width of the kernel they gather
//! under, and a logistic curve from their density to a probability. Votes are fewer where a survey is thin, an echo
//! sounder's of half hidden blocks for example: the curve knows that too.
//!
//! A hypothesis is right when a true centre lies within a quarter of d_max. Width and curve belong to the weights —
//! another network votes more or less sharply — and travel in their file.

use crate::stage::{SegmentConfig, modes_by_width};
use crate::tile::LabelledScene;
use crate::vote_peaks::suppressed;
use crate::{SegmentError, SegmentModel};
use geom::{DMat3, DVec3, Observer, PointCloud, SeedTree, Vec3};
use serde::{Deserialize, Serialize};

/// Distance to a true centre below which a hypothesis is right, d_max.
const RIGHT: f32 = 0.25;

/// Thinned points around a centre from which a survey counts as dense there. Free choice; no other was tried.
const DENSE: f32 = 200.0;

/// Widths tried, d_max. Votes on a shape that was trained on scatter by 0.1 to 0.2, on others by twice that; blocks
/// that touch are further apart than 0.7.
const WIDTHS: [f32; 4] = [0.12, 0.15, 0.19, 0.24];

/// Weak pull of the fit towards no slope, no shortfall and no offset. Free choice: far below what a hundred hypotheses say,
/// enough to keep separable data finite.
const PULL: [f64; 3] = [1e-3, 1e-2, 1e-9];

/// How votes become hypotheses with a confidence.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Calibration {
    /// Width of the kernel, d_max.
    pub vote_width: f32,
    /// From the density under it to a confidence.
    pub confidence: Confidence,
}

impl Default for Calibration {
    fn default() -> Self {
        Self { vote_width: WIDTHS[0], confidence: Confidence::default() }
    }
}

/// What speaks for a hypothesis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PeakFeatures {
    /// Density of the votes.
    pub density: f32,
    /// Thinned points within d_max of the centre, mean over the passes: where a survey is thin, fewer votes say as much.
    pub around: f32,
}

/// Probability that a hypothesis is a block's centre.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Confidence {
    /// Vote density at which half of the hypotheses are right, where the survey is dense.
    pub density_at_half: f32,
    /// Steepness per e-fold of density.
    pub slope: f32,
    /// E-folds of density that an e-fold fewer points around a centre stand for; 0 in files that state none.
    #[serde(default)]
    pub thin: f32,
}

impl Default for Confidence {
    /// Of the first shipped weights, for files that state none.
    fn default() -> Self {
        Self { density_at_half: 17.5, slope: 2.13, thin: 0.0 }
    }
}

impl PeakFeatures {
    /// ln density, and how many e-folds the place falls short of a dense survey.
    fn terms(&self) -> [f32; 2] {
        let points = self.around.min(DENSE);
        [self.density.max(1e-6).ln(), ((DENSE + 1.0) / (points + 1.0)).ln()]
    }
}

impl Confidence {
    /// The probability.
    pub fn of(&self, features: &PeakFeatures) -> f32 {
        let [density, short] = features.terms();
        let x = (density - self.density_at_half.ln()) * self.slope + short * self.thin;
        1.0 / (1.0 + (-x).exp())
    }

    /// The curve that makes what was seen most likely; `None` when nothing, or only one of right and wrong, was seen.
    pub fn fit(seen: &[(PeakFeatures, bool)]) -> Option<Self> {
        if seen.iter().all(|s| s.1) || seen.iter().all(|s| !s.1) {
            return None;
        }
        // Newton's method for p = 1 / (1 + exp(−w·x)), x = (ln density, shortfall, 1), with a weak pull towards none.
        let pull = PULL;
        let mut w = [0.0_f64; 3];
        for _ in 0..50 {
            let mut g: [f64; 3] = std::array::from_fn(|i| -pull[i] * w[i]);
            let mut h: [[f64; 3]; 3] =
                std::array::from_fn(|i| std::array::from_fn(|j| f64::from(i == j) * pull[i]));
            for (features, right) in seen {
                let [density, short] = features.terms().map(f64::from);
                let x = [density, short, 1.0];
                let p = 1.0 / (1.0 + (-(0..3).map(|i| w[i] * x[i]).sum::<f64>()).exp());
                for i in 0..3 {
                    g[i] += (f64::from(u8::from(*right)) - p) * x[i];
                    for j in 0..3 {
                        h[i][j] += p * (1.0 - p) * x[i] * x[j];
                    }
                }
            }
            // Positive definite: the pull alone is.
            let step = (DMat3::from_cols_array_2d(&h).inverse() * DVec3::from_array(g)).to_array();
            // Newton's full step can leap where the classes hardly overlap.
            let longest = step.iter().fold(0.0_f64, |a, s| a.max(s.abs()));
            for i in 0..3 {
                w[i] += step[i] * (2.0 / longest).min(1.0);
            }
        }
        let curve = Self {
            density_at_half: (-w[2] / w[0]).exp() as f32,
            slope: w[0] as f32,
            thin: (w[1] as f32).max(0.0),
        };
        (curve.slope > 0.0 && curve.density_at_half.is_finite() && curve.density_at_half > 0.0)
            .then_some(curve)
    }
}

/// What a network makes of scenes it was not trained on, under every width tried.
#[derive(Debug, Default)]
pub struct CalibrationData {
    by_width: [HypothesesOfWidth; WIDTHS.len()],
}

/// One width on those scenes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Trial {
    /// Width of the kernel, d_max.
    pub vote_width: f32,
    /// Hypotheses seen.
    pub hypotheses: usize,
    /// The curve fitted to them; none where all were right or all wrong.
    pub confidence: Option<Confidence>,
    /// Area under precision against blocks found, blocks.
    pub precision_area_blocks: f32,
}

#[derive(Debug, Default)]
struct HypothesesOfWidth {
    /// PeakFeatures and rightness of every hypothesis.
    all: Vec<(PeakFeatures, bool)>,
    /// PeakFeatures of those far enough apart for instances, and whether each is the first at its true centre.
    apart: Vec<(PeakFeatures, bool)>,
}

impl CalibrationData {
    /// Adds a scene.
    pub fn add(
        &mut self,
        model: &SegmentModel,
        scene: &LabelledScene,
        seed: SeedTree,
        observer: &dyn Observer,
    ) -> Result<(), SegmentError> {
        let cloud = PointCloud::from_positions(scene.position_m.clone());
        let centres: Vec<Vec3> = scene.centre_m.iter().map(|c| *c / scene.unit_m).collect();
        let near = |at: Vec3| {
            let found = centres.iter().enumerate().map(|(i, c)| ((*c - at).length(), i));
            found.min_by(|a, b| a.0.total_cmp(&b.0)).filter(|n| n.0 < RIGHT).map(|n| n.1)
        };
        let modes = modes_by_width(&cloud, scene.unit_m, model, &WIDTHS, seed, observer)?;
        for (seen, modes) in self.by_width.iter_mut().zip(modes) {
            seen.all
                .extend(modes.iter().map(|(peak, features)| (*features, near(peak.at).is_some())));
            let apart = suppressed(
                modes.iter().map(|m| m.0).collect(),
                SegmentConfig::default().instance_spacing,
            );
            let mut taken = vec![false; centres.len()];
            for (peak, features) in modes.iter().filter(|m| apart.contains(&m.0)) {
                let first = near(peak.at).is_some_and(|c| !std::mem::replace(&mut taken[c], true));
                seen.apart.push((*features, first));
            }
        }
        Ok(())
    }

    /// How well each width tried ranks right instances before wrong ones.
    pub fn trials(&self) -> impl Iterator<Item = Trial> + '_ {
        WIDTHS.iter().zip(&self.by_width).map(|(&vote_width, seen)| {
            let confidence = Confidence::fit(&seen.all);
            let precision_area_blocks = confidence.map_or(0.0, |c| seen.precision_area_blocks(&c));
            Trial { vote_width, hypotheses: seen.all.len(), confidence, precision_area_blocks }
        })
    }

    /// The width whose instances rank best, with its curve; `None` when nothing, or only right or wrong, was seen.
    pub fn fit(&self) -> Option<Calibration> {
        // Of equals the narrower.
        let better = |best: Trial, next: Trial| {
            if next.precision_area_blocks > best.precision_area_blocks { next } else { best }
        };
        let best = self.trials().filter(|t| t.confidence.is_some()).reduce(better)?;
        Some(Calibration { vote_width: best.vote_width, confidence: best.confidence? })
    }
}

impl HypothesesOfWidth {
    /// Area under precision against blocks found, most confident instance first; blocks.
    fn precision_area_blocks(&self, curve: &Confidence) -> f32 {
        let mut ranked: Vec<(f32, bool)> =
            self.apart.iter().map(|(features, first)| (curve.of(features), *first)).collect();
        ranked.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        let (mut found, mut area) = (0.0, 0.0);
        for (rank, (_, first)) in ranked.iter().enumerate() {
            if *first {
                found += 1.0;
                area += found / (rank + 1) as f32;
            }
        }
        area
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::RngExt;

    #[test]
    fn a_fit_finds_the_curve_its_data_came_from() {
        let truth = Confidence { density_at_half: 12.0, slope: 1.7, thin: 2.5 };
        let mut rng = SeedTree::new(4).rng();
        let seen: Vec<(PeakFeatures, bool)> = (0..20_000)
            .map(|_| {
                let density = rng.random_range(0.0_f32..5.0).exp();
                let features = PeakFeatures { density, around: rng.random_range(20.0..400.0) };
                (features, rng.random::<f32>() < truth.of(&features))
            })
            .collect();
        let fit = Confidence::fit(&seen).unwrap();
        assert!(
            (fit.density_at_half / 12.0 - 1.0).abs() < 0.08 && (fit.slope - 1.7).abs() < 0.1,
            "{fit:?}"
        );
        assert!((fit.thin - 2.5).abs() < 0.25, "{fit:?}");
    }

    #[test]
    fn the_width_with_fewer_wrong_instances_ahead_of_right_ones_wins() {
        let dense = |density| PeakFeatures { density, around: 300.0 };
        let seen = |rows: &[(f32, bool)]| {
            let rows: Vec<_> = rows.iter().map(|&(d, right)| (dense(d), right)).collect();
            HypothesesOfWidth { all: rows.clone(), apart: rows }
        };
        let mixed = || seen(&[(9.0, true), (8.0, false), (7.0, true), (6.0, false), (1.0, false)]);
        let ordered = seen(&[(9.0, true), (8.0, true), (7.0, false), (6.0, false), (1.0, false)]);
        let evidence =
            CalibrationData { by_width: [mixed(), ordered, mixed(), HypothesesOfWidth::default()] };
        assert_eq!(evidence.fit().unwrap().vote_width, WIDTHS[1]);
        assert!(
            (mixed().precision_area_blocks(&evidence.fit().unwrap().confidence)
                - (1.0 + 2.0 / 3.0))
                .abs()
                < 1e-6
        );
        assert_eq!(CalibrationData::default().fit(), None);
    }

    #[test]
    fn nothing_to_learn_from_is_no_curve() {
        let dense = |density| PeakFeatures { density, around: 300.0 };
        assert_eq!(Confidence::fit(&[]), None);
        assert_eq!(Confidence::fit(&[(dense(3.0), true), (dense(4.0), true)]), None);
        // Separable data: steep, but a curve.
        let seen = [(1.0, false), (2.0, false), (50.0, true), (60.0, true)]
            .map(|(d, right)| (dense(d), right));
        let steep = Confidence::fit(&seen).unwrap();
        assert!(steep.of(&dense(1.0)) < 0.1 && steep.of(&dense(60.0)) > 0.9);
    }
}
