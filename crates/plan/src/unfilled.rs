//! Places that stay below the design, and why no block went there.
//!
//! In: the surfaces with the finished plan and what was tried. Out: windows of one block's size that hardly overlap.

use crate::{PlanConfig, PlanError, PlanInput, Surfaces, block_to_place, windows};
use geom::Vec2;
use scene::{PlacementState, Plan};

/// Part of the minimum volume from which a gap is shown: less is the roughness of any armour layer.
const SHOWN: f32 = 0.25;
/// Windows that overlap by more are one place.
const OVERLAP: f32 = 0.05;

/// A square place that stays below the design.
#[derive(Clone, Debug, PartialEq)]
pub struct Unfilled {
    /// Its middle, local frame.
    pub centre: Vec2,
    /// Half its edge, metres.
    pub half_m: f32,
    /// Volume between surface and design less what stands above it, m³.
    pub void_m3: f32,
    /// Why no block went there.
    pub reason: UnfilledReason,
}

/// Why a place got no block.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum UnfilledReason {
    /// It lacks less than the minimum volume.
    Small,
    /// Blocks were tried there; most of them were removed for this.
    Tried(PlacementState),
    /// It lacks the minimum volume, but no trial there came to rest: it was covered, out of the crane's reach, or found
    /// no pose.
    NoTrial,
}

/// The places, largest void first. Errors: those of the plan's own configuration.
pub fn unfilled(
    input: &PlanInput,
    config: &PlanConfig,
    surfaces: &Surfaces,
    plan: &Plan,
) -> Result<Vec<Unfilled>, PlanError> {
    let block = input.catalog.get(block_to_place(input, config)?);
    let mut settings = config.resolve(block, input.catalog.d_max_m())?;
    let minimum_m3 = settings.minimum_volume_m3;
    (settings.minimum_volume_m3, settings.nms_iou) = (SHOWN * minimum_m3, OVERLAP);
    let half_m = settings.window_m / 2.0;
    let reason = |centre: Vec2, void_m3: f32| {
        let mut tried: Vec<PlacementState> = plan
            .removed
            .iter()
            .filter(|p| (p.drop.translation.truncate() - centre).abs().max_element() <= half_m)
            .map(|p| p.state)
            .collect();
        tried.sort();
        let often = |s: &PlacementState| tried.iter().filter(|t| *t == s).count();
        match tried.iter().max_by_key(|s| (often(s), std::cmp::Reverse(**s))) {
            _ if void_m3 <= minimum_m3 => UnfilledReason::Small,
            Some(state) => UnfilledReason::Tried(*state),
            None => UnfilledReason::NoTrial,
        }
    };
    let found = windows::detect(&surfaces.planned, &surfaces.design, &settings, |_| true);
    Ok(found
        .into_iter()
        .map(|w| Unfilled {
            centre: w.centre,
            half_m,
            void_m3: w.deficit_m3,
            reason: reason(w.centre, w.deficit_m3),
        })
        .collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use geom::{HeightMap, Pose, Vec3};
    use scene::{Catalog, DesignSurface, ModelId, Placement, Scene, SiteFrame};

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
        Placement { order, round, model, drop, rest: drop, filled_m3, contacts, state }
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
        assert_eq!(near(3.0, 3.0).reason, UnfilledReason::Tried(Unstable));
        assert_eq!(near(9.0, 3.0).reason, UnfilledReason::NoTrial);
        assert_eq!(near(6.0, 9.0).reason, UnfilledReason::Small);
        assert!((near(9.0, 3.0).void_m3 - 6.0).abs() < 0.3);
        assert_eq!(found.len(), 3, "{found:?}");
    }
}
