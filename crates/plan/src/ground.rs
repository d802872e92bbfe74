//! The ground under the pile, from what the recognised blocks do not explain.
//!
//! In: the survey and the recognised blocks. Out: a height grid. Points on or near a recognised block are set aside; of
//! the rest a low percentile per cell is a candidate. Two facts of the site clean it: ground does not rise by half
//! a block within a block's length (that is a block nobody recognised), and no block reaches below the ground it
//! stands on, so the undersides of the accepted blocks are an upper bound. Cells without evidence are interpolated.

use geom::{Event, HeightMap, MeshQuery, Observer, PointCloud, Pose, Stage, Vec2, Vec3, Warning};
use scene::{Catalog, Ground, ModelId, Recognised};
use serde::{Deserialize, Serialize};

/// Fewer known cells than one in so many is told: the rest is interpolated. Free choice.
const LITTLE_SEEN: usize = 20;
/// Cells along the longer side at most: a stray point far out must not make the grid huge.
pub(crate) const MOST_CELLS: f32 = 4000.0;
/// A cell is compared with those this many block lengths around it: as far as a block on the ground reaches, and one more.
const RISEN_WITHIN: f32 = 2.0;
/// Finer cells, in block lengths, are taken for this: what is compared must stay bounded.
const FINEST_CELL: f32 = 0.1;

/// Settings; lengths are in units of the largest block's box edge.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct GroundConfig {
    /// Edge of a cell, in block lengths.
    pub cell: f32,
    /// Points this near to a recognised block belong to it, in block lengths.
    pub near: f32,
    /// Which of a cell's heights counts, in [0, 1].
    pub percentile: f32,
    /// Fewest unexplained points that say anything of a cell.
    pub points: usize,
    /// Rise between neighbouring cells that no ground makes, in block lengths, on top of `slope`.
    pub step: f32,
    /// Steepest ground, rise over run.
    pub slope: f32,
}

impl Default for GroundConfig {
    fn default() -> Self {
        Self { cell: 0.5, near: 0.05, percentile: 0.1, points: 3, step: 0.2, slope: 0.7 }
    }
}

/// Estimates the ground; says so when it had to guess.
pub fn estimate_ground(
    cloud: &PointCloud,
    recognised: &[Recognised],
    catalog: &Catalog,
    config: &GroundConfig,
    observer: &dyn Observer,
) -> Ground {
    let warn =
        |message: String| observer.event(Event::Warned(Warning { stage: Stage::Plan, message }));
    let length_m = catalog.iter().map(|(_, m)| m.d_box_m).fold(0.0, f32::max);
    let accepted = Accepted::of(recognised, catalog);
    let lowest = |(model, pose): &(ModelId, Pose)| {
        catalog
            .get(*model)
            .mesh
            .vertices
            .iter()
            .map(|&v| (*pose * v).z)
            .fold(f32::INFINITY, f32::min)
    };
    let lowest_m = accepted.blocks.iter().map(lowest).fold(f32::INFINITY, f32::min);
    if cloud.is_empty() || length_m <= 0.0 {
        let z_m = if lowest_m.is_finite() { lowest_m } else { 0.0 };
        warn(format!(
            "no points to estimate the ground from: taken as level at {z_m:.2} m (local height)"
        ));
        return Ground::Level { z_m };
    }
    let claimed = recognised.iter().flat_map(|r| &r.points).copied();
    let loose = unexplained(cloud, claimed, &accepted, config.near * length_m);
    let mut map = low_points(cloud, &loose, config, length_m);
    drop_risen_cells(&mut map, config, length_m);
    let known = map.z_m.iter().filter(|z| z.is_finite()).count();
    if known == 0 {
        let z_m = if lowest_m.is_finite() { lowest_m } else { cloud.bounds().min.z };
        warn(format!(
            "the survey shows no ground between the blocks: taken as level at the lowest block, {z_m:.2} m (local height); \
             give a ground level if you know it"
        ));
        return Ground::Level { z_m };
    }
    if known * LITTLE_SEEN < map.z_m.len() {
        warn(format!(
            "ground is seen in {known} of {} cells only; the rest is interpolated",
            map.z_m.len()
        ));
    }
    map.fill_empty();
    press_under(&mut map, &accepted.blocks, catalog);
    Ground::Grid { origin: map.origin, cell_m: map.cell_m, nx: map.nx, z_m: map.z_m }
}

/// The blocks that are there.
pub(crate) struct Accepted<'a> {
    recognised: &'a [Recognised],
    catalog: &'a Catalog,
    /// Type and pose of each.
    pub blocks: Vec<(ModelId, Pose)>,
}

impl<'a> Accepted<'a> {
    /// Those of a recognition that are judged and of the catalogue.
    pub fn of(recognised: &'a [Recognised], catalog: &'a Catalog) -> Self {
        let stated = scene::stated(recognised).map(|(_, fit)| (fit.model, fit.site_from_block));
        let blocks = stated.filter(|(model, _)| (model.0 as usize) < catalog.len()).collect();
        Self { recognised, catalog, blocks }
    }

    /// Survey points they claim.
    pub fn points(&self) -> impl Iterator<Item = u32> + 'a {
        scene::stated(self.recognised).flat_map(|(block, _)| &block.points).copied()
    }
}

/// Indices of the points that are not claimed and that no accepted block touches.
pub(crate) fn unexplained(
    cloud: &PointCloud,
    claimed: impl Iterator<Item = u32>,
    accepted: &Accepted,
    near_m: f32,
) -> Vec<u32> {
    let Accepted { catalog, blocks: accepted, .. } = accepted;
    let mut explained = vec![false; cloud.len()];
    for point in claimed {
        if let Some(flag) = explained.get_mut(point as usize) {
            *flag = true;
        }
    }
    let edge_m = accepted.iter().map(|(m, _)| 2.0 * catalog.get(*m).d_max_m).fold(1e-3, f32::max);
    let square = |p: Vec3| ((p.x / edge_m).floor() as i64, (p.y / edge_m).floor() as i64);
    let mut squares: std::collections::BTreeMap<(i64, i64), Vec<usize>> = Default::default();
    // One query structure a model; a mesh without triangles explains nothing.
    let queries: Vec<Option<MeshQuery>> =
        catalog.iter().map(|(_, m)| MeshQuery::new(&m.mesh).ok()).collect();
    for (i, (model, pose)) in accepted.iter().enumerate() {
        squares.entry(square(*pose * catalog.get(*model).centre)).or_default().push(i);
    }
    let touches = |p: Vec3| {
        let (x, y) = square(p);
        let near = (x - 1..=x + 1).flat_map(|x| (y - 1..=y + 1).map(move |y| (x, y)));
        near.filter_map(|s| squares.get(&s)).flatten().any(|&i| {
            let (id, pose) = accepted[i];
            let model = catalog.get(id);
            (p - pose * model.centre).length() <= model.d_max_m + near_m
                && queries[id.0 as usize]
                    .as_ref()
                    .is_some_and(|q| q.signed_distance_m(pose.inverse() * p) <= near_m)
        })
    };
    (0..cloud.len())
        .filter(|&i| {
            let p = cloud.position_m[i];
            !explained[i] && p.is_finite() && !touches(p)
        })
        .map(|i| i as u32)
        .collect()
}

/// The low percentile of each cell that has enough points.
fn low_points(
    cloud: &PointCloud,
    loose: &[u32],
    config: &GroundConfig,
    length_m: f32,
) -> HeightMap {
    let bounds = cloud.bounds();
    let cell_m = (config.cell * length_m).max((bounds.size().x.max(bounds.size().y)) / MOST_CELLS);
    let mut map =
        HeightMap::empty(bounds.min.truncate(), bounds.max.truncate() + Vec2::splat(1e-3), cell_m);
    let mut heights: Vec<Vec<f32>> = vec![Vec::new(); map.z_m.len()];
    for &i in loose {
        let p = cloud.position_m[i as usize];
        if let Some((ix, iy)) = map.cell_of(p.x, p.y) {
            heights[iy * map.nx + ix].push(p.z);
        }
    }
    for (cell, mut z) in heights.into_iter().enumerate() {
        if z.len() >= config.points.max(1) {
            let at = ((z.len() - 1) as f32 * config.percentile.clamp(0.0, 1.0)).round() as usize;
            map.z_m[cell] = *z.select_nth_unstable_by(at, f32::total_cmp).1;
        }
    }
    map
}

/// Empties cells that stand above a cell nearby by more than ground can.
fn drop_risen_cells(map: &mut HeightMap, config: &GroundConfig, length_m: f32) {
    let known = map.clone();
    let reach = (RISEN_WITHIN / config.cell.max(FINEST_CELL)).ceil() as usize;
    for iy in 0..map.ny {
        for ix in 0..map.nx {
            let z = known.at(ix, iy);
            let near_x = ix.saturating_sub(reach)..(ix + reach + 1).min(map.nx);
            let near_y = iy.saturating_sub(reach)..(iy + reach + 1).min(map.ny);
            let risen = near_y.flat_map(|j| near_x.clone().map(move |i| (i, j))).any(|(i, j)| {
                let run = known.cell_m * ((i.abs_diff(ix)) as f32).hypot(j.abs_diff(iy) as f32);
                z - known.at(i, j) > config.step * length_m + config.slope * run
            });
            if risen {
                map.z_m[iy * map.nx + ix] = f32::NAN;
            }
        }
    }
}

/// Presses the ground down to the undersides of the blocks that stand on it.
fn press_under(map: &mut HeightMap, accepted: &[(ModelId, Pose)], catalog: &Catalog) {
    for (model, pose) in accepted {
        map.lower(&catalog.get(*model).mesh, pose);
    }
}
