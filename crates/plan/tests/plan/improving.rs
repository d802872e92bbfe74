//! Improving a plan: better by its weights, sound by every rule, the same with any number of threads.

use crate::site::{Site, site};
use geom::{SeedTree, Silent};
use plan::{Aim, ObjectiveConfig, PlanConfig, choices, plan, replan};
use scene::{PlacedBlock, Plan};

fn config(improve: f32) -> PlanConfig {
    let mut config = PlanConfig { block: Some("large".into()), ..PlanConfig::default() };
    (config.search.attitudes, config.search.verify) = (48, 3);
    config.search.improve = improve;
    config
}

fn worth(site: &Site, plan: &Plan) -> f32 {
    let volume_m3 = site.catalog.get(scene::ModelId(1)).volume_m3;
    (plan.summary.void_before_m3 - plan.summary.void_after_m3) / volume_m3
        - plan.summary.protruding as f32
}

#[test]
fn it_is_better_and_every_block_still_rests_where_it_says() {
    let site = site(9.0, 6, 2.4);
    let seed = SeedTree::new(2);
    let rounds = plan(&site.input(), &config(0.0), seed, &Silent).unwrap();
    let better = plan(&site.input(), &config(1.0), seed, &Silent).unwrap();
    assert!(
        worth(&site, &better) > worth(&site, &rounds) + 0.5,
        "{:?} {:?}",
        rounds.summary,
        better.summary
    );
    // Dropped once more, one after the other, all come to rest as planned.
    let again =
        replan(&site.input(), &better, &PlanConfig { rounds: 0, ..config(0.0) }, seed, &Silent)
            .unwrap();
    assert_eq!(again.placements.len(), better.placements.len());
    for (i, p) in better.placements.iter().enumerate() {
        assert_eq!(p.order as usize, i + 1);
        assert!(p.contacts >= 2 || p.rest.translation.z < 1.5, "{p:?}");
    }
    // What is built stays where it is.
    let built: Vec<PlacedBlock> = better.placements[..3]
        .iter()
        .enumerate()
        .map(|(i, p)| PlacedBlock {
            block: scene::InstanceId(100 + i as u32),
            model: p.model,
            site_from_block: p.rest,
        })
        .collect();
    let input = plan::PlanInput { placed: &built, ..site.input() };
    let on = replan(&input, &better, &config(1.0), seed, &Silent).unwrap();
    for p in &better.placements[3..] {
        assert!(on.placements.iter().any(|q| q.rest == p.rest), "{p:?} was moved");
    }
}

#[test]
fn threads_change_nothing() {
    let site = site(9.0, 6, 2.4);
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| plan(&site.input(), &config(0.5), SeedTree::new(5), &Silent)).unwrap()
    };
    assert_eq!(with(1).placements, with(3).placements);
}

#[test]
fn three_aims_are_three_plans() {
    let site = site(9.0, 6, 2.4);
    let found = choices(&site.input(), &config(1.0), SeedTree::new(2), &Silent).unwrap();
    let of = |aim: Aim| &found.iter().find(|(a, _)| *a == aim).unwrap().1;
    let contacts = |p: &Plan| {
        p.placements.iter().map(|p| p.contacts.min(5) as f32).sum::<f32>()
            / p.placements.len() as f32
    };
    let (fewest, fullest, stable) = (of(Aim::Fewest), of(Aim::Fullest), of(Aim::MostStable));
    assert!(fewest.summary.blocks <= fullest.summary.blocks);
    assert!(fullest.summary.void_after_m3 <= fewest.summary.void_after_m3 + 1e-3);
    assert!(
        contacts(stable) >= contacts(fewest) - 0.05,
        "{} {}",
        contacts(stable),
        contacts(fewest)
    );
}

#[test]
fn weights_and_policies_that_cannot_be_are_named() {
    let site = site(6.0, 0, 2.4);
    let refused = |config: &PlanConfig| {
        plan(&site.input(), config, SeedTree::new(1), &Silent).unwrap_err().to_string()
    };
    let network = PlanConfig { policy: plan::Policy::Random, ..config(1.0) };
    assert!(refused(&network).contains("search.improve"));
    let objective = ObjectiveConfig { cost: f32::NAN, ..ObjectiveConfig::default() };
    let said = refused(&PlanConfig { objective, ..config(0.0) });
    assert!(said.contains("plan.objective.cost"), "{said}");
    assert!(refused(&config(1e9)).contains("1000 passes"));
}
