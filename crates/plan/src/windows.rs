//! Space detection: where a block is missing (METHOD §6 step 2, Eq. 4.1–4.2, Algorithm 2).
//!
//! In: the present surface and the design on the same raster. Out: windows of about one block whose summed deficit
//! exceeds the minimum volume v, the best first, overlapping ones suppressed. Deficits are signed: what already
//! stands above the design counts against a window. Cells without a design count nothing.

use crate::Settings;
use geom::{CellRect, HeightMap, Vec2};

/// A place that lacks at least the minimum volume.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Window {
    /// The cells of the window.
    pub cells: CellRect,
    /// Its middle.
    pub centre: Vec2,
    /// Summed deficit, m³.
    pub deficit_m3: f32,
}

/// Windows that are open, exceed the minimum volume and survive the suppression, largest deficit first.
pub fn detect(
    surface: &HeightMap,
    design: &HeightMap,
    settings: &Settings,
    mut open: impl FnMut(&Window) -> bool,
) -> Vec<Window> {
    let size = cells_in(settings.window_m, surface.cell_m).min(surface.nx).min(surface.ny);
    let stride = cells_in(settings.stride_m, surface.cell_m);
    let summed = summed_deficit(surface, design);
    let mut windows = Vec::new();
    for y0 in (0..=surface.ny - size).step_by(stride) {
        for x0 in (0..=surface.nx - size).step_by(stride) {
            let cells = CellRect { x0, x1: x0 + size, y0, y1: y0 + size };
            let centre = (surface.centre(cells.x0, cells.y0)
                + surface.centre(cells.x1 - 1, cells.y1 - 1))
                * 0.5;
            let inside = design.at(x0 + size / 2, y0 + size / 2).is_finite();
            let deficit_m3 = summed.over(&cells) as f32;
            let window = Window { cells, centre, deficit_m3 };
            if inside && deficit_m3 > settings.minimum_volume_m3 && open(&window) {
                windows.push(window);
            }
        }
    }
    suppress(windows, settings.nms_iou)
}

/// Leaves `most` of the windows, evenly from the first to the last; 0 leaves all.
pub fn thin(windows: &mut Vec<Window>, most: usize) {
    let all = windows.len();
    if most > 0 && most < all {
        *windows = (0..most).map(|i| windows[i * all / most]).collect();
    }
}

/// Non-maximum suppression by IoU (Algorithm 2); ties keep the window found first.
pub fn suppress(mut windows: Vec<Window>, iou: f32) -> Vec<Window> {
    windows.sort_by(|a, b| b.deficit_m3.total_cmp(&a.deficit_m3));
    let mut kept: Vec<Window> = Vec::new();
    // Windows are all of one size: only kept ones in the neighbouring buckets can overlap.
    let mut buckets: std::collections::BTreeMap<(usize, usize), Vec<usize>> = Default::default();
    for window in windows {
        let size = (window.cells.x1 - window.cells.x0).max(1);
        let (bx, by) = (window.cells.x0 / size, window.cells.y0 / size);
        let near = (bx.saturating_sub(1)..=bx + 1)
            .flat_map(|x| (by.saturating_sub(1)..=by + 1).map(move |y| (x, y)));
        let covered = near
            .filter_map(|b| buckets.get(&b))
            .flatten()
            .any(|&k| kept[k].cells.iou(&window.cells) >= iou);
        if !covered {
            buckets.entry((bx, by)).or_default().push(kept.len());
            kept.push(window);
        }
    }
    kept
}

fn cells_in(length_m: f32, cell_m: f32) -> usize {
    ((length_m / cell_m).round() as usize).max(1)
}

/// Deficit of one cell, m³ (Eq. 4.2); 0 where nothing is designed.
pub fn cell_deficit_m3(surface: &HeightMap, design: &HeightMap, cell: usize) -> f32 {
    let lacking_m = design.z_m[cell] - surface.z_m[cell];
    if lacking_m.is_finite() { lacking_m * surface.cell_m * surface.cell_m } else { 0.0 }
}

/// Sum of the cells' positive deficits, m³: the void below the design.
pub fn void_m3(surface: &HeightMap, design: &HeightMap) -> f32 {
    (0..surface.z_m.len())
        .map(|c| f64::from(cell_deficit_m3(surface, design, c).max(0.0)))
        .sum::<f64>() as f32
}

/// A summed-area table: any rectangle's sum in four look-ups.
struct Summed {
    stride: usize,
    sum: Vec<f64>,
}

fn summed_deficit(surface: &HeightMap, design: &HeightMap) -> Summed {
    let stride = surface.nx + 1;
    let mut sum = vec![0.0; stride * (surface.ny + 1)];
    for iy in 0..surface.ny {
        let mut row = 0.0;
        for ix in 0..surface.nx {
            row += f64::from(cell_deficit_m3(surface, design, iy * surface.nx + ix));
            sum[(iy + 1) * stride + ix + 1] = sum[iy * stride + ix + 1] + row;
        }
    }
    Summed { stride, sum }
}

impl Summed {
    fn over(&self, r: &CellRect) -> f64 {
        let at = |x: usize, y: usize| self.sum[y * self.stride + x];
        at(r.x1, r.y1) - at(r.x0, r.y1) - at(r.x1, r.y0) + at(r.x0, r.y0)
    }
}
