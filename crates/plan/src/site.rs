//! What planning starts from: input checked, lengths resolved, blocks prepared for physics.

use crate::uncertainty::MOST_SEEDS;
use crate::{
    Insertion, ObjectiveConfig, PlanConfig, PlanError, Policy, Settings,
    assortment::{self, Choice},
    crane::Allowed,
    network_pose::Proposer,
    pattern::Pattern,
    search::Attitudes,
    stack::{self, Stack},
    surveyed::{SQUARE, leave_out_unseen},
};
use geom::{HeightMap, Observer, PointCloud, SeedTree, Stage, Vec2, Vec3, Warning};
use rand::RngExt;
use scene::{
    Catalog, DesignSurface, InstanceId, ModelId, PlacedBlock, Placement, PlacementState, Scene,
    SiteFrame,
};
use sim::{BlockShape, World};
use std::collections::BTreeSet;

/// What a cell costs while a plan is made: five maps of f32 and two copies of the deficit's sums, with the room their growth
/// takes. 85 M cells were seen to need more than 4 GB.
const BYTES_A_CELL: f64 = 56.0;
/// Overlap of two recognised blocks, in d_box, that is told: what METHOD §5 lets a right pose be off by.
const DEEP: f32 = 0.1;
/// A design farther than this from every block, in d_max, lies elsewhere. Free choice: a wrong coordinate system is off by kilometres.
const ELSEWHERE: f64 = 10.0;

/// What the planner is given.
#[derive(Clone, Copy)]
pub struct PlanInput<'a> {
    /// Recognised blocks and the ground they lie on.
    pub scene: &'a Scene,
    /// Where the local frame lies.
    pub frame: &'a SiteFrame,
    /// What is to be built.
    pub design: &'a DesignSurface,
    /// The site's block types.
    pub catalog: &'a Catalog,
    /// New blocks that are already placed, as built; counted as part of the pile.
    pub placed: &'a [PlacedBlock],
    /// What proposes poses for policy `network`; the other policies need none.
    pub proposer: Option<&'a dyn Proposer>,
    /// The survey, where ground that it does not show is not judged; `None`: the ground is known everywhere.
    pub survey: Option<&'a PointCloud>,
}

/// The checked site.
pub(crate) struct Site<'a> {
    /// What to place, the largest block first; at least one.
    pub types: Vec<TypeToPlace<'a>>,
    /// Types of the pile that are not placed but may be set elsewhere.
    resets: Vec<TypeToPlace<'a>>,
    /// Most blocks that are set elsewhere, and which alone may be; none: any.
    pub most_reset: u32,
    pub reset_blocks: Vec<u32>,
    /// Blocks of the pile that the plan lifts from their places.
    pub lifted: BTreeSet<InstanceId>,
    pub shapes: Vec<BlockShape>,
    design: HeightMap,
    walls: Vec<(Vec3, Vec3)>,
}

/// One type that is placed, with everything that depends on its size and mass.
pub(crate) struct TypeToPlace<'a> {
    pub settings: Settings,
    pub model: ModelId,
    pub poses: Poses<'a>,
    /// Attitudes in which it is lowered before it is guided; `None`: straight down only.
    pub guided: Option<Attitudes>,
    pub allowed: Allowed,
    /// Blocks that lie ready; `None`: as many as needed are made.
    pub stock: Option<u32>,
    /// Cost of one in its place.
    pub cost: f32,
    /// Of the places of a window the one of most worth is taken; `None`: the one that lies deepest, as `search` ranks them.
    pub by_worth: Option<ObjectiveConfig>,
}

/// Where initial poses come from, made ready.
pub(crate) enum Poses<'a> {
    Random,
    /// With the turn at which it first looks at a window, drawn like the attitudes of the search.
    Network(&'a dyn Proposer, f32),
    Search(Attitudes),
    Pattern(Pattern),
}

/// Checks everything that can be wrong with the input and warns about what is merely odd.
pub(crate) fn prepare<'a>(
    input: &PlanInput<'a>,
    config: &PlanConfig,
    seed: SeedTree,
    observer: &dyn Observer,
) -> Result<Site<'a>, PlanError> {
    input.design.check()?;
    let chosen = types_to_place(input, config)?;
    let mut settings = chosen
        .iter()
        .map(|c| config.resolve(input.catalog.get(c.model), input.catalog.d_max_m()))
        .collect::<Result<Vec<_>, _>>()?;
    one_raster(&mut settings);
    let margin_m = input.catalog.get(chosen[0].model).d_box_m;
    check_raster(input.design, margin_m, &settings[0])?;
    let mut design = stack::design_map(input.design, input.frame, settings[0].cell_m, margin_m);
    leave_out_unsurveyed(&mut design, input, config, margin_m, observer);
    if !design.z_m.iter().any(|z| z.is_finite()) {
        return Err(PlanError::NoWorks { cell_m: settings[0].cell_m });
    }
    check_place(input)?;
    let shapes =
        input.catalog.iter().map(|(_, m)| BlockShape::new(m)).collect::<Result<Vec<_>, _>>()?;
    warn_of_pile(input, &shapes, &settings[0], observer);
    warn_of_zones(input, config, &chosen, observer);
    let walls = if settings[0].walls { walls(input)? } else { Vec::new() };
    let types = chosen
        .iter()
        .zip(settings)
        .map(|(choice, settings)| type_to_place(input, config, choice, settings, seed))
        .collect::<Result<Vec<_>, _>>()?;
    warn_of_reach(input, &types, &design, observer);
    warn_of_hook(input, &types, &design, observer);
    let resets = types_to_reset(input, config, &types, seed)?;
    let (most_reset, reset_blocks) = (config.reset, config.reset_blocks.clone());
    let lifted = BTreeSet::new();
    Ok(Site { types, resets, most_reset, reset_blocks, lifted, shapes, design, walls })
}

/// What the configuration says to place, largest block first; without `blocks` one type of any number.
pub(crate) fn types_to_place(
    input: &PlanInput,
    config: &PlanConfig,
) -> Result<Vec<Choice>, PlanError> {
    if config.blocks.is_empty() {
        let model = block_to_place(input, config)?;
        return Ok(vec![Choice { model, stock: None, cost: 1.0 }]);
    }
    if config.block.is_some() {
        return Err(PlanError::BlockAndBlocks);
    }
    if config.policy == Policy::Network && config.blocks.len() > 1 {
        return Err(PlanError::NetworkPlacesOneType);
    }
    if config.policy == Policy::Pattern && config.blocks.len() > 1 {
        return Err(PlanError::PatternPlacesOneType);
    }
    assortment::choices(&config.blocks, input.catalog)
}

/// All types are laid onto one raster: the finest that any of them asks for.
fn one_raster(settings: &mut [Settings]) {
    let cell_m = settings.iter().map(|s| s.cell_m).fold(f32::INFINITY, f32::min);
    settings.iter_mut().for_each(|s| s.cell_m = cell_m);
}

/// The types of the pile that are not placed, made ready for being set elsewhere.
fn types_to_reset<'a>(
    input: &PlanInput<'a>,
    config: &PlanConfig,
    types: &[TypeToPlace],
    seed: SeedTree,
) -> Result<Vec<TypeToPlace<'a>>, PlanError> {
    if config.reset == 0 {
        return match config.reset_blocks.first() {
            Some(_) => Err(PlanError::ResetNone { named: config.reset_blocks.len() }),
            None => Ok(Vec::new()),
        };
    }
    let config = PlanConfig { policy: Policy::Search, pattern: None, ..config.clone() };
    let others = input.catalog.iter().filter(|(id, _)| types.iter().all(|t| t.model != *id));
    let ready = |(model, block): (ModelId, &scene::BlockModel)| {
        let mut settings = config.resolve(block, input.catalog.d_max_m())?;
        settings.cell_m = types[0].settings.cell_m;
        let choice = Choice { model, stock: None, cost: 1.0 };
        type_to_place(input, &config, &choice, settings, seed)
    };
    others.map(ready).collect()
}

fn type_to_place<'a>(
    input: &PlanInput<'a>,
    config: &PlanConfig,
    choice: &Choice,
    settings: Settings,
    seed: SeedTree,
) -> Result<TypeToPlace<'a>, PlanError> {
    let block = input.catalog.get(choice.model);
    let poses = match settings.policy {
        Policy::Random => Poses::Random,
        Policy::Network => {
            let turn_rad = seed.child("turn", 0).rng().random::<f32>() * std::f32::consts::TAU;
            Poses::Network(input.proposer.ok_or(PlanError::NoPlacementModel)?, turn_rad)
        }
        Policy::Pattern => Poses::Pattern(Pattern::new(
            &config.pattern.clone().unwrap_or_default(),
            &settings,
            block,
            (input.design, input.frame),
            seed,
        )?),
        Policy::Search => {
            Poses::Search(Attitudes::new(block, &settings, seed.child("attitudes", 0)))
        }
    };
    let guided = (settings.insertion == Insertion::Guided)
        .then(|| Attitudes::new(block, &settings, seed.child("attitudes", 0)));
    let mass_kg = block.mass_kg();
    let reach = config.crane.as_ref().map(|c| c.reach(block, input.frame)).transpose()?;
    let closed = assortment::closed_zones(&config.zones, mass_kg, input.frame)?;
    let allowed = Allowed { reach, closed };
    let Choice { model, stock, cost } = *choice;
    // A plan that is improved is made by the same measure from the start, unless people taught another one.
    let by_worth = settings.search.weights.is_none() && settings.search.improve > 0.0;
    let by_worth = by_worth.then_some(settings.objective);
    Ok(TypeToPlace { settings, model, poses, guided, allowed, stock, cost, by_worth })
}

fn warn(observer: &dyn Observer, message: String) {
    observer.event(geom::Event::Warned(Warning { stage: Stage::Plan, message }));
}

/// Says what is odd about the pile.
fn warn_of_pile(
    input: &PlanInput,
    shapes: &[BlockShape],
    settings: &Settings,
    observer: &dyn Observer,
) {
    if input.scene.blocks.is_empty() {
        let message = "no blocks were recognised: the plan builds on the bare ground; check the recognition before you use it";
        warn(observer, message.into());
    }
    let d_box_m = input.catalog.iter().map(|(_, m)| m.d_box_m).fold(f32::INFINITY, f32::min);
    let (pairs, deepest_m) = overlaps(input, shapes, settings);
    if pairs > 0 {
        warn(
            observer,
            format!(
                "{pairs} pairs of recognised blocks overlap by more than {:.2} m (deepest {deepest_m:.2} m); they stay as they are, but check their poses",
                DEEP * d_box_m
            ),
        );
    }
}

/// Says which types the crane carries to no part of the works.
fn warn_of_reach(
    input: &PlanInput,
    types: &[TypeToPlace],
    design: &HeightMap,
    observer: &dyn Observer,
) {
    for kind in types {
        let Some(reach) = &kind.allowed.reach else { continue };
        let places = (0..design.ny).flat_map(|y| (0..design.nx).map(move |x| (x, y)));
        let nearest_m = places
            .filter(|&(x, y)| design.at(x, y).is_finite())
            .map(|(x, y)| reach.distance_m(design.centre(x, y)))
            .fold(f32::INFINITY, f32::min);
        let (block, radius_m) = (input.catalog.get(kind.model), reach.radius_m());
        if nearest_m > radius_m {
            warn(
                observer,
                format!(
                    "the crane carries no \"{}\" ({:.0} kg) to the works: it lifts it to {radius_m:.1} m, the nearest part lies {nearest_m:.1} m from a stand; move plan.crane.stand or correct plan.crane.capacity",
                    block.name,
                    block.mass_kg()
                ),
            );
        }
    }
}

/// Says where the hook is too low for the design.
fn warn_of_hook(
    input: &PlanInput,
    types: &[TypeToPlace],
    design: &HeightMap,
    observer: &dyn Observer,
) {
    let Some((_, _, design_m)) = design.min_mean_max_m() else { return };
    let highest =
        |t: &TypeToPlace| t.allowed.reach.as_ref().map_or(f32::INFINITY, |r| r.highest_m());
    let highest_m = types.iter().map(highest).fold(f32::NEG_INFINITY, f32::max);
    if highest_m < design_m {
        let site_m = |z: f32| f64::from(z) + input.frame.origin[2];
        warn(
            observer,
            format!(
                "the crane's hook lets blocks go with their centres at {:.2} m or lower, the design reaches {:.2} m: nothing is placed above; raise crane.hook_level_m or shorten crane.sling_m",
                site_m(highest_m),
                site_m(design_m)
            ),
        );
    }
}

/// Says which zones stay empty because no type is heavy enough.
fn warn_of_zones(
    input: &PlanInput,
    config: &PlanConfig,
    chosen: &[Choice],
    observer: &dyn Observer,
) {
    let heaviest_kg =
        chosen.iter().map(|c| input.catalog.get(c.model).mass_kg()).fold(0.0, f32::max);
    for zone in assortment::unserved(&config.zones, heaviest_kg) {
        warn(
            observer,
            format!(
                "zone \"{}\" asks for blocks of {:.0} kg or more, the heaviest of the plan has {heaviest_kg:.0} kg: nothing is placed there; add a heavier type to plan.blocks",
                zone.name, zone.minimum_mass_kg
            ),
        );
    }
}

/// Takes out of the works what nobody has surveyed, unless it is asked for, and says so.
fn leave_out_unsurveyed(
    design: &mut HeightMap,
    input: &PlanInput,
    config: &PlanConfig,
    d_box_m: f32,
    observer: &dyn Observer,
) {
    let Some(survey) = input.survey.filter(|_| !config.unsurveyed) else { return };
    let cell_m2 = design.cell_m * design.cell_m;
    let works_m2 = design.z_m.iter().filter(|z| z.is_finite()).count() as f32 * cell_m2;
    let left_m2 = leave_out_unseen(design, &survey.position_m, SQUARE * d_box_m);
    if left_m2 > 0.0 {
        let message = format!(
            "{left_m2:.0} m² of the design ({:.0} %) lie where nothing was surveyed: they are not judged and not planned on; survey them, state the [ground], or say `unsurveyed = true` in [plan]",
            100.0 * left_m2 / works_m2
        );
        observer.event(geom::Event::Warned(Warning { stage: Stage::Plan, message }));
    }
}

impl<'a> Site<'a> {
    /// The largest type.
    pub fn main(&self) -> &TypeToPlace<'a> {
        &self.types[0]
    }

    /// The one of these that is placed with `model`.
    pub fn of_model(&self, model: ModelId) -> Option<&TypeToPlace<'a>> {
        self.types.iter().chain(&self.resets).find(|t| t.model == model)
    }

    /// The pile before planning, without what the plan lifts.
    pub fn stack<'s>(&'s self, input: &PlanInput<'s>) -> Stack<'s> {
        self.stack_but(input, &self.lifted)
    }

    /// The pile without some of its recognised blocks.
    pub fn stack_but<'s>(
        &'s self,
        input: &PlanInput<'s>,
        lifted: &BTreeSet<InstanceId>,
    ) -> Stack<'s> {
        let mut stack = Stack::new(
            input.catalog,
            &self.shapes,
            &input.scene.ground,
            input.design,
            input.frame,
            self.design.clone(),
        );
        stack.walls = self.walls.clone();
        let stays = |b: &&PlacedBlock| !lifted.contains(&b.block);
        for block in input.scene.blocks.iter().filter(stays).chain(input.placed) {
            stack.add(*block, 0);
        }
        stack.existing = stack.blocks.len();
        stack
    }

    /// The pile with what of a plan is kept.
    pub fn stack_with<'s>(&'s self, input: &PlanInput<'s>, tried: &[Placement]) -> Stack<'s> {
        let mut stack = self.stack(input);
        for p in tried.iter().filter(|p| p.state == PlacementState::Kept) {
            let block = InstanceId(stack.blocks.len() as u32 + 1);
            stack.add(PlacedBlock { block, model: p.model, site_from_block: p.rest }, 1);
        }
        stack
    }
}

/// Whether the raster of a design fits into memory, whichever block of the catalogue is placed: to be asked before anything is
/// paid for. Errors: [`PlanError::TooManyCells`], and every setting that is out of range.
pub fn check_extent(
    design: &DesignSurface,
    catalog: &Catalog,
    config: &PlanConfig,
) -> Result<(), PlanError> {
    let seeds = config.uncertainty.seeds;
    if seeds > MOST_SEEDS {
        return Err(PlanError::TooMuch {
            key: "uncertainty.seeds",
            value: seeds,
            most: MOST_SEEDS,
        });
    }
    let listed =
        |name: &str| config.blocks.is_empty() || config.blocks.iter().any(|b| b.name == name);
    let asked =
        |name: &str| config.block.as_ref().is_none_or(|block| block == name) && listed(name);
    for (_, model) in catalog.iter().filter(|(_, m)| asked(&m.name)) {
        let settings = config.resolve(model, catalog.d_max_m())?;
        check_raster(design, model.d_box_m, &settings)?;
    }
    Ok(())
}

/// Memory that the maps of a plan take, bytes, for the block whose maps are largest. Errors: a setting that is out of range.
pub fn raster_bytes(
    design: &DesignSurface,
    catalog: &Catalog,
    config: &PlanConfig,
) -> Result<u64, PlanError> {
    let asked = |name: &str| config.block.as_ref().is_none_or(|block| block == name);
    let mut most = 0;
    for (_, model) in catalog.iter().filter(|(_, m)| asked(&m.name)) {
        let settings = config.resolve(model, catalog.d_max_m())?;
        most = most.max(raster_cells(design, model.d_box_m, &settings));
    }
    Ok((most as f64 * BYTES_A_CELL) as u64)
}

/// Cells of the raster over a design and a margin around it.
fn raster_cells(design: &DesignSurface, margin_m: f32, settings: &Settings) -> u64 {
    let [low, high] = design.extent();
    let along = |axis: usize| high[axis] - low[axis] + 2.0 * f64::from(margin_m);
    let cells_along = |axis: usize| (along(axis) / f64::from(settings.cell_m)).max(1.0) as u64;
    cells_along(0).saturating_mul(cells_along(1))
}

fn check_raster(
    design: &DesignSurface,
    margin_m: f32,
    settings: &Settings,
) -> Result<(), PlanError> {
    let [low, high] = design.extent();
    let cells = raster_cells(design, margin_m, settings);
    let limit = (f64::from(settings.memory_gb) * 1e9 / BYTES_A_CELL) as u64;
    if cells > limit {
        return Err(PlanError::TooManyCells {
            cells,
            cell_m: settings.cell_m,
            width_m: high[0] - low[0],
            height_m: high[1] - low[1],
            limit,
            memory_gb: settings.memory_gb,
        });
    }
    Ok(())
}

/// The block named in the configuration, else the most frequent of the pile, else the first.
pub fn block_to_place(input: &PlanInput, config: &PlanConfig) -> Result<ModelId, PlanError> {
    if input.catalog.is_empty() {
        return Err(PlanError::EmptyCatalog);
    }
    if let Some(name) = &config.block {
        return input.catalog.find(name).ok_or_else(|| {
            let known: Vec<&str> = input.catalog.iter().map(|(_, m)| m.name.as_str()).collect();
            PlanError::UnknownBlock {
                key: "plan.block",
                name: name.clone(),
                known: known.join(", "),
            }
        });
    }
    let count = |id: ModelId| input.scene.blocks.iter().filter(|b| b.model == id).count();
    let most =
        input.catalog.iter().map(|(id, _)| id).max_by_key(|&id| (count(id), std::cmp::Reverse(id)));
    Ok(most.expect("the catalogue is not empty"))
}

/// The design must lie at the pile, not in another zone or with swapped axes.
fn check_place(input: &PlanInput) -> Result<(), PlanError> {
    let [low, high] = input.design.extent();
    let away = |b: &PlacedBlock| {
        let at = input.frame.site_from_local(b.site_from_block * input.catalog.get(b.model).centre);
        let beyond = |v: f64, axis: usize| (low[axis] - v).max(v - high[axis]).max(0.0);
        beyond(at.x, 0).hypot(beyond(at.y, 1))
    };
    let nearest = input.scene.blocks.iter().map(away).fold(f64::INFINITY, f64::min);
    let limit = ELSEWHERE * f64::from(input.catalog.d_max_m());
    if nearest.is_finite() && nearest > limit {
        let crs = if input.frame.crs.is_empty() {
            "local coordinates".into()
        } else {
            input.frame.crs.clone()
        };
        return Err(PlanError::DesignElsewhere { away_m: nearest, crs });
    }
    Ok(())
}

/// Pairs of existing blocks that overlap too deeply, and the deepest overlap.
fn overlaps(input: &PlanInput, shapes: &[BlockShape], settings: &Settings) -> (usize, f32) {
    let mut world = World::new(&settings.physics);
    let ids: Vec<_> = input
        .scene
        .blocks
        .iter()
        .chain(input.placed)
        .map(|b| {
            (
                world.add_fixed(&shapes[b.model.0 as usize], &b.site_from_block),
                input.catalog.get(b.model).d_box_m,
            )
        })
        .collect();
    let (mut pairs, mut deepest) = (0, 0.0_f32);
    for (id, d_box_m) in ids {
        let mut with: Vec<_> = world
            .contacts(id)
            .into_iter()
            .filter(|c| {
                c.depth_m > DEEP * d_box_m
                    && matches!(c.other, sim::Touched::Block(other) if other > id)
            })
            .inspect(|c| deepest = deepest.max(c.depth_m))
            .map(|c| c.other)
            .collect();
        with.dedup();
        pairs += with.len();
    }
    (pairs, deepest)
}

/// Inward half-spaces of a convex boundary.
fn walls(input: &PlanInput) -> Result<Vec<(Vec3, Vec3)>, PlanError> {
    let (DesignSurface::Level { boundary, .. } | DesignSurface::Planes { boundary, .. }) =
        input.design
    else {
        return Err(PlanError::WallsNeedConvexBoundary);
    };
    let corners: Vec<Vec2> = boundary
        .iter()
        .map(|p| {
            Vec2::new((p[0] - input.frame.origin[0]) as f32, (p[1] - input.frame.origin[1]) as f32)
        })
        .collect();
    let n = corners.len();
    let turn = |i: usize| {
        let (a, b, c) = (corners[i], corners[(i + 1) % n], corners[(i + 2) % n]);
        (b - a).perp_dot(c - b)
    };
    let left = (0..n).all(|i| turn(i) >= 0.0);
    if !left && !(0..n).all(|i| turn(i) <= 0.0) {
        return Err(PlanError::WallsNeedConvexBoundary);
    }
    Ok((0..n)
        .filter_map(|i| {
            let (a, b) = (corners[i], corners[(i + 1) % n]);
            let inward = (b - a).perp() * if left { 1.0 } else { -1.0 };
            (inward.length() > 0.0).then(|| (a.extend(0.0), inward.normalize().extend(0.0)))
        })
        .collect())
}
