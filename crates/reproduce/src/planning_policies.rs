//! The policies against each other at the method's v and f and at f = 0.5 m, where the thesis' network was worse.

use crate::planning_log::{Figures, PlanningLog, Trial};
use crate::planning_site::{POLICIES, Span, mean_and_spread, method_volume_m3};
use crate::{Bench, Experiment, ReproduceError, Table};
use std::fmt::Write;

pub const EXPERIMENT: Experiment = Experiment {
    name: "planning-policies",
    about: "random, network and search at the method's v and f and at f = 0.5 m, over seeds",
    body,
};

/// Thresholds: the method's for the block, and the loose one.
const OVERFLOWS: [(&str, Option<f32>); 2] = [("the method's", None), ("0.5 m", Some(0.5))];

fn body(bench: &Bench) -> Result<String, ReproduceError> {
    let span = Span::new(bench)?;
    let mut log = PlanningLog::open(bench.folder.join("planning-policies.csv"), span.stamp()?)?;
    let volume_m3 = method_volume_m3(&span)?;
    let mut text = format!(
        "{} {} plans each; standard deviation over the seeds after ±. Seconds are of wall time a plan, on whatever else \
         the machine does.\n",
        span.words(),
        bench.settings.repeats
    );
    for (name, overflow_m) in OVERFLOWS {
        let heads = [
            "policy",
            "blocks",
            "against random",
            "mean distance, m",
            "void left, m³",
            "porosity",
            "protruding",
            "s a plan",
        ];
        let mut table = Table::new(&heads);
        let mut random = None;
        for (policy_name, policy) in POLICIES {
            let mut plans = Vec::new();
            for repeat in 0..bench.settings.repeats {
                let trial =
                    Trial { policy: (policy_name, policy), overflow_m, repeat, improve: [0.0; 2] };
                plans.extend(log.figures(bench, &span, &trial, &[volume_m3])?);
            }
            let of =
                |f: fn(&Figures) -> f64| mean_and_spread(&plans.iter().map(f).collect::<Vec<_>>());
            let blocks = of(|p| p.blocks);
            let base = *random.get_or_insert(blocks.0);
            let (distance, void) = (of(|p| p.mean_distance_m), of(|p| p.void_after_m3));
            table.row([
                policy_name.to_string(),
                format!("{:.1} ± {:.1}", blocks.0, blocks.1),
                format!("{:+.1} %", 100.0 * (blocks.0 / base - 1.0)),
                format!("{:.3} ± {:.3}", distance.0, distance.1),
                format!("{:.0}", void.0),
                format!("{:.3}", of(|p| p.porosity).0),
                format!("{:.0}", of(|p| p.protruding).0),
                format!("{:.1}", of(|p| p.seconds).0),
            ]);
        }
        write!(text, "\n## f = {name}\n\n{}", table.finish()).expect("a string takes all text");
    }
    Ok(text)
}
