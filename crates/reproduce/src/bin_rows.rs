//! The rows of chapter 2's tables: each a network, trained on a part, with a way to read instances from it.

use crate::bin_kept::{RowResult, RowsOnDisk};
use crate::bin_parts::{BinPart, in_units};
use crate::peak_memory::with_peak;
use crate::segmentation_judge::{Judged, verdict};
use crate::segmentation_shapes::of_blocks;
use crate::{Bench, ReproduceError};
use geom::{SeedTree, Vec3, thin};
use peers::{Backbone, Group, Method, Peer, PeerConfig, WatershedConfig, watershed};
use pose::PoseConfig;
use scene::{CentreHypothesis, Segmentation};
use segment::loss::{LossConfig, PairLossConfig};
use segment::sparse_votes::SparseVotesConfig;
use segment::tile::ThinScene;
use segment::{NetworkConfig, SegmentConfig, SegmentModel, Split, TrainConfig, segment, train};
use synth::SynthScene;

/// A network to train.
#[derive(Clone, Debug, PartialEq)]
pub enum Net {
    /// FPCC, from the shipped tetrapod weights, under a reading of the pair loss.
    Fpcc(PairLossConfig),
    /// FPCCv2 with our heads, from the weights for any shape, or from nothing.
    V2 {
        /// From the weights for any shape.
        from_any_shape: bool,
    },
    /// The sparse U-Net with our heads, from nothing.
    Sparse,
    /// A peer, from nothing.
    Peer(Method, Backbone),
    /// No network: the depth image alone.
    Image,
}

/// How instances are read from it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reading {
    /// As the network's own paper has it: Algorithm 1 for FPCC, each peer's grouping, the watershed.
    Own,
    /// Algorithm 1 on FPCCv2.
    Thesis,
    /// Votes.
    Votes,
    /// Votes, then the points of recognised poses.
    Poses,
}

/// A row: name, network, reading.
pub type Row = (&'static str, Net, Reading);

/// Every row, in the order of the tables.
pub fn rows() -> Vec<Row> {
    let peer = |method, backbone| Net::Peer(method, backbone);
    let v2 = |from_any_shape| Net::V2 { from_any_shape };
    vec![
        ("FPCC, the text's loss", Net::Fpcc(PairLossConfig::default()), Reading::Own),
        ("FPCC, the authors' loss", Net::Fpcc(PairLossConfig::of_the_authors()), Reading::Own),
        ("FPCCv2, Algorithm 1", v2(true), Reading::Thesis),
        ("FPCCv2, votes", v2(true), Reading::Votes),
        ("FPCCv2, votes and poses", v2(true), Reading::Poses),
        ("FPCCv2 from nothing, votes", v2(false), Reading::Votes),
        ("sparse U-Net, votes", Net::Sparse, Reading::Votes),
        ("SGPN on DGCNN", peer(Method::Sgpn, Backbone::Dgcnn), Reading::Own),
        ("ASIS on DGCNN", peer(Method::Asis, Backbone::Dgcnn), Reading::Own),
        ("3D-BoNet on DGCNN", peer(Method::BoNet, Backbone::Dgcnn), Reading::Own),
        ("PointGroup on DGCNN", peer(Method::PointGroup, Backbone::Dgcnn), Reading::Own),
        (
            "PointGroup on sparse U-Net",
            peer(Method::PointGroup, Backbone::SparseUnet),
            Reading::Own,
        ),
        ("depth-image watershed, for SD-Mask", Net::Image, Reading::Own),
    ]
}

/// A network ready to look at scenes.
pub enum Trained {
    /// One of the stage's.
    Model(Box<SegmentModel>),
    /// A peer.
    Peer(Box<Peer>),
    /// None.
    Image,
}

/// What a training of a part is given.
pub struct Course<'a> {
    /// The part.
    pub part: &'a BinPart,
    /// Scenes the peers learn from; the stage's networks draw as many from the same seeds.
    pub training_scenes: &'a [ThinScene],
    /// Where trainings are kept.
    pub disk: &'a RowsOnDisk,
    /// Optimiser steps.
    pub steps: u64,
    /// Seed of first weights and tiles, for repetitions.
    pub repeat: u64,
}

impl Net {
    /// Trains it, or goes on with its training; the name tells its folder. Its steps with it.
    pub fn train(
        &self,
        bench: &Bench,
        course: &Course<'_>,
        name: &str,
    ) -> Result<(Trained, u64), ReproduceError> {
        let folder = course.disk.training(name);
        let seed = course.part.root(bench.settings.seed).child("network", course.repeat);
        match self {
            Self::Image => Ok((Trained::Image, 0)),
            Self::Peer(method, backbone) => {
                let config = PeerConfig {
                    mirror: course.part.mirrored,
                    ..PeerConfig::new(*method, *backbone, course.steps)
                };
                let (peer, steps) =
                    peers::train(course.training_scenes, &config, &folder, seed, bench.observer)?;
                finished(steps, course.steps)?;
                Ok((Trained::Peer(Box::new(peer)), steps))
            }
            _ => {
                let config = self.config(course)?;
                let init = self.init()?;
                let (part, root) = (course.part, bench.settings.seed);
                let source = |split: Split, index: u64| part.training_scene(root, split, index);
                let trained =
                    train(&source, &config, init.as_ref(), &folder, seed, bench.observer)?;
                finished(trained.steps, course.steps)?;
                Ok((Trained::Model(Box::new(trained.model)), trained.steps))
            }
        }
    }

    fn config(&self, course: &Course<'_>) -> Result<TrainConfig, ReproduceError> {
        let training_scenes = course.training_scenes.len() as u64;
        let mut config = TrainConfig {
            steps: course.steps,
            warmup: (course.steps / 10).clamp(1, 50),
            mirror: course.part.mirrored,
            scenes_first: training_scenes.clamp(1, 12),
            scenes_kept: training_scenes.max(1),
            // New scenes come until there are as many as the peers have.
            steps_per_scene: (course.steps / training_scenes.max(1)).max(1),
            checkpoint_steps: 100,
            validation_steps: course.steps.max(1),
            validation_scenes: 2,
            calibration_scenes: training_scenes.clamp(2, 6),
            name: format!("bin-picking, {}", course.part.name),
            shapes: course.part.shapes()?,
            ..Default::default()
        };
        match self {
            Self::Fpcc(pair) => {
                let sizes = segment::fpcc::FpccConfig { batch_points: 2048, ..Default::default() };
                config.network = NetworkConfig::Fpcc(sizes);
                config.loss = LossConfig { pair: pair.clone(), ..LossConfig::of_the_thesis() };
            }
            Self::Sparse => {
                config.network = NetworkConfig::SparseUnet(SparseVotesConfig::default());
            }
            Self::V2 { .. } | Self::Peer(..) | Self::Image => {}
        }
        Ok(config)
    }

    fn init(&self) -> Result<Option<SegmentModel>, ReproduceError> {
        let name = match self {
            Self::Fpcc(_) => "fpcc",
            Self::V2 { from_any_shape: true } => "any-shape",
            _ => return Ok(None),
        };
        Ok(SegmentModel::shipped_as(name).transpose()?)
    }
}

fn finished(steps: u64, wanted: u64) -> Result<(), ReproduceError> {
    if steps < wanted { Err(ReproduceError::Stopped) } else { Ok(()) }
}

impl Trained {
    /// Instances of a scene's cloud. `gamma` is Algorithm 1's radius over d_max.
    pub fn instances(
        &self,
        bench: &Bench,
        part: &BinPart,
        scene: &SynthScene,
        reading: Reading,
        gamma: f32,
    ) -> Result<Segmentation, ReproduceError> {
        let position = &scene.survey.cloud.position_m;
        match self {
            Self::Model(model) => {
                let plain = match reading {
                    Reading::Own | Reading::Thesis => SegmentConfig::thesis(),
                    Reading::Votes | Reading::Poses => SegmentConfig::default(),
                };
                let config = SegmentConfig { suppression: gamma, ..plain };
                let seed = SeedTree::new(bench.settings.seed).child("segment", 0);
                let cloud = &scene.survey.cloud;
                let found = segment(cloud, &part.catalog, model, &config, seed, bench.observer)?;
                if reading != Reading::Poses {
                    return Ok(found);
                }
                let seed = SeedTree::new(bench.settings.seed).child("pose", 0);
                let config = PoseConfig::default();
                let blocks = pose::recognise(
                    &scene.survey,
                    &found,
                    &part.catalog,
                    &config,
                    seed,
                    bench.observer,
                )?;
                Ok(of_blocks(&blocks, position.len()))
            }
            Self::Peer(peer) => {
                let thinned = thin(position, part.unit_m() / 7.0, Vec3::ZERO);
                let kept: Vec<Vec3> = thinned.kept.iter().map(|&i| position[i as usize]).collect();
                let seed = SeedTree::new(bench.settings.seed).child("peer", 0);
                let groups = peer.groups(&in_units(&kept, part.unit_m()), seed);
                Ok(of_groups(&groups, kept.len(), |i| thinned.cell_of_point[i], position.len()))
            }
            Self::Image => {
                let units = in_units(position, part.unit_m());
                let groups = watershed(&units, &WatershedConfig::default());
                Ok(of_groups(&groups, units.len(), |i| i as u32, position.len()))
            }
        }
    }

    /// Its result on scenes.
    pub fn judged(
        &self,
        bench: &Bench,
        part: &BinPart,
        scenes: &[SynthScene],
        reading: Reading,
        gamma: f32,
        steps: u64,
    ) -> Result<RowResult, ReproduceError> {
        let mut judged = Vec::new();
        let (mut seconds, mut points, mut peak) = (0.0, 0, None);
        for scene in scenes {
            let from = (bench.clock)();
            let (found, bytes) = with_peak(|| self.instances(bench, part, scene, reading, gamma));
            seconds += (bench.clock)() - from;
            points += scene.survey.cloud.len();
            peak = peak.max(bytes);
            judged.push(Judged::of(&found?, scene));
        }
        let v = verdict(&judged)?;
        let count = scenes.len().max(1) as f64;
        Ok(RowResult {
            right: v.counts.true_positives,
            wrong: v.counts.false_positives,
            missed: v.counts.false_negatives,
            ap: v.ap,
            ap50: v.ap50,
            seconds: seconds / count,
            points: points as f64 / count,
            peak_mb: peak.map(|bytes| bytes as f64 / 1e6),
            steps,
        })
    }
}

/// Groups among thinned points as labels of all points.
fn of_groups(
    groups: &[Group],
    thinned: usize,
    of_point: impl Fn(usize) -> u32,
    points: usize,
) -> Segmentation {
    let mut label = vec![0_u32; thinned];
    for (number, group) in (1..).zip(groups) {
        for &i in &group.points {
            label[i as usize] = number;
        }
    }
    let instance: Vec<u32> = (0..points).map(|i| label[of_point(i) as usize]).collect();
    let hypothesis =
        |g: &Group| CentreHypothesis { centre: Vec3::ZERO, score: g.score, points: Vec::new() };
    Segmentation {
        confidence: instance.iter().map(|i| f32::from(*i > 0)).collect(),
        instance,
        hypotheses: groups.iter().map(hypothesis).collect(),
        instances: groups.len(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_rows_are_distinct() {
        let rows = rows();
        for (i, row) in rows.iter().enumerate() {
            assert!(rows[..i].iter().all(|o| o.0 != row.0));
        }
        assert!(rows.iter().filter(|r| matches!(r.1, Net::Peer(..))).count() == 5);
    }

    #[test]
    fn groups_label_every_point_of_their_cells() {
        let groups = [Group { points: vec![1], score: 0.5 }, Group { points: vec![0], score: 0.4 }];
        let found = of_groups(&groups, 3, |i| [0, 1, 1, 2][i], 4);
        assert_eq!(found.instance, [2, 1, 1, 0]);
        assert_eq!((found.instances, found.hypotheses[0].score), (2, 0.5));
    }
}
