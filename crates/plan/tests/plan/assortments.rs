//! Several types in one plan: stock, cost, zones.

use crate::site::{Heard, site};
use geom::{SeedTree, Silent};
use plan::{BlockChoice, PlanConfig, PlanError, Policy, ZoneConfig, plan};
use scene::Plan;

fn choice(name: &str, stock: Option<u32>, cost: f32) -> BlockChoice {
    BlockChoice { name: name.into(), stock, cost }
}

fn config(blocks: Vec<BlockChoice>) -> PlanConfig {
    let mut config = PlanConfig { blocks, rounds: 5, ..PlanConfig::default() };
    (config.search.attitudes, config.search.verify) = (48, 3);
    config
}

fn count(plan: &Plan, model: u16) -> usize {
    plan.placements.iter().filter(|p| p.model.0 == model).count()
}

#[test]
fn stock_is_used_first_and_never_exceeded() {
    let site = site(10.0, 8, 2.4);
    let heard = Heard::default();
    let config = config(vec![choice("large", None, 1.0), choice("small", Some(3), 50.0)]);
    let found = plan(&site.input(), &config, SeedTree::new(1), &heard).unwrap();
    assert_eq!(count(&found, 0), 3, "the three that lie ready go first, dear as they are");
    assert!(count(&found, 1) > 0);
    assert!(heard.has("all 3 blocks of \"small\" in stock are used"));
    let mass = 3.0 * f64::from(site.catalog.get(scene::ModelId(0)).mass_kg())
        + count(&found, 1) as f64 * f64::from(site.catalog.get(scene::ModelId(1)).mass_kg());
    assert!((found.summary.mass_kg / mass - 1.0).abs() < 1e-6);
}

#[test]
fn the_cheaper_way_to_fill_wins() {
    let site = site(10.0, 8, 2.4);
    let of = |large: f32, small: f32| {
        let config = config(vec![choice("large", None, large), choice("small", None, small)]);
        plan(&site.input(), &config, SeedTree::new(1), &Silent).unwrap()
    };
    let (dear_large, dear_small) = (of(100.0, 1.0), of(1.0, 100.0));
    assert!(count(&dear_large, 0) > count(&dear_large, 1), "{:?}", dear_large.summary);
    assert!(count(&dear_small, 1) > count(&dear_small, 0), "{:?}", dear_small.summary);
}

#[test]
fn one_listed_type_is_the_plan_of_that_block() {
    let site = site(10.0, 8, 2.4);
    let listed = config(vec![choice("large", None, 1.0)]);
    let named = PlanConfig { block: Some("large".into()), blocks: Vec::new(), ..listed.clone() };
    let seed = SeedTree::new(4);
    let one = plan(&site.input(), &listed, seed, &Silent).unwrap();
    let other = plan(&site.input(), &named, seed, &Silent).unwrap();
    assert_eq!(one.placements, other.placements);
    assert_eq!(one.summary, other.summary);
}

#[test]
fn light_blocks_stay_out_of_a_zone() {
    let site = site(10.0, 8, 2.4);
    let mass_kg = |m: u16| site.catalog.get(scene::ModelId(m)).mass_kg();
    let west = ZoneConfig {
        name: "head".into(),
        boundary: vec![[1000.0, 2000.0], [1005.0, 2000.0], [1005.0, 2010.0], [1000.0, 2010.0]],
        minimum_mass_kg: 0.5 * (mass_kg(0) + mass_kg(1)),
    };
    let mut config = config(vec![choice("large", None, 100.0), choice("small", None, 1.0)]);
    config.zones = vec![west];
    let found = plan(&site.input(), &config, SeedTree::new(1), &Silent).unwrap();
    let x = |p: &scene::Placement| (p.rest * site.catalog.get(p.model).centre).x;
    assert!(count(&found, 0) > 0 && count(&found, 1) > 0);
    assert!(found.placements.iter().filter(|p| p.model.0 == 0).all(|p| x(p) > 5.0));
    // None is heavy enough: said, and planned around.
    config.zones[0].minimum_mass_kg = 1e6;
    let heard = Heard::default();
    let found = plan(&site.input(), &config, SeedTree::new(1), &heard).unwrap();
    assert!(heard.has("zone \"head\""));
    assert!(found.placements.iter().all(|p| x(p) > 5.0));
}

#[test]
fn what_cannot_be_is_named() {
    let site = site(6.0, 0, 2.4);
    let refused = |config: &PlanConfig| {
        plan(&site.input(), config, SeedTree::new(1), &Silent).unwrap_err().to_string()
    };
    let none = refused(&config(vec![choice("large", Some(0), 1.0)]));
    assert!(none.contains("large") && none.contains("stock = 0"), "{none}");
    let twice = refused(&config(vec![choice("large", None, 1.0), choice("large", None, 1.0)]));
    assert!(twice.contains("named twice"), "{twice}");
    let free = refused(&config(vec![choice("large", None, 0.0)]));
    assert!(free.contains("cost = 0"), "{free}");
    let unknown = refused(&config(vec![choice("huge", None, 1.0)]));
    assert!(unknown.contains("plan.blocks") && unknown.contains("small, large"), "{unknown}");
    let both =
        PlanConfig { block: Some("large".into()), ..config(vec![choice("large", None, 1.0)]) };
    assert_eq!(
        plan(&site.input(), &both, SeedTree::new(1), &Silent).unwrap_err(),
        PlanError::BlockAndBlocks
    );
    let network = PlanConfig {
        policy: Policy::Network,
        ..config(vec![choice("large", None, 1.0), choice("small", None, 1.0)])
    };
    assert!(refused(&network).contains("one type"));
    let mut flat = config(vec![choice("large", None, 1.0)]);
    flat.zones =
        vec![ZoneConfig { name: "z".into(), boundary: vec![[0.0, 0.0]], minimum_mass_kg: 1.0 }];
    assert!(refused(&flat).contains("three"), "{}", refused(&flat));
}

#[test]
fn a_type_that_fits_no_window_is_told() {
    let site = site(10.0, 8, 2.4);
    let mut config = config(vec![choice("large", None, 1.0), choice("small", None, 1.0)]);
    config.zones = vec![ZoneConfig {
        name: "all".into(),
        boundary: vec![[999.0, 1999.0], [1011.0, 1999.0], [1011.0, 2011.0], [999.0, 2011.0]],
        minimum_mass_kg: site.catalog.get(scene::ModelId(1)).mass_kg(),
    }];
    let heard = Heard::default();
    let found = plan(&site.input(), &config, SeedTree::new(1), &heard).unwrap();
    assert_eq!(count(&found, 0), 0);
    assert!(heard.has("\"small\" fits no window"));
}
