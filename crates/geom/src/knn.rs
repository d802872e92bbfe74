//! Exact k nearest neighbours of every point of a cloud, all at once.
//!
//! Points go into the cells of a sparse grid; the queries of a cell share one list of candidates from the cells
//! around it, so distances are computed over contiguous coordinates. A ring of cells is added until the k-th
//! distance found is no larger than the distance to the unseen space. Much faster than a tree when *every* point
//! asks (graph networks, normals); for single queries use a kd-tree.

use crate::cells::Cells;
use crate::{Bounds, Vec3};
use rayon::prelude::*;

/// Neighbours of every point: `k` indices a row, nearest first, the point itself included.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct KnnTable {
    /// Neighbours a point has: the `k` asked for, or the number of points when there are fewer.
    pub k: usize,
    /// Row-major, `k` a point; ties go to the lower index.
    pub index: Vec<u32>,
}

impl KnnTable {
    /// The neighbours of point `i`, nearest first.
    pub fn row(&self, i: usize) -> &[u32] {
        &self.index[i * self.k..(i + 1) * self.k]
    }
}

/// The `k` nearest neighbours of every point, itself included, exact; points must be finite.
/// `k` is capped at the number of points.
pub fn knn(points: &[Vec3], k: usize) -> KnnTable {
    let k = k.min(points.len());
    if k == 0 {
        return KnnTable::default();
    }
    let grid = Grid::new(points, k);
    let mut index = vec![0_u32; points.len() * k];
    // Rows are written in cell order (contiguous for a thread), then moved to the points' order.
    let mut rows = vec![0_u32; points.len() * k];
    let mut jobs = Vec::with_capacity(grid.cells.len());
    let mut rest = rows.as_mut_slice();
    for c in 0..grid.cells.len() {
        let (mine, tail) = rest.split_at_mut((grid.start[c + 1] - grid.start[c]) * k);
        jobs.push((c, mine));
        rest = tail;
    }
    jobs.par_chunks_mut(16).for_each_init(Search::default, |search, chunk| {
        for (c, out) in chunk {
            search.cell(&grid, *c, k, out);
        }
    });
    for (row, &i) in rows.chunks_exact(k).zip(&grid.order) {
        index[i as usize * k..][..k].copy_from_slice(row);
    }
    KnnTable { k, index }
}

/// Points sorted into the occupied cells of a grid.
struct Grid {
    origin: Vec3,
    cell_m: f32,
    cells: Vec<[i32; 3]>,
    start: Vec<usize>,
    order: Vec<u32>,
    x: Vec<f32>,
    y: Vec<f32>,
    z: Vec<f32>,
}

impl Grid {
    fn new(points: &[Vec3], k: usize) -> Self {
        let bounds = Bounds::of(points.iter().copied());
        let mut cell_m = first_guess_m(&bounds, points.len(), k);
        let mut keyed = sorted_keys(points, bounds.min, cell_m);
        // Scans are surfaces of unknown folding: measure how full the cells are, then correct once.
        let occupied = keyed.members().count();
        let mean = points.len() as f32 / occupied as f32;
        let wanted = (k as f32 / 5.0).max(2.0);
        if !(0.5..2.0).contains(&(mean / wanted)) {
            cell_m *= (wanted / mean).sqrt().clamp(0.05, 20.0);
            cell_m = cell_m.max(bounds.size().max_element() / 2e6);
            keyed = sorted_keys(points, bounds.min, cell_m);
        }
        let mut grid = Self {
            origin: bounds.min,
            cell_m,
            cells: Vec::new(),
            start: Vec::new(),
            x: keyed.index.iter().map(|&i| points[i as usize].x).collect(),
            y: keyed.index.iter().map(|&i| points[i as usize].y).collect(),
            z: keyed.index.iter().map(|&i| points[i as usize].z).collect(),
            order: keyed.index,
        };
        let mut last = None;
        for (at, &key) in keyed.key.iter().enumerate() {
            if last != Some(key) {
                grid.cells.push(unpack(key));
                grid.start.push(at);
                last = Some(key);
            }
        }
        grid.start.push(points.len());
        grid
    }

    /// Runs of cells with the given x and y and z between the limits are contiguous: their points' range.
    fn column(&self, x: i32, y: i32, z0: i32, z1: i32) -> std::ops::Range<usize> {
        let from = self.cells.partition_point(|c| (c[0], c[1], c[2]) < (x, y, z0));
        let to = from
            + self.cells[from..]
                .iter()
                .take_while(|c| (c[0], c[1]) == (x, y) && c[2] <= z1)
                .count();
        self.start[from]..self.start[to]
    }
}

/// One thread's buffers.
#[derive(Default)]
struct Search {
    x: Vec<f32>,
    y: Vec<f32>,
    z: Vec<f32>,
    id: Vec<u32>,
    key: Vec<u64>,
}

impl Search {
    fn cell(&mut self, grid: &Grid, cell: usize, k: usize, out: &mut [u32]) {
        let queries = grid.start[cell]..grid.start[cell + 1];
        let mut pending: Vec<usize> = queries.clone().collect();
        let mut ring = 1;
        while !pending.is_empty() {
            self.gather(grid, grid.cells[cell], ring);
            let everything = self.id.len() == grid.order.len();
            if self.id.len() < k {
                ring *= 2;
                continue;
            }
            pending.retain(|&q| {
                let slot = q - queries.start;
                !self.query(grid, cell, ring, q, everything, &mut out[slot * k..(slot + 1) * k])
            });
            ring += 1 + ring / 2;
        }
    }

    fn gather(&mut self, grid: &Grid, [cx, cy, cz]: [i32; 3], ring: i32) {
        self.x.clear();
        self.y.clear();
        self.z.clear();
        self.id.clear();
        let mut take = |range: std::ops::Range<usize>| {
            self.x.extend_from_slice(&grid.x[range.clone()]);
            self.y.extend_from_slice(&grid.y[range.clone()]);
            self.z.extend_from_slice(&grid.z[range.clone()]);
            self.id.extend_from_slice(&grid.order[range]);
        };
        if ring > 32 {
            // Far-away stragglers: everything is cheaper than looking up ever more empty columns.
            take(0..grid.order.len());
            return;
        }
        for x in cx - ring..=cx + ring {
            for y in cy - ring..=cy + ring {
                take(grid.column(x, y, cz - ring, cz + ring));
            }
        }
    }

    /// Writes the neighbours of point `q`; false when points outside the ring could still be nearer.
    fn query(
        &mut self,
        grid: &Grid,
        cell: usize,
        ring: i32,
        q: usize,
        everything: bool,
        out: &mut [u32],
    ) -> bool {
        let k = out.len();
        let (px, py, pz) = (grid.x[q], grid.y[q], grid.z[q]);
        self.key.clear();
        self.key.extend(self.x.iter().zip(&self.y).zip(&self.z).zip(&self.id).map(
            |(((x, y), z), &id)| {
                let (dx, dy, dz) = (x - px, y - py, z - pz);
                let d2 = dx * dx + dy * dy + dz * dz;
                // Bits of a non-negative float sort like the float; the index breaks ties.
                (u64::from(d2.to_bits()) << 32) | u64::from(id)
            },
        ));
        if k < self.key.len() {
            self.key.select_nth_unstable(k - 1);
        }
        let best = &mut self.key[..k];
        best.sort_unstable();
        if !everything {
            let [cx, cy, cz] = grid.cells[cell];
            let margin = |p: f32, origin: f32, c: i32| {
                let low = p - (origin + (c - ring) as f32 * grid.cell_m);
                let high = origin + (c + ring + 1) as f32 * grid.cell_m - p;
                low.min(high)
            };
            let seen = margin(px, grid.origin.x, cx)
                .min(margin(py, grid.origin.y, cy))
                .min(margin(pz, grid.origin.z, cz));
            // Rounding of the cell borders must not hide a neighbour.
            let seen = (seen - grid.cell_m * 1e-3).max(0.0);
            if f32::from_bits((best[k - 1] >> 32) as u32) > seen * seen {
                return false;
            }
        }
        for (o, key) in out.iter_mut().zip(best) {
            *o = *key as u32;
        }
        true
    }
}

/// Cell edge if the points lay on a flat sheet of the box's two largest sides.
fn first_guess_m(bounds: &Bounds, count: usize, k: usize) -> f32 {
    let mut size = bounds.size().to_array();
    size.sort_by(f32::total_cmp);
    let area = size[2] * size[1].max(size[2] * 1e-3);
    let per_cell = (k as f32 / 5.0).max(2.0);
    let edge = (area * per_cell / count as f32).sqrt();
    let smallest = (size[2] / 2e6).max(1e-6);
    if edge.is_finite() { edge.max(smallest) } else { 1.0 }
}

fn sorted_keys(points: &[Vec3], origin: Vec3, cell_m: f32) -> Cells<u64> {
    let cell = |v: f32| ((v / cell_m) as u64).min((1 << 21) - 1);
    Cells::sorted(points, |p| {
        let d = p - origin;
        Some((cell(d.x) << 42) | (cell(d.y) << 21) | cell(d.z))
    })
}

fn unpack(key: u64) -> [i32; 3] {
    let mask = (1 << 21) - 1;
    [(key >> 42) as i32, ((key >> 21) & mask) as i32, (key & mask) as i32]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::SeedTree;
    use proptest::prelude::*;
    use rand::RngExt;

    fn brute(points: &[Vec3], k: usize) -> KnnTable {
        let k = k.min(points.len());
        let mut index = Vec::new();
        for p in points {
            let mut all: Vec<(u32, u32)> = points
                .iter()
                .enumerate()
                .map(|(j, q)| {
                    let d = *q - *p;
                    ((d.x * d.x + d.y * d.y + d.z * d.z).to_bits(), j as u32)
                })
                .collect();
            all.sort_unstable();
            index.extend(all[..k].iter().map(|a| a.1));
        }
        KnnTable { k, index }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(40))]
        #[test]
        fn equals_brute_force(seed in 0_u64..1000, n in 1_usize..400, k in 1_usize..50, flat in 0.0_f32..1.0, clumps in 1_usize..6) {
            let mut rng = SeedTree::new(seed).rng();
            let points: Vec<Vec3> = (0..n).map(|i| {
                let clump = Vec3::new((i % clumps) as f32 * 30.0, 0.0, 0.0);
                clump + Vec3::new(rng.random::<f32>() * 5.0, rng.random::<f32>() * 3.0, rng.random::<f32>() * flat)
            }).collect();
            prop_assert_eq!(knn(&points, k), brute(&points, k));
        }
    }

    #[test]
    fn duplicates_a_lone_outlier_and_empty() {
        assert_eq!(knn(&[], 5), KnnTable::default());
        let same = vec![Vec3::ONE; 40];
        assert_eq!(knn(&same, 8), brute(&same, 8));
        let mut far = vec![Vec3::ZERO; 10];
        far.extend((0..200).map(|i| Vec3::new(i as f32 * 0.01, (i * 7 % 13) as f32 * 0.01, 0.0)));
        far.push(Vec3::new(1e5, -2e4, 300.0));
        assert_eq!(knn(&far, 12), brute(&far, 12));
    }
}
