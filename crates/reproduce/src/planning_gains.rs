//! What improving and a second type give over today's rounds, at the same overflow threshold f: two shapes, several piles.

use crate::planning_log::kept_text;
use crate::planning_site::{SHAPES, SMALLER, SUPPLEMENT, Span, Works, mean_and_spread, settings};
use crate::{Bench, Experiment, ReproduceError, Table};
use geom::SeedTree;
use plan::{BlockChoice, PlanConfig, Policy};
use scene::Plan;
use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::PathBuf;

pub const EXPERIMENT: Experiment = Experiment {
    name: "planning-gains",
    about: "improved plans against the rounds alone, two types against one, two shapes",
    body,
};

/// Overflow threshold of all plans, m: the method's for the larger type.
const OVERFLOW_M: f32 = 0.315;
/// Trials a block of the improved plans.
const PASSES: f32 = 1.0;
/// What lifting a block costs, as so much concrete.
const LIFT_M3: f64 = 1.0;

/// Figures of one plan.
#[derive(Clone, Copy)]
struct Made {
    blocks: f64,
    smaller: f64,
    filled_m3: f64,
    distance_m: f64,
    protruding: f64,
    cost: f64,
    seconds: f64,
}

impl Made {
    fn of(span: &Span, plan: &Plan, seconds: f64) -> Self {
        let summary = &plan.summary;
        let small = span.catalog.find(SMALLER);
        let smaller = plan.placements.iter().filter(|p| Some(p.model) == small).count();
        let cost = plan.placements.iter().map(|p| cost(span, p.model)).sum();
        Self {
            blocks: f64::from(summary.blocks),
            smaller: smaller as f64,
            filled_m3: f64::from(summary.void_before_m3 - summary.void_after_m3),
            distance_m: f64::from(summary.mean_distance_m),
            protruding: f64::from(summary.protruding),
            cost,
            seconds,
        }
    }

    fn numbers(&self) -> [f64; 7] {
        let Self { blocks, smaller, filled_m3, distance_m, protruding, cost, seconds } = *self;
        [blocks, smaller, filled_m3, distance_m, protruding, cost, seconds]
    }

    fn read(line: &str) -> Option<(String, Self)> {
        let (name, numbers) = line.split_once(',')?;
        let numbers: Vec<f64> =
            numbers.split(',').map(|n| n.parse().ok()).collect::<Option<_>>()?;
        let [blocks, smaller, filled_m3, distance_m, protruding, cost, seconds] =
            numbers.try_into().ok()?;
        let made = Self { blocks, smaller, filled_m3, distance_m, protruding, cost, seconds };
        Some((name.into(), made))
    }
}

/// Concrete of a block and its lift, m³.
fn cost(span: &Span, model: scene::ModelId) -> f64 {
    f64::from(span.catalog.get(model).volume_m3) + LIFT_M3
}

/// The ways in the order of the table, by name.
fn ways(span: &Span) -> Vec<(String, PlanConfig)> {
    let base = |policy| PlanConfig { overflow_m: Some(OVERFLOW_M), ..settings(policy) };
    let choice = |name: &str| {
        let model = span.catalog.find(name).expect("it is in the span's catalogue");
        BlockChoice { name: name.into(), stock: None, cost: cost(span, model) as f32 }
    };
    let types = |names: &[&str]| {
        let blocks = names.iter().map(|n| choice(n)).collect();
        PlanConfig { block: None, blocks, ..base(Policy::Search) }
    };
    let mut improved = base(Policy::Search);
    improved.search.improve = PASSES;
    vec![
        ("random".into(), base(Policy::Random)),
        ("search".into(), base(Policy::Search)),
        (format!("search improve {PASSES}"), improved),
        ("smaller type alone".into(), types(&[SMALLER])),
        ("both types".into(), types(&[SUPPLEMENT, SMALLER])),
    ]
}

fn body(bench: &Bench) -> Result<String, ReproduceError> {
    let mut text = format!(
        "{} pile(s) of each shape, one plan a way; ± is the standard deviation over the piles. f = {OVERFLOW_M} m in all plans. Cost: m³ of \
         concrete, and {LIFT_M3} for each lift. Protruding: share of the blocks.\n",
        bench.settings.repeats
    );
    for (name, shape) in SHAPES {
        let mut rows: Vec<(String, Vec<Made>)> = Vec::new();
        for number in 0..bench.settings.repeats {
            let span = Span::of(bench, &Works { shape, number, ..Works::span(bench) })?;
            let file = bench.folder.join(format!("planning-gains-{name}-{number}.csv"));
            for (w, (way, made)) in of_pile(bench, &span, file)?.into_iter().enumerate() {
                if rows.len() <= w {
                    rows.push((way, Vec::new()));
                }
                rows[w].1.push(made);
            }
            if number == 0 {
                let words = span.words().replace("tetrapods", &format!("blocks ({name})"));
                write!(text, "\n## {name}\n\n{words}\n\n").expect("a string takes all text");
            }
        }
        text.push_str(&table(&rows));
    }
    Ok(text)
}

/// Every way on one pile; what an earlier run made is read.
fn of_pile(
    bench: &Bench,
    span: &Span,
    file: PathBuf,
) -> Result<Vec<(String, Made)>, ReproduceError> {
    let failed = |source| ReproduceError::File { file: file.display().to_string(), source };
    let kept = kept_text(&file)?;
    let stamp = span.stamp()?;
    let same = kept.lines().next() == Some(stamp.as_str());
    let mut known: BTreeMap<String, Made> = match same {
        true => kept.lines().skip(1).filter_map(Made::read).collect(),
        false => BTreeMap::new(),
    };
    let mut made = Vec::new();
    for (way, config) in ways(span) {
        if !known.contains_key(&way) {
            if bench.observer.cancelled() {
                return Err(ReproduceError::Stopped);
            }
            let start = (bench.clock)();
            let seed = SeedTree::new(bench.settings.seed).child("plan", span.works.number);
            let plan = plan::plan(&span.input(), &config, seed, bench.observer)?;
            known.insert(way.clone(), Made::of(span, &plan, (bench.clock)() - start));
            let line = |(name, m): (&String, &Made)| {
                let numbers: Vec<String> = m.numbers().iter().map(f64::to_string).collect();
                format!("{name},{}\n", numbers.join(","))
            };
            let lines: String = known.iter().map(line).collect();
            std::fs::write(&file, format!("{stamp}\n{lines}")).map_err(failed)?;
        }
        made.push((way.clone(), known[&way]));
    }
    Ok(made)
}

fn table(rows: &[(String, Vec<Made>)]) -> String {
    let heads = [
        "way",
        "blocks",
        "of these smaller",
        "void filled, m³",
        "against search",
        "protruding",
        "protruding, share",
        "mean distance, m",
        "cost",
        "cost a m³ of void",
        "s a plan",
    ];
    let mut table = Table::new(&heads);
    let searched = rows.iter().find(|(way, _)| way == "search");
    for (way, made) in rows {
        let of = |f: fn(&Made) -> f64| mean_and_spread(&made.iter().map(f).collect::<Vec<_>>());
        let gains: Vec<f64> = searched
            .into_iter()
            .flat_map(|(_, base)| base.iter().zip(made))
            .map(|(b, m)| 100.0 * (m.filled_m3 / b.filled_m3 - 1.0))
            .collect();
        let (gain, spread) = mean_and_spread(&gains);
        let both = |(mean, spread): (f64, f64)| format!("{mean:.1} ± {spread:.1}");
        table.row([
            way.clone(),
            both(of(|m| m.blocks)),
            format!("{:.1}", of(|m| m.smaller).0),
            both(of(|m| m.filled_m3)),
            format!("{gain:+.1} ± {spread:.1} %"),
            both(of(|m| m.protruding)),
            format!("{:.1} %", 100.0 * of(|m| m.protruding / m.blocks).0),
            format!("{:.3}", of(|m| m.distance_m).0),
            format!("{:.0}", of(|m| m.cost).0),
            both_of_cost(of(|m| m.cost / m.filled_m3)),
            format!("{:.1}", of(|m| m.seconds).0),
        ]);
    }
    table.finish()
}

fn both_of_cost((mean, spread): (f64, f64)) -> String {
    format!("{mean:.3} ± {spread:.3}")
}
