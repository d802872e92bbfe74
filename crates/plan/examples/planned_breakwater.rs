//! Plans a breakwater span like the thesis' site: 150 × 25 m, 1000 blocks dropped at random, a level design, a
//! supplement one size larger. Prints one line of figures a plan.
//!
//! `cargo run --release -p plan --example planned_breakwater -- policy=search seeds=3 length=150 blocks=1000`

mod span;

use geom::{SeedTree, Silent};
use plan::{PlanConfig, PlanInput, Policy};
use scene::{PlacementState, SiteFrame};
use span::{WIDTH_M, number, value};
use std::time::Instant;

fn main() {
    let length_m = number("length", 150.0);
    let count = number("blocks", 1000.0) as usize;
    let level_m = number("level", 3.0);

    let catalog = span::catalog();
    let started = Instant::now();
    let scene = span::pile(&catalog, length_m, count, SeedTree::new(number("site", 1.0) as u64));
    println!(
        "site: {count} blocks on {length_m} x {WIDTH_M} m in {:.1} s",
        started.elapsed().as_secs_f32()
    );
    let design = span::design(length_m, level_m);
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

    let mut config = PlanConfig { block: Some("supplement".into()), ..PlanConfig::default() };
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    for a in &arguments {
        let Some((key, v)) = a.split_once('=') else { continue };
        let f = || v.parse::<f32>().expect("a number");
        match key {
            "v" => config.minimum_volume_m3 = Some(f()),
            "f" => config.overflow_m = Some(f()),
            "rounds" => config.rounds = f() as u32,
            "supports" => config.minimum_supports = f() as u32,
            "shake" => config.shake_m_s = f(),
            "wedge" => config.wedge_limit = f(),
            "iou" => config.nms_iou = f(),
            "stride" => config.stride_m = Some(f()),
            "window" => config.window_m = Some(f()),
            "attitudes" => config.search.attitudes = f() as u32,
            "step" => config.search.step_cells = f() as u32,
            "verify" => config.search.verify = f() as u32,
            "trapped" => config.search.trapped_weight = f(),
            "protrusion" => config.search.protrusion_weight = f(),
            "improve" => config.search.improve = f(),
            "temperature" => config.search.temperature = f(),
            "wv" => config.objective.void = f(),
            "wc" => config.objective.count = f(),
            "wp" => config.objective.protrusion = f(),
            "ws" => config.objective.stability = f(),
            "inside" => {
                config.inside =
                    if v == "centre" { plan::Inside::Centre } else { plan::Inside::Whole }
            }
            "insertion" if v == "guided" => config.insertion = plan::Insertion::Guided,
            "walls" => config.walls = v == "true",
            _ => {}
        }
    }
    // Concrete of a block, m³, and a lift.
    let cost = |model| catalog.get(model).volume_m3 + 1.0;
    let choice = |name: &str| {
        let (name, model) = (name.to_string(), catalog.find(name).expect("it is there"));
        plan::BlockChoice { name, stock: None, cost: cost(model) }
    };
    match value("types", "").as_str() {
        "both" => config.blocks = vec![choice("supplement"), choice("smaller")],
        "smaller" => config.blocks = vec![choice("smaller")],
        _ => {}
    }
    if !config.blocks.is_empty() {
        config.block = None;
    }
    println!(
        "policy seed blocks mean_m max_m protruding void_before void_after porosity rounds drops over/unset/unst/out shut/opened/guided cost seconds"
    );
    let first = number("first", 0.0) as u64;
    let samples = number("shut", 0.0) as u32;
    if samples > 0 {
        return shut(&input, &config, samples, SeedTree::new(first));
    }
    for policy in value("policy", "random,search").split(',') {
        config.policy = match policy {
            "random" => Policy::Random,
            "search" => Policy::Search,
            other => panic!("no policy {other} here"),
        };
        for seed in first..first + number("seeds", 1.0) as u64 {
            let started = Instant::now();
            let plan = match plan::plan(&input, &config, SeedTree::new(seed), &Silent) {
                Ok(plan) => plan,
                Err(error) => return eprintln!("error: {error}"),
            };
            let s = plan.summary;
            println!(
                "{policy} {seed} {} {:.3} {:.2} {} {:.0} {:.0} {:.3} {} {} {}/{}/{}/{} {}/{}/{} {:.1} {:.1}",
                s.blocks,
                s.mean_distance_m,
                s.max_distance_m,
                s.protruding,
                s.void_before_m3,
                s.void_after_m3,
                s.porosity,
                s.rounds,
                plan.placements.len() + plan.removed.len(),
                s.overflowed,
                s.unsettled,
                s.unstable,
                s.outside,
                s.shut,
                s.opened,
                s.guided,
                plan.placements.iter().map(|p| cost(p.model)).sum::<f32>(),
                started.elapsed().as_secs_f32()
            );
            debug_assert!(plan.placements.iter().all(|p| p.state == PlacementState::Kept));
        }
    }
}

/// What shuts the windows that straight lowering leaves (`shut=6000`: so many poses looked at in each).
fn shut(input: &PlanInput, config: &PlanConfig, samples: u32, seed: SeedTree) {
    let found = plan::shut_windows(input, config, samples, seed, &Silent).expect("a plan");
    println!("x_m y_m deficit_m3 tried too_high left unstable wedged straight hidden opened path");
    for w in &found {
        println!(
            "{:.1} {:.1} {:.2} {} {} {} {} {} {} {} {} {}",
            w.centre.x,
            w.centre.y,
            w.deficit_m3,
            w.tried,
            w.too_high,
            w.left,
            w.unstable,
            w.wedged,
            w.straight,
            w.hidden,
            w.opened,
            w.path
        );
    }
}
