//! Height grids of both epochs over one raster.

use geom::{Bounds, Vec2, Vec3};

/// Points of a cell within this much of its highest one, in cells, are its surface.
const TOP: f32 = 0.5;

/// Mean height of the top surface in each cell, earlier and later.
pub(crate) struct Heights {
    low: Vec2,
    cell_m: f32,
    nx: usize,
    ny: usize,
    z_m: [Vec<f32>; 2],
}

/// Volumes of some cells.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Volumes {
    pub lost_m3: f64,
    pub gained_m3: f64,
    /// Plan area that both epochs show.
    pub area_m2: f64,
}

impl Heights {
    pub fn of(earlier: &[Vec3], later: &[Vec3], cell_m: f32) -> Self {
        let bounds = Bounds::of(earlier.iter().chain(later).copied().filter(|p| p.is_finite()));
        let low = bounds.min.truncate();
        let size = bounds.size().truncate();
        let count = |v: f32| (v / cell_m) as usize + 1;
        let (nx, ny) = if bounds.is_empty() { (0, 0) } else { (count(size.x), count(size.y)) };
        let mut out = Self { low, cell_m, nx, ny, z_m: [Vec::new(), Vec::new()] };
        out.z_m = [out.tops(earlier), out.tops(later)];
        out
    }

    fn tops(&self, points: &[Vec3]) -> Vec<f32> {
        let mut top = vec![f32::NEG_INFINITY; self.nx * self.ny];
        for p in points.iter().filter(|p| p.is_finite()) {
            let i = self.cell(*p);
            top[i] = top[i].max(p.z);
        }
        let (mut sum, mut count) = (vec![0.0_f32; top.len()], vec![0.0_f32; top.len()]);
        for p in points.iter().filter(|p| p.is_finite()) {
            let i = self.cell(*p);
            if p.z >= top[i] - TOP * self.cell_m {
                sum[i] += p.z - top[i];
                count[i] += 1.0;
            }
        }
        let mean = |i: usize| if count[i] > 0.0 { top[i] + sum[i] / count[i] } else { f32::NAN };
        (0..top.len()).map(mean).collect()
    }

    fn cell(&self, p: Vec3) -> usize {
        let at = (p.truncate() - self.low) / self.cell_m;
        (at.y as usize).min(self.ny - 1) * self.nx + (at.x as usize).min(self.nx - 1)
    }

    pub fn cells(&self) -> usize {
        self.nx * self.ny
    }

    pub fn cell_m(&self) -> f32 {
        self.cell_m
    }

    /// Middle of a cell.
    pub fn place(&self, i: usize) -> Vec3 {
        let at = Vec2::new((i % self.nx) as f32 + 0.5, (i / self.nx) as f32 + 0.5);
        (self.low + at * self.cell_m).extend(0.0)
    }

    /// Heights of a cell that both epochs show.
    pub fn both(&self, i: usize) -> Option<[f32; 2]> {
        let z = [self.z_m[0][i], self.z_m[1][i]];
        z.iter().all(|z| z.is_finite()).then_some(z)
    }

    /// Lost and gained where a cell changes by more than the level and a fifth of its edge (its own roughness).
    pub fn volumes(&self, cells: &[usize], level_m: f64) -> Volumes {
        let area = f64::from(self.cell_m).powi(2);
        let level = level_m.max(0.2 * f64::from(self.cell_m));
        let mut out = Volumes::default();
        for z in cells.iter().filter_map(|&i| self.both(i)) {
            let change = f64::from(z[1] - z[0]);
            out.area_m2 += area;
            if change > level {
                out.gained_m3 += area * change;
            } else if change < -level {
                out.lost_m3 -= area * change;
            }
        }
        out
    }

    /// Height that a twentieth of the cells exceeds, in both epochs.
    pub fn crest(&self, cells: &[usize]) -> Option<[f64; 2]> {
        let seen: Vec<[f32; 2]> = cells.iter().filter_map(|&i| self.both(i)).collect();
        if seen.is_empty() {
            return None;
        }
        let one = |e: usize| {
            let mut z: Vec<f32> = seen.iter().map(|z| z[e]).collect();
            z.sort_by(f32::total_cmp);
            f64::from(z[(0.95 * (z.len() - 1) as f32).round() as usize])
        };
        Some([one(0), one(1)])
    }
}
