//! Windows that straight lowering leaves: what shuts them, and which of them guided insertion opens.

use crate::planning_site::{SHAPES, Span, Works, settings};
use crate::{Bench, Experiment, ReproduceError, Table};
use geom::SeedTree;
use plan::{Policy, ShutWindow, shut_windows};
use std::fmt::Write;

pub const EXPERIMENT: Experiment = Experiment {
    name: "planning-paths",
    about: "what shuts the windows that straight lowering leaves, and which of them paths open",
    body,
};

/// Poses looked at in each window; those that are free are let go.
const SAMPLES: u32 = 6000;

fn body(bench: &Bench) -> Result<String, ReproduceError> {
    let samples = if bench.settings.quick { SAMPLES / 10 } else { SAMPLES };
    let mut text = format!(
        "{} pile(s) of each shape. Windows that lack the minimum volume and got no block by straight lowering; in each {samples} poses are \
         drawn anywhere between the highest allowed and a block's length below, and those that touch nothing are let go. A window has a \
         place if one of them stays by all rules of the planner; the place is hidden if no block can be lowered to it straight from above.\n",
        bench.settings.repeats
    );
    for (name, shape) in SHAPES {
        let mut table = Table::new(&HEADS);
        let mut all = Vec::new();
        for number in 0..bench.settings.repeats {
            let span = Span::of(bench, &Works { shape, number, ..Works::span(bench) })?;
            if number == 0 {
                let words = span.words().replace("tetrapods", &format!("blocks ({name})"));
                write!(text, "\n## {name}\n\n{words}\n\n").expect("a string takes all text");
            }
            let seed = SeedTree::new(bench.settings.seed).child("plan", number);
            let config = settings(Policy::Search);
            let found = shut_windows(&span.input(), &config, samples, seed, bench.observer)?;
            table.row(row(&format!("{}", number + 1), &found));
            all.extend(found);
        }
        table.row(row("all", &all));
        text.push_str(&table.finish());
    }
    Ok(text)
}

const HEADS: [&str; 11] = [
    "pile",
    "shut windows",
    "without any place",
    "of these too high",
    "roll away",
    "unstable",
    "wedged",
    "with a place",
    "of these hidden only",
    "opened",
    "of these along a path",
];

fn row(name: &str, found: &[ShutWindow]) -> [String; 11] {
    let count = |of: &dyn Fn(&ShutWindow) -> bool| found.iter().filter(|w| of(w)).count();
    let with = count(&ShutWindow::has_rest);
    let most = |w: &ShutWindow| {
        let causes = [w.too_high, w.left, w.unstable, w.wedged];
        (0..4).max_by_key(|&i| (causes[i], std::cmp::Reverse(i)))
    };
    let shut_by = |cause: usize| count(&|w| !w.has_rest() && most(w) == Some(cause)).to_string();
    let opened = count(&|w| w.opened);
    let share = |of: usize| format!("{:.0} %", 100.0 * opened as f64 / of.max(1) as f64);
    let opened_with = count(&|w| w.opened && w.has_rest());
    [
        name.into(),
        found.len().to_string(),
        (found.len() - with).to_string(),
        shut_by(0),
        shut_by(1),
        shut_by(2),
        shut_by(3),
        with.to_string(),
        count(&|w| w.hidden > 0 && w.straight == 0).to_string(),
        format!(
            "{opened}: {} of all, {:.0} % of those with a place",
            share(found.len()),
            100.0 * opened_with as f64 / with.max(1) as f64
        ),
        count(&|w| w.path).to_string(),
    ]
}
