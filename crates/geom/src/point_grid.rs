//! Points sorted into cubic cells: which lie near a place.
//!
//! In: positions and a cell edge. Out: indices within a radius, in a fixed order (cell by cell, ascending within).
//! Cells of one row along x lie next to each other in memory, so a ball is a few runs rather than many look-ups.

use crate::{Bounds, Vec3};

/// Positions sorted by cell.
#[derive(Clone, Debug)]
pub struct PointGrid {
    origin: Vec3,
    cell_m: f32,
    count: [u64; 3],
    /// Linear cell number of each entry, ascending.
    key: Vec<u64>,
    /// Index of the point of each entry.
    index: Vec<u32>,
    /// Position of each entry.
    position: Vec<Vec3>,
}

impl PointGrid {
    /// Sorts the points into cells of edge `cell_m`; positions that are not finite are left out.
    pub fn new(points: &[Vec3], cell_m: f32) -> Self {
        let bounds = Bounds::of(points.iter().copied().filter(|p| p.is_finite()));
        let (origin, size) =
            if bounds.is_empty() { (Vec3::ZERO, Vec3::ZERO) } else { (bounds.min, bounds.size()) };
        // No more than 2²⁰ cells along an axis, so that keys fit whatever the cell.
        let cell_m = cell_m.max(size.max_element() / 1_048_576.0).max(f32::MIN_POSITIVE);
        let count = (size / cell_m).to_array().map(|n| n as u64 + 1);
        let mut order: Vec<(u64, u32)> = points
            .iter()
            .enumerate()
            .filter(|(_, p)| p.is_finite())
            .map(|(i, &p)| {
                let c = ((p - origin) / cell_m).to_array().map(|v| v as u64);
                let c = [c[0].min(count[0] - 1), c[1].min(count[1] - 1), c[2].min(count[2] - 1)];
                ((c[2] * count[1] + c[1]) * count[0] + c[0], i as u32)
            })
            .collect();
        order.sort_unstable();
        Self {
            origin,
            cell_m,
            count,
            key: order.iter().map(|o| o.0).collect(),
            index: order.iter().map(|o| o.1).collect(),
            position: order.iter().map(|o| points[o.1 as usize]).collect(),
        }
    }

    /// Calls `found(index, position, squared distance)` for every point within `radius_m` of `centre`.
    pub fn for_each_within(
        &self,
        centre: Vec3,
        radius_m: f32,
        mut found: impl FnMut(u32, Vec3, f32),
    ) {
        if self.key.is_empty() || !centre.is_finite() || radius_m < 0.0 {
            return;
        }
        let low = (centre - radius_m - self.origin) / self.cell_m;
        let high = (centre + radius_m - self.origin) / self.cell_m;
        let last = self.count.map(|n| (n - 1) as f32);
        if high.min_element() < 0.0
            || low.x > last[0] + 1.0
            || low.y > last[1] + 1.0
            || low.z > last[2] + 1.0
        {
            return;
        }
        let range = |axis: usize| {
            let cell = |v: f32| v.clamp(0.0, last[axis]) as u64;
            (cell(low[axis]), cell(high[axis]))
        };
        let ((x0, x1), (y0, y1), (z0, z1)) = (range(0), range(1), range(2));
        let limit = radius_m * radius_m;
        for z in z0..=z1 {
            for y in y0..=y1 {
                let row = (z * self.count[1] + y) * self.count[0];
                let start = self.key.partition_point(|&k| k < row + x0);
                for i in start..self.key.len() {
                    if self.key[i] > row + x1 {
                        break;
                    }
                    let d2 = (self.position[i] - centre).length_squared();
                    if d2 <= limit {
                        found(self.index[i], self.position[i], d2);
                    }
                }
            }
        }
    }

    /// Indices within `radius_m` of `centre`, ascending.
    pub fn within(&self, centre: Vec3, radius_m: f32) -> Vec<u32> {
        let mut index = Vec::new();
        self.for_each_within(centre, radius_m, |i, _, _| index.push(i));
        index.sort_unstable();
        index
    }

    /// Nearest point within `radius_m`: index and squared distance; the smaller index wins a tie.
    pub fn nearest_within(&self, centre: Vec3, radius_m: f32) -> Option<(u32, f32)> {
        let mut best: Option<(u32, f32)> = None;
        self.for_each_within(centre, radius_m, |i, _, d2| {
            if best.is_none_or(|(j, b)| d2 < b || (d2 == b && i < j)) {
                best = Some((i, d2));
            }
        });
        best
    }
}

/// A cloud with one point a cell.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Thinned {
    /// Indices of the points kept, ascending.
    pub kept: Vec<u32>,
    /// For every input point its cell's entry in `kept`; `u32::MAX` for a position that is not finite.
    pub owner: Vec<u32>,
}

/// One point of each occupied cell of edge `cell_m`: the one nearest to the mean of the cell's points.
pub fn thin(points: &[Vec3], cell_m: f32) -> Thinned {
    let grid = PointGrid::new(points, cell_m);
    let mut kept_by_cell = Vec::new();
    let mut start = 0;
    while start < grid.key.len() {
        let end = start + grid.key[start..].partition_point(|&k| k == grid.key[start]);
        let mean = grid.position[start..end].iter().copied().sum::<Vec3>() / (end - start) as f32;
        let off = |i: usize| (grid.position[i] - mean).length_squared();
        let best = (start..end)
            .min_by(|&a, &b| off(a).total_cmp(&off(b)))
            .expect("a cell in the list has a point");
        kept_by_cell.push((grid.index[best], start, end));
        start = end;
    }
    kept_by_cell.sort_unstable();
    let mut owner = vec![u32::MAX; points.len()];
    for (entry, &(_, start, end)) in kept_by_cell.iter().enumerate() {
        for &i in &grid.index[start..end] {
            owner[i as usize] = entry as u32;
        }
    }
    Thinned { kept: kept_by_cell.iter().map(|k| k.0).collect(), owner }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn finds_what_a_full_scan_finds(
            points in prop::collection::vec(prop::array::uniform3(-3.0_f32..3.0), 0..120),
            centre in prop::array::uniform3(-4.0_f32..4.0), radius in 0.0_f32..3.0, cell in 0.05_f32..2.0,
        ) {
            let points: Vec<Vec3> = points.into_iter().map(Vec3::from_array).collect();
            let centre = Vec3::from_array(centre);
            let grid = PointGrid::new(&points, cell);
            let want: Vec<u32> = (0..points.len() as u32)
                .filter(|&i| (points[i as usize] - centre).length_squared() <= radius * radius).collect();
            prop_assert_eq!(grid.within(centre, radius), want);
        }

        #[test]
        fn thinning_keeps_one_a_cell(points in prop::collection::vec(prop::array::uniform3(0.0_f32..1.0), 1..200)) {
            let points: Vec<Vec3> = points.into_iter().map(Vec3::from_array).collect();
            let Thinned { kept, owner } = thin(&points, 0.25);
            prop_assert!(!kept.is_empty() && kept.len() <= points.len().min(125));
            // The owner of every point lies in its cell.
            for (p, &o) in points.iter().zip(&owner) {
                prop_assert!((points[kept[o as usize] as usize] - *p).length() <= 0.25 * 1.7321);
            }
        }
    }

    #[test]
    fn nothing_is_found_in_nothing_and_nan_is_left_out() {
        assert!(PointGrid::new(&[], 0.1).within(Vec3::ZERO, 9.0).is_empty());
        let grid = PointGrid::new(&[Vec3::NAN, Vec3::X], 0.1);
        assert_eq!(grid.within(Vec3::ZERO, 9.0), vec![1]);
    }
}
