//! Tables 4.4–4.7: blocks and mean distance to the design over minimum volume v and overflow threshold f, each policy.

use crate::planning_site::{POLICIES, Span, mean_and_spread, settings};
use crate::{Bench, Experiment, ReproduceError, Table};
use geom::SeedTree;
use plan::PlanConfig;
use std::fmt::Write;

pub const EXPERIMENT: Experiment = Experiment {
    name: "planning-tables",
    about: "blocks and mean distance over v and f, random, network, search (Tables 4.4-4.7)",
    body,
};

const VOLUMES_M3: [f32; 5] = [0.4, 1.0, 2.0, 3.0, 4.0];
const OVERFLOWS_M: [f32; 5] = [0.0, 0.1, 0.3, 0.35, 0.5];

fn body(bench: &Bench) -> Result<String, ReproduceError> {
    let span = Span::new(bench)?;
    let mut text = format!(
        "{} {} plan(s) a cell; standard deviation over the seeds in brackets.\n",
        span.words(),
        bench.settings.repeats
    );
    let heads: Vec<String> =
        std::iter::once("v, m³".to_string()).chain(OVERFLOWS_M.iter().map(|f| format!("f = {f} m"))).collect();
    let heads: Vec<&str> = heads.iter().map(String::as_str).collect();
    for (name, policy) in POLICIES {
        let (mut blocks, mut distances) = (Table::new(&heads), Table::new(&heads));
        for v in VOLUMES_M3 {
            let (mut counted, mut measured) = (vec![v.to_string()], vec![v.to_string()]);
            for f in OVERFLOWS_M {
                let config = PlanConfig { minimum_volume_m3: Some(v), overflow_m: Some(f), ..settings(policy) };
                let (mut n, mut d) = (Vec::new(), Vec::new());
                for repeat in 0..bench.settings.repeats {
                    let seed = SeedTree::new(bench.settings.seed).child("plan", repeat);
                    let s = span.plan(&config, seed, bench.observer)?;
                    n.push(f64::from(s.blocks));
                    d.push(f64::from(s.mean_distance_m));
                }
                let ((n, n_sd), (d, d_sd)) = (mean_and_spread(&n), mean_and_spread(&d));
                counted.push(if bench.settings.repeats > 1 {
                    format!("{n:.1} ({n_sd:.1})")
                } else {
                    format!("{n:.0}")
                });
                measured.push(if bench.settings.repeats > 1 {
                    format!("{d:.3} ({d_sd:.3})")
                } else {
                    format!("{d:.3}")
                });
            }
            blocks.row(counted);
            distances.row(measured);
        }
        write!(
            text,
            "\n## {name}\n\nBlocks placed\n\n{}\nMean distance to the design, m\n\n{}",
            blocks.finish(),
            distances.finish()
        )
        .expect("a string takes all text");
    }
    text.push_str(
        "\nThe thesis, 150 × 25 m: 645–1017 blocks (built: 864), mean distance 0.40–0.50 m, about 1 h a plan.\n",
    );
    Ok(text)
}
