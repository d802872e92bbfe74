//! What the experiments on poses share: true segments, a judged scene, a row of figures.

use crate::markdown::percent;
use crate::{Bench, ReproduceError};
use geom::{SeedTree, Vec3};
use metrics::{PoseCriteria, PoseScore, TrueBlock, score_poses};
use pose::PoseConfig;
use scene::{Catalog, CentreHypothesis, Recognised, Segmentation};
use synth::SynthScene;

/// Heads of [`figures`]' columns, after the first.
pub const FIGURES: [&str; 9] = [
    "scored",
    "P %",
    "R %",
    "E_d mm",
    "about shift mm",
    "E_R °",
    "type %",
    "type open",
    "s a scene",
];

/// The blocks of a scene as the metrics want them.
pub fn truths(made: &SynthScene) -> Vec<TrueBlock> {
    let pairs = made.scene.blocks.iter().zip(&made.occlusion);
    pairs.map(|(&placed, &occlusion)| TrueBlock { placed, occlusion }).collect()
}

/// True centre of mass of block `b`.
pub fn centre(made: &SynthScene, catalog: &Catalog, b: usize) -> Vec3 {
    let block = &made.scene.blocks[b];
    block.site_from_block * catalog.get(block.model).centre
}

/// The segmentation of an oracle: every block's points and centre.
pub fn true_segments(made: &SynthScene, catalog: &Catalog) -> Segmentation {
    let mut points: Vec<Vec<u32>> = vec![Vec::new(); made.scene.blocks.len()];
    let entry = |id: u32| made.scene.blocks.iter().position(|b| b.block.0 == id);
    for (i, &id) in made.instance.iter().enumerate() {
        if id > 0 {
            // Blocks are numbered from 1 in their order; look only when they are not.
            let guess = id as usize - 1;
            let known = made.scene.blocks.get(guess).is_some_and(|b| b.block.0 == id);
            if let Some(b) = if known { Some(guess) } else { entry(id) } {
                points[b].push(i as u32);
            }
        }
    }
    let mut hypotheses = Vec::new();
    let mut instance = vec![0; made.instance.len()];
    for (b, points) in points.into_iter().enumerate().filter(|p| !p.1.is_empty()) {
        for &i in &points {
            instance[i as usize] = hypotheses.len() as u32 + 1;
        }
        hypotheses.push(CentreHypothesis { centre: centre(made, catalog, b), score: 1.0, points });
    }
    let confidence = vec![1.0; made.instance.len()];
    Segmentation { instance, confidence, instances: hypotheses.len(), hypotheses }
}

/// A segmentation that knows nothing.
pub fn no_segments(made: &SynthScene) -> Segmentation {
    Segmentation::of_nothing(made.instance.len())
}

/// Several scenes' verdict.
#[derive(Default)]
pub struct Pooled {
    /// Pooled score.
    pub score: PoseScore,
    /// Wall time of the stage, seconds.
    pub seconds: f64,
    /// Scenes pooled.
    pub scenes: usize,
}

impl Pooled {
    /// Runs the stage on a scene and adds its verdict; returns what was found.
    pub fn add(
        &mut self,
        bench: &Bench,
        made: &SynthScene,
        segmentation: &Segmentation,
        catalog: &Catalog,
        config: &PoseConfig,
    ) -> Result<Vec<Recognised>, ReproduceError> {
        let start = (bench.clock)();
        let seed = SeedTree::new(bench.settings.seed).child("pose", 0);
        let found =
            pose::recognise(&made.survey, segmentation, catalog, config, seed, bench.observer)?;
        self.seconds += (bench.clock)() - start;
        self.scenes += 1;
        self.score =
            self.score.plus(&score_poses(&found, &truths(made), catalog, &PoseCriteria::default()));
        Ok(found)
    }

    /// The cells of [`FIGURES`].
    pub fn figures(&self) -> [String; 9] {
        let s = &self.score;
        let number = |v: Option<f64>, scale: f64, digits: usize| {
            v.map_or("–".into(), |v| format!("{:.digits$}", v * scale))
        };
        [
            (s.counts.true_positives + s.counts.false_negatives).to_string(),
            percent(s.counts.precision()),
            percent(s.counts.recall()),
            number(s.mean_displacement_m(), 1e3, 1),
            number(s.mean_about_shift_m(), 1e3, 1),
            number(s.mean_rotation_rad().map(f64::to_degrees), 1.0, 2),
            percent(s.type_accuracy()),
            s.types_open.to_string(),
            format!("{:.2}", self.seconds / self.scenes.max(1) as f64),
        ]
    }
}

/// Heads of a table whose first column is `first`.
pub fn heads(first: &'static str) -> Vec<&'static str> {
    std::iter::once(first).chain(FIGURES).collect()
}

/// A row of a table of [`heads`].
pub fn row(name: String, pooled: &Pooled) -> Vec<String> {
    std::iter::once(name).chain(pooled.figures()).collect()
}
