//! Generate-and-test data for a placement network, made twice with different draws: how many drops a second, and how
//! far apart the two "best" answers to the same window are — the error no regression of the best pose can go below.
//!
//! `cargo run --release -p plan --example placement_targets -- windows=24 drops=500`

mod span;

use geom::{Quat, SeedTree, Silent, Vec3};
use plan::{GenerateConfig, PlanConfig, PlanInput, WindowSample, generate_and_test};
use rand::RngExt;
use scene::SiteFrame;
use span::number;
use std::time::Instant;

fn main() {
    let catalog = span::catalog();
    let length_m = number("length", 60.0);
    let scene = span::pile(&catalog, length_m, (length_m * 6.7) as usize, SeedTree::new(1));
    let design = span::design(length_m, number("level", 2.4));
    let frame = SiteFrame::default();
    let input = PlanInput {
        scene: &scene,
        frame: &frame,
        design: &design,
        catalog: &catalog,
        placed: &[],
        proposer: None,
        survey: None,
    };
    let config = PlanConfig { block: Some("supplement".into()), ..PlanConfig::default() };
    let generate = GenerateConfig {
        windows: number("windows", 24.0) as u32,
        drops: number("drops", 500.0) as u32,
        ..GenerateConfig::default()
    };
    let make = |seed: u64| {
        let started = Instant::now();
        let made = generate_and_test(&input, &config, &generate, SeedTree::new(seed), &Silent)
            .expect("a sound site");
        let drops: u32 = made.iter().map(|s| s.drops).sum();
        println!(
            "{} windows, {drops} drops, {:.0} drops/s",
            made.len(),
            drops as f32 / started.elapsed().as_secs_f32()
        );
        made
    };
    let (one, two) = (make(1), make(2));
    let block = catalog.get(catalog.find("supplement").expect("in the catalogue"));
    let angle = |a: Quat, b: Quat| block.symmetry.rotation_error_rad(a, b).to_degrees();
    let both: Vec<(&WindowSample, &WindowSample)> =
        one.iter().zip(&two).filter(|(a, b)| !a.best.is_empty() && !b.best.is_empty()).collect();
    let of = |f: &dyn Fn(&WindowSample, &WindowSample) -> f32| {
        let mut v: Vec<f32> = both.iter().map(|(a, b)| f(a, b)).collect();
        v.sort_by(f32::total_cmp);
        let mean = v.iter().sum::<f32>() / v.len().max(1) as f32;
        (mean, v.get(v.len() / 2).copied().unwrap_or(f32::NAN))
    };
    println!("windows with an answer in both: {} of {}", both.len(), one.len());
    let (mean, median) = of(&|a, b| angle(a.best[0].drop.rotation, b.best[0].drop.rotation));
    println!("best against best: rotation mean {mean:.1}°, median {median:.1}°");
    let (mean, median) =
        of(&|a, b| (a.best[0].drop.translation - b.best[0].drop.translation).length());
    println!("best against best: centre mean {mean:.2} m, median {median:.2} m");
    let (mean, median) = of(&|a, b| {
        let (a, b) = (a.best[0].filled_m3, b.best[0].filled_m3);
        (a - b).abs() / a.max(b) * 100.0
    });
    println!("best against best: void filled differs by mean {mean:.1} %, median {median:.1} %");
    let (mean, _) = of(&|a, _| {
        let good = a.best.iter().filter(|d| d.filled_m3 >= 0.97 * a.best[0].filled_m3);
        let mut modes: Vec<Quat> = Vec::new();
        for d in good {
            if modes.iter().all(|m| angle(*m, d.drop.rotation) > 20.0) {
                modes.push(d.drop.rotation);
            }
        }
        modes.len() as f32
    });
    println!(
        "attitudes more than 20° apart within 3 % of the best of {}: mean {mean:.1}",
        generate.drops
    );
    let mut rng = SeedTree::new(9).rng();
    let mut any = || {
        let v = Vec3::new(
            rng.random::<f32>() - 0.5,
            rng.random::<f32>() - 0.5,
            rng.random::<f32>() - 0.5,
        );
        Quat::from_axis_angle(v.normalize_or(Vec3::Z), rng.random::<f32>() * std::f32::consts::TAU)
    };
    let guess = (0..2000).map(|_| angle(any(), any())).sum::<f32>() / 2000.0;
    println!("for comparison, two attitudes picked blindly: mean {guess:.1}°");
}
