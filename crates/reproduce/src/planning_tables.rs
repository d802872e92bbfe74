//! Tables 4.2–4.7: the site, seconds of each step; blocks and mean distance to the design over minimum volume v and overflow threshold f, each policy.
//!
//! Every plan is kept as it is made (`planning-tables.csv` beside the page), seed by seed, so that a run that was stopped
//! goes on and one with more repeats makes only those.

use crate::planning_log::{Figures, PlanningLog, Trial};
use crate::planning_site::{POLICIES, Span, mean_and_spread, site_table};
use crate::{Bench, Experiment, ReproduceError, Table};
use geom::SeedTree;
use std::fmt::Write;

pub const EXPERIMENT: Experiment = Experiment {
    name: "planning-tables",
    about: "the site, seconds a step, blocks and distances over v and f by policy (Tables 4.2-4.7)",
    body,
};

const VOLUMES_M3: [f32; 5] = [0.4, 1.0, 2.0, 3.0, 4.0];
const OVERFLOWS_M: [f32; 5] = [0.0, 0.1, 0.3, 0.35, 0.5];

fn body(bench: &Bench) -> Result<String, ReproduceError> {
    let span = Span::new(bench)?;
    let mut log = PlanningLog::open(bench.folder.join("planning-tables.csv"), span.stamp()?)?;
    let mut found: Vec<Cell> = Vec::new();
    for repeat in 0..bench.settings.repeats {
        // The quick policy first: a run that is stopped early has whole tables.
        for policy in POLICIES.into_iter().rev() {
            for f in OVERFLOWS_M {
                let trial = Trial { policy, overflow_m: Some(f), repeat, improve: [0.0; 2] };
                let figures = log.figures(bench, &span, &trial, &VOLUMES_M3)?;
                let cell = |(v, figures)| Cell { policy: policy.0, v, f, figures };
                found.extend(VOLUMES_M3.into_iter().zip(figures).map(cell));
            }
        }
    }
    let repeats = bench.settings.repeats;
    let mut text = format!(
        "{} {repeats} plan(s) a cell; standard deviation over the seeds in brackets.\n",
        span.words()
    );
    write!(text, "\n## Table 4.2: the site\n\n{}\n{}", site_table(&span), steps(bench, &span)?)
        .expect("a string takes all text");
    for (name, _) in POLICIES {
        let of_policy: Vec<&Cell> = found.iter().filter(|c| c.policy == name).collect();
        let blocks = table(&of_policy, |f| f.blocks, if repeats > 1 { 1 } else { 0 });
        let distances = table(&of_policy, |f| f.mean_distance_m, 3);
        let surfaces = table(&of_policy, |f| f.surface_distance_m, 3);
        let made: Vec<f64> =
            of_policy.iter().map(|c| c.figures.seconds).filter(|s| *s > 0.0).collect();
        let (seconds, _) = mean_and_spread(&made);
        write!(
            text,
            "\n## {name}\n\n{} plans made, {} shown to be the same as that of a smaller v; {seconds:.1} s a plan (wall time, on \
             whatever else the machine did).\n\nBlocks placed (Tables 4.4, 4.5)\n\n{blocks}\nMean distance of the added blocks' surface, seen from above, to the design, m (the \
             thesis' distance, Tables 4.6, 4.7)\n\n{surfaces}\nMean distance of the whole surface to the design, gaps between blocks included, \
             m (ours)\n\n{distances}",
            made.len(),
            of_policy.len() - made.len()
        )
        .expect("a string takes all text");
    }
    text.push_str(
        "\nThe thesis, 150 × 25 m: 645–1017 blocks (built: 864), mean distance 0.40–0.50 m, about 1 h a plan.\n",
    );
    Ok(text)
}

/// Table 4.3.
fn steps(bench: &Bench, span: &Span) -> Result<String, ReproduceError> {
    let mut table = Table::new(&["step", "s", "windows", "s a window"]);
    let seed = SeedTree::new(bench.settings.seed).child("steps", 0);
    for (name, seconds, windows) in span.step_seconds(seed, bench)? {
        let poses = POLICIES.iter().any(|p| p.0 == name);
        let name = if poses { format!("poses and drops, {name}") } else { name.to_string() };
        let each = if poses { format!("{:.3}", seconds / windows as f64) } else { "–".into() };
        let windows = if poses { windows.to_string() } else { "–".into() };
        table.row([name, format!("{seconds:.2}"), windows, each]);
    }
    Ok(format!(
        "## Table 4.3: seconds of the steps of a round\n\nWall time on the pile before planning; windows of a policy side by side on all \
         threads.\n\n{}",
        table.finish()
    ))
}

/// One plan of the tables.
struct Cell {
    policy: &'static str,
    v: f32,
    f: f32,
    figures: Figures,
}

/// A figure over v (down) and f (across): mean and, of several plans, standard deviation.
fn table(of_policy: &[&Cell], figure: fn(&Figures) -> f64, digits: usize) -> String {
    let heads: Vec<String> = std::iter::once("v, m³".to_string())
        .chain(OVERFLOWS_M.iter().map(|f| format!("f = {f} m")))
        .collect();
    let mut table = Table::new(&heads.iter().map(String::as_str).collect::<Vec<_>>());
    for v in VOLUMES_M3 {
        let cells = OVERFLOWS_M.iter().map(|&f| {
            let here = of_policy.iter().filter(|c| c.v == v && c.f == f);
            let values: Vec<f64> = here.map(|c| figure(&c.figures)).collect();
            let (mean, spread) = mean_and_spread(&values);
            if values.len() > 1 {
                format!("{mean:.digits$} ({spread:.digits$})")
            } else {
                format!("{mean:.digits$}")
            }
        });
        table.row(std::iter::once(v.to_string()).chain(cells));
    }
    table.finish()
}
