//! FPCC over a thinned cloud of any size: pieces as wide as the scenes it was trained on, each drawn into random batches,
//! clustered on its own — embeddings of two pieces do not compare — and stitched where their margins overlap.

use crate::embedding_clusters::{Clusters, cluster};
use crate::fpcc::{Fpcc, FpccConfig, batches, inputs_in};
use crate::infer::{Found, OwnClusters, Prediction, tiles};
use crate::network::Weighted;
use crate::output::EMBEDDING;
use crate::{SegmentConfig, SegmentError};
use geom::{Bounds, Observer, SeedTree, Vec3};
use net::floats;
use net::prelude::Device;

/// Edge of a piece's core, d_max.
const CORE: f32 = 6.0;
/// Seen beyond the core, d_max: a block whose centre lies in the core reaches one out, its neighbours one more.
pub(crate) const MARGIN: f32 = 2.0;

impl OwnClusters for Weighted<FpccConfig> {
    fn cluster(
        &self,
        position: &[Vec3],
        config: &SegmentConfig,
        seed: SeedTree,
        observer: &dyn Observer,
        points_done: &mut dyn FnMut(usize),
    ) -> Result<Found, SegmentError> {
        cluster_pieces(self, position, config, seed, observer, points_done)
    }
}

/// Runs the network on `position` (d_max) with its own clustering.
fn cluster_pieces(
    network: &Weighted<FpccConfig>,
    position: &[Vec3],
    config: &SegmentConfig,
    seed: SeedTree,
    observer: &dyn Observer,
    points_done: &mut dyn FnMut(usize),
) -> Result<Found, SegmentError> {
    let n = position.len();
    let mut found = Found {
        clusters: Clusters { centres: Vec::new(), member: vec![None; n] },
        prediction: Prediction {
            vote: position.to_vec(),
            error: vec![0.0; n],
            block: vec![1.0; n],
            centre: vec![0.0; n],
            embedding: Vec::new(),
        },
    };
    // Squared distance of each point to the centre it joined so far.
    let mut reach = vec![f32::INFINITY; n];
    let mut finished = 0;
    for (number, piece) in tiles(position, CORE, MARGIN).into_iter().enumerate() {
        if observer.cancelled() {
            return Err(SegmentError::Cancelled);
        }
        let local: Vec<Vec3> =
            piece.points.iter().map(|&i| position[i as usize] - piece.middle).collect();
        let batch_points = network.design.batch_points;
        let piece_seed = seed.child("piece", number as u64);
        let own = predict(&network.weights, batch_points, &local, piece_seed);
        let clusters = cluster(&local, &own, config.centre_threshold, config.suppression);
        let mut kept = vec![None; clusters.centres.len()];
        for (c, &at) in clusters.centres.iter().enumerate() {
            // The neighbouring piece has it in its own core.
            if (at as usize) < piece.core {
                kept[c] = Some(found.clusters.centres.len() as u32);
                found.clusters.centres.push(piece.points[at as usize]);
            }
        }
        for (slot, member) in clusters.member.iter().enumerate() {
            let Some((c, number)) = member.and_then(|c| kept[c as usize].map(|k| (c, k))) else {
                continue;
            };
            let d2 = (local[slot] - local[clusters.centres[c as usize] as usize]).length_squared();
            let i = piece.points[slot] as usize;
            if d2 < reach[i] {
                reach[i] = d2;
                found.clusters.member[i] = Some(number);
            }
        }
        for (slot, &i) in piece.points.iter().enumerate().take(piece.core) {
            found.prediction.centre[i as usize] = own.centre[slot];
        }
        finished += piece.core;
        points_done(finished);
    }
    middles(position, &mut found);
    Ok(found)
}

/// What the network says of one piece's points.
fn predict(network: &Fpcc, batch_points: usize, position: &[Vec3], seed: SeedTree) -> Prediction {
    let n = position.len();
    let mut out = Prediction {
        centre: vec![0.0; n],
        embedding: vec![0.0; n * EMBEDDING],
        ..Default::default()
    };
    let device = Device::flex();
    let input = inputs_in(position, &Bounds::of(position.iter().copied()));
    for batch in batches(n, batch_points, seed) {
        let rows: Vec<[f32; 6]> = batch.iter().map(|&i| input[i as usize]).collect();
        let result = network.forward(&rows, &device);
        let (centre, embedding) = (floats(result.centre), floats(result.embedding));
        for (slot, &i) in batch.iter().enumerate() {
            let i = i as usize;
            out.centre[i] = centre[slot];
            out.embedding[i * EMBEDDING..][..EMBEDDING]
                .copy_from_slice(&embedding[slot * EMBEDDING..][..EMBEDDING]);
        }
    }
    out
}

/// FPCC votes for nothing: a block's centre is guessed as the middle of its points.
fn middles(position: &[Vec3], found: &mut Found) {
    let mut sum = vec![(Vec3::ZERO, 0_u32); found.clusters.centres.len()];
    for (p, member) in position.iter().zip(&found.clusters.member) {
        if let Some(c) = member {
            let s = &mut sum[*c as usize];
            *s = (s.0 + *p, s.1 + 1);
        }
    }
    for (&centre, (total, count)) in found.clusters.centres.iter().zip(sum) {
        if count > 0 {
            found.prediction.vote[centre as usize] = total / count as f32;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use geom::Silent;
    use rand::RngExt;

    #[test]
    fn every_centre_is_found_once_whatever_the_pieces() {
        let device = Device::flex();
        device.seed(5);
        let config =
            FpccConfig { batch_points: 64, edge: 8, global: 16, joined: [12, 10], neighbours: 20 };
        let network = Weighted { weights: Fpcc::new(&config, &device), design: config };
        let all = SegmentConfig { centre_threshold: 0.0, suppression: 1.0, ..Default::default() };
        let mut rng = SeedTree::new(2).rng();
        let position: Vec<Vec3> = (0..3000)
            .map(|_| {
                Vec3::new(
                    rng.random::<f32>() * 20.0,
                    rng.random::<f32>() * 9.0,
                    rng.random::<f32>(),
                )
            })
            .collect();
        let found =
            network.cluster(&position, &all, SeedTree::new(1), &Silent, &mut |_| ()).unwrap();
        let mut centres = found.clusters.centres.clone();
        assert!(!centres.is_empty());
        centres.sort_unstable();
        centres.dedup();
        assert_eq!(centres.len(), found.clusters.centres.len());
        for (p, member) in position.iter().zip(&found.clusters.member) {
            if let Some(c) = member {
                let centre = position[found.clusters.centres[*c as usize] as usize];
                assert!((*p - centre).length() <= 1.0 + 1e-4, "farther than d_max is noise");
            }
        }
    }
}
