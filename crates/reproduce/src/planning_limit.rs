//! How far the policies are from what is possible: a long search with losses accepted at first (simulated annealing over lifted and
//! re-dropped blocks) bounds from below what could be reached; every policy is stated as a share of it.

use crate::planning_log::{Figures, PlanningLog, Trial};
use crate::planning_site::{Span, mean_and_spread, method_volume_m3};
use crate::{Bench, Experiment, ReproduceError, Table};
use plan::Policy;

pub const EXPERIMENT: Experiment = Experiment {
    name: "planning-limit",
    about: "policies and improved plans as shares of a long search",
    body,
};

/// Policy, trials a block after the rounds, temperature.
type Way = (&'static str, Policy, [f32; 2]);
/// The last is the long search.
const WAYS: [Way; 6] = [
    ("random", Policy::Random, [0.0, 0.0]),
    ("network", Policy::Network, [0.0, 0.0]),
    ("search", Policy::Search, [0.0, 0.0]),
    ("search improve 1", Policy::Search, [1.0, 0.0]),
    ("search improve 4", Policy::Search, [4.0, 0.0]),
    ("long search", Policy::Search, [100.0, 0.3]),
];
/// Trials a block of the long search where little time is asked for.
const QUICK: f32 = 6.0;

fn body(bench: &Bench) -> Result<String, ReproduceError> {
    let span = Span::new(bench)?;
    let file = bench.folder.join("planning-limit.csv");
    let mut log =
        PlanningLog::open(file, format!("{}, quick {}", span.stamp()?, bench.settings.quick));
    let volume_m3 = method_volume_m3(&span)?;
    let mut rows: Vec<(&str, Vec<Figures>)> = Vec::new();
    for (name, policy, [passes, temperature]) in WAYS {
        let passes = if bench.settings.quick { passes.min(QUICK) } else { passes };
        let mut plans = Vec::new();
        for repeat in 0..bench.settings.repeats {
            let improve = [passes, temperature];
            let trial = Trial { policy: (name, policy), overflow_m: None, repeat, improve };
            plans.extend(log.figures(bench, &span, &trial, &[volume_m3])?);
        }
        rows.push((name, plans));
    }
    let block_m3 = span.supplement_volume_m3();
    Ok(format!(
        "{} {} plans each; standard deviation over the seeds after ±. The objective is that of `[plan.objective]` by default: void filled in \
         volumes of a block, less the protruding blocks. Shares are of the long search, which is no proof of a limit: what it reached can \
         be reached.\n\n{}",
        span.words(),
        bench.settings.repeats,
        table(&rows, block_m3)
    ))
}

fn table(rows: &[(&str, Vec<Figures>)], block_m3: f64) -> String {
    let heads = [
        "way",
        "objective",
        "share",
        "blocks",
        "void filled, m³",
        "mean distance, m",
        "porosity",
        "protruding",
        "s a plan",
    ];
    let of = |plans: &[Figures], f: &dyn Fn(&Figures) -> f64| {
        mean_and_spread(&plans.iter().map(f).collect::<Vec<_>>())
    };
    let objective = |f: &Figures| f.void_filled_m3 / block_m3 - f.protruding;
    let longest = rows.last().map_or(f64::NAN, |(_, plans)| of(plans, &objective).0);
    let mut table = Table::new(&heads);
    for (name, plans) in rows {
        let both = |f: &dyn Fn(&Figures) -> f64| {
            let (mean, spread) = of(plans, f);
            format!("{mean:.1} ± {spread:.1}")
        };
        table.row([
            (*name).to_string(),
            both(&objective),
            format!("{:.0} %", 100.0 * of(plans, &objective).0 / longest),
            both(&|f| f.blocks),
            both(&|f| f.void_filled_m3),
            format!("{:.3}", of(plans, &|f| f.mean_distance_m).0),
            format!("{:.3}", of(plans, &|f| f.porosity).0),
            format!("{:.1}", of(plans, &|f| f.protruding).0),
            format!("{:.1}", of(plans, &|f| f.seconds).0),
        ]);
    }
    table.finish()
}
