//! Policy `pattern` on the small span.

use crate::site::{Heard, site};
use geom::{SeedTree, Silent};
use plan::{AttitudeRule, Bond, PatternConfig, PlanConfig, PlanError, Policy, plan};
use std::collections::BTreeSet;

fn config(pattern: PatternConfig) -> PlanConfig {
    PlanConfig {
        policy: Policy::Pattern,
        block: Some("large".into()),
        pattern: Some(pattern),
        ..PlanConfig::default()
    }
}

#[test]
fn every_block_lies_at_its_node_in_its_attitude() {
    let site = site(12.0, 0, 2.0);
    for bond in [Bond::Rows, Bond::HalfBrick, Bond::Staggered] {
        let pattern = PatternConfig {
            bond,
            spacing_m: Some([2.6, 2.4]),
            attitude: AttitudeRule::LegUp,
            origin: Some([1001.5, 2001.5]),
            layers: Some(1),
            ..PatternConfig::default()
        };
        let plan = plan(&site.input(), &config(pattern), SeedTree::new(1), &Silent).unwrap();
        assert!(plan.summary.blocks >= 9, "{bond:?}: {}", plan.summary.blocks);
        let nodes: BTreeSet<String> =
            plan.placements.iter().map(|p| p.handling.node.unwrap().to_string()).collect();
        assert_eq!(nodes.len(), plan.placements.len(), "a node takes one block a layer");
        for p in &plan.placements {
            let (node, block) = (p.handling.node.unwrap(), site.catalog.get(p.model));
            let shift = if bond == Bond::Rows || node.row % 2 != 0 { 0.0 } else { 1.3 };
            let north = 1.5 + (node.column - 1) as f32 * 2.6 + shift;
            let east = 1.5 + (node.row - 1) as f32 * 2.4;
            let at = p.rest * block.centre;
            assert!((at.x - east).abs() < 0.3 && (at.y - north).abs() < 0.3, "{node} at {at}");
            let attitude = plan::attitude(block, &p.rest);
            assert!(attitude.tilt_deg < 15.0, "a leg stands up: {attitude:?}");
        }
    }
}

#[test]
fn a_pattern_that_does_not_fit_is_refused_and_a_thin_one_named() {
    let site = site(9.0, 6, 1.8);
    let input = site.input();
    let refused =
        |config: PlanConfig| plan(&input, &config, SeedTree::new(1), &Silent).unwrap_err();
    let wide = PatternConfig { spacing_m: Some([2.0, 60.0]), ..PatternConfig::default() };
    assert!(matches!(refused(config(wide)), PlanError::PatternTooWide { .. }));
    let idle = PlanConfig { policy: Policy::Search, ..config(PatternConfig::default()) };
    assert_eq!(refused(idle), PlanError::PatternWithoutPolicy);
    let heard = Heard::default();
    let dense = PatternConfig { density_per_m2: Some(2.0), ..PatternConfig::default() };
    plan(&input, &config(dense), SeedTree::new(1), &heard).unwrap();
    assert!(heard.has("instead of 2.000"), "{:?}", heard.0);
}
