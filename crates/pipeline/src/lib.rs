//! The pipeline: what happens between a survey and a stacking plan, one call a room.
//!
//! In: a survey, a catalogue, a design surface. Out: recognised blocks and a plan. No algorithm lives here;
//! each line is a stage's verb.

mod error;
mod method;
mod recogniser;
pub mod sizes;
pub mod survey;

pub use error::PipelineError;
pub use method::Method;
pub use pose::{LineShifts, Part, PileFacts, PileVerdict, Templates};
pub use recogniser::{PartRecognition, Recogniser, Recognition, as_points};

use geom::{Observer, SeedTree, Vec3};
use plan::{GroundConfig, PlanConfig, PlanInput, Proposer, Surfaces, SurfacesInput, Uncertainty};
use pose::{PoseConfig, StatedPlane};
use scene::{Catalog, DesignSurface, Ground, PlacedBlock, Plan, Recognised, Scene, Survey};
use segment::{BackgroundConfig, SegmentConfig};
use serde::{Deserialize, Serialize};

/// Settings of all stages; `Default` is the method's. The tables of `site.toml`, a settings file and a run's `config.toml` are
/// these.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Config {
    /// Whose values stand where nothing else is said; only this word of it, the values are in the tables.
    #[serde(skip_serializing_if = "Method::is_default")]
    pub method: Method,
    /// Which points can hold blocks at all.
    pub background: BackgroundConfig,
    /// Settings of segmentation.
    pub segment: SegmentConfig,
    /// Settings of pose estimation.
    pub pose: PoseConfig,
    /// How the bed is estimated where nobody states it.
    pub bed: GroundConfig,
    /// Settings of planning.
    pub plan: PlanConfig,
}

impl Config {
    /// With the bed that the site states, where the settings of the pose stage state none.
    pub fn with_ground(mut self, ground: Option<&Ground>) -> Self {
        let (normal, point) = match ground {
            Some(Ground::Level { z_m }) => (Vec3::Z, Vec3::Z * *z_m),
            Some(Ground::Plane { point, normal }) => (*normal, *point),
            Some(Ground::Grid { .. }) | None => return self,
        };
        let plane = StatedPlane { normal: normal.to_array(), offset_m: normal.dot(point) };
        self.pose.bed.get_or_insert(plane);
        self
    }
}

/// What the works are planned on.
pub struct Works<'a> {
    /// The survey the blocks were recognised in.
    pub survey: &'a Survey,
    /// The site's block types.
    pub catalog: &'a Catalog,
    /// Recognised blocks; those not judged are left out.
    pub blocks: &'a [Recognised],
    /// New blocks already placed.
    pub placed: &'a [PlacedBlock],
    /// An earlier plan, of which what still holds is kept.
    pub previous: Option<&'a Plan>,
    /// What is to be built.
    pub design: &'a DesignSurface,
    /// What proposes poses for policy `network`; the other policies need none.
    pub proposer: Option<&'a dyn Proposer>,
    /// What the blocks lie on; `None`: estimated from the points no block explains.
    pub ground: Option<Ground>,
}

/// From blocks to a plan: the bed below them, the pile in the physics world, the blocks to add.
pub fn plan_works(
    works: &Works,
    config: &Config,
    seed: SeedTree,
    observer: &dyn Observer,
) -> Result<(Scene, Plan), PipelineError> {
    let scene =
        Scene { blocks: placed_blocks(works.blocks), ground: ground_of(works, config, observer) };
    let previous = works.previous.cloned().unwrap_or_default();
    let plan = plan::replan(
        &input(works, &scene),
        &previous,
        &config.plan,
        seed.child("plan", 0),
        observer,
    )?;
    Ok((scene, plan))
}

/// How far the count of a plan depends on chance: the same works planned with other seeds.
pub fn count_range(
    works: &Works,
    scene: &Scene,
    config: &Config,
    seed: SeedTree,
    observer: &dyn Observer,
) -> Result<Uncertainty, PipelineError> {
    Ok(plan::uncertainty(
        &input(works, scene),
        &config.plan,
        &config.plan.uncertainty,
        seed.child("plan", 0),
        observer,
    )?)
}

/// Design, survey and survey with the plan, on one raster.
pub fn planned_surfaces(works: &Works, scene: &Scene, plan: &Plan) -> Surfaces {
    plan::surfaces(&surfaces_input(works, scene, plan))
}

/// What drawings show of a plan.
pub fn surfaces(works: &Works, scene: &Scene, plan: &Plan) -> (Surfaces, Vec<plan::CrossSection>) {
    let input = surfaces_input(works, scene, plan);
    let surfaces = plan::surfaces(&input);
    let sections = plan::cross_sections(&input, &surfaces);
    (surfaces, sections)
}

/// Places that a plan leaves below the design, and why.
pub fn unfilled(
    works: &Works,
    scene: &Scene,
    plan: &Plan,
    surfaces: &Surfaces,
    config: &Config,
) -> Result<Vec<plan::Unfilled>, PipelineError> {
    Ok(plan::unfilled(&input(works, scene), &config.plan, surfaces, plan)?)
}

/// The signs by which each block of a plan was ranked.
pub fn signs_of_plan(
    works: &Works,
    scene: &Scene,
    plan: &Plan,
    config: &Config,
) -> Result<Vec<plan::Signs>, PipelineError> {
    Ok(plan::signs_of_plan(&input(works, scene), &config.plan, plan)?)
}

/// Pairs of places to choose between, where an answer teaches most.
pub fn pairs_to_choose(
    works: &Works,
    scene: &Scene,
    config: &Config,
    (learned, count): (&plan::Learned, usize),
    seed: SeedTree,
) -> Result<Vec<plan::CandidatePair>, PipelineError> {
    let (input, seed) = (input(works, scene), seed.child("plan", 0));
    Ok(plan::pairs_to_choose(&input, &config.plan, learned, count, seed, &geom::Silent)?)
}

/// The next blocks of a plan on what was really placed.
pub fn next_blocks(
    works: &Works,
    config: &Config,
    plan: &Plan,
    asked: (&std::collections::BTreeSet<u32>, usize),
    seed: SeedTree,
    observer: &dyn Observer,
) -> Result<Vec<plan::Next>, PipelineError> {
    let ground = ground_of(works, config, observer);
    let scene = Scene { blocks: placed_blocks(works.blocks), ground };
    let (input, seed) = (input(works, &scene), seed.child("plan", 0));
    Ok(plan::next_blocks(&input, &config.plan, plan, asked, seed, observer)?)
}

/// Three plans of the same works to choose from.
pub fn plan_choices(
    works: &Works,
    scene: &Scene,
    config: &Config,
    seed: SeedTree,
    observer: &dyn Observer,
) -> Result<Vec<(plan::Aim, Plan)>, PipelineError> {
    Ok(plan::choices(&input(works, scene), &config.plan, seed.child("plan", 0), observer)?)
}

/// How far each survey point lies below the design, metres.
pub fn point_deficits_m(works: &Works, scene: &Scene, plan: &Plan) -> Vec<f32> {
    plan::point_deficits_m(&surfaces_input(works, scene, plan))
}

/// Lines that show the design, each with whether it closes.
pub fn design_lines(works: &Works) -> Vec<(bool, Vec<geom::Vec3>)> {
    plan::design_lines(works.design, &works.survey.frame)
}

fn input<'a>(works: &'a Works, scene: &'a Scene) -> PlanInput<'a> {
    PlanInput {
        scene,
        frame: &works.survey.frame,
        design: works.design,
        catalog: works.catalog,
        placed: works.placed,
        proposer: works.proposer,
        // A bed that is stated is known everywhere.
        survey: works.ground.is_none().then_some(&works.survey.cloud),
    }
}

fn surfaces_input<'a>(works: &'a Works, scene: &'a Scene, plan: &'a Plan) -> SurfacesInput<'a> {
    SurfacesInput {
        cloud: &works.survey.cloud,
        frame: &works.survey.frame,
        design: works.design,
        ground: &scene.ground,
        catalog: works.catalog,
        plan,
    }
}

/// The bed as stated, or as the survey shows it between and beside the blocks; and what stands on it that is no
/// recognised block.
pub fn ground_of(works: &Works, config: &Config, observer: &dyn Observer) -> Ground {
    let (cloud, blocks, catalog) = (&works.survey.cloud, works.blocks, works.catalog);
    let stated = works.ground.clone();
    let bed = stated
        .unwrap_or_else(|| plan::estimate_ground(cloud, blocks, catalog, &config.bed, observer));
    plan::with_obstacles(bed, cloud, blocks, catalog, &config.bed, observer)
}

/// The accepted blocks as a pile.
pub fn placed_blocks(blocks: &[Recognised]) -> Vec<PlacedBlock> {
    blocks.iter().filter_map(Recognised::placed).collect()
}
