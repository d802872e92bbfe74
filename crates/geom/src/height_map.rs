//! A height map: the highest surface above each cell of a horizontal raster.
//!
//! In: posed meshes and points. Out: one height per cell, sampled exactly at the cell's centre (a mesh is never
//! replaced by points of it, so thin legs cannot fall between samples of the surface). A cell nothing covers is
//! empty (NaN) until [`HeightMap::fill_empty`] interpolates it from its neighbours (METHOD §6, Eq. 4.1).

use crate::gaps;
use crate::raster::Raster;
use crate::{Pose, TriMesh, Vec2, Vec3};

/// Heights at the centres of square cells, row by row northwards; NaN where nothing is known.
#[derive(Clone, Debug, PartialEq)]
pub struct HeightMap {
    /// Centre of the first cell.
    pub origin: [f32; 2],
    /// Edge of a cell, metres.
    pub cell_m: f32,
    /// Cells along x.
    pub nx: usize,
    /// Cells along y.
    pub ny: usize,
    /// Heights, metres: `z_m[iy * nx + ix]`.
    pub z_m: Vec<f32>,
}

/// A half-open block of cells: columns `x0..x1`, rows `y0..y1`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CellRect {
    /// First column.
    pub x0: usize,
    /// One past the last column.
    pub x1: usize,
    /// First row.
    pub y0: usize,
    /// One past the last row.
    pub y1: usize,
}

impl CellRect {
    /// Number of cells.
    pub fn area(&self) -> usize {
        (self.x1 - self.x0) * (self.y1 - self.y0)
    }

    /// Shared cells over all cells of both.
    pub fn iou(&self, other: &Self) -> f32 {
        let across =
            |a0: usize, a1: usize, b0: usize, b1: usize| a1.min(b1).saturating_sub(a0.max(b0));
        let both = across(self.x0, self.x1, other.x0, other.x1)
            * across(self.y0, self.y1, other.y0, other.y1);
        both as f32 / (self.area() + other.area() - both).max(1) as f32
    }
}

impl HeightMap {
    /// An empty map whose cells cover the rectangle between two corners; at least one cell each way.
    pub fn empty(min: Vec2, max: Vec2, cell_m: f32) -> Self {
        let count = |from: f32, to: f32| (((to - from) / cell_m - 1e-4).ceil().max(1.0)) as usize;
        let (nx, ny) = (count(min.x, max.x), count(min.y, max.y));
        let half = cell_m / 2.0;
        Self { origin: [min.x + half, min.y + half], cell_m, nx, ny, z_m: vec![f32::NAN; nx * ny] }
    }

    /// Sets every cell from a height at its centre.
    pub fn fill_with(&mut self, height_m: impl Fn(f32, f32) -> f32) {
        for iy in 0..self.ny {
            for ix in 0..self.nx {
                let c = self.centre(ix, iy);
                self.z_m[iy * self.nx + ix] = height_m(c.x, c.y);
            }
        }
    }

    /// Centre of a cell.
    pub fn centre(&self, ix: usize, iy: usize) -> Vec2 {
        Vec2::new(
            self.origin[0] + ix as f32 * self.cell_m,
            self.origin[1] + iy as f32 * self.cell_m,
        )
    }

    /// Height of a cell; NaN when empty.
    pub fn at(&self, ix: usize, iy: usize) -> f32 {
        self.z_m[iy * self.nx + ix]
    }

    /// The cell that holds a place, or `None` outside the map.
    pub fn cell_of(&self, x: f32, y: f32) -> Option<(usize, usize)> {
        let (u, v) = self.grid_of(x, y);
        let (i, j) = ((u + 0.5).floor(), (v + 0.5).floor());
        let inside = i >= 0.0 && j >= 0.0 && i < self.nx as f32 && j < self.ny as f32;
        inside.then_some((i as usize, j as usize))
    }

    /// The cells whose centres lie within `half_m` of (x, y) along both axes, cut at the border.
    pub fn rect_around(&self, x: f32, y: f32, half_m: f32) -> CellRect {
        let (u, v) = self.grid_of(x, y);
        let half = half_m / self.cell_m;
        let range = |c: f32, n: usize| {
            let low = (c - half).ceil().clamp(0.0, n as f32) as usize;
            let high = ((c + half).floor() + 1.0).clamp(0.0, n as f32) as usize;
            (low, high.max(low))
        };
        let ((x0, x1), (y0, y1)) = (range(u, self.nx), range(v, self.ny));
        CellRect { x0, x1, y0, y1 }
    }

    /// Raises the map to a posed mesh wherever the mesh covers a cell's centre; returns the cells it may have touched.
    pub fn raise(&mut self, mesh: &TriMesh, map_from_mesh: &Pose) -> CellRect {
        let raster = self.raster();
        let z_m = &mut self.z_m;
        raster.visit(mesh, map_from_mesh, |cell, z| z_m[cell] = higher(z_m[cell], z))
    }

    /// The same from below: every covered cell takes the lower of its height and the mesh's.
    pub fn lower(&mut self, mesh: &TriMesh, map_from_mesh: &Pose) -> CellRect {
        let raster = self.raster();
        let z_m = &mut self.z_m;
        raster.visit(mesh, map_from_mesh, |cell, z| z_m[cell] = lower(z_m[cell], z))
    }

    /// Top and underside of a posed mesh on the raster of this map, NaN where it covers no centre; in one pass, because
    /// the planner asks for both for every pose it looks at.
    pub fn top_and_underside(&self, mesh: &TriMesh, map_from_mesh: &Pose) -> (Self, Self) {
        let mut top = Self { z_m: vec![f32::NAN; self.nx * self.ny], ..*self };
        let mut under = top.clone();
        self.raster().visit(mesh, map_from_mesh, |cell, z| {
            top.z_m[cell] = higher(top.z_m[cell], z);
            under.z_m[cell] = lower(under.z_m[cell], z);
        });
        (top, under)
    }

    /// Raises the map to points: each lifts the cell it falls into. Points outside are passed over.
    pub fn raise_points(&mut self, points: &[Vec3]) {
        for p in points {
            if let Some((ix, iy)) = self.cell_of(p.x, p.y) {
                let cell = &mut self.z_m[iy * self.nx + ix];
                if p.z.is_finite() && (cell.is_nan() || *cell < p.z) {
                    *cell = p.z;
                }
            }
        }
    }

    /// Gives every empty cell a height: linear interpolation between the nearest known cells of its row and of its
    /// column, each weighted by how near they are; where neither has known cells on both sides, the nearest
    /// one continues. A plane with holes comes back as that plane. A map without any height stays empty.
    pub fn fill_empty(&mut self) {
        gaps::fill(self);
    }

    /// Height at a place, bilinear between cell centres; `None` outside the map or next to an empty cell.
    pub fn sample_m(&self, x: f32, y: f32) -> Option<f32> {
        self.cell_of(x, y)?;
        let (u, v) = self.grid_of(x, y);
        let node = |c: f32, n: usize| {
            let c = c.clamp(0.0, (n - 1) as f32);
            let i = (c as usize).min(n.saturating_sub(2));
            (i, (i + 1).min(n - 1), c - i as f32)
        };
        let ((i0, i1, fx), (j0, j1, fy)) = (node(u, self.nx), node(v, self.ny));
        let low = self.at(i0, j0) * (1.0 - fx) + self.at(i1, j0) * fx;
        let high = self.at(i0, j1) * (1.0 - fx) + self.at(i1, j1) * fx;
        let z = low * (1.0 - fy) + high * fy;
        z.is_finite().then_some(z)
    }

    /// Lowest, mean and highest known height; `None` when every cell is empty.
    pub fn min_mean_max_m(&self) -> Option<(f32, f32, f32)> {
        let (mut low, mut high, mut sum, mut count) =
            (f32::INFINITY, f32::NEG_INFINITY, 0.0_f64, 0_u64);
        for &z in self.z_m.iter().filter(|z| !z.is_nan()) {
            (low, high, sum, count) = (low.min(z), high.max(z), sum + f64::from(z), count + 1);
        }
        (count > 0).then(|| (low, (sum / count as f64) as f32, high))
    }

    fn raster(&self) -> Raster {
        Raster { origin: self.origin, cell_m: self.cell_m, nx: self.nx, ny: self.ny }
    }

    fn grid_of(&self, x: f32, y: f32) -> (f32, f32) {
        ((x - self.origin[0]) / self.cell_m, (y - self.origin[1]) / self.cell_m)
    }
}

/// The higher of two heights; an empty cell (NaN) takes the new one.
fn higher(old: f32, z: f32) -> f32 {
    if old >= z { old } else { z }
}

/// The lower of two heights; an empty cell (NaN) takes the new one.
fn lower(old: f32, z: f32) -> f32 {
    if old <= z { old } else { z }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn pyramid() -> TriMesh {
        let vertices = vec![
            Vec3::new(-1.0, -1.0, 0.0),
            Vec3::new(1.0, -1.0, 0.0),
            Vec3::new(1.0, 1.0, 0.0),
            Vec3::new(-1.0, 1.0, 0.0),
            Vec3::new(0.0, 0.0, 1.0),
        ];
        let triangles = vec![[0, 2, 1], [0, 3, 2], [0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]];
        TriMesh { vertices, triangles }
    }

    #[test]
    fn a_pyramid_is_exact_at_every_centre() {
        let mut map = HeightMap::empty(Vec2::splat(-1.2), Vec2::splat(1.2), 0.1);
        let pose = Pose::from_translation(Vec3::new(0.03, -0.02, 2.0));
        map.raise(&pyramid(), &pose);
        for iy in 0..map.ny {
            for ix in 0..map.nx {
                let p = map.centre(ix, iy) - Vec2::new(0.03, -0.02);
                let height = 1.0 - p.x.abs().max(p.y.abs());
                let z = map.at(ix, iy);
                if height > 1e-3 {
                    assert!((z - 2.0 - height).abs() < 1e-4, "{p} {z} {height}");
                } else if height < -1e-3 {
                    assert!(z.is_nan());
                }
            }
        }
        let (low, _, high) = map.min_mean_max_m().unwrap();
        assert!(low >= 2.0 && high <= 3.0);
        let mut under = HeightMap::empty(Vec2::splat(-1.2), Vec2::splat(1.2), 0.1);
        under.lower(&pyramid(), &pose);
        assert!(under.z_m.iter().all(|z| z.is_nan() || (z - 2.0).abs() < 1e-5));
    }

    #[test]
    fn a_window_s_iou() {
        let a = CellRect { x0: 0, x1: 4, y0: 0, y1: 4 };
        let b = CellRect { x0: 2, x1: 6, y0: 0, y1: 4 };
        assert!((a.iou(&b) - 8.0 / 24.0).abs() < 1e-6);
        assert_eq!(a.iou(&CellRect { x0: 4, x1: 8, y0: 0, y1: 4 }), 0.0);
    }

    #[test]
    fn an_empty_map_stays_empty_and_answers() {
        let mut map = HeightMap::empty(Vec2::ZERO, Vec2::ONE, 0.25);
        map.fill_empty();
        assert_eq!(map.min_mean_max_m(), None);
        assert_eq!(map.sample_m(0.5, 0.5), None);
        map.raise_points(&[
            Vec3::new(0.1, 0.1, 3.0),
            Vec3::new(9.0, 9.0, 9.0),
            Vec3::new(0.1, 0.1, 2.0),
        ]);
        map.fill_empty();
        assert!(map.z_m.iter().all(|&z| (z - 3.0).abs() < 1e-6));
    }

    proptest! {
        #[test]
        fn one_pass_gives_the_same_bits_as_two(turn in (-3.0f32..3.0, -3.0f32..3.0), x in -2.0f32..2.0, z in -1.0f32..1.0) {
            let map = HeightMap::empty(Vec2::splat(-1.5), Vec2::splat(1.5), 0.07);
            let rotation = crate::Quat::from_rotation_x(turn.0) * crate::Quat::from_rotation_y(turn.1);
            let pose = Pose::from_parts(Vec3::new(x, 0.3, z), rotation);
            let (top, under) = map.top_and_underside(&pyramid(), &pose);
            let (mut raised, mut lowered) = (map.clone(), map.clone());
            raised.raise(&pyramid(), &pose);
            lowered.lower(&pyramid(), &pose);
            let bits = |map: &HeightMap| map.z_m.iter().map(|z| z.to_bits()).collect::<Vec<_>>();
            prop_assert_eq!(bits(&top), bits(&raised));
            prop_assert_eq!(bits(&under), bits(&lowered));
        }

        #[test]
        fn holes_in_a_plane_come_back_as_the_plane(
            slope in (-1.0f32..1.0, -1.0f32..1.0),
            holes in prop::collection::vec((1usize..11, 1usize..11), 0..60),
        ) {
            let mut map = HeightMap::empty(Vec2::ZERO, Vec2::splat(6.0), 0.5);
            let plane = |x: f32, y: f32| 3.0 + slope.0 * x + slope.1 * y;
            map.fill_with(plane);
            for (ix, iy) in holes {
                map.z_m[iy * 12 + ix] = f32::NAN;
            }
            map.fill_empty();
            for iy in 0..12 {
                for ix in 0..12 {
                    let c = map.centre(ix, iy);
                    prop_assert!((map.at(ix, iy) - plane(c.x, c.y)).abs() < 1e-4);
                }
            }
            prop_assert!((map.sample_m(2.6, 3.1).unwrap() - plane(2.6, 3.1)).abs() < 1e-4);
        }

        #[test]
        fn order_of_raising_never_matters(shift in prop::collection::vec((-1.0f32..1.0, -1.0f32..1.0, 0.0f32..1.0), 1..6)) {
            let poses: Vec<Pose> = shift.iter().map(|s| Pose::from_translation(Vec3::new(s.0, s.1, s.2))).collect();
            let build = |order: &mut dyn Iterator<Item = &Pose>| {
                let mut map = HeightMap::empty(Vec2::splat(-2.0), Vec2::splat(2.0), 0.1);
                for pose in order {
                    map.raise(&pyramid(), pose);
                }
                map.z_m.iter().map(|z| z.to_bits()).collect::<Vec<_>>()
            };
            prop_assert_eq!(build(&mut poses.iter()), build(&mut poses.iter().rev()));
        }
    }
}
