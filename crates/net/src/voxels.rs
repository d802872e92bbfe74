//! Voxels of a cloud at several resolutions and how they hang together, for sparse convolutions.
//!
//! In: points and the edge of a voxel. Out: for every level, each twice as coarse as the one before, the 27 neighbours of
//! each occupied voxel and the eight children that each coarser one has. Only occupied voxels exist; a hash finds them.

use geom::Vec3;

/// No such voxel.
pub const NONE: u32 = u32::MAX;
/// Neighbours of a voxel, itself included.
pub const NEIGHBOURS: usize = 27;
/// Children of a voxel of the next level.
pub const CHILDREN: usize = 8;
/// Numbers of a voxel the network reads: mean of its points from its middle, in edges, one, and padding.
pub const INPUT: usize = 8;

/// One resolution.
#[derive(Clone, Debug, Default)]
pub struct VoxelLevel {
    /// Occupied voxels.
    pub count: usize,
    /// `[count · 27]`: the voxel at each offset, z slowest, or [`NONE`]; the voxel itself is the fourteenth.
    pub neighbours: Vec<u32>,
    /// `[coarser count · 8]`: the voxels of this level in each of the next; empty on the last level.
    pub children: Vec<u32>,
    /// `[count · 8]`: the voxel of the next level at the slot this one has in it; empty on the last level.
    pub parents: Vec<u32>,
}

/// A cloud as voxels.
#[derive(Clone, Debug, Default)]
pub struct Voxels {
    /// Finest first.
    pub levels: Vec<VoxelLevel>,
    /// Finest voxel of each point.
    pub voxel_of_point: Vec<u32>,
    /// Mean of the points of each finest voxel.
    pub mean: Vec<Vec3>,
    /// `[count · INPUT]` of the finest level.
    pub input: Vec<f32>,
}

impl Voxels {
    /// Voxels of `edge` and `levels - 1` coarser resolutions.
    pub fn new(points: &[Vec3], edge: f32, levels: usize) -> Self {
        let cells: Vec<[i32; 3]> = points.iter().map(|p| cell(*p / edge)).collect();
        let (mut coordinates, voxel_of_point) = distinct(&cells);
        let mut sum = vec![(Vec3::ZERO, 0_u32); coordinates.len()];
        for (p, &v) in points.iter().zip(&voxel_of_point) {
            let s = &mut sum[v as usize];
            *s = (s.0 + *p, s.1 + 1);
        }
        let mean: Vec<Vec3> = sum.iter().map(|&(s, n)| s / n as f32).collect();
        let mut input = Vec::with_capacity(mean.len() * INPUT);
        for (m, c) in mean.iter().zip(&coordinates) {
            let middle = Vec3::new(c[0] as f32, c[1] as f32, c[2] as f32) + 0.5;
            let off = *m / edge - middle;
            input.extend([off.x, off.y, off.z, 1.0, 0.0, 0.0, 0.0, 0.0]);
        }
        let mut made = Vec::with_capacity(levels);
        for level in 0..levels.max(1) {
            let mut this = VoxelLevel {
                count: coordinates.len(),
                neighbours: neighbours(&coordinates),
                ..Default::default()
            };
            if level + 1 < levels {
                let above: Vec<[i32; 3]> = coordinates.iter().map(|c| c.map(|v| v >> 1)).collect();
                let (coarser, parent) = distinct(&above);
                this.children = vec![NONE; coarser.len() * CHILDREN];
                this.parents = vec![NONE; coordinates.len() * CHILDREN];
                for (i, (c, &p)) in coordinates.iter().zip(&parent).enumerate() {
                    let slot = (c[0] & 1 | (c[1] & 1) << 1 | (c[2] & 1) << 2) as usize;
                    this.children[p as usize * CHILDREN + slot] = i as u32;
                    this.parents[i * CHILDREN + slot] = p;
                }
                coordinates = coarser;
            }
            made.push(this);
        }
        Self { levels: made, voxel_of_point, mean, input }
    }
}

/// Largest number of a cell along an axis; farther points share the outermost cells.
const FAR: f32 = (1 << 19) as f32;

fn cell(p: Vec3) -> [i32; 3] {
    let at = p.floor().clamp(Vec3::splat(-FAR), Vec3::splat(FAR));
    [at.x as i32, at.y as i32, at.z as i32]
}

/// Distinct cells in the order they come, and the number of each cell given.
fn distinct(cells: &[[i32; 3]]) -> (Vec<[i32; 3]>, Vec<u32>) {
    let mut table = CellTable::new(cells.len());
    let mut found = Vec::new();
    let number = cells
        .iter()
        .map(|c| {
            let number = table.number(key(*c), found.len() as u32);
            if number as usize == found.len() {
                found.push(*c);
            }
            number
        })
        .collect();
    (found, number)
}

fn neighbours(coordinates: &[[i32; 3]]) -> Vec<u32> {
    let mut table = CellTable::new(coordinates.len());
    for (i, c) in coordinates.iter().enumerate() {
        table.number(key(*c), i as u32);
    }
    let mut out = Vec::with_capacity(coordinates.len() * NEIGHBOURS);
    for c in coordinates {
        for z in -1..=1 {
            for y in -1..=1 {
                for x in -1..=1 {
                    out.push(table.find(key([c[0] + x, c[1] + y, c[2] + z])));
                }
            }
        }
    }
    out
}

/// 21 bits an axis; never 0.
fn key(c: [i32; 3]) -> u64 {
    let part = |v: i32| (i64::from(v) + (1 << 20)) as u64 & 0x1f_ffff;
    part(c[0]) | part(c[1]) << 21 | part(c[2]) << 42 | 1 << 63
}

/// Cells by key: open addressing, at most half full.
struct CellTable {
    keys: Vec<u64>,
    numbers: Vec<u32>,
    mask: usize,
}

impl CellTable {
    fn new(cells: usize) -> Self {
        let size = (2 * cells.max(1)).next_power_of_two();
        Self { keys: vec![0; size], numbers: vec![NONE; size], mask: size - 1 }
    }

    fn slot(&self, key: u64) -> usize {
        let mixed = key.wrapping_mul(0x9e37_79b9_7f4a_7c15);
        let mut at = (mixed ^ mixed >> 32) as usize & self.mask;
        while self.keys[at] != 0 && self.keys[at] != key {
            at = (at + 1) & self.mask;
        }
        at
    }

    /// The number of a cell, which is `next` when it is new.
    fn number(&mut self, key: u64, next: u32) -> u32 {
        let at = self.slot(key);
        if self.keys[at] == 0 {
            (self.keys[at], self.numbers[at]) = (key, next);
        }
        self.numbers[at]
    }

    fn find(&self, key: u64) -> u32 {
        self.numbers[self.slot(key)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use geom::SeedTree;
    use rand::RngExt;

    #[test]
    fn links_go_both_ways() {
        let mut rng = SeedTree::new(1).rng();
        let points: Vec<Vec3> = (0..3000)
            .map(|_| Vec3::new(rng.random(), rng.random(), rng.random()) * 4.0 - 2.0)
            .collect();
        let voxels = Voxels::new(&points, 0.3, 3);
        assert_eq!(voxels.levels.len(), 3);
        for (p, &v) in points.iter().zip(&voxels.voxel_of_point) {
            assert!((*p - voxels.mean[v as usize]).abs().max_element() <= 0.3 + 1e-6);
        }
        for level in &voxels.levels {
            for i in 0..level.count {
                assert_eq!(level.neighbours[i * NEIGHBOURS + 13], i as u32);
                for k in 0..NEIGHBOURS {
                    let j = level.neighbours[i * NEIGHBOURS + k];
                    if j != NONE {
                        let back = level.neighbours[j as usize * NEIGHBOURS + 26 - k];
                        assert_eq!(back, i as u32);
                    }
                }
            }
            for (at, &child) in level.children.iter().enumerate().filter(|c| *c.1 != NONE) {
                let slot = child as usize * CHILDREN + at % CHILDREN;
                assert_eq!(level.parents[slot], (at / CHILDREN) as u32);
            }
        }
        let finest = &voxels.levels[0];
        assert_eq!(finest.parents.iter().filter(|p| **p != NONE).count(), finest.count);
        assert!(voxels.levels[1].count < finest.count);
    }

    #[test]
    fn nothing_and_far_away_are_no_trouble() {
        assert_eq!(Voxels::new(&[], 0.1, 3).levels[2].count, 0);
        let far = Voxels::new(&[Vec3::splat(1e30), Vec3::ZERO, Vec3::splat(-1e30)], 0.1, 4);
        assert_eq!(far.levels[0].count, 3);
    }
}
