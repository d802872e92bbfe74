//! What can make planning impossible.

/// Names the setting or the input and says what to do.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PlanError {
    /// A setting out of range.
    #[error("plan.{key} = {value} is not allowed: {why}")]
    BadSetting {
        /// Key in the file.
        key: &'static str,
        /// The value.
        value: f32,
        /// What is allowed.
        why: &'static str,
    },
    /// A block that the crane lifts nowhere.
    #[error(
        "plan.crane.capacity: the crane lifts {most_kg:.0} kg at most, a \"{name}\" has {mass_kg:.0} kg: plan for a larger crane or a lighter type"
    )]
    TooHeavy {
        /// Its type.
        name: String,
        /// Its mass.
        mass_kg: f32,
        /// Largest capacity of the table.
        most_kg: f32,
    },
    /// A count beyond all use.
    #[error(
        "plan.{key} = {value} is more than {most}, from which no plan gains; use a smaller number"
    )]
    TooMuch {
        /// Key in the file.
        key: &'static str,
        /// The value.
        value: u32,
        /// Most that is taken.
        most: u32,
    },
    /// A physics setting out of range or a block the engine cannot take.
    #[error(transparent)]
    Physics(#[from] sim::SimError),
    /// The design makes no sense.
    #[error(transparent)]
    Design(#[from] scene::design::DesignError),
    /// The window holds less than one cell.
    #[error(
        "plan.window_m = {window_m} m is smaller than a cell of {cell_m} m: enlarge window_m or reduce cell_m"
    )]
    WindowBelowCell {
        /// Edge of the window.
        window_m: f32,
        /// Edge of a cell.
        cell_m: f32,
    },
    /// The raster would not fit into memory.
    #[error(
        "the design spans {cells} cells of {cell_m} m (its rectangle is {width_m:.0} m × {height_m:.0} m), more than {limit}, which is what {memory_gb} GB hold: enlarge plan.cell_m, give plan.memory_gb more, or check the design's coordinates"
    )]
    TooManyCells {
        /// Cells needed.
        cells: u64,
        /// Edge of a cell.
        cell_m: f32,
        /// Extent west to east, metres.
        width_m: f64,
        /// Extent south to north, metres.
        height_m: f64,
        /// Cells allowed.
        limit: u64,
        /// The memory they fill.
        memory_gb: f32,
    },
    /// No block types at all.
    #[error("the catalogue has no block to place")]
    EmptyCatalog,
    /// The block asked for is not in the catalogue.
    #[error("{key}: \"{name}\" is not in the catalogue; it has: {known}")]
    UnknownBlock {
        /// Key in the file.
        key: &'static str,
        /// The name asked for.
        name: String,
        /// Names there are.
        known: String,
    },
    /// A type that cannot be placed as asked.
    #[error("plan.blocks, \"{name}\": {why}")]
    Assortment {
        /// The type.
        name: String,
        /// What is wrong and what to do.
        why: String,
    },
    /// `block` and `blocks` contradict each other.
    #[error(
        "plan.block and plan.blocks are both given: keep plan.blocks for several types, plan.block for one"
    )]
    BlockAndBlocks,
    /// A policy that knows one type only.
    #[error(
        "policy `network` places one type: give plan.block instead of plan.blocks, or use policy `search`"
    )]
    NetworkPlacesOneType,
    /// A zone that cannot be.
    #[error("plan.zones, \"{name}\": {why}")]
    Zone {
        /// What the file calls it.
        name: String,
        /// What is wrong and what to do.
        why: String,
    },
    /// The design has no cell anywhere.
    #[error(
        "the design surface covers nothing that was surveyed: no cell of {cell_m} m has a design height and survey points near it; check its boundary"
    )]
    NoWorks {
        /// Edge of a cell.
        cell_m: f32,
    },
    /// The design lies away from everything surveyed.
    #[error(
        "the design lies {away_m:.0} m away from the nearest recognised block: check the boundary's coordinates (east, north, in {crs})"
    )]
    DesignElsewhere {
        /// Distance from the design's rectangle to the nearest block.
        away_m: f64,
        /// Coordinate reference system of the site.
        crs: String,
    },
    /// Walls were asked for around a boundary they cannot follow.
    #[error(
        "plan.walls needs a convex boundary (a level or planes design with a convex polygon); set walls = false"
    )]
    WallsNeedConvexBoundary,
    /// No network is there to propose poses.
    #[error(
        "policy `network` needs a placement network (`PlanInput::proposer`); give one or use `search` or `random`"
    )]
    NoPlacementModel,
    /// Nothing may be re-set, but blocks are named.
    #[error(
        "plan.reset_blocks names {named} blocks, but plan.reset = 0: say in plan.reset how many of them may be lifted"
    )]
    ResetNone {
        /// Blocks named.
        named: usize,
    },
    /// A block that is to be re-set is not there.
    #[error(
        "plan.reset_blocks: no block {block} is stated in this survey, which has {blocks}; take the numbers of recognise/blocks.csv"
    )]
    NoSuchBlock {
        /// The number.
        block: u32,
        /// Blocks there are.
        blocks: usize,
    },
    /// A block that is to be re-set cannot be lifted.
    #[error("plan.reset_blocks: block {block} cannot be lifted: {why}; take it off the list")]
    HeldBlock {
        /// The number.
        block: u32,
        /// What holds it.
        why: String,
    },
    /// The nodes of the pattern lie farther apart than the works are wide.
    #[error(
        "the pattern's spacing of {spacing_m:.2} m is wider than the works ({width_m:.1} m × {height_m:.1} m): reduce plan.pattern.spacing_m or give more density_per_m2"
    )]
    PatternTooWide {
        /// Largest spacing.
        spacing_m: f32,
        /// Extent west to east.
        width_m: f32,
        /// Extent south to north.
        height_m: f32,
    },
    /// A pattern is of one type.
    #[error("policy `pattern` places one type: name one in plan.blocks, or use policy `search`")]
    PatternPlacesOneType,
    /// Settings of a pattern that is not asked for.
    #[error(
        "plan.pattern goes with policy `pattern`: set policy = \"pattern\" or take the table out"
    )]
    PatternWithoutPolicy,
    /// Paths are searched for windows that other policies tried in vain.
    #[error("plan.insertion = \"guided\" goes with policy `search` or `network`: use one of them")]
    GuidedRandom,
    /// The user asked to stop.
    #[error("planning was stopped")]
    Cancelled,
}
