//! Meshes laid onto a horizontal raster: which cell centres a posed mesh covers, and at what heights.

use crate::height_map::CellRect;
use crate::{Pose, TriMesh, Vec2, Vec3};

/// Where the cells of a map lie, apart from their heights.
#[derive(Clone, Copy)]
pub(crate) struct Raster {
    pub origin: [f32; 2],
    pub cell_m: f32,
    pub nx: usize,
    pub ny: usize,
}

impl Raster {
    /// Tells `cover` every cell centre the posed mesh lies over or under, with the height there.
    pub fn visit(
        self,
        mesh: &TriMesh,
        map_from_mesh: &Pose,
        mut cover: impl FnMut(usize, f32),
    ) -> CellRect {
        let vertices: Vec<Vec3> = mesh.vertices.iter().map(|&v| *map_from_mesh * v).collect();
        let (mut min, mut max) = (Vec2::splat(f32::INFINITY), Vec2::splat(f32::NEG_INFINITY));
        for v in &vertices {
            (min, max) = (min.min(v.truncate()), max.max(v.truncate()));
        }
        for t in &mesh.triangles {
            self.visit_triangle(t.map(|i| vertices[i as usize]), &mut cover);
        }
        if vertices.is_empty() {
            return CellRect { x0: 0, x1: 0, y0: 0, y1: 0 };
        }
        self.rect_between(min, max)
    }

    /// Cells whose centres lie in the closed rectangle.
    fn rect_between(&self, min: Vec2, max: Vec2) -> CellRect {
        let (x0, x1) = self.range(min.x, max.x, self.origin[0], self.nx);
        let (y0, y1) = self.range(min.y, max.y, self.origin[1], self.ny);
        CellRect { x0, x1, y0, y1 }
    }

    /// Columns or rows between two places. Casts instead of `ceil` and `floor`, which are calls on a plain x86-64: most
    /// triangles of a block cover no centre at all, so this is half the cost of laying it onto the raster.
    fn range(&self, low: f32, high: f32, origin: f32, n: usize) -> (usize, usize) {
        let low = (low - origin) / self.cell_m - 1e-3;
        let whole = low as usize;
        let first = whole.saturating_add(usize::from(low > whole as f32)).min(n);
        let high = (high - origin) / self.cell_m + 1e-3;
        let end = if high >= 0.0 { (high as usize).saturating_add(1).min(n) } else { 0 };
        (first, end.max(first))
    }

    /// Every cell centre on or in the triangle's shadow gets the plane's height there.
    fn visit_triangle(&self, corners: [Vec3; 3], cover: &mut impl FnMut(usize, f32)) {
        let [a, b, c] = corners;
        let (ab, ac) = ((b - a).truncate(), (c - a).truncate());
        let twice = ab.perp_dot(ac);
        // A triangle seen edge-on covers no centre; its neighbours carry its rim.
        if twice.is_nan() || twice.abs() <= 1e-12 {
            return;
        }
        let (low, high) = (a.min(b).min(c), a.max(b).max(c));
        let (x0, x1) = self.range(low.x, high.x, self.origin[0], self.nx);
        if x0 == x1 {
            return;
        }
        let (y0, y1) = self.range(low.y, high.y, self.origin[1], self.ny);
        // A hair of tolerance, so that a centre on a shared edge is covered by at least one of its triangles.
        let hair = 1e-5;
        for iy in y0..y1 {
            for ix in x0..x1 {
                let centre = Vec2::new(
                    self.origin[0] + ix as f32 * self.cell_m,
                    self.origin[1] + iy as f32 * self.cell_m,
                );
                let p = centre - a.truncate();
                let (v, w) = (p.perp_dot(ac) / twice, ab.perp_dot(p) / twice);
                if v >= -hair && w >= -hair && v + w <= 1.0 + hair {
                    let z = a.z + v * (b.z - a.z) + w * (c.z - a.z);
                    cover(iy * self.nx + ix, z.clamp(low.z, high.z));
                }
            }
        }
    }
}
