//! How far the policies are from what is possible: a long search with losses accepted at first (simulated annealing over lifted and
//! re-dropped blocks) bounds from below what could be reached; every policy is stated as a share of it.

use crate::planning_log::{Figures, PlanningLog, Trial};
use crate::planning_site::{Span, Works, mean_and_spread, method_volume_m3};
use crate::{Bench, Experiment, ReproduceError, Table};
use plan::Policy;
use std::path::PathBuf;

pub const EXPERIMENT: Experiment = Experiment {
    name: "planning-limit",
    about: "policies and improved plans as shares of a long search",
    body,
};

/// Policy, trials a block after the rounds, temperature.
type Way = (&'static str, Policy, [f32; 2]);
/// Trials a block of the long search: more than a hundred times the work of the rounds.
const LONG: f32 = 30.0;
/// The last is the long search.
const WAYS: [Way; 7] = [
    ("random", Policy::Random, [0.0, 0.0]),
    ("network", Policy::Network, [0.0, 0.0]),
    ("search", Policy::Search, [0.0, 0.0]),
    ("search improve 1", Policy::Search, [1.0, 0.0]),
    ("search improve 2", Policy::Search, [2.0, 0.0]),
    ("search improve 4", Policy::Search, [4.0, 0.0]),
    ("long search", Policy::Search, [LONG, 0.3]),
];
/// Trials a block of the long search where little time is asked for.
const QUICK: f32 = 6.0;

/// Small sites, square: a few windows that see each other, and the edge of all of them.
const SMALL: (u64, f64) = (10, 8.0);
/// Spans of the method's width.
const SPANS: u64 = 3;

fn body(bench: &Bench) -> Result<String, ReproduceError> {
    let repeats = bench.settings.repeats;
    let (small, spans) = if bench.settings.quick { (2, 1) } else { (SMALL.0, SPANS) };
    let span = Works::span(bench);
    let square = Works { length_m: SMALL.1, width_m: SMALL.1, ..span };
    let sets = [("small sites", "small", square, small), ("spans", "spans", span, spans)];
    let mut text = format!(
        "{repeats} plan(s) of each site; standard deviation over plans after ±. The objective is that of `[plan.objective]` by default: void \
         filled in volumes of a block, less the protruding blocks. Shares are of the long search ({LONG} trials a block, losses accepted \
         at first), mean by mean; it is no proof of a limit: what it reached can be reached. Seconds are of wall time.\n"
    );
    for (title, name, works, count) in sets {
        let mut rows: Vec<(&str, Vec<Figures>)> = WAYS.map(|(way, _, _)| (way, vec![])).into();
        let mut block_m3 = 0.0;
        for number in 0..count {
            let span = Span::of(bench, &Works { number, ..works })?;
            let file = bench.folder.join(format!("planning-limit-{name}-{number}.csv"));
            of_site(bench, &span, file, &mut rows)?;
            block_m3 = span.supplement_volume_m3();
            if number == 0 {
                let words =
                    format!("\n## {count} {title}\n\nEach like the first: {}\n\n", span.words());
                text.push_str(&words);
            }
        }
        text.push_str(&table(&rows, block_m3));
    }
    Ok(text)
}

/// Plans a site in every way.
fn of_site(
    bench: &Bench,
    span: &Span,
    file: PathBuf,
    rows: &mut [(&'static str, Vec<Figures>)],
) -> Result<(), ReproduceError> {
    let quick = bench.settings.quick;
    let mut log = PlanningLog::open(file, format!("{}, quick {quick}", span.stamp()?))?;
    let volume_m3 = method_volume_m3(span)?;
    for ((name, policy, [passes, temperature]), row) in WAYS.into_iter().zip(rows) {
        let passes = if quick { passes.min(QUICK) } else { passes };
        for repeat in 0..bench.settings.repeats {
            let improve = [passes, temperature];
            let trial = Trial { policy: (name, policy), overflow_m: None, repeat, improve };
            row.1.extend(log.figures(bench, span, &trial, &[volume_m3])?);
        }
    }
    Ok(())
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
