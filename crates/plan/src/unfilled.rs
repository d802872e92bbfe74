//! Places that stay below the design, and why no block went there.
//!
//! In: the surfaces with the finished plan and what was tried. Out: windows of one block's size that hardly overlap, each with
//! one reason. Where something was tried the reason is what removed most trials; elsewhere the lowest pose on the finished pile tells.

use crate::{
    PlanConfig, PlanError, PlanInput, Policy, Surfaces, acceptance, reset,
    search::Attitudes,
    site::{self, Site, TypeToPlace},
    stack::Stack,
    windows::{self, Window},
};
use geom::{SeedTree, Silent, Vec2};
use scene::{Placement, PlacementState, Plan};
use serde::{Deserialize, Serialize};

/// Part of the minimum volume from which a gap is shown: less is the roughness of any armour layer.
const SHOWN: f32 = 0.25;
/// Windows that overlap by more are one place.
const OVERLAP: f32 = 0.05;
/// Attitudes laid into a place where nothing was tried: the lowest of fewer is hardly higher.
const ATTITUDES: u32 = 64;

/// A square place that stays below the design.
#[derive(Clone, Debug, PartialEq)]
pub struct Unfilled {
    /// Its middle, local frame.
    pub centre: Vec2,
    /// Half its edge, metres.
    pub half_m: f32,
    /// Volume between surface and design less what stands above it, m³.
    pub void_m3: f32,
    /// Drops that were tried in it and removed.
    pub trials: u32,
    /// Why no block went there.
    pub reason: UnfilledReason,
}

/// Why a place got no block.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum UnfilledReason {
    /// It lacks less than the minimum volume.
    #[serde(rename = "too-small")]
    Small,
    /// A block there stands above the design by more than the overflow threshold.
    Overflow,
    /// A block there rolls or slides away: an edge without a hold.
    UnstableEdge,
    /// A block there touches too few others.
    Unsupported,
    /// A block there is wedged under others or moves under a shake.
    Unstable,
    /// A block there does not come to rest.
    Unsettled,
    /// No block lies there wholly within the boundary.
    Boundary,
    /// The crane does not carry a block that far.
    OutOfReach,
    /// Its zone asks for heavier blocks than the plan has.
    TooLight,
    /// The blocks in stock are used.
    Stock,
    /// The rounds ended before it was its turn.
    Rounds,
    /// Its neighbourhood was tried and closed; a block laid into it alone might fit.
    Closed,
}

impl UnfilledReason {
    /// All of them.
    pub const ALL: [Self; 12] = [
        Self::Small,
        Self::Overflow,
        Self::UnstableEdge,
        Self::Unsupported,
        Self::Unstable,
        Self::Unsettled,
        Self::Boundary,
        Self::OutOfReach,
        Self::TooLight,
        Self::Stock,
        Self::Rounds,
        Self::Closed,
    ];

    /// The word in `unfilled.csv`.
    pub fn word(self) -> &'static str {
        match self {
            Self::Small => "too-small",
            Self::Overflow => "overflow",
            Self::UnstableEdge => "unstable-edge",
            Self::Unsupported => "unsupported",
            Self::Unstable => "unstable",
            Self::Unsettled => "unsettled",
            Self::Boundary => "boundary",
            Self::OutOfReach => "out-of-reach",
            Self::TooLight => "too-light",
            Self::Stock => "stock",
            Self::Rounds => "rounds",
            Self::Closed => "closed",
        }
    }
}

/// The places, largest void first. Errors: those of the plan's own configuration.
pub fn unfilled(
    input: &PlanInput,
    config: &PlanConfig,
    surfaces: &Surfaces,
    plan: &Plan,
) -> Result<Vec<Unfilled>, PlanError> {
    // The poses of policy `search`, whatever the plan's: it alone says how low a block could lie.
    let laid = PlanConfig { policy: Policy::Search, pattern: None, ..config.clone() };
    let mut site = site::prepare(input, &laid, SeedTree::new(0), &Silent)?;
    site.lifted = reset::lifted(input, &plan.placements);
    let kind = site.types.last().unwrap_or(site.main());
    let mut shown = kind.settings.clone();
    (shown.minimum_volume_m3, shown.nms_iou) = (SHOWN * shown.minimum_volume_m3, OVERLAP);
    let found = windows::detect(&surfaces.planned, &surfaces.design, &shown, |_| true);
    let finished = Finished::new(input, config, &site, kind, plan);
    Ok(found.iter().map(|w| finished.unfilled(w, kind.settings.window_m / 2.0)).collect())
}

/// The pile with the plan in it, and what was tried.
struct Finished<'s, 'a> {
    site: &'s Site<'a>,
    /// The smallest type.
    kind: &'s TypeToPlace<'a>,
    stack: Stack<'s>,
    attitudes: Attitudes,
    plan: &'s Plan,
    policy: Policy,
}

impl<'s, 'a> Finished<'s, 'a> {
    fn new(
        input: &PlanInput<'s>,
        config: &PlanConfig,
        site: &'s Site<'a>,
        kind: &'s TypeToPlace<'a>,
        plan: &'s Plan,
    ) -> Self {
        let stack = site.stack_with(input, &plan.placements);
        let mut settings = kind.settings.clone();
        settings.search.attitudes = ATTITUDES.min(settings.search.attitudes);
        let block = input.catalog.get(kind.model);
        let attitudes = Attitudes::new(block, &settings, SeedTree::new(0));
        Self { site, kind, stack, attitudes, plan, policy: config.policy }
    }

    fn unfilled(&self, window: &Window, half_m: f32) -> Unfilled {
        let within = |p: &&Placement, half_m: f32| {
            (p.drop.translation.truncate() - window.centre).abs().max_element() <= half_m
        };
        let tried: Vec<&Placement> =
            self.plan.removed.iter().filter(|p| within(p, half_m)).collect();
        let near: Vec<&Placement> =
            self.plan.removed.iter().filter(|p| within(p, 2.0 * half_m)).collect();
        let (centre, void_m3) = (window.centre, window.deficit_m3);
        let small = void_m3 <= self.kind.settings.minimum_volume_m3;
        let reason = self
            .closed_to_all(centre)
            .or_else(|| small.then_some(UnfilledReason::Small))
            .or_else(|| self.most_often(&tried))
            .or_else(|| self.lowest_pose(window))
            .or_else(|| self.most_often(&near))
            .unwrap_or(match self.plan.summary.rounds >= self.kind.settings.rounds {
                true => UnfilledReason::Rounds,
                false => UnfilledReason::Closed,
            });
        Unfilled { centre, half_m, void_m3, trials: tried.len() as u32, reason }
    }

    /// What keeps every type away, whatever the pile.
    fn closed_to_all(&self, place: Vec2) -> Option<UnfilledReason> {
        let types = || self.site.types.iter();
        let left = |t: &&TypeToPlace| {
            let used = self.plan.placements.iter().filter(|p| p.model == t.model).count();
            t.stock.is_none_or(|stock| used < stock as usize)
        };
        if !types().any(|t| t.allowed.within_reach(place)) {
            return Some(UnfilledReason::OutOfReach);
        }
        if !types().any(|t| t.allowed.covers(place)) {
            return Some(UnfilledReason::TooLight);
        }
        let any_left = types().filter(left).any(|t| t.allowed.covers(place));
        (!any_left).then_some(UnfilledReason::Stock)
    }

    /// What removed most of these; of equal numbers the first.
    fn most_often(&self, tried: &[&Placement]) -> Option<UnfilledReason> {
        let mut causes: Vec<UnfilledReason> = tried.iter().map(|p| self.cause(p)).collect();
        causes.sort();
        let often = |c: &UnfilledReason| causes.iter().filter(|other| *other == c).count();
        causes.iter().max_by_key(|c| (often(c), std::cmp::Reverse(**c))).copied()
    }

    /// What removed one block.
    fn cause(&self, p: &Placement) -> UnfilledReason {
        let kind = self.site.of_model(p.model).unwrap_or(self.kind);
        let (settings, block) = (&kind.settings, self.stack.catalog.get(p.model));
        let centre = (p.rest * block.centre).truncate();
        let away_m = (centre - (p.drop * block.centre).truncate()).length();
        let limit_m = match self.policy {
            Policy::Random => settings.roam_m,
            _ => settings.displacement_limit_m,
        };
        match p.state {
            PlacementState::Overflow => UnfilledReason::Overflow,
            PlacementState::Unsettled => UnfilledReason::Unsettled,
            PlacementState::Outside
                if !kind.allowed.within_reach(centre)
                    || !kind.allowed.hook_high_enough((p.rest * block.centre).z) =>
            {
                UnfilledReason::OutOfReach
            }
            PlacementState::Outside if !kind.allowed.heavy_enough(centre) => {
                UnfilledReason::TooLight
            }
            PlacementState::Outside => UnfilledReason::Boundary,
            PlacementState::Unstable | PlacementState::Kept if away_m > limit_m => {
                UnfilledReason::UnstableEdge
            }
            PlacementState::Unstable | PlacementState::Kept
                if p.contacts < settings.minimum_supports =>
            {
                UnfilledReason::Unsupported
            }
            PlacementState::Unstable | PlacementState::Kept => UnfilledReason::Unstable,
        }
    }

    /// What the lowest pose of a block on the finished pile says; `None`: one fits under the design.
    fn lowest_pose(&self, window: &Window) -> Option<UnfilledReason> {
        let (mut settings, model) = (self.kind.settings.clone(), self.kind.model);
        let allowed_m = settings.overflow_m;
        settings.overflow_m = 1e6;
        let found = self.attitudes.candidates(&self.stack, &settings, model, window);
        let block = self.stack.catalog.get(model);
        let above = |c: &crate::search::Candidate| {
            acceptance::above_design_m(&self.stack, c.pose * block.centre)
        };
        match found.iter().map(above).reduce(f32::min) {
            None => Some(UnfilledReason::Boundary),
            Some(lowest_m) if lowest_m > allowed_m => Some(UnfilledReason::Overflow),
            Some(_) => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use geom::{HeightMap, Pose, Vec3};
    use scene::{Catalog, DesignSurface, ModelId, Scene, SiteFrame};

    fn works(deep: impl Fn(f32, f32) -> f32) -> Surfaces {
        let mut design = HeightMap::empty(Vec2::ZERO, Vec2::splat(12.0), 0.1);
        let mut planned = design.clone();
        design.fill_with(|_, _| 2.0);
        planned.fill_with(|x, y| 2.0 - deep(x, y));
        Surfaces { design, as_surveyed: planned.clone(), planned }
    }

    fn removed(x: f32, y: f32, state: PlacementState) -> Placement {
        let drop = Pose::from_parts(Vec3::new(x, y, 3.0), geom::Quat::IDENTITY);
        let model = ModelId(0);
        let (order, round, contacts, filled_m3) = (1, 1, 0, 0.0);
        let handling = scene::Handling::default();
        Placement { order, round, model, drop, rest: drop, filled_m3, contacts, state, handling }
    }

    #[test]
    fn every_hole_is_named_with_its_reason() {
        // Three holes of 2 m × 2 m: deep and tried, deep and not tried, shallow.
        let hole =
            |x: f32, y: f32, at: [f32; 2]| (x - at[0]).abs() < 1.0 && (y - at[1]).abs() < 1.0;
        let surfaces = works(|x, y| match () {
            () if hole(x, y, [3.0, 3.0]) || hole(x, y, [9.0, 3.0]) => 1.5,
            () if hole(x, y, [6.0, 9.0]) => 0.3,
            () => 0.0,
        });
        let shape = scene::Shape::Tetrapod { size: 2.0 };
        let model = blocks::shape_model("t", shape, 2300.0).unwrap();
        let catalog = Catalog::new(vec![model]);
        let scene = Scene { blocks: Vec::new(), ground: scene::Ground::Level { z_m: 0.0 } };
        let frame = SiteFrame::default();
        let boundary = vec![[0.0, 0.0], [12.0, 0.0], [12.0, 12.0], [0.0, 12.0]];
        let design = DesignSurface::Level { boundary, level_m: 2.0 };
        let input = PlanInput {
            scene: &scene,
            frame: &frame,
            design: &design,
            catalog: &catalog,
            placed: &[],
            proposer: None,
            survey: None,
        };
        use PlacementState::{Outside, Overflow, Unstable};
        let removed = vec![
            removed(3.2, 3.1, Overflow),
            removed(2.9, 3.0, Unstable),
            removed(3.0, 2.8, Unstable),
            removed(11.5, 11.5, Outside),
        ];
        let plan = Plan { removed, ..Plan::default() };
        let config = PlanConfig { minimum_volume_m3: Some(2.0), ..PlanConfig::default() };
        let found = unfilled(&input, &config, &surfaces, &plan).unwrap();
        let near = |x: f32, y: f32| {
            let here = |w: &&Unfilled| (w.centre - Vec2::new(x, y)).length() < 0.3;
            found.iter().find(here).unwrap_or_else(|| panic!("nothing at {x}, {y}: {found:?}"))
        };
        assert_eq!(near(3.0, 3.0).reason, UnfilledReason::Unsupported);
        assert_eq!(near(3.0, 3.0).trials, 3);
        assert_eq!(near(9.0, 3.0).reason, UnfilledReason::Closed);
        assert_eq!(near(6.0, 9.0).reason, UnfilledReason::Small);
        assert!((near(9.0, 3.0).void_m3 - 6.0).abs() < 0.3);
        assert_eq!(found.len(), 3, "{found:?}");
    }
}
