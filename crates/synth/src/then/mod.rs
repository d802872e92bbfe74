//! What happens to a finished scene before it is surveyed again, with the truth of every change.
//!
//! In: a scene of [`crate::scene`], its recipe and what happens: a storm, or works that build a plan. Out: the scene after it, settled by
//! the physics engine, scanned anew with the sensor's own new errors; and what happened to every block.

mod broken;
mod happening;
mod settle;
mod storm;
mod works;

pub use happening::{Datum, Sinking, Storm, Then, Works};

use crate::recipe::Recipe;
use crate::scene::measure;
use crate::{SynthError, SynthScene};
use geom::{DVec3, Plane, Quat, SeedTree, Vec3};
use scene::{Catalog, InstanceId, ModelId, PlacedBlock, Plan, Scene};
use serde::{Deserialize, Serialize};

/// What was done to a block.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum What {
    /// Nothing; its neighbours may have pushed it.
    Kept,
    /// Thrown by a wave.
    Kicked,
    /// Turned about its centre.
    Turned,
    /// Went down with the bed.
    Sunk,
    /// Taken away.
    Missing,
    /// Lost the end of a leg.
    Broken,
    /// Turned by a rotation that maps it onto itself.
    Rolled,
    /// Came from elsewhere.
    Added,
    /// Placed as planned, with the crane's error.
    Placed,
    /// Planned and not placed.
    Skipped,
}

impl What {
    /// The word in the truth file.
    pub fn word(self) -> &'static str {
        match self {
            Self::Kept => "kept",
            Self::Kicked => "kicked",
            Self::Turned => "turned",
            Self::Sunk => "sunk",
            Self::Missing => "missing",
            Self::Broken => "broken",
            Self::Rolled => "rolled",
            Self::Added => "added",
            Self::Placed => "placed",
            Self::Skipped => "skipped",
        }
    }
}

/// What really happened to a block.
#[derive(Clone, Debug, PartialEq)]
pub struct TrueChange {
    /// Number in the scene before; `None` for a block that came.
    pub earlier: Option<InstanceId>,
    /// Number in the scene after; `None` for a block that is gone.
    pub later: Option<InstanceId>,
    /// Order in the plan, of a planned block.
    pub planned: Option<u32>,
    /// Type.
    pub model: ModelId,
    /// What was done.
    pub what: What,
    /// Shift of the centre after settling, metres; of a planned block: against its planned rest.
    pub shift_m: Vec3,
    /// The least turn over the block's symmetry, radians.
    pub turn_rad: f32,
    /// Share of the leg that broke off; 0 for a whole block.
    pub lost_leg: f32,
    /// What lies beyond this plane (block coordinates) is gone.
    pub cut: Option<Plane>,
}

/// The second epoch.
#[derive(Clone, Debug)]
pub struct NextEpoch {
    /// The scene after, with its own survey.
    pub scene: SynthScene,
    /// What happened: one entry a block of either scene and of the plan.
    pub changes: Vec<TrueChange>,
    /// Whether everything came to rest.
    pub at_rest: bool,
}

/// Lets it happen to `before`, settles and scans again. `plan` is what works build; a storm needs none.
pub fn then(
    recipe: &Recipe,
    catalog: &Catalog,
    before: &Scene,
    then: &Then,
    plan: Option<&Plan>,
    seed: SeedTree,
) -> Result<NextEpoch, SynthError> {
    then.check()?;
    let mut recipe = recipe.clone();
    let (sensor, density) = then.survey();
    if let Some(sensor) = sensor {
        recipe.sensor = sensor.clone();
    }
    recipe.density_per_m2 = density.unwrap_or(recipe.density_per_m2);
    let resolved = recipe.resolve(catalog)?;
    let events = match then {
        Then::Storm(storm) => storm::events(storm, before, catalog, &resolved, seed),
        Then::Works(works) => {
            let plan = plan.ok_or(SynthError::NoPlan)?;
            works::events(works, before, plan, catalog, seed)?
        }
    };
    let settled = settle::settled(&recipe, &resolved, catalog, before, &events)?;
    let after = Scene { blocks: settled.blocks.clone(), ground: events.ground.clone() };
    let mut scene =
        measure(&recipe, &resolved, &settled.catalog, after, Vec::new(), seed.child("scan", 0))?;
    for (block, &model) in scene.scene.blocks.iter_mut().zip(&settled.model) {
        // A broken block is of the type it always was.
        block.model = model;
    }
    displace(&mut scene, then.datum());
    let changes = changes(catalog, before, &events, &scene.scene.blocks, &settled);
    Ok(NextEpoch { scene, changes, at_rest: settled.at_rest })
}

/// A block of the scene after, before it settles.
#[derive(Clone, Debug)]
struct Start {
    earlier: Option<InstanceId>,
    planned: Option<(u32, geom::Pose)>,
    model: ModelId,
    pose: geom::Pose,
    what: What,
    /// Velocity of the centre, m/s.
    speed: Vec3,
    lost_leg: f32,
    cut: Option<Plane>,
    /// Falls onto the pile after the rest has settled.
    last: bool,
}

/// Everything that happens.
#[derive(Clone, Debug)]
struct Events {
    blocks: Vec<Start>,
    gone: Vec<PlacedBlock>,
    skipped: Vec<(u32, ModelId)>,
    ground: scene::Ground,
}

fn changes(
    catalog: &Catalog,
    before: &Scene,
    events: &Events,
    after: &[PlacedBlock],
    settled: &settle::Settled,
) -> Vec<TrueChange> {
    let mut out = Vec::new();
    for (i, (start, block)) in events.blocks.iter().zip(after).enumerate() {
        let model = catalog.get(start.model);
        let from = match (start.planned, start.earlier) {
            (Some((_, rest)), _) => Some(rest),
            (None, Some(id)) => {
                before.blocks.iter().find(|b| b.block == id).map(|b| b.site_from_block)
            }
            (None, None) => None,
        };
        let to = block.site_from_block;
        let shift_m = from.map_or(Vec3::ZERO, |from| to * model.centre - from * model.centre);
        let turn_rad =
            from.map_or(0.0, |from| model.symmetry.rotation_error_rad(to.rotation, from.rotation));
        out.push(TrueChange {
            earlier: start.earlier,
            later: Some(block.block),
            planned: start.planned.map(|p| p.0),
            model: settled.model[i],
            what: start.what,
            shift_m,
            turn_rad,
            lost_leg: start.lost_leg,
            cut: start.cut,
        });
    }
    let gone = |what, earlier, planned, model| TrueChange {
        earlier,
        later: None,
        planned,
        model,
        what,
        shift_m: Vec3::ZERO,
        turn_rad: 0.0,
        lost_leg: 0.0,
        cut: None,
    };
    out.extend(events.gone.iter().map(|b| gone(What::Missing, Some(b.block), None, b.model)));
    out.extend(events.skipped.iter().map(|&(o, m)| gone(What::Skipped, None, Some(o), m)));
    out
}

/// Moves the survey, not the blocks: an error of its datum.
fn displace(scene: &mut SynthScene, datum: &Datum) {
    if *datum == Datum::default() {
        return;
    }
    let turn = Quat::from_rotation_z(datum.yaw_deg.to_radians())
        * Quat::from_rotation_y(datum.tilt_deg[1].to_radians())
        * Quat::from_rotation_x(datum.tilt_deg[0].to_radians());
    let shift = DVec3::from_array(datum.shift_m.map(f64::from));
    let scale = 1.0 + 1e-6 * f64::from(datum.scale_ppm);
    let moved = |p: &Vec3| (turn.as_dquat() * p.as_dvec3() * scale + shift).as_vec3();
    scene.survey.cloud.position_m = scene.survey.cloud.position_m.iter().map(moved).collect();
    scene.survey.sensor_positions = scene.survey.sensor_positions.iter().map(moved).collect();
}
