//! Bad input gives a clear result or a clear error.

use crate::site::{self, Heard};
use geom::{Pose, SeedTree, Silent, Vec3};
use plan::{PlanConfig, PlanError, Policy, plan};
use scene::{DesignSurface, InstanceId, ModelId, PlacedBlock};

fn quick() -> PlanConfig {
    let mut config = PlanConfig { rounds: 1, ..PlanConfig::default() };
    config.search.attitudes = 16;
    config.search.verify = 1;
    config
}

#[test]
fn a_design_below_the_surface_gives_an_empty_plan_and_says_so() {
    let site = site::site(8.0, 3, -1.0);
    let heard = Heard::default();
    let plan = plan(&site.input(), &quick(), SeedTree::new(1), &heard).unwrap();
    assert_eq!((plan.placements.len(), plan.summary.blocks), (0, 0));
    assert!(heard.has("below the present surface"), "{:?}", heard.0);
}

#[test]
fn errors_name_what_to_change() {
    let site = site::site(8.0, 3, 2.0);
    let run =
        |config: &PlanConfig| plan(&site.input(), config, SeedTree::new(1), &Silent).map(|_| ());
    let window = PlanConfig { window_m: Some(0.05), cell_m: Some(0.1), ..quick() };
    assert!(matches!(run(&window), Err(PlanError::WindowBelowCell { .. })));
    let unknown = PlanConfig { block: Some("dolly".into()), ..quick() };
    assert!(
        matches!(run(&unknown), Err(PlanError::UnknownBlock { known, .. }) if known == "small, large")
    );
    let network = PlanConfig { policy: Policy::Network, ..quick() };
    assert!(matches!(run(&network), Err(PlanError::NoPlacementModel)));
    let cells = PlanConfig { cell_m: Some(1e-4), ..quick() };
    assert!(matches!(run(&cells), Err(PlanError::TooManyCells { .. })));
    let asked = |config: &PlanConfig| plan::check_extent(&site.design, &site.catalog, config);
    assert!(matches!(asked(&cells), Err(PlanError::TooManyCells { .. })));
    assert_eq!(asked(&quick()), Ok(()));
    // Four thousand million rounds, and an allocation of 412 GB, were once begun.
    let rounds = PlanConfig { rounds: u32::MAX, ..quick() };
    assert!(matches!(run(&rounds), Err(PlanError::TooMuch { key: "rounds", .. })));
    let search = plan::SearchConfig { attitudes: u32::MAX, ..Default::default() };
    let attitudes = PlanConfig { search, ..quick() };
    assert!(matches!(run(&attitudes), Err(PlanError::TooMuch { key: "search.attitudes", .. })));
    for bad in [
        PlanConfig { cell_m: Some(f32::NAN), ..quick() },
        PlanConfig { stride_m: Some(0.0), ..quick() },
        PlanConfig { displacement_limit_m: Some(-1.0), ..quick() },
    ] {
        assert!(matches!(run(&bad), Err(PlanError::BadSetting { .. })));
    }
    let physics = sim::PhysicsConfig { step_s: 1.0, ..Default::default() };
    assert!(matches!(run(&PlanConfig { physics, ..quick() }), Err(PlanError::Physics(_))));
}

#[test]
fn a_boundary_elsewhere_is_an_error() {
    let mut site = site::site(8.0, 3, 2.0);
    // North and east swapped.
    let boundary = vec![[2000.0, 1000.0], [2008.0, 1000.0], [2008.0, 1008.0], [2000.0, 1008.0]];
    site.design = DesignSurface::Level { level_m: 12.0, boundary };
    let result = plan(&site.input(), &quick(), SeedTree::new(1), &Silent).map(|_| ());
    assert!(matches!(result, Err(PlanError::DesignElsewhere { away_m, .. }) if away_m > 1000.0));
}

#[test]
fn without_blocks_the_plan_builds_on_the_ground_and_warns() {
    let mut site = site::site(8.0, 0, 1.5);
    let heard = Heard::default();
    let found = plan(&site.input(), &quick(), SeedTree::new(1), &heard).unwrap();
    assert!(!found.placements.is_empty());
    assert!(heard.has("no blocks were recognised"));
    site.catalog = scene::Catalog::default();
    let none = plan(&site.input(), &quick(), SeedTree::new(1), &Silent).map(|_| ());
    assert!(matches!(none, Err(PlanError::EmptyCatalog)));
}

#[test]
fn blocks_that_overlap_in_the_input_are_reported_and_stay() {
    let mut site = site::site(8.0, 2, 2.0);
    let first = site.scene.blocks[0];
    let pose = Pose::from_parts(
        first.site_from_block.translation + Vec3::new(0.3, 0.0, 0.0),
        first.site_from_block.rotation,
    );
    site.scene.blocks.push(PlacedBlock {
        block: InstanceId(9),
        model: ModelId(0),
        site_from_block: pose,
    });
    let heard = Heard::default();
    let found = plan(&site.input(), &quick(), SeedTree::new(1), &heard).unwrap();
    assert!(heard.has("overlap"), "{:?}", heard.0);
    let block = site.catalog.get(ModelId(0));
    assert!(
        found
            .placements
            .iter()
            .all(|p| (p.rest.translation - p.drop.translation).length() < block.d_box_m)
    );
}

#[test]
fn a_crane_that_reaches_nothing_is_told_by_name_with_the_distance() {
    let site = site::site(8.0, 3, 2.0);
    let capacity = vec![[10.0, 20_000.0]];
    let stand = vec![[900.0, 2000.0]];
    let crane = plan::CraneConfig { stand, capacity, ..Default::default() };
    let config = PlanConfig { crane: Some(crane), ..quick() };
    let heard = Heard::default();
    let plan = plan(&site.input(), &config, SeedTree::new(1), &heard).unwrap();
    assert_eq!(plan.summary.blocks, 0);
    assert!(heard.has("carries no \"small\""), "{:?}", heard.0);
    assert!(heard.has("lies 100."), "{:?}", heard.0);
    assert!(!heard.has("reduce plan.minimum_volume_m3"), "{:?}", heard.0);
}

#[test]
fn a_type_that_stays_in_no_window_is_told_with_what_removed_it() {
    // Windows lack volume, but under this design every block stands too high.
    let site = site::site(8.0, 3, 0.5);
    let config = PlanConfig { minimum_volume_m3: Some(0.1), overflow_m: Some(0.0), ..quick() };
    let heard = Heard::default();
    let plan = plan(&site.input(), &config, SeedTree::new(1), &heard).unwrap();
    assert_eq!(plan.summary.blocks, 0);
    assert!(heard.has("no block of \"small\""), "{:?}", heard.0);
    assert!(heard.has("overflow_m = 0.00"), "{:?}", heard.0);
}
