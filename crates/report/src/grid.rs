//! A height map as the page holds it: few enough cells, 16 bits each.

use crate::blob::{Blob, Span};
use geom::HeightMap;
use serde::Serialize;

/// More cells than this are gathered: a page is looked at, not computed with.
const MOST_CELLS: usize = 300_000;
/// Nothing on a screen is finer, metres.
const FINEST_STEP: f32 = 0.001;

/// Where the values lie and how they are read: `low + (value − 1)·step`, 0 = none.
#[derive(Serialize)]
pub(crate) struct Grid {
    origin: [f32; 2],
    cell: f32,
    nx: usize,
    ny: usize,
    low: f32,
    step: f32,
    z: Span,
}

/// The map as columns; cells are means of those they gather, empty where none of them has a value.
pub(crate) fn grid(map: &HeightMap, blob: &mut Blob) -> Grid {
    let every = ((map.nx * map.ny).div_ceil(MOST_CELLS) as f32).sqrt().ceil().max(1.0) as usize;
    let map = if every == 1 { map.clone() } else { gathered(map, every) };
    let (low, _, high) = map.min_mean_max_m().unwrap_or((0.0, 0.0, 1.0));
    let step = ((high - low) / 65_534.0).max(FINEST_STEP.min((high - low).max(1e-6) / 2_000.0));
    let value = |z: f32| if z.is_finite() { 1 + ((z - low) / step).round() as u16 } else { 0 };
    let z = blob.u16_deltas(map.z_m.iter().map(|z| value(*z)));
    Grid { origin: map.origin, cell: map.cell_m, nx: map.nx, ny: map.ny, low, step, z }
}

fn gathered(map: &HeightMap, every: usize) -> HeightMap {
    let (nx, ny) = (map.nx.div_ceil(every), map.ny.div_ceil(every));
    let shift = (every - 1) as f32 / 2.0 * map.cell_m;
    let mean = |i: usize, j: usize| {
        let (mut sum, mut count) = (0.0_f32, 0_u32);
        for y in j * every..((j + 1) * every).min(map.ny) {
            for x in i * every..((i + 1) * every).min(map.nx) {
                let z = map.at(x, y);
                if z.is_finite() {
                    (sum, count) = (sum + z, count + 1);
                }
            }
        }
        if count == 0 { f32::NAN } else { sum / count as f32 }
    };
    HeightMap {
        origin: [map.origin[0] + shift, map.origin[1] + shift],
        cell_m: map.cell_m * every as f32,
        nx,
        ny,
        z_m: (0..nx * ny).map(|c| mean(c % nx, c / nx)).collect(),
    }
}
