//! A part of the works taken out on its own, so that a change can be tried there without touching the rest.
//!
//! In: the pile before planning, the plan's blocks in planning order, a place. Out: a small [`Stack`] that holds everything a
//! drop at that place can meet, without the lifted blocks and without those that no longer rest where they did.

use crate::{
    Insertion, replan,
    rounds::{self, Turn},
    site::{Site, TypeToPlace},
    stack::Stack,
    windows,
};
use geom::{Bounds, CellRect, HeightMap, SeedTree, Vec2, Vec3};
use scene::{BlockModel, InstanceId, PlacedBlock, Placement, PlacementState};

/// Windows within this many window edges of the place are filled anew.
const FILLED: f32 = 1.5;
/// Most rounds in which they are filled.
const ROUNDS: u32 = 4;

/// The pile without and with the plan, kept up to date while the plan changes.
pub(crate) struct Base<'s, 'a> {
    existing: &'s Stack<'a>,
    /// Surface with all blocks of the plan.
    pub surface: HeightMap,
    pub design: &'s HeightMap,
    filled_m: f32,
    changed_m: f32,
    seen_m: f32,
    /// Half the edge of what is cut out of the raster: nothing that is changed reads or writes beyond it.
    raster_m: f32,
    d_max_m: f32,
    /// Blocks farther apart than this cannot have met while one of them settled.
    beside_m: f32,
    /// Room left about a block while it settles.
    room_m: f32,
}

impl<'s, 'a> Base<'s, 'a> {
    pub fn new(site: &Site, existing: &'s Stack<'a>, kept: &[Placement]) -> Self {
        let most = |of: fn(&TypeToPlace) -> f32| site.types.iter().map(of).fold(0.0, f32::max);
        let d_max_m = existing.catalog.d_max_m();
        let filled_m = FILLED * most(|t| t.settings.window_m);
        let changed_m = filled_m + 2.5 * d_max_m;
        let displacement_m = most(|t| t.settings.displacement_limit_m);
        let mut surface = existing.surface.clone();
        for p in kept {
            surface.raise(&existing.catalog.get(p.model).mesh, &p.rest);
        }
        Self {
            existing,
            surface,
            design: &existing.design,
            filled_m,
            changed_m,
            seen_m: most(|t| t.settings.local_radius_m) + d_max_m,
            raster_m: changed_m + displacement_m + 2.0 * d_max_m,
            d_max_m,
            beside_m: 2.0 * d_max_m + displacement_m,
            room_m: most(|t| t.settings.shake_limit_m),
        }
    }

    /// Box of everything a planned block passed from where it was let go to its rest.
    fn passed(&self, p: &Placement) -> Bounds {
        let vertices = &self.existing.catalog.get(p.model).mesh.vertices;
        let poses = || p.handling.path.iter().chain([&p.drop, &p.rest]);
        Bounds::of(poses().flat_map(|pose| vertices.iter().map(move |&v| *pose * v)))
            .grown(self.room_m)
    }

    /// Distance from which two changes cannot see each other.
    pub fn apart_m(&self) -> f32 {
        2.0 * self.changed_m + self.seen_m
    }

    /// The largest type.
    pub fn block(&self, site: &Site) -> &BlockModel {
        self.existing.catalog.get(site.main().model)
    }

    /// Centre of mass of a planned block at rest.
    pub fn centre(&self, p: &Placement) -> Vec3 {
        p.rest * self.existing.catalog.get(p.model).centre
    }

    fn away_m(&self, p: &Placement, place: Vec2) -> f32 {
        (self.centre(p).truncate() - place).length()
    }

    /// Blocks of the plan nearer than this.
    pub fn within(&self, kept: &[Placement], place: Vec2, radius_m: f32) -> Vec<usize> {
        (0..kept.len()).filter(|&i| self.away_m(&kept[i], place) < radius_m).collect()
    }

    /// The block of the plan nearest to a place, if it can be changed from there.
    pub fn nearest(&self, kept: &[Placement], place: Vec2) -> Option<usize> {
        let near = self.within(kept, place, self.filled_m);
        near.into_iter()
            .min_by(|&i, &j| self.away_m(&kept[i], place).total_cmp(&self.away_m(&kept[j], place)))
    }

    /// What is left of each type when these blocks are lifted.
    pub fn stock_left(
        &self,
        site: &Site,
        kept: &[Placement],
        lifted: &[usize],
    ) -> Vec<Option<u32>> {
        let left = |t: &TypeToPlace| {
            let own = |p: &&Placement| p.model == t.model;
            let used = kept.iter().filter(own).count()
                - lifted.iter().map(|&i| &kept[i]).filter(own).count();
            t.stock.map(|stock| stock.saturating_sub(used as u32))
        };
        site.types.iter().map(left).collect()
    }

    /// Void below the design, m³, in a region of the works as they are.
    pub fn void_m3(&self, region: &Region) -> f32 {
        windows::void_m3(&cropped(&self.surface, &region.cells), &region.stack.design)
    }

    /// Lays the surface anew where the plan changed.
    pub fn renew(&mut self, kept: &[Placement], place: Vec2) {
        let reach_m = self.changed_m + self.d_max_m;
        let cells = self.surface.rect_around(place.x, place.y, reach_m);
        for iy in cells.y0..cells.y1 {
            let row = iy * self.surface.nx;
            self.surface.z_m[row + cells.x0..row + cells.x1]
                .copy_from_slice(&self.existing.surface.z_m[row + cells.x0..row + cells.x1]);
        }
        // The square's corners lie farther away than its edge.
        let near_m = 1.5 * reach_m + self.d_max_m;
        for i in self.within(kept, place, near_m) {
            let p = &kept[i];
            self.surface.raise(&self.existing.catalog.get(p.model).mesh, &p.rest);
        }
    }
}

/// A region with some blocks lifted.
pub(crate) struct Region<'a> {
    pub stack: Stack<'a>,
    pub cells: CellRect,
    /// Blocks that are not in it any more, by their place in the list.
    pub gone: Vec<usize>,
    place: Vec2,
    filled_m: f32,
}

impl<'a> Region<'a> {
    /// Lifts blocks and whatever does not stay without them; `None` when that would reach too far or to one of the first `fixed`.
    pub fn without(
        site: &Site,
        base: &Base<'_, 'a>,
        kept: &[Placement],
        place: Vec2,
        lifted: &[usize],
        fixed: usize,
    ) -> Option<Self> {
        let cells = base.surface.rect_around(place.x, place.y, base.raster_m);
        let met_m = base.changed_m + base.seen_m;
        let mut stack = base.existing.cropped(&cells, place, met_m);
        let mut gone: Vec<usize> = Vec::new();
        let mut left: Vec<Bounds> = Vec::new();
        // The square's corners lie farther away than its edge, and blocks reach into it.
        let laid_m = std::f32::consts::SQRT_2 * base.raster_m + base.d_max_m;
        for i in base.within(kept, place, laid_m.max(met_m)) {
            let p = &kept[i];
            if lifted.contains(&i) {
                gone.push(i);
                left.push(base.passed(p));
                continue;
            }
            let beside =
                |&g: &usize| base.away_m(&kept[g], base.centre(p).truncate()) < base.beside_m;
            // What did not pass where a lifted block stood settles as it did.
            let met = || {
                let passed = base.passed(p);
                left.iter().any(|l| l.intersects(&passed))
            };
            if gone.iter().any(beside) && met() {
                if base.away_m(p, place) > base.changed_m {
                    return None;
                }
                if replan::still_holds(site, &stack, p).is_none() {
                    if i < fixed {
                        return None;
                    }
                    gone.push(i);
                    left.push(base.passed(p));
                    continue;
                }
            }
            add(&mut stack, p);
        }
        Some(Self { stack, cells, gone, place, filled_m: base.filled_m })
    }

    /// Void below the design in it, m³.
    pub fn void_m3(&self) -> f32 {
        windows::void_m3(&self.stack.surface, &self.stack.design)
    }

    /// Fills the windows about the place; tells each new block with the void that is then left.
    pub fn fill(
        &mut self,
        types: &[TypeToPlace],
        mut stock: Vec<Option<u32>>,
        toe_first: bool,
        seed: SeedTree,
        mut told: impl FnMut(&Stack, &Placement, f32),
    ) {
        let mut closed: Vec<Vec2> = Vec::new();
        for round in 1..=ROUNDS {
            let mut any = false;
            for scale in 0..types.len() {
                let windows = self.windows(&types[scale], &closed, toe_first);
                for (w, window) in windows.iter().enumerate() {
                    let seed = seed
                        .child("window", (u64::from(round) * 64 + scale as u64) * 1024 + w as u64);
                    let turn = Turn { scale, round, insertion: Insertion::Straight };
                    let tried = rounds::serve(types, &stock, &self.stack, &turn, window, seed);
                    let Some(p) = tried.into_iter().find(|p| p.state == PlacementState::Kept)
                    else {
                        closed.push(window.centre);
                        continue;
                    };
                    any = true;
                    add(&mut self.stack, &p);
                    let of = types.iter().position(|t| t.model == p.model);
                    if let Some(left) = of.and_then(|t| stock[t].as_mut()) {
                        *left = left.saturating_sub(1);
                    }
                    told(&self.stack, &p, self.void_m3());
                }
            }
            if !any {
                break;
            }
        }
    }

    /// Windows near the place that were not tried in vain, in the order in which they are filled.
    fn windows(
        &self,
        kind: &TypeToPlace,
        closed: &[Vec2],
        toe_first: bool,
    ) -> Vec<windows::Window> {
        let same_m = 0.45 * kind.settings.window_m;
        let open = |w: &windows::Window| {
            (w.centre - self.place).length() <= self.filled_m
                && kind.allowed.covers(w.centre)
                && closed.iter().all(|c| (*c - w.centre).length() >= same_m)
        };
        let surface = &self.stack.surface;
        let mut windows = windows::detect(surface, &self.stack.design, &kind.settings, open);
        if toe_first {
            let level = |w: &windows::Window| {
                let (x, y) = ((w.cells.x0 + w.cells.x1) / 2, (w.cells.y0 + w.cells.y1) / 2);
                surface.at(x, y)
            };
            windows.sort_by(|a, b| level(a).total_cmp(&level(b)));
        }
        windows
    }
}

fn add(stack: &mut Stack, p: &Placement) {
    let block = InstanceId(stack.blocks.len() as u32 + 1);
    stack.add(PlacedBlock { block, model: p.model, site_from_block: p.rest }, 0);
}

/// The cells of a rectangle as a map of their own, on the same raster.
pub(crate) fn cropped(map: &HeightMap, cells: &CellRect) -> HeightMap {
    let first = map.centre(cells.x0, cells.y0);
    let (nx, ny) = (cells.x1 - cells.x0, cells.y1 - cells.y0);
    let row = |iy: usize| &map.z_m[iy * map.nx + cells.x0..iy * map.nx + cells.x1];
    let z_m = (cells.y0..cells.y1).flat_map(|iy| row(iy).iter().copied()).collect();
    HeightMap { origin: [first.x, first.y], cell_m: map.cell_m, nx, ny, z_m }
}
