//! Points sorted into cubic cells: which lie near a place.
//!
//! In: positions and a cell edge. Out: indices within a radius, in a fixed order (cell by cell, ascending within).
//! Cells of one row along x lie next to each other in memory, so a ball is a few runs rather than many look-ups.

use crate::cells::Cells;
use crate::{Bounds, Vec3};

/// Positions sorted by cell.
#[derive(Clone, Debug)]
pub struct PointGrid {
    origin: Vec3,
    cell_m: f32,
    count: [u64; 3],
    /// Keys are linear cell numbers.
    cells: Cells<u64>,
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
        let cells = Cells::sorted(points, |p| {
            if !p.is_finite() {
                return None;
            }
            let c = ((p - origin) / cell_m).to_array().map(|v| v as u64);
            let c = [c[0].min(count[0] - 1), c[1].min(count[1] - 1), c[2].min(count[2] - 1)];
            Some((c[2] * count[1] + c[1]) * count[0] + c[0])
        });
        let position = cells.index.iter().map(|&i| points[i as usize]).collect();
        Self { origin, cell_m, count, cells, position }
    }

    /// The points by cell.
    pub(crate) fn cells(&self) -> &Cells<u64> {
        &self.cells
    }

    /// Calls `found(index, position, squared distance)` for every point within `radius_m` of `centre`.
    pub fn for_each_within(
        &self,
        centre: Vec3,
        radius_m: f32,
        mut found: impl FnMut(u32, Vec3, f32),
    ) {
        if self.position.is_empty() || !centre.is_finite() || radius_m < 0.0 {
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
                let start = self.cells.key.partition_point(|&k| k < row + x0);
                for i in start..self.position.len() {
                    if self.cells.key[i] > row + x1 {
                        break;
                    }
                    let d2 = (self.position[i] - centre).length_squared();
                    if d2 <= limit {
                        found(self.cells.index[i], self.position[i], d2);
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
    }

    #[test]
    fn nothing_is_found_in_nothing_and_nan_is_left_out() {
        assert!(PointGrid::new(&[], 0.1).within(Vec3::ZERO, 9.0).is_empty());
        let grid = PointGrid::new(&[Vec3::NAN, Vec3::X], 0.1);
        assert_eq!(grid.within(Vec3::ZERO, 9.0), vec![1]);
    }
}
