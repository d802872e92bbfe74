//! Training tiles: a piece of a scene the way the network will see pieces of a survey.
//!
//! A labelled scene is thinned to the network's resolution once or twice (other grid, other density), then many tiles
//! are cut from it, each turned about the vertical and possibly mirrored.

use geom::{Bounds, SeedTree, Vec3, thin};
use net::Neighbourhood;
use rand::RngExt;
use rand::seq::SliceRandom;

/// A scene with its truth, in metres.
#[derive(Clone, Debug, Default)]
pub struct LabelledScene {
    /// Points, local frame.
    pub position_m: Vec<Vec3>,
    /// Block of each point, from 1; 0 for none.
    pub instance: Vec<u32>,
    /// Pose centre of block `i + 1`.
    pub centre_m: Vec<Vec3>,
    /// The network's unit of length for this scene: d_max of its blocks.
    pub unit_m: f32,
}

/// A scene thinned to the network's resolution, in units of d_max.
#[derive(Clone, Debug, Default)]
pub struct ThinScene {
    position: Vec<Vec3>,
    instance: Vec<u32>,
    offset: Vec<Vec3>,
}

/// What the points of a tile should be told.
#[derive(Clone, Debug)]
pub struct Targets {
    /// Positions, d_max.
    pub position: Vec<Vec3>,
    /// Block of each point; 0 for none.
    pub instance: Vec<u32>,
    /// From the point to its block's pose centre, d_max; zero for none.
    pub offset: Vec<Vec3>,
    /// 1 for points whose neighbourhood the cut did not touch, else 0.
    pub inner: Vec<f32>,
    /// Box around the piece of the scene the points were drawn from, in the same coordinates.
    pub bounds: Bounds,
}

impl Default for Targets {
    fn default() -> Self {
        Self {
            position: Vec::new(),
            instance: Vec::new(),
            offset: Vec::new(),
            inner: Vec::new(),
            bounds: Bounds::EMPTY,
        }
    }
}

impl Targets {
    /// s = 1 − (‖p − c‖ / d_max)^β, clipped to [0, 1]; 0 off the blocks (Eq. 2.5).
    pub fn centre_score(&self, beta: f32) -> Vec<f32> {
        let score = |o: &Vec3| {
            let part = if beta == 2.0 { o.length_squared() } else { o.length().powf(beta) };
            (1.0 - part).clamp(0.0, 1.0)
        };
        let one = |(&i, o): (&u32, &Vec3)| if i > 0 { score(o) } else { 0.0 };
        self.instance.iter().zip(&self.offset).map(one).collect()
    }
}

impl ThinScene {
    /// Thins `scene` with cells of `cell` d_max after keeping each point with a random probability of at least
    /// `sparsest`.
    pub fn new(scene: &LabelledScene, cell: f32, sparsest: f32, seed: SeedTree) -> Self {
        let mut rng = seed.rng();
        let keep = sparsest + (1.0 - sparsest) * rng.random::<f32>();
        let shift = Vec3::new(rng.random(), rng.random(), rng.random());
        let kept: Vec<usize> =
            (0..scene.position_m.len()).filter(|_| rng.random::<f32>() < keep).collect();
        let positions: Vec<Vec3> = kept.iter().map(|&i| scene.position_m[i]).collect();
        let thinned = thin(&positions, cell * scene.unit_m, shift);
        let mut out = Self::default();
        for at in thinned.kept {
            let i = kept[at as usize];
            let (p, instance) = (scene.position_m[i], scene.instance[i]);
            out.position.push(p / scene.unit_m);
            out.instance.push(instance);
            out.offset.push(match instance {
                0 => Vec3::ZERO,
                b => (scene.centre_m[b as usize - 1] - p) / scene.unit_m,
            });
        }
        out
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        self.position.len()
    }

    /// True without points.
    pub fn is_empty(&self) -> bool {
        self.position.is_empty()
    }

    /// A random point, mostly one on a block.
    fn place<R: rand::Rng>(&self, rng: &mut R) -> Vec3 {
        let mut at = rng.random_range(0..self.len());
        for _ in 0..20 {
            if self.instance[at] > 0 {
                break;
            }
            at = rng.random_range(0..self.len());
        }
        self.position[at]
    }

    /// The `points` nearest in plan to a random point, mostly one on a block; turned, and mirrored half the time if
    /// `mirror`. Points nearer than `margin` d_max to the cut are not inner.
    pub fn tile(&self, points: usize, margin: f32, mirror: bool, seed: SeedTree) -> Targets {
        let mut rng = seed.rng();
        let middle = self.place(&mut rng);
        let mut near: Vec<(u32, u32)> = self
            .position
            .iter()
            .enumerate()
            .map(|(i, p)| ((*p - middle).truncate().length_squared().to_bits(), i as u32))
            .collect();
        let mut reach = f32::INFINITY;
        if near.len() > points {
            near.select_nth_unstable(points);
            reach = f32::from_bits(near[points].0).sqrt();
            near.truncate(points);
        }
        near.sort_unstable_by_key(|n| n.1);
        let turn = turn(mirror, &mut rng);
        let mut targets = Targets::default();
        for (distance, i) in near {
            let i = i as usize;
            targets.position.push(turn(self.position[i] - middle));
            targets.instance.push(self.instance[i]);
            targets.offset.push(turn(self.offset[i]));
            targets.inner.push(f32::from(f32::from_bits(distance).sqrt() <= reach - margin));
        }
        targets.bounds = Bounds::of(targets.position.iter().copied());
        targets
    }

    /// `points` drawn at random from a square piece `edge` d_max wide around a random point, mostly one on a block (METHOD
    /// §2: a batch is drawn from a whole scene); turned and mirrored as a tile. A piece of fewer points repeats some.
    pub fn sample(
        &self,
        points: usize,
        edge: f32,
        margin: f32,
        mirror: bool,
        seed: SeedTree,
    ) -> Targets {
        let mut rng = seed.rng();
        let middle = self.place(&mut rng);
        let turn = turn(mirror, &mut rng);
        let out =
            |i: usize| turn(self.position[i] - middle).truncate().abs().max_element() - 0.5 * edge;
        let mut inside: Vec<usize> = (0..self.len()).filter(|&i| out(i) <= 0.0).collect();
        inside.shuffle(&mut rng);
        let bounds = Bounds::of(inside.iter().map(|&i| turn(self.position[i] - middle)));
        let mut targets = Targets { bounds, ..Default::default() };
        for &i in inside.iter().cycle().take(points) {
            targets.position.push(turn(self.position[i] - middle));
            targets.instance.push(self.instance[i]);
            targets.offset.push(turn(self.offset[i]));
            targets.inner.push(f32::from(out(i) <= -margin));
        }
        targets
    }
}

/// A random turn about the vertical, and a mirror half the time if `mirror`.
fn turn<R: rand::Rng>(mirror: bool, rng: &mut R) -> impl Fn(Vec3) -> Vec3 + use<R> {
    let (sin, cos) = (rng.random::<f32>() * std::f32::consts::TAU).sin_cos();
    let side = if mirror && rng.random::<bool>() { -1.0 } else { 1.0 };
    move |v: Vec3| Vec3::new(side * (cos * v.x - sin * v.y), sin * v.x + cos * v.y, v.z)
}

/// The neighbourhood the network wants for the positions.
pub fn neighbourhood(position: Vec<Vec3>, config: &net::BackboneConfig) -> Neighbourhood {
    Neighbourhood::dilated(position, config.neighbours, config.dilation)
}
