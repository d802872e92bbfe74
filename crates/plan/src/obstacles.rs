//! What stands on the ground and is no recognised block: a block of another kind, a crown wall, a block that was missed.
//!
//! In: the ground, the survey and the recognised blocks. Out: the ground with such things on it, solid up to where
//! points were measured, so that nothing is planned into them. A survey that the blocks explain leaves the ground as it is.

use crate::GroundConfig;
use crate::ground::{Accepted, MOST_CELLS, unexplained};
use geom::{Event, HeightMap, Observer, PointCloud, Stage, Vec2, Warning};
use scene::{Catalog, Ground, Recognised};

/// Edge of a cell, in block lengths.
const CELL: f32 = 0.125;
/// Of a cell's points this part must stand on the ground unexplained: fewer are noise of the block below them.
const SHARE: f32 = 0.25;
/// Cells on each side of a cell that decide with it.
const AROUND: usize = 2;
/// Standing cells, of the 25 there, that make a thing of more than a few outliers.
const FEWEST: usize = 8;
/// Which of a cell's standing points is its height.
const PERCENTILE: f32 = 0.9;
/// Rounds in which unseen cells beside standing ones become solid too: sides that no ray met.
const SHADOW: usize = 2;

/// Puts what the blocks do not explain onto the ground and says how much that is.
pub fn with_obstacles(
    ground: Ground,
    cloud: &PointCloud,
    recognised: &[Recognised],
    catalog: &Catalog,
    config: &GroundConfig,
    observer: &dyn Observer,
) -> Ground {
    let length_m = catalog.iter().map(|(_, m)| m.d_box_m).fold(0.0, f32::max);
    if cloud.is_empty() || length_m <= 0.0 {
        return ground;
    }
    let accepted = Accepted::of(recognised, catalog);
    let (mut tops, seen) = standing(&ground, cloud, &accepted, config, length_m);
    let (cell_m, solid) = (tops.cell_m, tops.z_m.iter().filter(|z| z.is_finite()).count());
    if solid == 0 {
        return ground;
    }
    let area_m2 = solid as f32 * cell_m * cell_m;
    let digits = if area_m2 < 0.1 { 4 } else { usize::from(area_m2 < 10.0) };
    observer.event(Event::Warned(Warning {
        stage: Stage::Plan,
        message: format!(
            "{area_m2:.digits$} m² of the survey stand above the ground and are no recognised block: taken as solid, nothing is planned into \
             it; look there for missed blocks and for types the catalogue does not name"
        ),
    }));
    for _ in 0..SHADOW {
        fill_shadow(&mut tops, &seen);
    }
    // No recognised block reaches into what stands beside or below it.
    let mut undersides = HeightMap { z_m: vec![f32::NAN; tops.z_m.len()], ..tops.clone() };
    for (model, pose) in &accepted.blocks {
        undersides.lower(&catalog.get(*model).mesh, pose);
    }
    let mut whole = tops.clone();
    whole.fill_with(|x, y| ground.height_m(x, y));
    for (cell, z) in whole.z_m.iter_mut().enumerate() {
        // `min` and `max` pass over NaN.
        let top = if tops.z_m[cell].is_nan() {
            f32::NAN
        } else {
            tops.z_m[cell].min(undersides.z_m[cell])
        };
        *z = z.max(top);
    }
    Ground::Grid { origin: whole.origin, cell_m, nx: whole.nx, z_m: whole.z_m }
}

/// Heights of the cells in which something stands, and the survey points of each cell.
fn standing(
    ground: &Ground,
    cloud: &PointCloud,
    accepted: &Accepted,
    config: &GroundConfig,
    length_m: f32,
) -> (HeightMap, Vec<u32>) {
    let loose = unexplained(cloud, accepted.points(), accepted, config.near * length_m);
    let bounds = cloud.bounds();
    let cell_m = (CELL * length_m).max(bounds.size().x.max(bounds.size().y) / MOST_CELLS);
    let mut tops =
        HeightMap::empty(bounds.min.truncate(), bounds.max.truncate() + Vec2::splat(1e-3), cell_m);
    let seen = counts(&tops, cloud);
    let rise_m = config.step * length_m + config.slope * cell_m;
    let mut high: Vec<(usize, f32)> = Vec::new();
    for &i in &loose {
        let p = cloud.position_m[i as usize];
        if let Some((ix, iy)) = tops.cell_of(p.x, p.y)
            && p.z > ground.height_m(p.x, p.y) + rise_m
        {
            high.push((iy * tops.nx + ix, p.z));
        }
    }
    high.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
    for column in high.chunk_by(|a, b| a.0 == b.0) {
        let cell = column[0].0;
        if column.len() as f32 >= SHARE * seen[cell] as f32 {
            tops.z_m[cell] = column[((column.len() - 1) as f32 * PERCENTILE).round() as usize].1;
        }
    }
    drop_few(&mut tops);
    (tops, seen)
}

/// Survey points of each cell.
fn counts(map: &HeightMap, cloud: &PointCloud) -> Vec<u32> {
    let mut count = vec![0_u32; map.z_m.len()];
    for p in &cloud.position_m {
        if let Some((ix, iy)) = map.cell_of(p.x, p.y) {
            count[iy * map.nx + ix] += 1;
        }
    }
    count
}

/// Heights of the other cells within `reach` cells.
fn around(map: &HeightMap, ix: usize, iy: usize, reach: usize) -> impl Iterator<Item = f32> + '_ {
    let columns = ix.saturating_sub(reach)..(ix + reach + 1).min(map.nx);
    let rows = iy.saturating_sub(reach)..(iy + reach + 1).min(map.ny);
    let cells = rows.flat_map(move |j| columns.clone().map(move |i| (i, j)));
    cells.filter(move |&c| c != (ix, iy)).map(|(i, j)| map.at(i, j))
}

/// Empties standing cells that hardly another stands beside.
fn drop_few(map: &mut HeightMap) {
    let known = map.clone();
    for iy in 0..map.ny {
        for ix in 0..map.nx {
            if around(&known, ix, iy, AROUND).filter(|z| z.is_finite()).count() + 1 < FEWEST {
                map.z_m[iy * map.nx + ix] = f32::NAN;
            }
        }
    }
}

/// Gives cells without any point, beside at least three standing ones, the height of the lowest of these.
fn fill_shadow(map: &mut HeightMap, seen: &[u32]) {
    let known = map.clone();
    for iy in 0..map.ny {
        for ix in 0..map.nx {
            let cell = iy * map.nx + ix;
            if seen[cell] == 0 && known.z_m[cell].is_nan() {
                let beside: Vec<f32> =
                    around(&known, ix, iy, 1).filter(|z| z.is_finite()).collect();
                if beside.len() >= 3 {
                    map.z_m[cell] = beside.into_iter().fold(f32::INFINITY, f32::min);
                }
            }
        }
    }
}
