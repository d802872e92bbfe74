//! The network over a thinned cloud of any size: square tiles in plan, each seen with a margin as wide as the network
//! looks, so that a point's result does not depend on where the tiles are cut.

use crate::SegmentConfig;
use crate::SegmentError;
use crate::embedding_clusters::Clusters;
use crate::output::EMBEDDING;
use geom::{Bounds, Observer, SeedTree, Vec2, Vec3};
use net::replicas::each_on_one_thread;
use std::cmp::Reverse;
use std::collections::BTreeMap;

/// Edge of a tile's core, d_max.
const CORE: f32 = 16.0;
/// Seen beyond the core, d_max: three hops to the farthest of 80 neighbours at the default resolution.
const MARGIN: f32 = 2.2;
/// Points of a tile above which its core is halved.
const MOST_POINTS: usize = 16_000;

/// What the network says of every thinned point; lengths in d_max.
#[derive(Clone, Debug, Default)]
pub(crate) struct Prediction {
    /// Expected pose centre.
    pub vote: Vec<Vec3>,
    /// Expected distance of the vote from the true centre.
    pub error: Vec<f32>,
    /// Probability of lying on a block.
    pub block: Vec<f32>,
    /// Centre score; empty unless asked for with the embedding.
    pub centre: Vec<f32>,
    /// 128 numbers a point; empty unless asked for.
    pub embedding: Vec<f32>,
}

/// A network of whose points each votes for its block's centre.
pub(crate) trait TileVotes: Sync {
    /// What it says of a tile's core, in its order; `position` are all points of the cloud, d_max.
    fn predict(&self, position: &[Vec3], tile: &Tile, with_embedding: bool) -> Prediction;
}

/// A network with a clustering of its own.
pub(crate) trait OwnClusters: Sync {
    /// Instances of a thinned cloud, d_max; `points_done` hears how many points are finished.
    fn cluster(
        &self,
        position: &[Vec3],
        config: &SegmentConfig,
        seed: SeedTree,
        observer: &dyn Observer,
        points_done: &mut dyn FnMut(usize),
    ) -> Result<Found, SegmentError>;
}

/// Labels of all points; a prediction whose `vote` is each point's cluster middle.
pub(crate) struct Found {
    pub clusters: Clusters,
    pub prediction: Prediction,
}

/// Runs the network on clouds (d_max), all their tiles side by side, a tile a thread. `tile_done` hears the part of the
/// work finished so far.
pub(crate) fn predict(
    network: &dyn TileVotes,
    clouds: &[Vec<Vec3>],
    with_embedding: bool,
    observer: &dyn Observer,
    mut tile_done: impl FnMut(f32),
) -> Result<Vec<Prediction>, SegmentError> {
    let mut jobs: Vec<(usize, Tile)> = Vec::new();
    for (cloud, position) in clouds.iter().enumerate() {
        jobs.extend(tiles(position, CORE, MARGIN).into_iter().map(|tile| (cloud, tile)));
    }
    // Long ones first, so that the threads end together.
    jobs.sort_by_key(|(_, tile)| Reverse(tile.points.len()));
    let work = |job: usize| {
        let (cloud, tile) = &jobs[job];
        (!observer.cancelled()).then(|| network.predict(&clouds[*cloud], tile, with_embedding))
    };
    let mut out: Vec<Prediction> =
        clouds.iter().map(|c| Prediction::zeros(c.len(), with_embedding)).collect();
    let total = clouds.iter().map(Vec::len).sum::<usize>().max(1) as f32;
    let mut finished = 0;
    let mut cancelled = false;
    let done = |job: usize, result: Option<Prediction>| {
        let (cloud, tile) = &jobs[job];
        match result {
            Some(part) => {
                out[*cloud].take(&tile.points[..tile.core], part);
                finished += tile.core;
                tile_done(finished as f32 / total);
            }
            None => cancelled = true,
        }
        !cancelled
    };
    each_on_one_thread(jobs.len(), work, done).map_err(SegmentError::Threads)?;
    if cancelled { Err(SegmentError::Cancelled) } else { Ok(out) }
}

impl Prediction {
    fn zeros(n: usize, with_embedding: bool) -> Self {
        let n_embedding = if with_embedding { n } else { 0 };
        Self {
            vote: vec![Vec3::ZERO; n],
            error: vec![0.0; n],
            block: vec![0.0; n],
            centre: vec![0.0; n_embedding],
            embedding: vec![0.0; n_embedding * EMBEDDING],
        }
    }

    /// Takes what `part` says of `points`, in their order.
    fn take(&mut self, points: &[u32], part: Self) {
        for (slot, &i) in points.iter().enumerate() {
            let i = i as usize;
            self.vote[i] = part.vote[slot];
            self.error[i] = part.error[slot];
            self.block[i] = part.block[slot];
            if !part.embedding.is_empty() {
                self.centre[i] = part.centre[slot];
                self.embedding[i * EMBEDDING..][..EMBEDDING]
                    .copy_from_slice(&part.embedding[slot * EMBEDDING..][..EMBEDDING]);
            }
        }
    }
}

/// Points of a tile, those of its core first.
pub(crate) struct Tile {
    pub points: Vec<u32>,
    pub core: usize,
    pub middle: Vec3,
}

/// Squares of about `core_edge` d_max with `margin` around them. A margin must not be wider than a core.
pub(crate) fn tiles(position: &[Vec3], core_edge: f32, margin: f32) -> Vec<Tile> {
    let bounds = Bounds::of(position.iter().copied());
    let size = bounds.size().truncate();
    let count = (size / core_edge).ceil().max(Vec2::ONE);
    let step = (size / count).max(Vec2::splat(1e-6));
    // Only occupied cells: a stray point kilometres away must not cost memory.
    let mut cells: BTreeMap<(i64, i64), Vec<u32>> = BTreeMap::new();
    for (i, p) in position.iter().enumerate() {
        let at = ((*p - bounds.min).truncate() / step).floor().min(count - 1.0);
        cells.entry((at.x as i64, at.y as i64)).or_default().push(i as u32);
    }
    let mut tiles = Vec::new();
    for (&(x, y), core) in &cells {
        let low = bounds.min.truncate() + step * Vec2::new(x as f32, y as f32);
        let mut around = Vec::new();
        for v in y - 1..=y + 1 {
            for u in x - 1..=x + 1 {
                if (u, v) != (x, y) {
                    around.extend(cells.get(&(u, v)).into_iter().flatten());
                }
            }
        }
        divide(position, core.clone(), around, [low, low + step], margin, &mut tiles);
    }
    tiles
}

/// Adds the tile with the margin it needs, or its two halves when it holds too many points.
fn divide(
    position: &[Vec3],
    core: Vec<u32>,
    around: Vec<u32>,
    [low, high]: [Vec2; 2],
    margin: f32,
    tiles: &mut Vec<Tile>,
) {
    let size = high - low;
    if core.len() > MOST_POINTS && size.max_element() > margin {
        let axis = usize::from(size.y > size.x);
        let cut = (low[axis] + high[axis]) / 2.0;
        let (left, right): (Vec<u32>, Vec<u32>) =
            core.iter().partition(|&&i| position[i as usize][axis] < cut);
        let (mut left_high, mut right_low) = (high, low);
        left_high[axis] = cut;
        right_low[axis] = cut;
        let with = |other: &[u32]| around.iter().chain(other).copied().collect::<Vec<u32>>();
        let (left_around, right_around) = (with(&right), with(&left));
        divide(position, left, left_around, [low, left_high], margin, tiles);
        divide(position, right, right_around, [right_low, high], margin, tiles);
        return;
    }
    if core.is_empty() {
        return;
    }
    // Nearest to the core first: what only a level's neighbours look at comes last and is not computed further.
    let outside = |i: u32| {
        let p = position[i as usize].truncate();
        (low - p).max(p - high).max_element()
    };
    let count = core.len();
    let mut points = core;
    let mut beside: Vec<(u32, u32)> = around
        .into_iter()
        .filter(|&i| outside(i) <= margin)
        .map(|i| (outside(i).max(0.0).to_bits(), i))
        .collect();
    beside.sort_unstable();
    points.extend(beside.into_iter().map(|b| b.1));
    let middle = ((low + high) / 2.0).extend(position[points[0] as usize].z);
    tiles.push(Tile { points, core: count, middle });
}

#[cfg(test)]
mod tests {
    use super::*;
    use geom::SeedTree;
    use rand::RngExt;

    #[test]
    fn every_point_is_in_one_core_and_sees_its_margin() {
        let mut rng = SeedTree::new(1).rng();
        let position: Vec<Vec3> = (0..60_000)
            .map(|_| {
                Vec3::new(
                    rng.random::<f32>() * 40.0,
                    rng.random::<f32>() * 13.0,
                    rng.random::<f32>(),
                )
            })
            .collect();
        let mut seen = vec![0; position.len()];
        for tile in tiles(&position, CORE, MARGIN) {
            let core = Bounds::of(tile.points[..tile.core].iter().map(|&i| position[i as usize]));
            for &i in &tile.points[..tile.core] {
                seen[i as usize] += 1;
            }
            let inside = |p: Vec3| {
                let (low, high) = (core.min - (MARGIN - 0.1), core.max + (MARGIN - 0.1));
                p.truncate().cmpge(low.truncate()).all()
                    && p.truncate().cmple(high.truncate()).all()
            };
            let expected = position.iter().filter(|p| inside(**p)).count();
            assert!(tile.points.len() >= expected);
        }
        assert!(seen.iter().all(|&s| s == 1));
    }
}
