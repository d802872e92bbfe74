//! Is there a right answer to a window? Generate-and-test asked several times, the network, and what each choice is worth.
//!
//! The thesis has its network learn the best of many random drops. Here the same windows are searched again with other
//! draws: how far two searches disagree is the error that a network that has learnt everything would still make. Then
//! the void that each choice fills says what the disagreement costs.

use crate::placement_network::RECIPE;
use crate::planning_site::mean_and_spread;
use crate::{Bench, Experiment, ReproduceError, Table};
use geom::SeedTree;
use placement::{GoodPose, PlacementModel, Split, offsets, turns_rad};
use plan::{
    GenerateConfig, NetworkConfig, PlanConfig, PlanInput, Policy, Proposer, RandomConfig,
    WindowSample, each_window, generate_and_test,
};
use scene::{BlockModel, Catalog, Shape, SiteFrame};
use synth::Recipe;
use teach::PlacementScenes;

pub const EXPERIMENT: Experiment = Experiment {
    name: "placement-ambiguity",
    about: "whether a window has one best pose: repeated searches, the network, and what each choice fills",
    body,
};

/// How much is searched.
struct Effort {
    /// Random drops of a search; the thesis took 1000 to 3000.
    drops: u32,
    /// Windows of a pile.
    windows: u32,
    /// Drops a window of the plan made by generate-and-test.
    plan_drops: u32,
}

impl Effort {
    fn of(bench: &Bench) -> Self {
        if bench.settings.quick {
            Self { drops: 100, windows: 4, plan_drops: 10 }
        } else {
            Self { drops: 500, windows: 16, plan_drops: 200 }
        }
    }
}

/// Searches of a window.
const SEARCHES: usize = 4;
/// What the thesis' network was asked for.
const ASKED: (f32, f32) = (15.0, 0.25);

/// Rotation (degrees) and displacement (metres) of one pose from another.
type Offset = (f32, f32);

/// Everything measured, one entry a window unless said.
#[derive(Default)]
struct Found {
    windows: usize,
    /// Every search against every other.
    pairs: Vec<Offset>,
    /// The best of all other searches against each search.
    oracle: Vec<Offset>,
    /// The pose of the other searches that lies nearest to the rest of them, against each search.
    middle: Vec<Offset>,
    /// The network's surest answer, against the first search.
    surest: Vec<Offset>,
    /// Whether one of its answers lies within what was asked: 16 modes; at all turns.
    near: [Vec<bool>; 2],
    /// Void filled over that of the best of one search, for each of [`CHOICES`].
    filled: [Vec<f32>; 6],
    /// Blocks, void left and mean distance of whole plans, for each of [`PLANS`] and each pile.
    plans: [Vec<(f64, f64, f64)>; 4],
}

const PLANS: [&str; 4] = ["random", "generate-and-test, N drops a window", "network", "search"];

const CHOICES: [&str; 6] = [
    "best of another search (N drops)",
    "best of N drops among those a plan may keep",
    "one random drop",
    "the network's surest answer as it is (thesis)",
    "the network's 96 answers ranked, 8 dropped (shipped)",
    "search, 8 dropped (shipped)",
];

fn body(bench: &Bench) -> Result<String, ReproduceError> {
    let recipe = Recipe::parse(RECIPE)
        .map_err(|e| ReproduceError::Recipe { set: "placement".into(), message: e.to_string() })?;
    let tetrapod =
        |name: &str, size: f32| blocks::shape_model(name, Shape::Tetrapod { size }, 2300.0);
    let catalog =
        Catalog::new(vec![tetrapod("tetrapod-2.0m", 2.0)?, tetrapod("tetrapod-2.1m", 2.1)?]);
    let block = catalog.get(catalog.find("tetrapod-2.1m").expect("it was just put there"));
    let model = PlacementModel::shipped()?;
    let scenes = PlacementScenes { recipe: &recipe, catalog: &catalog, block };
    let mut found = Found::default();
    for index in 0..bench.settings.scenes {
        let seed = SeedTree::new(bench.settings.seed);
        let background = scenes.background(Split::HeldOut, index, seed).map_err(|message| {
            ReproduceError::Placement(placement::PlacementError::Background { index, message })
        })?;
        let frame = SiteFrame::default();
        let input = PlanInput {
            scene: &background.scene,
            frame: &frame,
            design: &background.design,
            catalog: &catalog,
            placed: &[],
            proposer: Some(&model),
            survey: None,
        };
        measure(bench, &input, block, &model, seed.child("ambiguity", index), &mut found)?;
    }
    Ok(page(bench, &found))
}

/// Adds the windows of one pile.
fn measure(
    bench: &Bench,
    input: &PlanInput,
    block: &BlockModel,
    model: &PlacementModel,
    seed: SeedTree,
    found: &mut Found,
) -> Result<(), ReproduceError> {
    let config = PlanConfig { block: Some(block.name.clone()), ..PlanConfig::default() };
    let Effort { drops, windows, plan_drops } = Effort::of(bench);
    let generate = GenerateConfig { drops, windows, view: model.view(), keep: 1 };
    let searches: Vec<Vec<WindowSample>> = (0..SEARCHES)
        .map(|s| {
            generate_and_test(
                input,
                &config,
                &generate,
                seed.child("search", s as u64),
                bench.observer,
            )
        })
        .collect::<Result<_, _>>()?;
    let one = NetworkConfig { proposals: 1, nudge_cells: 0, verify: 1 };
    let random = |drops| PlanConfig {
        policy: Policy::Random,
        random: RandomConfig { drops },
        ..config.clone()
    };
    let policies = [
        random(drops),
        random(1),
        PlanConfig { policy: Policy::Network, network: one, ..config.clone() },
        PlanConfig { policy: Policy::Network, ..config.clone() },
        PlanConfig { policy: Policy::Search, ..config.clone() },
    ];
    let chosen = policies
        .iter()
        .map(|policy| each_window(input, policy, windows, seed.child("policy", 0), bench.observer))
        .collect::<Result<Vec<_>, _>>()?;
    let plans = [random(1), random(plan_drops), policies[3].clone(), policies[4].clone()];
    for (list, policy) in plans.iter().enumerate() {
        let s = plan::plan(input, policy, seed.child("plan", 0), bench.observer)?.summary;
        let figures =
            (f64::from(s.blocks), f64::from(s.void_after_m3), f64::from(s.mean_distance_m));
        found.plans[list].push(figures);
    }
    for window in 0..searches[0].len() {
        if searches.iter().any(|s| s[window].best.is_empty()) {
            continue;
        }
        let best = |s: usize| &searches[s][window].best[0];
        let off = |a: usize, b: usize| {
            let angle =
                block.symmetry.rotation_error_rad(best(a).drop.rotation, best(b).drop.rotation);
            (angle.to_degrees(), (best(a).drop.translation - best(b).drop.translation).length())
        };
        let cost = |o: Offset| o.0 / ASKED.0 + o.1 / ASKED.1;
        for held in 0..SEARCHES {
            let others: Vec<usize> = (0..SEARCHES).filter(|&o| o != held).collect();
            found.pairs.extend(others.iter().map(|&o| off(o, held)));
            let fullest = others
                .iter()
                .copied()
                .max_by(|&a, &b| best(a).filled_m3.total_cmp(&best(b).filled_m3));
            found.oracle.push(off(fullest.expect("there are others"), held));
            let sum = |o: usize| {
                others.iter().filter(|&&p| p != o).map(|&p| cost(off(o, p))).sum::<f32>()
            };
            let middle = others.iter().copied().min_by(|&a, &b| sum(a).total_cmp(&sum(b)));
            found.middle.push(off(middle.expect("there are others"), held));
        }
        let target = GoodPose {
            centre: best(0).drop.translation / block.d_box_m,
            rotation: best(0).drop.rotation,
            filled: best(0).filled_m3 / block.volume_m3,
        };
        let depth = &searches[0][window].depth;
        for (list, turns) in [vec![0.0], turns_rad(0.0)].into_iter().enumerate() {
            let answers = offsets(model, depth, &turns, &target, &block.symmetry);
            let in_units: Vec<Offset> =
                answers.iter().map(|o| (o.0.to_degrees(), o.1 * block.d_box_m)).collect();
            found.near[list].push(in_units.iter().any(within));
            if list == 0 {
                found.surest.extend(in_units.first());
            }
        }
        let full_m3 = best(0).filled_m3;
        found.filled[0].push(best(1).filled_m3 / full_m3);
        for (list, answers) in chosen.iter().enumerate() {
            let kept_m3 = answers[window].kept.as_ref().map_or(0.0, |p| p.filled_m3);
            found.filled[list + 1].push(kept_m3 / full_m3);
        }
        found.windows += 1;
    }
    Ok(())
}

fn within(o: &Offset) -> bool {
    o.0 <= ASKED.0 && o.1 <= ASKED.1
}

fn page(bench: &Bench, found: &Found) -> String {
    let effort = Effort::of(bench);
    let mean = |v: &mut dyn Iterator<Item = f32>| {
        let v: Vec<f32> = v.collect();
        v.iter().sum::<f32>() / v.len().max(1) as f32
    };
    let share = |v: &mut dyn Iterator<Item = bool>| 100.0 * mean(&mut v.map(f32::from));
    let mut errors = Table::new(&[
        "answer",
        "rotation error",
        "displacement, m",
        "within 15°",
        "within 0.25 m",
        "within both",
    ]);
    for (name, offsets) in [
        ("best of one search for the best of another", &found.pairs),
        ("best of all other searches", &found.oracle),
        ("middle of all other searches", &found.middle),
        ("the network's surest", &found.surest),
    ] {
        errors.row([
            name.to_string(),
            format!("{:.1}°", mean(&mut offsets.iter().map(|o| o.0))),
            format!("{:.2}", mean(&mut offsets.iter().map(|o| o.1))),
            format!("{:.0} %", share(&mut offsets.iter().map(|o| o.0 <= ASKED.0))),
            format!("{:.0} %", share(&mut offsets.iter().map(|o| o.1 <= ASKED.1))),
            format!("{:.0} %", share(&mut offsets.iter().map(within))),
        ]);
    }
    let mut fills = Table::new(&[
        "choice",
        &format!("void filled against the best of {} random drops", effort.drops),
        "windows left empty",
    ]);
    for (name, filled) in CHOICES.iter().zip(&found.filled) {
        fills.row([
            name.replace('N', &effort.drops.to_string()),
            format!("{:.1} %", 100.0 * mean(&mut filled.iter().copied())),
            format!("{:.0} %", share(&mut filled.iter().map(|f| *f == 0.0))),
        ]);
    }
    let mut plans = Table::new(&["plan", "blocks", "void left, m³", "mean distance, m"]);
    for (name, figures) in PLANS.iter().zip(&found.plans) {
        let of = |f: fn(&(f64, f64, f64)) -> f64| {
            mean_and_spread(&figures.iter().map(f).collect::<Vec<_>>()).0
        };
        plans.row([
            name.replace('N', &effort.plan_drops.to_string()),
            format!("{:.1}", of(|f| f.0)),
            format!("{:.1}", of(|f| f.1)),
            format!("{:.3}", of(|f| f.2)),
        ]);
    }
    format!(
        "{} windows of {} held-out piles, each searched {SEARCHES} times by {} random drops of a 2.1 m tetrapod; a search's \
         best is the drop that moved at most 0.1 block lengths sideways and fills most void. Rotations modulo symmetry.\n\n\
         {}\nOne of the network's 16 answers lies within 15° and 0.25 m of the best of a search in {:.0} % of the windows; with \
         the six turns at which the planner shows a window, in {:.0} %.\n\n{}\nA choice of the planner has passed every check of a \
         plan (height, support, wedging, shake), the best of a search only that it stayed; a window left empty counts as 0.\n\nWhole plans of the same piles, means:\n\n{}",
        found.windows,
        bench.settings.scenes,
        effort.drops,
        errors.finish(),
        share(&mut found.near[0].iter().copied()),
        share(&mut found.near[1].iter().copied()),
        fills.finish(),
        plans.finish()
    )
}
