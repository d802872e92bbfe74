//! Planning on, uncertainty, cranes.

use crate::site;
use geom::{Pose, SeedTree, Silent, Vec3};
use plan::{
    CraneConfig, PlanConfig, PlanError, PlanInput, UncertaintyConfig, plan, replan, uncertainty,
};
use scene::{InstanceId, PlacedBlock, Placement};

fn config() -> PlanConfig {
    let mut config = PlanConfig { block: Some("large".into()), rounds: 4, ..PlanConfig::default() };
    config.search.attitudes = 48;
    config.search.verify = 2;
    config
}

fn built(placements: &[Placement]) -> Vec<PlacedBlock> {
    let number = |(i, p): (usize, &Placement)| PlacedBlock {
        block: InstanceId(100 + i as u32),
        model: p.model,
        site_from_block: p.rest,
    };
    placements.iter().enumerate().map(number).collect()
}

#[test]
fn only_what_changed_is_planned_again() {
    let site = site::site(12.0, 16, 2.5);
    let first = plan(&site.input(), &config(), SeedTree::new(1), &Silent).unwrap();
    let half = first.placements.len() / 2;
    let mut placed = built(&first.placements[..half]);
    let input = PlanInput { placed: &placed, ..site.input() };
    let again = replan(&input, &first, &config(), SeedTree::new(2), &Silent).unwrap();
    let rest = &first.placements[half..];
    let carried =
        |p: &&Placement| again.placements.iter().any(|q| q.rest == p.rest && q.drop == p.drop);
    assert_eq!(
        rest.iter().filter(carried).count(),
        rest.len(),
        "all that is left is kept to the bit"
    );

    // The first block was set down half in the place of the first one that is still to come.
    let taken = rest[0].rest;
    placed[0].site_from_block =
        Pose::from_parts(taken.translation + Vec3::new(0.5, 0.5, 0.3), taken.rotation);
    let input = PlanInput { placed: &placed, ..site.input() };
    let moved = replan(&input, &first, &config(), SeedTree::new(2), &Silent).unwrap();
    let kept = rest.iter().filter(|p| moved.placements.iter().any(|q| q.rest == p.rest)).count();
    assert!(kept < rest.len() && 2 * kept >= rest.len(), "{kept} of {} kept", rest.len());
}

#[test]
fn counts_come_with_percentiles_and_formulas() {
    let site = site::site(12.0, 16, 2.5);
    let study = UncertaintyConfig { seeds: 3, overflow_m: vec![0.0, 0.4], ..Default::default() };
    let found = uncertainty(&site.input(), &config(), &study, SeedTree::new(1), &Silent).unwrap();
    assert_eq!(found.cases.len(), 6);
    let p = found.blocks;
    assert!(p.p10 <= p.p50 && p.p50 <= p.p90 && p.p10 < p.p90);
    let [strict, loose] = found.by_thresholds.as_slice() else {
        panic!("one entry for each (v, f)")
    };
    assert!(
        strict.overflow_m == 0.0 && loose.overflow_m == 0.4 && strict.blocks.p50 < loose.blocks.p50
    );
    assert!(
        p.p10 >= strict.blocks.p10
            && p.p90 <= loose.blocks.p90
            && loose.void_after_m3 < strict.void_after_m3
    );
    let mean = |f: f32| {
        found.cases.iter().filter(|c| c.overflow_m == f).map(|c| c.summary.blocks).sum::<u32>()
    };
    assert!(mean(0.0) < mean(0.4), "a higher threshold lets more blocks stay");
    for formula in [found.by_layers, found.by_volume, found.by_own_porosity] {
        assert!((0.4..2.5).contains(&(formula / p.p50)), "{formula} against {}", p.p50);
    }
    for case in &found.cases {
        let (one, two) = (case.summary.porosity, case.summary.porosity_rasterised);
        assert!((one - two).abs() < 0.01, "porosity {one} and {two}");
    }
    let own = PlanConfig { overflow_m: Some(0.4), ..config() };
    let carried_out = plan(&site.input(), &own, SeedTree::new(1), &Silent).unwrap();
    assert_eq!(
        found.cases.iter().find(|c| c.overflow_m == 0.4).unwrap().summary,
        carried_out.summary
    );
    let none = UncertaintyConfig { seeds: 0, ..Default::default() };
    let error = uncertainty(&site.input(), &config(), &none, SeedTree::new(1), &Silent);
    assert!(matches!(error, Err(PlanError::BadSetting { key: "uncertainty.seeds", .. })));
}

#[test]
fn a_crane_limits_the_place_and_turns_the_order() {
    let site = site::site(12.0, 16, 2.5);
    let crane = |radius: f32, capacity: f32| {
        Some(CraneConfig {
            stand: vec![[1000.0, 2006.0]],
            capacity: vec![[radius, capacity], [radius + 9.0, 1000.0]],
            ..CraneConfig::default()
        })
    };
    let near = plan(
        &site.input(),
        &PlanConfig { crane: crane(8.0, 1e4), ..config() },
        SeedTree::new(1),
        &Silent,
    )
    .unwrap();
    let block = site.catalog.get(site.catalog.find("large").unwrap());
    let away =
        |p: &Placement| (p.rest * block.centre - Vec3::new(0.0, 6.0, 0.0)).truncate().length();
    assert!(!near.placements.is_empty() && near.placements.iter().all(|p| away(p) <= 8.0));
    // Free of each other, the farther goes first; near each other, planning order (rounds) decides.
    for (i, late) in near.placements.iter().enumerate() {
        for early in &near.placements[..i] {
            let apart = (late.rest.translation - early.rest.translation).truncate().length();
            assert!(apart >= 2.0 * block.d_max_m || early.round <= late.round);
        }
    }
    for pair in near.placements.windows(2) {
        let apart = (pair[0].rest * block.centre - pair[1].rest * block.centre).truncate().length();
        assert!(away(&pair[0]) >= away(&pair[1]) || apart < 2.0 * block.d_max_m);
    }
    let weak = plan(
        &site.input(),
        &PlanConfig { crane: crane(8.0, 100.0), ..config() },
        SeedTree::new(1),
        &Silent,
    );
    assert!(matches!(weak, Err(PlanError::TooHeavy { .. })));
}
