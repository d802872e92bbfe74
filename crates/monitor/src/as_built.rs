//! What was built against what was planned.
//!
//! In: the epoch the plan was made on, a later epoch, the plan. The blocks of both epochs are compared first; what the later one has
//! beyond the earlier is new and may be a planned block. New and planned blocks are paired by one assignment over distance
//! and turn; a planned block without a partner is looked for in the cloud before it is called not placed.

use crate::body::{Body, Difference, difference};
use crate::built_level::{BuiltLevel, levels_m};
use crate::change::Class;
use crate::common_error::CommonError;
use crate::compare::{CompareConfig, Comparison, compare};
use crate::dense::zeros;
use crate::layer::{Figures, figures};
use crate::matching::{MatchConfig, matched};
use crate::single::{Only, Single, solids};
use crate::surface_samples::samples;
use crate::view::View;
use crate::{Epoch, MonitorError, SeenBlock, StableGround};
use geom::{DVec3, Observer, PointGrid, Vec3};
use scene::{Catalog, Placement, Plan};
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};

/// When a planned block counts as placed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct AsBuiltConfig {
    /// Settings of the comparison of both epochs.
    pub compare: CompareConfig,
    /// Largest distance from its plan of a block that is in place, in block lengths.
    pub place_blocks: f64,
    /// Largest turn from its plan of a block that is in place, radians.
    pub place_turn_rad: f64,
    /// Farthest a block may end from its plan and still be it, in block lengths.
    pub gate_blocks: f64,
}

impl Default for AsBuiltConfig {
    fn default() -> Self {
        // A crane hardly moves what lies there, but covers much of it: a covered block is not the new one above it.
        let matching =
            MatchConfig { gate_blocks: 0.35, move_sd_blocks: 0.1, ..MatchConfig::default() };
        Self {
            compare: CompareConfig { matching, ..CompareConfig::default() },
            place_blocks: 0.1,
            place_turn_rad: 0.175,
            gate_blocks: 0.75,
        }
    }
}

/// What became of a planned block.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Built {
    /// Stands as planned, within the tolerance.
    Placed,
    /// Stands there, farther off or turned more than the tolerance.
    OffBy,
    /// Another type stands in its place.
    Replaced,
    /// Nothing stands there.
    NotPlaced,
    /// The later survey does not show its place.
    Hidden,
    /// Stands there though nobody planned it.
    Extra,
}

impl Built {
    /// All of them, in the order of tables.
    pub const ALL: [Self; 6] =
        [Self::Placed, Self::OffBy, Self::Replaced, Self::NotPlaced, Self::Hidden, Self::Extra];

    /// The word in files.
    pub fn word(self) -> &'static str {
        match self {
            Self::Placed => "placed",
            Self::OffBy => "off by",
            Self::Replaced => "replaced by another",
            Self::NotPlaced => "not placed",
            Self::Hidden => "hidden",
            Self::Extra => "extra",
        }
    }
}

/// One planned or extra block.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BuiltBlock {
    /// Order in the plan; `None` for an extra.
    pub order: Option<u32>,
    /// Number in the later epoch.
    pub later_id: Option<u32>,
    /// Type that was planned, of an extra the type found.
    pub model: scene::ModelId,
    /// What became of it.
    pub state: Built,
    /// Built less planned, metres.
    pub off_m: [f64; 3],
    /// Length of it.
    pub distance_m: f64,
    /// The least turn over the symmetry, radians.
    pub turn_rad: f64,
    /// Level of detection of the distance, in its direction: 1.96 standard deviations of the built pose, the registration and what the
    /// plan's survey may be off by as a whole.
    pub level_m: f64,
    /// The same along east, north and up.
    pub level_axes_m: [f64; 3],
    /// Where it stands, or should, earlier epoch's local frame.
    pub centre: Vec3,
    /// What a reader should know.
    pub note: String,
}

/// The works as they are.
#[derive(Clone, Debug)]
pub struct AsBuilt {
    /// Planned blocks in placing order, then extras.
    pub blocks: Vec<BuiltBlock>,
    /// What happened to the blocks that were there before.
    pub comparison: Comparison,
    /// Concrete of the new blocks, m³.
    pub concrete_m3: f64,
    /// Plan area of the cells that the new blocks raised, m².
    pub area_m2: f64,
    /// 1 − concrete / volume between the measured surfaces before and after.
    pub porosity_measured: Option<f64>,
    /// The same between the surfaces that the posed blocks make.
    pub porosity_of_poses: Option<f64>,
    /// New blocks a square metre times the square of Dn: packing density coefficient.
    pub packing: Option<f64>,
}

impl AsBuilt {
    /// Blocks of a state.
    pub fn count(&self, state: Built) -> usize {
        self.blocks.iter().filter(|b| b.state == state).count()
    }

    /// New blocks that stand: planned ones and extras.
    pub fn built(&self) -> usize {
        self.blocks.iter().filter(|b| b.later_id.is_some()).count()
    }
}

/// Compares a plan with a later epoch. `plan` is in the earlier epoch's local frame.
pub fn as_built(
    earlier: &Epoch,
    plan: &Plan,
    later: &Epoch,
    catalog: &Catalog,
    stable: &StableGround,
    config: &AsBuiltConfig,
    observer: &dyn Observer,
) -> Result<AsBuilt, MonitorError> {
    if let Some(p) = plan.placements.iter().find(|p| usize::from(p.model.0) >= catalog.len()) {
        let (block, model) = (p.order, p.model.0);
        return Err(MonitorError::UnknownModel { block, model, known: catalog.len() });
    }
    let comparison = compare(earlier, later, catalog, stable, &config.compare, observer)?;
    let planned: Vec<Body> =
        plan.placements.iter().enumerate().map(|(i, p)| planned_body(i, p, catalog)).collect();
    let (mut new, sure) = new_bodies(&comparison, earlier, later, catalog);
    let loose = MatchConfig {
        gate_blocks: config.gate_blocks,
        rise_blocks: config.gate_blocks,
        move_sd_blocks: 0.3 * config.gate_blocks,
        moved_share: 1.0 - 1e-6,
        ..config.compare.matching
    };
    // A planned block may be replaced by another type: types do not keep a pair apart here.
    let open: Vec<Body> =
        planned.iter().map(|b| Body { type_judged: false, ..b.clone() }).collect();
    let pairs = matched(&open, &new, catalog, &zeros::<6>(), &loose)?;
    let size_m = catalog.iter().map(|(_, m)| f64::from(m.d_box_m)).fold(0.0, f64::max);
    let of_plan = CommonError::of(earlier.survey.sensor, size_m / 2.0);
    let level = BuiltLevel { comparison: &comparison, of_plan };
    let mut blocks = planned_blocks(plan, &planned, &new, &pairs, &level, later, catalog, config);
    look_for_missing(&mut blocks, plan, &planned, &comparison, earlier, later, catalog, config);
    let taken: BTreeSet<usize> = pairs.iter().map(|p| p.later).collect();
    // What nobody planned must be new beyond doubt: else it may have stood there before.
    let untaken = new.iter().enumerate().filter(|(i, _)| !taken.contains(i) && sure[*i]);
    blocks.extend(untaken.map(|(_, body)| extra(body, later)));
    let mut place = 0..new.len();
    new.retain(|_| place.next().is_some_and(|i| sure[i] || taken.contains(&i)));
    let Figures { concrete_m3, area_m2, porosity_measured, porosity_of_poses, packing } =
        figures(&new, earlier, &comparison.later_points, catalog);
    Ok(AsBuilt {
        blocks,
        comparison,
        concrete_m3,
        area_m2,
        porosity_measured,
        porosity_of_poses,
        packing,
    })
}

fn planned_body(index: usize, placement: &Placement, catalog: &Catalog) -> Body {
    let mut covariance = zeros::<6>();
    (0..6).for_each(|i| covariance[i][i] = 1e-8);
    Body {
        index,
        model: placement.model,
        type_judged: true,
        centre: (placement.rest * catalog.get(placement.model).centre).as_dvec3(),
        rotation: placement.rest.rotation.as_dquat().normalize(),
        covariance,
        confidence: 1.0,
    }
}

/// Blocks of the later epoch that are none of the earlier one's, registered. One that the earlier survey merely failed to
/// recognise stands in that survey's cloud, and is not new. Beside each block: whether it is new beyond doubt.
fn new_bodies(
    comparison: &Comparison,
    earlier: &Epoch,
    later: &Epoch,
    catalog: &Catalog,
) -> (Vec<Body>, Vec<bool>) {
    let origin = DVec3::from_array(later.survey.frame.origin)
        - DVec3::from_array(earlier.survey.frame.origin);
    let stands = |c: &&crate::Change| {
        c.earlier_id.is_none() && matches!(c.class, Class::New | Class::Doubtful)
    };
    let surely: BTreeMap<u32, bool> = comparison
        .changes
        .iter()
        .filter(stands)
        .filter_map(|c| Some((c.later_id?, c.class == Class::New)))
        .collect();
    let is_new = |b: &Body| surely.get(&later.blocks[b.index].id).copied();
    Body::all(later, catalog, origin)
        .into_iter()
        .filter_map(|b| {
            let sure = is_new(&b)?;
            Some((b.moved(&comparison.reference.motion), sure))
        })
        .unzip()
}

#[allow(clippy::too_many_arguments)] // each is one of the stage's own values
fn planned_blocks(
    plan: &Plan,
    planned: &[Body],
    new: &[Body],
    pairs: &[crate::matching::Pair],
    level: &BuiltLevel,
    later: &Epoch,
    catalog: &Catalog,
    config: &AsBuiltConfig,
) -> Vec<BuiltBlock> {
    let one = |(i, body): (usize, &Body)| {
        // Pairs come ascending by the planned block.
        let pair = pairs.binary_search_by_key(&i, |p| p.earlier);
        let partner = pair.ok().map(|k| &new[pairs[k].later]);
        let mut out = BuiltBlock {
            order: Some(plan.placements[i].order),
            later_id: None,
            model: body.model,
            state: Built::NotPlaced,
            off_m: [0.0; 3],
            distance_m: 0.0,
            turn_rad: 0.0,
            level_m: 0.0,
            level_axes_m: [0.0; 3],
            centre: body.centre.as_vec3(),
            note: String::new(),
        };
        let Some(found) = partner else { return out };
        let seen: &SeenBlock = &later.blocks[found.index];
        let delta: Difference = difference(body, found, catalog);
        let size = f64::from(catalog.get(body.model).d_box_m);
        out.later_id = Some(seen.id);
        out.off_m = delta.shift().to_array();
        out.distance_m = delta.shift().length();
        out.turn_rad = delta.turn().length();
        (out.level_m, out.level_axes_m) = levels_m(&level.covariance(found), delta.shift());
        out.centre = found.centre.as_vec3();
        let other_type = found.model != body.model && found.type_judged;
        let in_place =
            out.distance_m <= config.place_blocks * size && out.turn_rad <= config.place_turn_rad;
        out.state = match (other_type, in_place) {
            (true, _) => Built::Replaced,
            (false, true) => Built::Placed,
            (false, false) => Built::OffBy,
        };
        if other_type {
            out.note = format!("a {} stands there", catalog.get(found.model).name);
        }
        out
    };
    planned.iter().enumerate().map(one).collect()
}

/// A planned block nobody recognised: seen through, it is not placed; covered or not surveyed, nobody can say.
#[allow(clippy::too_many_arguments)] // each is one of the stage's own values
fn look_for_missing(
    blocks: &mut [BuiltBlock],
    plan: &Plan,
    planned: &[Body],
    comparison: &Comparison,
    earlier: &Epoch,
    later: &Epoch,
    catalog: &Catalog,
    config: &AsBuiltConfig,
) {
    let open: Vec<&Body> = planned
        .iter()
        .zip(blocks.iter())
        .filter(|(_, b)| b.later_id.is_none())
        .map(|p| p.0)
        .collect();
    let size_m = catalog.iter().map(|(_, m)| m.d_box_m).fold(0.0, f32::max);
    let origin = DVec3::from_array(later.survey.frame.origin)
        - DVec3::from_array(earlier.survey.frame.origin);
    let motion = &comparison.reference.motion;
    let sensors = later
        .survey
        .sensor_positions
        .iter()
        .map(|s| motion.apply(s.as_dvec3() + origin).as_vec3())
        .collect();
    let kind = later.survey.sensor;
    let noise = kind.noise_sd_m(catalog.d_max_m());
    let view = View::new(&comparison.later_points, sensors, kind, noise, size_m);
    let stated: Vec<SeenBlock> = plan.placements.iter().map(as_seen).collect();
    let samples = samples(catalog, config.compare.single.samples);
    let single = &config.compare.single;
    // The plan shows all of its own surface.
    let own = View::everything();
    let solids = solids(catalog);
    let nothing = PointGrid::new(&[], 1.0);
    let judge = Single {
        unexplained: &nothing,
        catalog,
        samples: &samples,
        solids: &solids,
        own: &own,
        other: &view,
        room: None,
        config: single,
    };
    let place: BTreeMap<u32, usize> =
        blocks.iter().enumerate().filter_map(|(i, b)| Some((b.order?, i))).collect();
    for change in judge.judge_all(&open, &stated, Only::Earlier) {
        let Some(&at) = change.earlier_id.and_then(|order| place.get(&order)) else { continue };
        let block = &mut blocks[at];
        (block.state, block.note) = match change.class {
            Class::Missing => (Built::NotPlaced, String::new()),
            _ => (Built::Hidden, change.note),
        };
    }
}

fn as_seen(placement: &Placement) -> SeenBlock {
    SeenBlock {
        id: placement.order,
        model: placement.model,
        type_judged: true,
        site_from_block: placement.rest,
        covariance: None,
        confidence: 1.0,
        occlusion: 0.0,
        points: Vec::new(),
    }
}

fn extra(body: &Body, later: &Epoch) -> BuiltBlock {
    BuiltBlock {
        order: None,
        later_id: Some(later.blocks[body.index].id),
        model: body.model,
        state: Built::Extra,
        off_m: [0.0; 3],
        distance_m: 0.0,
        turn_rad: 0.0,
        level_m: 0.0,
        level_axes_m: [0.0; 3],
        centre: body.centre.as_vec3(),
        note: String::new(),
    }
}
