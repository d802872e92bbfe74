//! Settings of the planner.
//!
//! METHOD §6 gives lengths and volumes for blocks of about 2 m. A length left out is that value scaled with the block
//! (× d_box / 2 m; volumes with the cube), so that a 2 m block gets the method's figures and a 4 m block or a 5 cm
//! part gets sensible ones. [`PlanConfig`] is what a user writes, [`Settings`] what the planner uses.

use crate::{
    BlockChoice, CraneConfig, ObjectiveConfig, PatternConfig, PlanError, SignWeights,
    UncertaintyConfig, WorksConfig, ZoneConfig,
};
use scene::BlockModel;
use serde::{Deserialize, Serialize};
use sim::PhysicsConfig;

/// How the pose is chosen in which a block is let go.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Policy {
    /// Anywhere about the window's centre in any attitude (the thesis' baseline).
    Random,
    /// Predicted by a network from the window's depth image (the thesis).
    Network,
    /// The best of many poses laid onto the height map, verified by physics (ours).
    #[default]
    Search,
    /// On the nodes of a regular grid, layer upon layer (layered placing).
    Pattern,
}

/// How a block gets to the pose in which it is let go.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Insertion {
    /// Straight down.
    #[default]
    Straight,
    /// Straight down where that serves; where nothing can be lowered so, carried sideways and turned on the way.
    Guided,
}

/// What must lie inside the boundary.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Inside {
    /// The whole block.
    #[default]
    Whole,
    /// Its centre of mass.
    Centre,
}

/// Everything that can be set. A length or volume left out follows from the block's size.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PlanConfig {
    /// Where initial poses come from.
    pub policy: Policy,
    /// Whether blocks are only lowered straight down.
    pub insertion: Insertion,
    /// So many blocks of the pile may be lifted and set elsewhere.
    pub reset: u32,
    /// Numbers of the only blocks that may; none: those that stand too high.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub reset_blocks: Vec<u32>,
    /// Settings of policy `pattern`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pattern: Option<PatternConfig>,
    /// Name of the block to place; left out: the type most frequent in the pile, else the first of the catalogue.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub block: Option<String>,
    /// Several types to place, instead of `block`.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub blocks: Vec<BlockChoice>,
    /// Parts of the works where light blocks may not lie.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub zones: Vec<ZoneConfig>,
    /// Edge of a height-map cell Δl; 0.1 m for a 2 m block.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cell_m: Option<f32>,
    /// Edge of the sliding window, d_x = d_y; one block.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub window_m: Option<f32>,
    /// Stride s of the window; a quarter of it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stride_m: Option<f32>,
    /// Minimum volume v a window must lack; 1 m³ for a 2 m block.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub minimum_volume_m3: Option<f32>,
    /// Windows sharing at least this IoU with a better one are dropped (Algorithm 2).
    pub nms_iou: f32,
    /// Overflow threshold f: how far a centroid may stand above the design; 0.3 m for a 2 m block.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub overflow_m: Option<f32>,
    /// Random drops start within ± this of the window's centre; 0.5 m for a 2 m block.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub jitter_m: Option<f32>,
    /// Most rounds.
    pub rounds: u32,
    /// Whether ground that nobody has surveyed is planned on, as interpolated from afar.
    pub unsurveyed: bool,
    /// What must lie inside the boundary.
    pub inside: Inside,
    /// Solid walls along a convex boundary (a bin; the thesis' boundary planes). Never counted as support.
    pub walls: bool,
    /// How far a block of policies `network` and `search` may move sideways while it settles; 0.2 m for a 2 m block.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub displacement_limit_m: Option<f32>,
    /// Blocks it must touch at rest, unless it stands on the ground.
    pub minimum_supports: u32,
    /// Share of its footprint that may lie under blocks placed before it: more is wedged in from below.
    pub wedge_limit: f32,
    /// Speed a shake gives to a block at rest (scaled with √size); 0: no shake test.
    pub shake_m_s: f32,
    /// How far the shake may move it; 0.1 m for a 2 m block.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shake_limit_m: Option<f32>,
    /// Memory the planner's maps may fill, GB; a design that spans more is refused before work begins.
    pub memory_gb: f32,
    /// Simulated time a drop may take before it counts as unsettled (scaled with √size).
    pub drop_time_s: f32,
    /// Whether blocks of the plan are fixed once they rest. If not, a drop may push them, and one that moves any of them
    /// farther than `shake_limit_m` is removed; several times slower.
    pub frozen: bool,
    /// Settings of policy `random`.
    pub random: RandomConfig,
    /// Settings of policy `search`.
    pub search: SearchConfig,
    /// Settings of policy `network`.
    pub network: NetworkConfig,
    /// What makes one plan better than another; asked by `search.improve`.
    pub objective: ObjectiveConfig,
    /// The crane, if its reach matters.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub crane: Option<CraneConfig>,
    /// Working hours, rate and tides, if days are to be told.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub works: Option<WorksConfig>,
    /// Physics settings.
    pub physics: PhysicsConfig,
    /// How the range of the count is found.
    pub uncertainty: UncertaintyConfig,
}

impl PlanConfig {
    /// The thesis' way to a pose: one random drop in a window; its network where the caller chooses [`Policy::Network`].
    pub fn thesis() -> Self {
        Self { policy: Policy::Random, random: RandomConfig { drops: 1 }, ..Self::default() }
    }
}

/// Settings of policy `random`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RandomConfig {
    /// Drops in a window. 1: the thesis' baseline. More: of those that stay within `displacement_limit_m` and may stay the one that
    /// fills most, which is what the thesis' network is taught (generate-and-test); some hundred times slower.
    pub drops: u32,
}

impl Default for RandomConfig {
    fn default() -> Self {
        Self { drops: 1 }
    }
}

/// Settings of policy `search`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SearchConfig {
    /// Attitudes tried, spread evenly over all rotations modulo the block's symmetry.
    pub attitudes: u32,
    /// Spacing of the positions tried, in cells.
    pub step_cells: u32,
    /// Candidates verified by physics in each window.
    pub verify: u32,
    /// Weight of the void trapped under a block against its height.
    pub trapped_weight: f32,
    /// Weight of what stands above the design against the block's height.
    pub protrusion_weight: f32,
    /// Weights of all signs, as ratings taught them; left out: those of height, trapped void and protrusion above.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub weights: Option<SignWeights>,
    /// Trials for each planned block in which it is lifted and its surroundings are filled anew; 0: the rounds alone.
    pub improve: f32,
    /// Loss of a trial that is accepted with probability 1/e at the start of improving, falling to 0 at its end; in volumes
    /// of a block. 0: only what is better.
    pub temperature: f32,
}

/// Settings of policy `network`; how poses are ranked stands with policy `search`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct NetworkConfig {
    /// Proposals looked at in each window, the surest first.
    pub proposals: u32,
    /// How far a proposal may be moved on the raster for a deeper place, in cells.
    pub nudge_cells: u32,
    /// Proposals verified by physics in each window.
    pub verify: u32,
}

impl SearchConfig {
    /// With learned weights also where candidates are ranked on the raster, which knows void and protrusion alone.
    fn ranked(&self) -> Self {
        let Some(w) = self.weights else { return self.clone() };
        let against_height = |weight: f32| (weight / w.above.max(0.1)).min(10.0);
        Self {
            trapped_weight: against_height(w.raised),
            protrusion_weight: against_height(w.protruding),
            ..self.clone()
        }
    }
}

impl Default for NetworkConfig {
    fn default() -> Self {
        Self { proposals: 96, nudge_cells: 4, verify: 8 }
    }
}

impl Default for SearchConfig {
    fn default() -> Self {
        Self {
            attitudes: 256,
            step_cells: 2,
            verify: 8,
            trapped_weight: 0.25,
            protrusion_weight: 2.0,
            weights: None,
            improve: 0.0,
            temperature: 0.0,
        }
    }
}

impl Default for PlanConfig {
    fn default() -> Self {
        Self {
            policy: Policy::Search,
            insertion: Insertion::Straight,
            reset: 0,
            reset_blocks: Vec::new(),
            pattern: None,
            block: None,
            blocks: Vec::new(),
            zones: Vec::new(),
            cell_m: None,
            window_m: None,
            stride_m: None,
            minimum_volume_m3: None,
            nms_iou: 0.3,
            overflow_m: None,
            jitter_m: None,
            rounds: 20,
            unsurveyed: false,
            inside: Inside::Whole,
            walls: false,
            displacement_limit_m: None,
            minimum_supports: 2,
            wedge_limit: 0.2,
            shake_m_s: 0.1,
            shake_limit_m: None,
            memory_gb: 3.0,
            drop_time_s: 10.0,
            frozen: true,
            random: RandomConfig::default(),
            search: SearchConfig::default(),
            network: NetworkConfig::default(),
            objective: ObjectiveConfig::default(),
            crane: None,
            works: None,
            // Half the step rate and half the rest time of a pile: one block on fixed ones settles as well (the shake tells).
            physics: PhysicsConfig {
                step_s: 1.0 / 60.0,
                rest_time_s: 0.25,
                ..PhysicsConfig::default()
            },
            uncertainty: UncertaintyConfig::default(),
        }
    }
}

/// The settings with every length resolved for one block.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Where initial poses come from.
    pub policy: Policy,
    /// Whether blocks are only lowered straight down.
    pub insertion: Insertion,
    /// Edge of a height-map cell.
    pub cell_m: f32,
    /// Edge of the sliding window.
    pub window_m: f32,
    /// Stride of the window.
    pub stride_m: f32,
    /// Minimum volume v.
    pub minimum_volume_m3: f32,
    /// IoU threshold of the windows' suppression.
    pub nms_iou: f32,
    /// Overflow threshold f.
    pub overflow_m: f32,
    /// Half range of random positions.
    pub jitter_m: f32,
    /// Most rounds.
    pub rounds: u32,
    /// What must lie inside the boundary.
    pub inside: Inside,
    /// Whether the boundary is solid.
    pub walls: bool,
    /// Sideways movement allowed while settling.
    pub displacement_limit_m: f32,
    /// Blocks to touch at least.
    pub minimum_supports: u32,
    /// Share of the footprint allowed under other blocks.
    pub wedge_limit: f32,
    /// Speed of the shake.
    pub shake_m_s: f32,
    /// Movement allowed under the shake.
    pub shake_limit_m: f32,
    /// Memory of the maps.
    pub memory_gb: f32,
    /// Time limit of a drop.
    pub drop_time_s: f32,
    /// Whether placed blocks are fixed.
    pub frozen: bool,
    /// How far a local world reaches from the place of the drop.
    pub local_radius_m: f32,
    /// Placed blocks nearer than this to the place of the drop are free to move; 0: none.
    pub loose_radius_m: f32,
    /// How far a block may roll in it without meeting blocks that the local world does not hold.
    pub roam_m: f32,
    /// Random settings.
    pub random: RandomConfig,
    /// Search settings.
    pub search: SearchConfig,
    /// Network settings.
    pub network: NetworkConfig,
    /// What makes one plan better than another.
    pub objective: ObjectiveConfig,
    /// Physics for this block size.
    pub physics: PhysicsConfig,
}

impl PlanConfig {
    /// Checks every range and resolves what was left out for `model`; `reach_m` is the largest d_max in the scene.
    pub fn resolve(&self, model: &BlockModel, reach_m: f32) -> Result<Settings, PlanError> {
        if self.pattern.is_some() && self.policy != Policy::Pattern {
            return Err(PlanError::PatternWithoutPolicy);
        }
        let scale = model.d_box_m / 2.0;
        let length = |value: Option<f32>, default_m: f32| value.unwrap_or(default_m * scale);
        let window_m = length(self.window_m, 2.0);
        // Two bodies meet within two reaches; the rest is room to roll (random) or to settle (predicted poses).
        let reach_m = reach_m.max(model.d_max_m);
        let roam_m = if self.policy == Policy::Random { 2.0 } else { 1.0 } * reach_m;
        let settings = Settings {
            policy: self.policy,
            insertion: self.insertion,
            cell_m: length(self.cell_m, 0.1),
            window_m,
            stride_m: self.stride_m.unwrap_or(window_m / 4.0),
            minimum_volume_m3: self.minimum_volume_m3.unwrap_or(scale.powi(3)),
            nms_iou: self.nms_iou,
            overflow_m: length(self.overflow_m, 0.3),
            jitter_m: length(self.jitter_m, 0.5),
            rounds: self.rounds,
            inside: self.inside,
            walls: self.walls,
            displacement_limit_m: length(self.displacement_limit_m, 0.2),
            minimum_supports: self.minimum_supports,
            wedge_limit: self.wedge_limit,
            shake_m_s: self.shake_m_s * scale.sqrt(),
            shake_limit_m: length(self.shake_limit_m, 0.1),
            memory_gb: self.memory_gb,
            drop_time_s: self.drop_time_s * scale.sqrt(),
            frozen: self.frozen,
            // Loose neighbours need what they stand on.
            local_radius_m: 2.0 * reach_m + roam_m + if self.frozen { 0.0 } else { 2.0 * reach_m },
            loose_radius_m: if self.frozen { 0.0 } else { 2.0 * reach_m },
            roam_m,
            random: self.random,
            search: self.search.ranked(),
            network: self.network,
            objective: self.objective,
            physics: self.physics.for_block_size(model.d_box_m),
        };
        settings.check()?;
        Ok(settings)
    }
}

/// One of the settings that is a count.
type Count = fn(&Settings) -> u32;

/// Counts that multiply work, with the most of each: ten and more times what any measured plan gained from. Beyond lies a slip
/// of the keyboard that would run for years or ask for all memory.
const MOST: [(&str, Count, u32); 7] = [
    ("rounds", |s| s.rounds, 1_000),
    ("random.drops", |s| s.random.drops, 10_000),
    ("search.attitudes", |s| s.search.attitudes, 10_000),
    ("search.step_cells", |s| s.search.step_cells, 1_000),
    ("search.verify", |s| s.search.verify, 1_000),
    ("network.proposals", |s| s.network.proposals, 10_000),
    ("network.verify", |s| s.network.verify, 1_000),
];

/// Trials a block from which nothing more is gained.
const MOST_PASSES: f32 = 1_000.0;

impl Settings {
    fn check(&self) -> Result<(), PlanError> {
        for (key, value, most) in MOST {
            if value(self) > most {
                return Err(PlanError::TooMuch { key, value: value(self), most });
            }
        }
        let positive = |key, value: f32| {
            let ok = value > 0.0 && value.is_finite();
            if ok {
                Ok(())
            } else {
                Err(PlanError::BadSetting { key, value, why: "it must be above 0" })
            }
        };
        let not_negative = |key, value: f32| {
            let ok = value >= 0.0 && value.is_finite();
            if ok {
                Ok(())
            } else {
                Err(PlanError::BadSetting { key, value, why: "it must not be negative" })
            }
        };
        positive("cell_m", self.cell_m)?;
        positive("window_m", self.window_m)?;
        if self.window_m < self.cell_m {
            return Err(PlanError::WindowBelowCell {
                window_m: self.window_m,
                cell_m: self.cell_m,
            });
        }
        positive("stride_m", self.stride_m)?;
        positive("memory_gb", self.memory_gb)?;
        not_negative("minimum_volume_m3", self.minimum_volume_m3)?;
        positive("nms_iou", self.nms_iou)?;
        if !self.overflow_m.is_finite() {
            let (key, value) = ("overflow_m", self.overflow_m);
            return Err(PlanError::BadSetting { key, value, why: "it must be a number" });
        }
        not_negative("jitter_m", self.jitter_m)?;
        positive("displacement_limit_m", self.displacement_limit_m)?;
        if self.displacement_limit_m > self.roam_m {
            let (key, value) = ("displacement_limit_m", self.displacement_limit_m);
            return Err(PlanError::BadSetting {
                key,
                value,
                why: "it must not exceed the block's own reach",
            });
        }
        not_negative("wedge_limit", self.wedge_limit)?;
        not_negative("shake_m_s", self.shake_m_s)?;
        positive("shake_limit_m", self.shake_limit_m)?;
        positive("drop_time_s", self.drop_time_s)?;
        positive("random.drops", self.random.drops as f32)?;
        positive("search.attitudes", self.search.attitudes as f32)?;
        positive("search.step_cells", self.search.step_cells as f32)?;
        positive("search.verify", self.search.verify as f32)?;
        positive("network.proposals", self.network.proposals as f32)?;
        positive("network.verify", self.network.verify as f32)?;
        not_negative("search.trapped_weight", self.search.trapped_weight)?;
        not_negative("search.protrusion_weight", self.search.protrusion_weight)?;
        not_negative("search.improve", self.search.improve)?;
        not_negative("search.temperature", self.search.temperature)?;
        if self.search.improve > MOST_PASSES {
            let (key, value) = ("search.improve", self.search.improve);
            return Err(PlanError::BadSetting {
                key,
                value,
                why: "more than 1000 passes gain nothing",
            });
        }
        if self.search.improve > 0.0 && self.policy != Policy::Search {
            let (key, value) = ("search.improve", self.search.improve);
            return Err(PlanError::BadSetting { key, value, why: "it goes with policy `search`" });
        }
        let tries_all = matches!(self.policy, Policy::Search | Policy::Network);
        if self.insertion == Insertion::Guided && !tries_all {
            return Err(PlanError::GuidedRandom);
        }
        self.search.weights.iter().try_for_each(SignWeights::check)?;
        self.objective.check()?;
        Ok(self.physics.check()?)
    }
}
