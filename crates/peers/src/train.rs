//! A peer's training, through the loop that all networks share.

use crate::PeerError;
use crate::grouping::TrainingTile;
use crate::network::{Backbone, Peer, PeerConfig, PeerNetwork};
use geom::{Observer, SeedTree};
use net::prelude::{Device, GradientsParams, Module};
use net::training::{Part, first_weights};
use net::{Checkpoint, Replicas, Schedule, Task, Training, UnetConfig, floats};
use rand::RngExt;
use segment::fpcc::inputs_in;
use segment::tile::{Targets, ThinScene};
use std::path::Path;

/// Widest piece a tile is drawn from, d_max: FPCC's.
const WIDEST: f32 = 10.0;
/// Fewest points of a scene that is learnt from.
const FEWEST: usize = 64;

/// Trains a peer on `scenes`, thinned to a seventh of d_max, in `folder`, which may hold a training to go on with. A
/// training that was stopped gives the peer as it is.
pub fn train(
    scenes: &[ThinScene],
    config: &PeerConfig,
    folder: &Path,
    seed: SeedTree,
    observer: &dyn Observer,
) -> Result<(Peer, u64), PeerError> {
    let scenes: Vec<&ThinScene> = scenes.iter().filter(|s| s.len() >= FEWEST).collect();
    if scenes.is_empty() {
        return Err(PeerError::NoScenes);
    }
    let device = Device::flex().autodiff();
    let grouping = config.method.grouping();
    let network = first_weights(&device, seed, |d| PeerNetwork::new(config, grouping, d));
    let checkpoint = Checkpoint::open(folder, &format!("{config:?}"))?;
    let schedule = Schedule {
        steps: config.steps,
        learning_rate: config.learning_rate,
        warmup: (config.steps / 10).min(50),
        weight_decay: 1e-2,
        replicas: config.replicas,
        checkpoint_steps: 100,
        validation_steps: config.steps.max(1),
    };
    let training: Training<'_, PeerNetwork> =
        Training::begin::<PeerError>(network, schedule, &checkpoint, device, observer)?;
    let task = PeerTask { config, scenes, seed };
    let outcome = training.run(&task, Ok)?;
    let network = outcome.network.valid().to_device(&Device::flex());
    Ok((Peer { config: config.clone(), network }, outcome.steps))
}

struct PeerTask<'a> {
    config: &'a PeerConfig,
    scenes: Vec<&'a ThinScene>,
    seed: SeedTree,
}

impl PeerTask<'_> {
    fn tile(&self, part: &Part<'_>) -> Targets {
        let node = self.seed.child("tile", part.step).child("replica", part.replica as u64);
        let mut rng = node.rng();
        let scene = self.scenes[rng.random_range(0..self.scenes.len())];
        let edge = WIDEST * rng.random_range(0.6..1.0);
        let (points, mirror, seed) = (self.config.points, self.config.mirror, node.child("cut", 0));
        match self.config.backbone {
            Backbone::Dgcnn => scene.sample(points, edge, 0.0, mirror, seed),
            Backbone::SparseUnet => scene.tile(points, 0.0, mirror, seed),
        }
    }
}

impl Task for PeerTask<'_> {
    type Network = PeerNetwork;
    type Batch = u64;
    type Report = f32;
    type Judgement = ();
    type Error = PeerError;
    const HEADER: &'static str = "step,learning_rate,loss";

    fn gradients(&self, network: &PeerNetwork, _: &u64, part: &Part<'_>) -> (GradientsParams, f32) {
        let tile = self.tile(part);
        let progress = part.step as f32 / self.config.steps.max(1) as f32;
        let sample = TrainingTile { tile: &tile, progress, device: part.device };
        let grouping = self.config.method.grouping();
        let share = 1.0 / part.replicas as f32;
        if let Some(unet) = &network.unet {
            let voxels = UnetConfig::default().voxels(&tile.position);
            let trace = unet.trace(&voxels, part.device);
            let loss = grouping.loss(&network.layers, trace.features(), &sample);
            let value = floats(loss.clone())[0];
            return (trace.backward(network, &(loss * share), part.device), value);
        }
        let dgcnn = network.dgcnn.as_ref().expect("a peer has one of both backbones");
        let features = dgcnn.features(&inputs_in(&tile.position, &tile.bounds), part.device);
        let loss = grouping.loss(&network.layers, features, &sample);
        let value = floats(loss.clone())[0];
        (GradientsParams::from_grads((loss * share).backward(), network), value)
    }

    fn mean(&self, parts: &[f32]) -> f32 {
        parts.iter().sum::<f32>() / parts.len().max(1) as f32
    }

    fn loss(&self, report: &f32) -> f32 {
        *report
    }

    fn judge(&self, _: &PeerNetwork, _: u64, _: &Replicas) {}

    fn line(&self, step: u64, rate: f64, report: &f32, _: Option<&()>) -> String {
        format!("{step},{rate:.3e},{report:.5}")
    }

    fn model(&self, network: &PeerNetwork, steps: u64) -> Result<Vec<u8>, PeerError> {
        let words = [("steps".to_owned(), steps.to_string())];
        Ok(net::weights::to_bytes(&network.valid().to_device(&Device::flex()), &words.into())?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Method;
    use geom::{Silent, Vec3};
    use segment::tile::LabelledScene;

    /// Three balls apart.
    fn balls(seed: u64) -> ThinScene {
        let mut rng = SeedTree::new(seed).rng();
        let mut scene = LabelledScene { unit_m: 1.0, ..Default::default() };
        for ball in 0..3 {
            let centre = Vec3::new(2.6 * ball as f32, rng.random::<f32>(), 0.0);
            scene.centre_m.push(centre);
            for _ in 0..400 {
                let mut draw = || rng.random_range(-1.0_f32..1.0);
                let out = Vec3::new(draw(), draw(), draw()).normalize_or(Vec3::X);
                scene.position_m.push(centre + out);
                scene.instance.push(ball + 1);
            }
        }
        ThinScene::new(&scene, 1.0 / 7.0, 1.0, SeedTree::new(seed).child("thin", 0))
    }

    #[test]
    fn every_method_learns_on_both_backbones_and_goes_on_where_it_stopped() {
        let scenes = [balls(1), balls(2)];
        for method in [Method::Sgpn, Method::Asis, Method::BoNet, Method::PointGroup] {
            for backbone in [Backbone::Dgcnn, Backbone::SparseUnet] {
                let folder = tempfile::tempdir().unwrap();
                let config =
                    PeerConfig { points: 128, replicas: 1, ..PeerConfig::new(method, backbone, 6) };
                let run =
                    || train(&scenes, &config, folder.path(), SeedTree::new(3), &Silent).unwrap();
                let (peer, steps) = run();
                assert_eq!(steps, 6);
                let again = run().0;
                let tile = balls(3).sample(300, 10.0, 0.0, false, SeedTree::new(4));
                let groups = peer.groups(&tile.position, SeedTree::new(5));
                assert_eq!(again.groups(&tile.position, SeedTree::new(5)), groups);
                let mut points: Vec<u32> = groups.iter().flat_map(|g| g.points.clone()).collect();
                let count = points.len();
                points.sort_unstable();
                points.dedup();
                assert_eq!(points.len(), count, "{method:?}: a point in two groups");
            }
        }
    }

    #[test]
    fn no_scenes_is_said() {
        let folder = tempfile::tempdir().unwrap();
        let config = PeerConfig::new(Method::Asis, Backbone::Dgcnn, 1);
        let none = train(&[], &config, folder.path(), SeedTree::new(1), &Silent);
        assert!(matches!(none, Err(PeerError::NoScenes)));
    }

    #[test]
    fn pointgroup_parts_balls_after_a_short_training() {
        let scenes: Vec<ThinScene> = (0..6).map(balls).collect();
        let folder = tempfile::tempdir().unwrap();
        let config = PeerConfig {
            points: 700,
            replicas: 1,
            ..PeerConfig::new(Method::PointGroup, Backbone::SparseUnet, 250)
        };
        let (peer, _) = train(&scenes, &config, folder.path(), SeedTree::new(1), &Silent).unwrap();
        let tile = balls(99).tile(10_000, 0.0, false, SeedTree::new(4));
        let groups = peer.groups(&tile.position, SeedTree::new(5));
        let right = (1..=3_u32).filter(|&ball| {
            let truth: Vec<u32> = (0..tile.instance.len() as u32)
                .filter(|&i| tile.instance[i as usize] == ball)
                .collect();
            groups.iter().any(|g| crate::grouping::iou(&g.points, &truth) > 0.5)
        });
        assert_eq!(right.count(), 3);
    }
}
