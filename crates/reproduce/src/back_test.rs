//! Whether the range that a plan announces holds the count that its works need.
//!
//! A trial: a pile is surveyed and recognised, works are planned on it with P10 and P90 of the count, the physics engine builds the plan
//! with a crane's errors, and what stands is planned on from until no window is left. Each trial is kept in a file, so
//! that many can be made in several goes.

use crate::as_built::{as_recognised, works};
use crate::markdown::percent;
use crate::monitoring::{kept, recognised};
use crate::monitoring_score::Share;
use crate::{Bench, Experiment, ReproduceError, SiteSet, Table, site_sets};
use geom::SeedTree;
use pipeline::{Config, count_range, plan_works};
use plan::{PlanConfig, PlanInput, UncertaintyConfig};
use scene::{Catalog, DesignSurface, Plan, Recognised, Survey};
use segment::SegmentModel;
use serde::{Deserialize, Serialize};
use synth::then::{Then, Works, then};

pub const EXPERIMENT: Experiment = Experiment {
    name: "back-test",
    about: "whether P10 to P90 of a plan's count hold the blocks that its works need",
    body,
};

/// The works: a level so far above the bed, on a square of this side in the middle of the pen.
const LEVEL_M: f64 = 4.2;
const SIDE_M: f64 = 7.0;
/// Plans a range is made of.
const SEEDS: u32 = 10;
/// Shifts of the works, each planned on what the last one left.
const SHIFTS: u64 = 4;
/// What v, f and the friction are changed by, either way, to see what the count makes of it.
const VOLUME: f32 = 1.25;
const OVERFLOW_M: f32 = 0.1;
const FRICTION: f32 = 0.1;

/// One trial: blocks everywhere.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Trial {
    p10: f32,
    p90: f32,
    /// Of the plan that was built.
    planned: u32,
    /// What stood at last.
    built: u32,
    /// Of plans with other seeds.
    plans: Vec<u32>,
    /// What the same plans come to when built with the crane's errors in the planner's own physics.
    worked: Vec<u32>,
    /// Of a plan on the blocks as they really lie.
    on_truth: u32,
    /// Of plans with less and more of v, of f and of friction.
    volume: [u32; 2],
    overflow: [u32; 2],
    friction: [u32; 2],
}

fn body(bench: &Bench) -> Result<String, ReproduceError> {
    let sets = site_sets()?;
    let set = sets.iter().find(|s| s.name == "sawara-uav").expect("a set of the recipes");
    let mut trials: Vec<Trial> = Vec::new();
    for index in 0..bench.settings.repeats {
        if bench.observer.cancelled() {
            return Err(ReproduceError::Stopped);
        }
        let file = bench.folder.join(format!(
            "back-test-{}-{index}-{}.json",
            bench.settings.seed,
            env!("CARGO_PKG_VERSION")
        ));
        trials.push(kept(&file, || one_trial(bench, set, index))?);
    }
    let mut inside = Share::default();
    let mut of_plans = Share::default();
    for t in &trials {
        let built = t.built as f32;
        inside.count((t.p10.floor()..=t.p90.ceil()).contains(&built));
        let (low, high) = (t.plans.iter().min(), t.plans.iter().max());
        of_plans.count(low.is_some_and(|l| *l <= t.built) && high.is_some_and(|h| t.built <= *h));
    }
    let share = |s: &Share| percent((s.of > 0).then(|| s.hits as f64 / s.of as f64));
    let mean = |of: &dyn Fn(&Trial) -> f32| mean(&trials.iter().map(of).collect::<Vec<_>>());
    Ok(format!(
        "{} piles of 50 to 60 tetrapods surveyed by drone, a level design {LEVEL_M} m above the bed on {SIDE_M} × {SIDE_M} m; built by the physics \
         engine with 15 cm and 10° a block, {SHIFTS} shifts at most.\n\n\
         P10–P90 ({SEEDS} plans, each built with the crane's errors) hold the count that was needed in **{} %** ({} of {}); smallest to largest of the \
         same plans without the crane {} %. Planned {:.1}, needed {:.1}, middle of the range {:.1}, width {:.1} blocks on average.\n\n{}",
        inside.of,
        share(&inside),
        inside.hits,
        inside.of,
        share(&of_plans),
        mean(&|t| t.planned as f32),
        mean(&|t| t.built as f32),
        mean(&|t| 0.5 * (t.p10 + t.p90)),
        mean(&|t| t.p90 - t.p10),
        shares(&trials)
    ))
}

/// What the count depends on, one cause at a time.
fn shares(trials: &[Trial]) -> String {
    let mut table =
        Table::new(&["cause", "standard deviation, blocks", "shift of the mean, blocks"]);
    let within = |of: &dyn Fn(&Trial) -> &Vec<u32>| {
        let one = |t: &Trial| variance(&of(t).iter().map(|c| *c as f32).collect::<Vec<_>>());
        mean(&trials.iter().map(one).collect::<Vec<_>>())
    };
    let (chance, works) = (within(&|t| &t.plans), within(&|t| &t.worked));
    let shift = |of: &dyn Fn(&Trial) -> f32| mean(&trials.iter().map(of).collect::<Vec<_>>());
    let of_list = |l: &[u32]| mean(&l.iter().map(|c| *c as f32).collect::<Vec<_>>());
    let mut row = |name: &str, variance: f32, shift: f32| {
        table.row(vec![
            name.into(),
            format!("{:.2}", variance.max(0.0).sqrt()),
            format!("{shift:+.2}"),
        ]);
    };
    row("the planner's own choices", chance, 0.0);
    row(
        "the crane (15 cm, 10°) with the plans after it",
        works - chance,
        shift(&|t| of_list(&t.worked) - of_list(&t.plans)),
    );
    // Two plans of one pile differ by chance anyway.
    let seen = |t: &Trial| t.planned as f32 - t.on_truth as f32;
    let recognition: Vec<f32> = trials.iter().map(seen).collect();
    row(
        "recognition: poses and blocks not judged",
        variance(&recognition) - 2.0 * chance,
        mean(&recognition),
    );
    type Ends = fn(&Trial) -> [u32; 2];
    let pairs: [(&str, Ends); 3] = [
        ("minimum volume v, × 0.8 to × 1.25", |t| t.volume),
        ("overflow f, ± 10 cm", |t| t.overflow),
        ("friction, ± 0.1", |t| t.friction),
    ];
    for (name, of) in pairs {
        let half = |t: &Trial| 0.5 * (of(t)[1] as f32 - of(t)[0] as f32);
        let halves: Vec<f32> = trials.iter().map(half).collect();
        // Half the difference of two plans has half the variance of one.
        let squares: Vec<f32> = halves.iter().map(|h| h * h).collect();
        row(name, mean(&squares) - 0.5 * chance, mean(&halves));
    }
    let left: Vec<f32> = trials.iter().map(|t| t.built as f32 - of_list(&t.worked)).collect();
    row("needed less the works' mean", variance(&left), mean(&left));
    table.finish()
}

fn mean(values: &[f32]) -> f32 {
    values.iter().sum::<f32>() / values.len().max(1) as f32
}

fn variance(values: &[f32]) -> f32 {
    let m = mean(values);
    let squares: f32 = values.iter().map(|v| (v - m).powi(2)).sum();
    squares / values.len().saturating_sub(1).max(1) as f32
}

fn one_trial(bench: &Bench, set: &SiteSet, trial: u64) -> Result<Trial, ReproduceError> {
    let seed = SeedTree::new(bench.settings.seed).child("back-test", trial);
    let failed = |source| ReproduceError::Scene { set: set.name.into(), index: trial, source };
    let made = synth::scene(&set.recipe, &set.catalog, seed.child("scene", 0)).map_err(failed)?;
    let model = match bench.model {
        Some(model) => model.clone(),
        None => SegmentModel::shipped(&set.catalog)?,
    };
    let blocks = recognised(bench, &made.survey, &set.catalog, &model)?;
    let planning = Planning { survey: &made.survey, catalog: &set.catalog, bench, seed };
    let mut config = Config::default();
    config.plan.uncertainty = UncertaintyConfig { seeds: SEEDS, ..UncertaintyConfig::default() };
    let design = design();
    let on = works(&made.survey, &set.catalog, &blocks, &design);
    let (scene, plan) = plan_works(&on, &config, seed, bench.observer)?;
    let range = count_range(&on, &scene, &config, seed, bench.observer)?;
    let (planned, needed) =
        (plan.placements.len() as u32, built(bench, set, &made, plan, seed, trial)?);
    let with = |change: &dyn Fn(&mut PlanConfig)| {
        let mut config = Config::default();
        change(&mut config.plan);
        planning.blocks(&blocks, &config)
    };
    let volume = |factor: f32| with(&|c| c.minimum_volume_m3 = Some(factor));
    let overflow = |by: f32| with(&|c| c.overflow_m = Some(0.3 + by));
    let friction = |by: f32| with(&|c| c.physics.friction += by);
    Ok(Trial {
        p10: range.blocks.p10,
        p90: range.blocks.p90,
        planned,
        built: needed,
        plans: range.cases.iter().map(|c| c.summary.blocks).collect(),
        worked: range.cases.iter().map(|c| c.built).collect(),
        on_truth: planning.blocks(&as_recognised(&made.scene), &Config::default())?,
        volume: [volume(1.0 / VOLUME)?, volume(VOLUME)?],
        overflow: [overflow(-OVERFLOW_M)?, overflow(OVERFLOW_M)?],
        friction: [friction(-FRICTION)?, friction(FRICTION)?],
    })
}

fn design() -> DesignSurface {
    let h = SIDE_M / 2.0;
    DesignSurface::Level { level_m: LEVEL_M, boundary: vec![[-h, -h], [h, -h], [h, h], [-h, h]] }
}

/// What plans of a trial share.
struct Planning<'a> {
    survey: &'a Survey,
    catalog: &'a Catalog,
    bench: &'a Bench<'a>,
    seed: SeedTree,
}

impl Planning<'_> {
    fn blocks(&self, blocks: &[Recognised], config: &Config) -> Result<u32, ReproduceError> {
        let design = design();
        let on = works(self.survey, self.catalog, blocks, &design);
        let (_, plan) = plan_works(&on, config, self.seed, self.bench.observer)?;
        Ok(plan.placements.len() as u32)
    }
}

/// Blocks that stand when the plan is built with the crane's errors and planned on from what really stands.
fn built(
    bench: &Bench,
    set: &SiteSet,
    made: &synth::SynthScene,
    mut plan: Plan,
    seed: SeedTree,
    trial: u64,
) -> Result<u32, ReproduceError> {
    let failed = |source| ReproduceError::Scene { set: set.name.into(), index: trial, source };
    // The crane skips nothing here and adds nothing of its own: it builds, looks and goes on.
    let happens = Then::Works(Works { skipped: 0.0, extra: 0.0, ..Works::default() });
    let mut recipe = set.recipe.clone();
    recipe.density_per_m2 = 50.0;
    let (design, mut pile) = (design(), made.scene.clone());
    for shift in 0..SHIFTS {
        if plan.placements.is_empty() {
            break;
        }
        let seed = seed.child("shift", shift);
        let next =
            then(&recipe, &set.catalog, &pile, &happens, Some(&plan), seed).map_err(failed)?;
        pile = next.scene.scene;
        if shift + 1 < SHIFTS {
            let input = PlanInput {
                scene: &pile,
                frame: &made.survey.frame,
                design: &design,
                catalog: &set.catalog,
                placed: &[],
                proposer: None,
                survey: None,
            };
            plan = plan::plan(&input, &PlanConfig::default(), seed, bench.observer)?;
        }
    }
    Ok((pile.blocks.len() - made.scene.blocks.len()) as u32)
}
