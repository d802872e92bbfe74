//! The stage: survey points in, labels, instances and centre hypotheses out.
//!
//! For every distinct block size: thin to the network's resolution (several grids, so that every point is seen through
//! several neighbours), run the network, gather votes, find their modes. Modes that are far enough apart and dense
//! enough become instances; all of them go on as hypotheses. Everything is in units of d_max, which the catalogue gives.

use crate::all_scales::{AtScale, Found, Hypothesis};
use crate::calibration::PeakFeatures;
use crate::embedding_clusters::{Clusters, cluster};
use crate::infer::{OwnClusters, TileVotes, predict};
use crate::network::Inference;
use crate::vote_instances::{Pass, by_votes, modes};
use crate::vote_peaks::Peak;
use crate::{SegmentError, SegmentModel};
use geom::{Event, Observer, PointCloud, SeedTree, Stage, Vec3, Warning, thin};
use rand::RngExt;
use scene::{Catalog, Segmentation};

/// How points become instances.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Clustering {
    /// Modes of the votes for the pose centre: ours.
    #[default]
    Votes,
    /// Non-maximum suppression of the centre score, then the nearest centre in embedding space: the thesis (Algorithm 1).
    /// Networks with a clustering of their own (FPCC) take it whatever is chosen.
    Embedding,
}

/// Nothing here needs a user's choice: lengths are in d_max of the catalogue's blocks.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SegmentConfig {
    /// Votes or embeddings.
    pub clustering: Clustering,
    /// Thinnings of the cloud; each costs one run of the network and steadies the votes.
    pub passes: u32,
    /// Hypotheses nearer than this to a better one do not become instances.
    pub instance_spacing: f32,
    /// Confidence below which a hypothesis is dropped.
    pub least_score: f32,
    /// Confidence below which a hypothesis does not become an instance; more with weights for any shape
    /// ([`ModelDescription::least_instance_score`](crate::ModelDescription::least_instance_score)).
    pub least_instance_score: f32,
    /// Points whose vote is farther than this from every instance get no label.
    pub reach: f32,
    /// Probability of lying on a block below which a point gets no label.
    pub least_block: f32,
    /// Centre score above which a point can be a centre (thesis: 0.6).
    pub centre_threshold: f32,
    /// Radius of Algorithm 1 (thesis: γ = 1).
    pub suppression: f32,
}

impl Default for SegmentConfig {
    fn default() -> Self {
        Self {
            clustering: Clustering::Votes,
            passes: 4,
            instance_spacing: 0.5,
            least_score: 0.01,
            least_instance_score: 0.4,
            reach: 0.4,
            least_block: 0.5,
            centre_threshold: 0.6,
            suppression: 1.0,
        }
    }
}

impl SegmentConfig {
    /// The thesis' clustering (Algorithm 1 and the nearest centre in embedding space) on one view of the cloud.
    pub fn thesis() -> Self {
        Self { clustering: Clustering::Embedding, passes: 1, ..Self::default() }
    }
}

/// Sizes closer than this share one run of the network.
const SAME_SIZE: f32 = 1.3;

/// Labels every point of the cloud. Hypotheses come best first; instances are the first of them.
pub fn segment(
    cloud: &PointCloud,
    catalog: &Catalog,
    model: &SegmentModel,
    config: &SegmentConfig,
    seed: SeedTree,
    observer: &dyn Observer,
) -> Result<Segmentation, SegmentError> {
    let units = scales(catalog)?;
    config.check()?;
    if let Some(point) = cloud.position_m.iter().position(|p| !p.is_finite()) {
        return Err(SegmentError::NotFinite { point });
    }
    let unseen_types = model.unseen_types(catalog);
    if !unseen_types.is_empty() {
        observer.event(Event::Warned(Warning {
            stage: Stage::Segment,
            message: format!(
                "the weights `{}` were not trained on the shape of {}; expect misses, or train with `tsumu-lab train segment`",
                model.description.name,
                unseen_types.join(", ")
            ),
        }));
    }
    observer.event(Event::Started { stage: Stage::Segment, total: cloud.len() as u64 });
    let mut found = Found::default();
    for (at, &unit_m) in units.iter().enumerate() {
        let progress = Progress { observer, points: cloud.len(), part: at, parts: units.len() };
        found.add(at_scale(
            cloud,
            unit_m,
            model,
            config,
            seed.child("scale", at as u64),
            &progress,
        )?);
    }
    let result = found.into_segmentation(cloud.len());
    if result.instances == 0 && !cloud.is_empty() {
        observer.event(Event::Warned(Warning {
            stage: Stage::Segment,
            message: format!(
                "no block found among {} points; are the units of the survey and of the catalogue (d_max {:.3} m) right?",
                cloud.len(),
                catalog.d_max_m()
            ),
        }));
    }
    observer.event(Event::Finished { stage: Stage::Segment });
    Ok(result)
}

/// The distinct sizes of a catalogue, metres, largest first: sizes within 30 % of the largest of a group share its mean.
pub fn scales(catalog: &Catalog) -> Result<Vec<f32>, SegmentError> {
    if catalog.is_empty() {
        return Err(SegmentError::EmptyCatalog);
    }
    let mut sizes = Vec::new();
    for (_, model) in catalog.iter() {
        if !(model.d_max_m > 0.0 && model.d_max_m.is_finite()) {
            return Err(SegmentError::BadBlockSize {
                name: model.name.clone(),
                d_max_m: model.d_max_m,
            });
        }
        sizes.push(model.d_max_m);
    }
    sizes.sort_by(|a, b| b.total_cmp(a));
    let mut units = Vec::new();
    let mut rest = sizes.as_slice();
    while let Some(&largest) = rest.first() {
        let count = rest.iter().take_while(|s| **s * SAME_SIZE >= largest).count();
        units.push(rest[..count].iter().sum::<f32>() / count as f32);
        rest = &rest[count..];
    }
    Ok(units)
}

struct Progress<'a> {
    observer: &'a dyn Observer,
    points: usize,
    part: usize,
    parts: usize,
}

impl Progress<'_> {
    /// `share` of this scale's work is done.
    fn tell(&self, share: f32) {
        let done = (self.part as f32 + share) / self.parts as f32 * self.points as f32;
        self.observer.event(Event::Advanced { stage: Stage::Segment, done: done as u64 });
    }
}

fn at_scale(
    cloud: &PointCloud,
    unit_m: f32,
    model: &SegmentModel,
    config: &SegmentConfig,
    seed: SeedTree,
    progress: &Progress<'_>,
) -> Result<AtScale, SegmentError> {
    let network = match model.network.inference() {
        Inference::Votes(network) => network,
        Inference::OwnClusters(network) => {
            return by_own_clusters(network, cloud, unit_m, model, config, seed, progress);
        }
    };
    let passes = if config.clustering == Clustering::Embedding { 1 } else { config.passes };
    let passes = Passes { network, cell: model.description.cell, count: passes };
    let runs = passes.run(cloud, unit_m, config, seed, progress)?;
    Ok(match config.clustering {
        Clustering::Votes => by_votes(&runs, cloud.len(), unit_m, &model.description, config),
        Clustering::Embedding => {
            let run = &runs[0];
            let clusters = cluster(
                &run.position,
                &run.prediction,
                config.centre_threshold,
                config.suppression,
            );
            by_embedding(&clusters, run, cloud.len(), unit_m, config)
        }
    })
}

fn by_own_clusters(
    network: &dyn OwnClusters,
    cloud: &PointCloud,
    unit_m: f32,
    model: &SegmentModel,
    config: &SegmentConfig,
    seed: SeedTree,
    progress: &Progress<'_>,
) -> Result<AtScale, SegmentError> {
    let thinned = thin(&cloud.position_m, model.description.cell * unit_m, Vec3::ZERO);
    let position: Vec<Vec3> =
        thinned.kept.iter().map(|&i| cloud.position_m[i as usize] / unit_m).collect();
    let total = position.len().max(1) as f32;
    let found = network.cluster(
        &position,
        config,
        seed.child("batches", 0),
        progress.observer,
        &mut |done| progress.tell(done as f32 / total),
    )?;
    let run = Pass { thinned, prediction: found.prediction, position };
    Ok(by_embedding(&found.clusters, &run, cloud.len(), unit_m, config))
}

/// Every mode of the votes at one scale with its features, before any confidence, for each width of the kernel; d_max.
pub(crate) fn modes_by_width(
    cloud: &PointCloud,
    unit_m: f32,
    model: &SegmentModel,
    widths: &[f32],
    seed: SeedTree,
    observer: &dyn Observer,
) -> Result<Vec<Vec<(Peak, PeakFeatures)>>, SegmentError> {
    let progress = Progress { observer, points: cloud.len(), part: 0, parts: 1 };
    let config = SegmentConfig::default();
    let Inference::Votes(network) = model.network.inference() else {
        return Err(SegmentError::NoVotes {
            architecture: model.description.network.architecture(),
        });
    };
    let passes = Passes { network, cell: model.description.cell, count: config.passes };
    let runs = passes.run(cloud, unit_m, &config, seed, &progress)?;
    Ok(widths.iter().map(|&width| modes(&runs, width)).collect())
}

/// A network that is shown several thinnings of a cloud.
struct Passes<'a> {
    network: &'a dyn TileVotes,
    /// Edge of a thinning cell, d_max.
    cell: f32,
    count: u32,
}

impl Passes<'_> {
    fn run(
        &self,
        cloud: &PointCloud,
        unit_m: f32,
        config: &SegmentConfig,
        seed: SeedTree,
        progress: &Progress<'_>,
    ) -> Result<Vec<Pass>, SegmentError> {
        let with_embedding = config.clustering == Clustering::Embedding;
        let mut thinned = Vec::new();
        let mut clouds: Vec<Vec<Vec3>> = Vec::new();
        for pass in 0..self.count {
            let mut rng = seed.child("pass", u64::from(pass)).rng();
            let shift = if pass == 0 {
                Vec3::ZERO
            } else {
                Vec3::new(rng.random(), rng.random(), rng.random())
            };
            let thin = thin(&cloud.position_m, self.cell * unit_m, shift);
            clouds.push(thin.kept.iter().map(|&i| cloud.position_m[i as usize] / unit_m).collect());
            thinned.push(thin);
        }
        let told = |share| progress.tell(share);
        let predictions = predict(self.network, &clouds, with_embedding, progress.observer, told)?;
        let runs = thinned.into_iter().zip(predictions).zip(clouds);
        Ok(runs
            .map(|((thinned, prediction), position)| Pass { thinned, prediction, position })
            .collect())
    }
}

fn by_embedding(
    clusters: &Clusters,
    run: &Pass,
    points: usize,
    unit_m: f32,
    config: &SegmentConfig,
) -> AtScale {
    let hypotheses = clusters
        .centres
        .iter()
        .map(|&c| Hypothesis {
            centre: run.prediction.vote[c as usize] * unit_m,
            score: run.prediction.centre[c as usize].clamp(1e-6, 1.0),
            instance: true,
            points: Vec::new(),
        })
        .collect();
    let label = (0..points)
        .map(|i| {
            let at = run.thinned.cell_of_point[i] as usize;
            let on_block = run.prediction.block[at];
            clusters.member[at].filter(|_| on_block >= config.least_block).map(|h| (h, on_block))
        })
        .collect();
    AtScale { hypotheses, label }
}

impl SegmentConfig {
    fn check(&self) -> Result<(), SegmentError> {
        let within = |name, value: f32, low: f32, high: f32, allowed| {
            if value >= low && value <= high {
                Ok(())
            } else {
                Err(SegmentError::Setting { name, value: value.into(), allowed })
            }
        };
        within("passes", self.passes as f32, 1.0, 64.0, "1 to 64")?;
        within("instance_spacing", self.instance_spacing, 0.01, 10.0, "0.01 to 10 d_max")?;
        within("reach", self.reach, 0.01, 10.0, "0.01 to 10 d_max")?;
        within("least_score", self.least_score, 0.0, 1.0, "0 to 1")?;
        within("least_instance_score", self.least_instance_score, 0.0, 1.0, "0 to 1")?;
        within("least_block", self.least_block, 0.0, 1.0, "0 to 1")?;
        within("centre_threshold", self.centre_threshold, 0.0, 1.0, "0 to 1")?;
        within("suppression", self.suppression, 0.01, 10.0, "0.01 to 10 d_max")
    }
}
