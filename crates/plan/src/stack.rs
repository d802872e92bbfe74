//! The pile as it stands at one moment of planning: blocks, present surface, design, who is near whom.

use crate::{Inside, region};
use geom::{CellRect, HeightMap, Pose, Vec2, Vec3};
use scene::{Catalog, DesignSurface, Ground, ModelId, PlacedBlock, SiteFrame};
use sim::BlockShape;

/// A block within solid walls is judged drawn in to this part about its centre: it may press into a wall by a hundredth.
const WITHIN_WALLS: f32 = 0.98;

/// Blocks so far and the surface they make.
pub(crate) struct Stack<'a> {
    pub catalog: &'a Catalog,
    pub shapes: &'a [BlockShape],
    pub ground: &'a Ground,
    pub design_surface: &'a DesignSurface,
    pub frame: &'a SiteFrame,
    /// Existing blocks first, then new ones in the order of placing.
    pub blocks: Vec<PlacedBlock>,
    /// How many of them were there before planning.
    pub existing: usize,
    /// Present surface; outside the works too.
    pub surface: HeightMap,
    /// Design heights in the local frame; NaN outside the works.
    pub design: HeightMap,
    /// When each cell last rose; 0: before planning.
    pub changed: Vec<u32>,
    /// Convex walls: a point and the inward normal of each.
    pub walls: Vec<(Vec3, Vec3)>,
    buckets: Buckets,
}

/// The map that covers the works with a margin, holding the design's heights.
pub(crate) fn design_map(
    design: &DesignSurface,
    frame: &SiteFrame,
    cell_m: f32,
    margin_m: f32,
) -> HeightMap {
    let [low, high] = design.extent();
    let local =
        |p: [f64; 2]| Vec2::new((p[0] - frame.origin[0]) as f32, (p[1] - frame.origin[1]) as f32);
    let mut map = HeightMap::empty(local(low) - margin_m, local(high) + margin_m, cell_m);
    map.fill_with(|x, y| level_m(design, frame, x, y));
    map
}

/// Design height at a local place, local frame; NaN outside the works.
fn level_m(design: &DesignSurface, frame: &SiteFrame, x: f32, y: f32) -> f32 {
    let level = design.level_at(f64::from(x) + frame.origin[0], f64::from(y) + frame.origin[1]);
    level.map_or(f32::NAN, |z| (z - frame.origin[2]) as f32)
}

impl<'a> Stack<'a> {
    pub fn new(
        catalog: &'a Catalog,
        shapes: &'a [BlockShape],
        ground: &'a Ground,
        design_surface: &'a DesignSurface,
        frame: &'a SiteFrame,
        design: HeightMap,
    ) -> Self {
        let mut surface = design.clone();
        surface.fill_with(|x, y| ground.height_m(x, y));
        let reach_m = catalog.d_max_m().max(design.cell_m);
        let changed = vec![0; design.z_m.len()];
        let buckets = Buckets::new(&design, 2.0 * reach_m);
        let blocks = Vec::new();
        Self {
            catalog,
            shapes,
            ground,
            design_surface,
            frame,
            blocks,
            existing: 0,
            surface,
            design,
            changed,
            walls: Vec::new(),
            buckets,
        }
    }

    /// A part of it on its own: these cells, and the blocks within `radius_m` of a place.
    pub fn cropped(&self, cells: &CellRect, place: Vec2, radius_m: f32) -> Self {
        let design = region::cropped(&self.design, cells);
        let surface = region::cropped(&self.surface, cells);
        let buckets = Buckets::new(&design, self.buckets.edge_m);
        let mut part = Self {
            blocks: Vec::new(),
            existing: 0,
            changed: vec![0; design.z_m.len()],
            walls: self.walls.clone(),
            surface,
            design,
            buckets,
            ..*self
        };
        for i in self.near(place.x, place.y, radius_m) {
            part.buckets.insert(self.centre(i).truncate(), part.blocks.len());
            part.blocks.push(self.blocks[i]);
        }
        part.existing = part.blocks.len();
        part
    }

    /// Adds a block and lifts the surface; `tick` counts batches.
    pub fn add(&mut self, block: PlacedBlock, tick: u32) {
        let model = self.catalog.get(block.model);
        let rect = self.surface.raise(&model.mesh, &block.site_from_block);
        for iy in rect.y0..rect.y1 {
            for ix in rect.x0..rect.x1 {
                self.changed[iy * self.surface.nx + ix] = tick;
            }
        }
        let centre = block.site_from_block * model.centre;
        self.buckets.insert(centre.truncate(), self.blocks.len());
        self.blocks.push(block);
    }

    /// Blocks whose centre lies within `radius_m` of (x, y), in order.
    pub fn near(&self, x: f32, y: f32, radius_m: f32) -> Vec<usize> {
        let mut found: Vec<usize> = self
            .buckets
            .around(x, y, radius_m)
            .filter(|&i| (self.centre(i).truncate() - Vec2::new(x, y)).length() <= radius_m)
            .collect();
        found.sort_unstable();
        found
    }

    /// Centre of mass of a block.
    pub fn centre(&self, i: usize) -> Vec3 {
        let block = &self.blocks[i];
        block.site_from_block * self.catalog.get(block.model).centre
    }

    /// Design height at a place, exact; NaN outside the works.
    pub fn design_level_m(&self, x: f32, y: f32) -> f32 {
        level_m(self.design_surface, self.frame, x, y)
    }

    /// The present surface at a place; the ground off the map.
    pub fn surface_m(&self, at: Vec2) -> f32 {
        let cell = self.surface.cell_of(at.x, at.y);
        cell.map_or_else(|| self.ground.height_m(at.x, at.y), |(ix, iy)| self.surface.at(ix, iy))
    }

    /// Whether (x, y) belongs to the works, by the raster.
    pub fn has_design(&self, x: f32, y: f32) -> bool {
        self.design.cell_of(x, y).is_some_and(|(ix, iy)| self.design.at(ix, iy).is_finite())
    }

    /// Whether a posed block lies inside the boundary; what leans on a solid wall may press into it by a hundredth.
    pub fn is_inside(&self, model: ModelId, pose: &Pose, inside: Inside) -> bool {
        let model = self.catalog.get(model);
        let has_design = |p: Vec3| self.design_level_m(p.x, p.y).is_finite();
        let share = if self.walls.is_empty() { 1.0 } else { WITHIN_WALLS };
        let drawn_in = |v: Vec3| *pose * (model.centre + (v - model.centre) * share);
        let whole = || model.mesh.vertices.iter().all(|&v| has_design(drawn_in(v)));
        has_design(*pose * model.centre) && (inside == Inside::Centre || whole())
    }

    /// When any cell within `half_m` of (x, y) last rose.
    pub fn last_change(&self, x: f32, y: f32, half_m: f32) -> u32 {
        let rect = self.surface.rect_around(x, y, half_m);
        (rect.y0..rect.y1)
            .flat_map(|iy| {
                self.changed[iy * self.surface.nx + rect.x0..iy * self.surface.nx + rect.x1].iter()
            })
            .fold(0, |a, &b| a.max(b))
    }
}

/// Block numbers by square of the plane.
struct Buckets {
    origin: [f32; 2],
    edge_m: f32,
    nx: usize,
    ny: usize,
    held: Vec<Vec<usize>>,
}

impl Buckets {
    fn new(map: &HeightMap, edge_m: f32) -> Self {
        let count = |n: usize| ((n as f32 * map.cell_m / edge_m).ceil() as usize).max(1);
        let (nx, ny) = (count(map.nx), count(map.ny));
        Self { origin: map.origin, edge_m, nx, ny, held: vec![Vec::new(); nx * ny] }
    }

    /// Places outside go to the border squares, so nothing is ever lost.
    fn square(&self, x: f32, y: f32) -> (usize, usize) {
        let axis = |v: f32, o: f32, n: usize| {
            (((v - o) / self.edge_m).floor().clamp(0.0, (n - 1) as f32)) as usize
        };
        (axis(x, self.origin[0], self.nx), axis(y, self.origin[1], self.ny))
    }

    fn insert(&mut self, place: Vec2, block: usize) {
        let (i, j) = self.square(place.x, place.y);
        self.held[j * self.nx + i].push(block);
    }

    fn around(&self, x: f32, y: f32, radius_m: f32) -> impl Iterator<Item = usize> + '_ {
        let (i0, j0) = self.square(x - radius_m, y - radius_m);
        let (i1, j1) = self.square(x + radius_m, y + radius_m);
        (j0..=j1).flat_map(move |j| {
            (i0..=i1).flat_map(move |i| self.held[j * self.nx + i].iter().copied())
        })
    }
}
