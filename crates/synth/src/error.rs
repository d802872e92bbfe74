//! What can be wrong with a recipe or a scene made from it.

use sim::SimError;

/// Names the key and says what is allowed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SynthError {
    /// The recipe is not valid TOML or has a key that does not exist; the message holds the line.
    #[error("the recipe cannot be read: {message}")]
    Parse {
        /// The parser's message with line and column.
        message: String,
    },
    /// A number out of range.
    #[error("recipe: {key} = {value} is not allowed: {why}")]
    BadValue {
        /// Key in the file.
        key: &'static str,
        /// The value.
        value: f64,
        /// What is allowed.
        why: &'static str,
    },
    /// A mix that names a block the catalogue lacks.
    #[error("recipe: mix names block `{name}`, which the catalogue does not have; it has {known}")]
    UnknownModel {
        /// The name.
        name: String,
        /// The names there are.
        known: String,
    },
    /// No blocks to drop.
    #[error("the catalogue has no block; add a [[catalog.block]] to the recipe")]
    EmptyCatalog,
    /// The site is smaller than one block.
    #[error(
        "recipe: the site is {site_m:.3} m wide, but one block needs {block_m:.3} m; make the site larger or the blocks smaller"
    )]
    SiteTooSmall {
        /// Width of the site.
        site_m: f32,
        /// Width one block needs in any orientation.
        block_m: f32,
    },
    /// More points than memory or sense allow.
    #[error(
        "recipe: density_per_m2 = {density} gives {points:.0} points; at most {limit:.0} are made, lower the density"
    )]
    TooDense {
        /// The density asked.
        density: f64,
        /// Points that would follow.
        points: f64,
        /// Most points of a scene.
        limit: f64,
    },
    /// The sensor cannot see the density asked.
    #[error("recipe: density_per_m2 = {density} cannot be reached: {why}")]
    DensityOutOfReach {
        /// The density asked.
        density: f32,
        /// What stands in the way and what to change.
        why: String,
    },
    /// Every attempt failed a check.
    #[error(
        "no pile passed the checks in {attempts} attempts; the last one: {last}. Fewer blocks, a larger site or a longer physics.max_time_s help"
    )]
    NoPile {
        /// Piles dropped.
        attempts: u32,
        /// What was wrong with the last.
        last: String,
    },
    /// Hidden-point removal asked of a sensor that never makes hidden points.
    #[error(
        "recipe: visibility = \"katz\" does not go with sensor.kind = \"{sensor}\", whose rays end on the first surface they meet; \
         remove the key, or take kind = \"gaussian\" or \"uav\""
    )]
    NothingToRemove {
        /// Kind of the sensor.
        sensor: &'static str,
    },
    /// What happens next is not valid TOML or has a key that does not exist.
    #[error("what happens next cannot be read: {message}")]
    Happening {
        /// The parser's message with line and column.
        message: String,
    },
    /// A number of it out of range.
    #[error("what happens next: {key} = {value} is not allowed: {why}")]
    BadHappening {
        /// Key in the file.
        key: &'static str,
        /// The value.
        value: f64,
        /// What is allowed.
        why: &'static str,
    },
    /// Works without a plan.
    #[error("works build a plan, and none was given; name the run folder that holds one")]
    NoPlan,
    /// A plan of another catalogue.
    #[error(
        "placement {order} of the plan is of a block the catalogue lacks; it has {known} types"
    )]
    PlanModel {
        /// Which placement.
        order: u32,
        /// Types there are.
        known: usize,
    },
    /// A viewpoint that hidden-point removal cannot use.
    #[error(transparent)]
    HiddenPoints(#[from] geom::hidden_points::HiddenPointsError),
    /// A physics setting or a block the engine cannot take.
    #[error(transparent)]
    Physics(#[from] SimError),
}
