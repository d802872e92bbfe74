//! Generate-and-test data.

use crate::site;
use geom::{SeedTree, Silent, Vec3};
use plan::{
    DepthView, GenerateConfig, PlanConfig, Policy, RandomConfig, each_window, generate_and_test,
};

#[test]
fn samples_hold_only_drops_that_stayed_best_first() {
    let site = site::site(10.0, 10, 2.5);
    let generate = GenerateConfig {
        drops: 150,
        windows: 3,
        view: DepthView { pixels: 32, edge: 1.5 },
        keep: 5,
    };
    let make = || {
        generate_and_test(
            &site.input(),
            &PlanConfig::default(),
            &generate,
            SeedTree::new(4),
            &Silent,
        )
        .unwrap()
    };
    let samples = make();
    assert_eq!(samples, make(), "the same seed gives the same data");
    assert_eq!(samples.len(), 3);
    let block = site.catalog.get(site.catalog.find("small").unwrap());
    assert!(samples.iter().any(|s| s.best.len() > 1));
    for sample in &samples {
        assert_eq!(sample.depth.len(), 32 * 32);
        assert!(
            sample.depth.iter().all(|d| *d * block.d_box_m <= 2.5 + 1e-4),
            "nothing lies below the ground"
        );
        assert!(sample.best.len() <= 5);
        assert!(sample.best.windows(2).all(|w| w[0].filled_m3 >= w[1].filled_m3));
        for drop in &sample.best {
            assert!(drop.displaced_m <= 0.1 * block.d_box_m + 1e-4);
            let canonical = block.symmetry.canonical(&drop.drop).rotation;
            assert!(canonical.dot(drop.drop.rotation).abs() > 1.0 - 1e-4);
            let sideways =
                Vec3::new(drop.drop.translation.x, drop.drop.translation.y, 0.0).length();
            assert!(sideways <= 0.25 * block.d_box_m * std::f32::consts::SQRT_2 + 1e-3);
        }
    }
}

#[test]
fn every_window_is_answered_by_itself() {
    let site = site::site(10.0, 10, 2.5);
    let view = DepthView { pixels: 8, edge: 1.0 };
    let generate = GenerateConfig { drops: 1, windows: 4, view, keep: 1 };
    let windows = generate_and_test(
        &site.input(),
        &PlanConfig::default(),
        &generate,
        SeedTree::new(4),
        &Silent,
    )
    .unwrap();
    let answers = |policy, drops| {
        let config = PlanConfig { policy, random: RandomConfig { drops }, ..PlanConfig::default() };
        each_window(&site.input(), &config, 4, SeedTree::new(5), &Silent).unwrap()
    };
    let filled = |policy, drops| {
        let answers = answers(policy, drops);
        assert_eq!(answers.len(), 4);
        assert!(answers.iter().zip(&windows).all(|(a, w)| a.centre == w.centre));
        answers.iter().filter_map(|a| a.kept.as_ref()).map(|p| p.filled_m3).sum::<f32>()
    };
    assert!(filled(Policy::Random, 60) > filled(Policy::Random, 1));
    assert!(filled(Policy::Search, 1) > 0.0);
}
