//! The pipeline: what happens between a survey and a stacking plan, one call a room.
//!
//! In: a survey, a catalogue, a design surface. Out: recognised blocks and a plan. No algorithm lives here;
//! each line is a stage's verb.

mod background;
mod error;
pub mod lessons;
mod placement_lessons;
pub mod review;
pub mod survey;

pub use background::Foreground;
pub use error::PipelineError;
pub use lessons::Lessons;
pub use placement_lessons::PlacementLessons;

use geom::{Observer, SeedTree, Silent};
use plan::{GroundConfig, PlanConfig, PlanInput, Proposer, Surfaces, SurfacesInput, Uncertainty, UncertaintyConfig};
use pose::PoseConfig;
use scene::{Catalog, DesignSurface, Ground, Judgement, PlacedBlock, Plan, Recognised, Scene, Segmentation, Survey};
use segment::{SegmentConfig, SegmentModel};
use serde::{Deserialize, Serialize};

/// Settings of all stages; `Default` is the method's.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Config {
    /// Settings of segmentation.
    pub segment: SegmentConfig,
    /// Settings of pose estimation.
    pub pose: PoseConfig,
    /// How the bed is estimated where nobody states it.
    pub ground: GroundConfig,
    /// Settings of planning.
    pub plan: PlanConfig,
    /// How the range of the count is found.
    pub uncertainty: UncertaintyConfig,
}

/// What recognition leaves. Indices and labels are those of the whole survey.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Recognition {
    /// Instances and centre hypotheses.
    pub segmentation: Segmentation,
    /// Blocks, accepted and not judged.
    pub blocks: Vec<Recognised>,
}

/// From a survey to blocks: the bin goes, points are segmented, segments become blocks.
pub fn recognise(
    survey: &Survey,
    catalog: &Catalog,
    model: &SegmentModel,
    config: &Config,
    seed: SeedTree,
    observer: &dyn Observer,
) -> Result<Recognition, PipelineError> {
    let segments = segment_foreground(survey, catalog, model, config, seed, observer)?;
    recognise_segments(survey, catalog, segments, config, seed, observer)
}

/// The first half of [`recognise`], apart so that a long job can be kept after it: instances of the part of the survey
/// that can hold blocks; labels and indices are those of that part.
pub fn segment_foreground(
    survey: &Survey,
    catalog: &Catalog,
    model: &SegmentModel,
    config: &Config,
    seed: SeedTree,
    observer: &dyn Observer,
) -> Result<Segmentation, PipelineError> {
    Ok(segmented(survey, catalog, model, config, seed, observer)?.1)
}

/// The second half: segments become blocks. `segments` are those of [`segment_foreground`] with the same seed.
pub fn recognise_segments(
    survey: &Survey,
    catalog: &Catalog,
    segments: Segmentation,
    config: &Config,
    seed: SeedTree,
    observer: &dyn Observer,
) -> Result<Recognition, PipelineError> {
    let foreground = Foreground::of(survey, catalog, seed.child("background", 0), &Silent);
    let part = &foreground.survey;
    let blocks = pose::recognise(part, &segments, catalog, &config.pose, seed.child("pose", 0), observer)?;
    Ok(foreground.whole(segments, blocks))
}

/// The first room alone: which point belongs to which block.
pub fn segment_survey(
    survey: &Survey,
    catalog: &Catalog,
    model: &SegmentModel,
    config: &Config,
    seed: SeedTree,
    observer: &dyn Observer,
) -> Result<Segmentation, PipelineError> {
    let (foreground, segmentation) = segmented(survey, catalog, model, config, seed, observer)?;
    Ok(foreground.whole(segmentation, Vec::new()).segmentation)
}

/// The part of a survey that can hold blocks, and its instances.
fn segmented(
    survey: &Survey,
    catalog: &Catalog,
    model: &SegmentModel,
    config: &Config,
    seed: SeedTree,
    observer: &dyn Observer,
) -> Result<(Foreground, Segmentation), PipelineError> {
    survey::check_scale(survey, catalog)?;
    let foreground = Foreground::of(survey, catalog, seed.child("background", 0), observer);
    let cloud = &foreground.survey.cloud;
    let segmentation = segment::segment(cloud, catalog, model, &config.segment, seed.child("segment", 0), observer)?;
    Ok((foreground, segmentation))
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
    let scene = Scene { blocks: placed_blocks(works.blocks), ground: ground_of(works, config, observer) };
    let previous = works.previous.cloned().unwrap_or_default();
    let plan = plan::replan(&input(works, &scene), &previous, &config.plan, seed.child("plan", 0), observer)?;
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
    Ok(plan::uncertainty(&input(works, scene), &config.plan, &config.uncertainty, seed.child("plan", 0), observer)?)
}

/// What drawings show of a plan.
pub fn surfaces(works: &Works, scene: &Scene, plan: &Plan) -> (Surfaces, Vec<plan::CrossSection>) {
    let input = surfaces_input(works, scene, plan);
    let surfaces = plan::surfaces(&input);
    let sections = plan::cross_sections(&input, &surfaces);
    (surfaces, sections)
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

/// The bed as stated, or as the survey shows it between and beside the blocks.
pub fn ground_of(works: &Works, config: &Config, observer: &dyn Observer) -> Ground {
    match &works.ground {
        Some(ground) => ground.clone(),
        None => plan::estimate_ground(&works.survey.cloud, works.blocks, works.catalog, &config.ground, observer),
    }
}

/// The accepted blocks as a pile.
pub fn placed_blocks(blocks: &[Recognised]) -> Vec<PlacedBlock> {
    blocks
        .iter()
        .filter(|b| b.judgement == Judgement::Accepted)
        .map(|b| PlacedBlock { block: b.block, model: b.model, site_from_block: b.site_from_block })
        .collect()
}
