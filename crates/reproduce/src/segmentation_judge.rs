//! Instances of a scene against its truth: precision, recall, AP (METHOD §5). Blocks hidden to 80 % or more are
//! neither scored nor held against an instance that lies on them.

use crate::ReproduceError;
use metrics::{DetectionCounts, InstanceScene, ScoredScene};
use scene::Segmentation;
use synth::SynthScene;

/// Occlusion from which a block is not scored.
pub const HIDDEN: f32 = 0.8;

/// Labels of one scene without what does not count, ready to be pooled.
#[derive(Clone, Debug)]
pub struct Judged {
    predicted: Vec<u32>,
    truth: Vec<u32>,
    score: Vec<f32>,
}

/// Figures over all scenes.
#[derive(Clone, Copy, Debug)]
pub struct Verdict {
    /// At IoU .5.
    pub counts: DetectionCounts,
    /// Mean over the IoU limits .50 to .90.
    pub ap: Option<f64>,
    /// At IoU .5.
    pub ap50: Option<f64>,
}

impl Judged {
    /// Puts a segmentation beside the truth of its scene.
    pub fn of(found: &Segmentation, scene: &SynthScene) -> Self {
        let hidden: Vec<bool> = scene.occlusion.iter().map(|&o| o >= HIDDEN).collect();
        let (predicted, truth) = metrics::without_hidden(&found.instance, &scene.instance, &hidden);
        Self {
            predicted,
            truth,
            score: found.hypotheses.iter().take(found.instances).map(|h| h.score).collect(),
        }
    }
}

/// Pools scenes.
pub fn verdict(judged: &[Judged]) -> Result<Verdict, ReproduceError> {
    fn labels(j: &Judged) -> InstanceScene<'_> {
        InstanceScene { predicted: &j.predicted, truth: &j.truth }
    }
    let scenes: Vec<InstanceScene> = judged.iter().map(labels).collect();
    let scored: Vec<ScoredScene> =
        judged.iter().map(|j| ScoredScene { labels: labels(j), score: &j.score }).collect();
    let counts = metrics::precision_recall(&scenes, 0.5)?;
    let ap = metrics::average_precision(&scored)?;
    Ok(Verdict { counts, ap: ap.ap, ap50: ap.ap50 })
}
