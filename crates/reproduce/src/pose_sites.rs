//! Tables 3.3 and 3.4: poses on the six site-sensor sets, from true segments, from the network's and from none.

use crate::pose_judge::{Pooled, heads, no_segments, row, true_segments};
use crate::{Bench, Experiment, ReproduceError, Table, table_sets, weights_line};
use pose::PoseConfig;

pub const EXPERIMENT: Experiment = Experiment {
    name: "pose-sites",
    about: "poses on the six sets from true, network's and no segments (thesis, Tables 3.3, 3.4)",
    body,
};

fn body(bench: &Bench) -> Result<String, ReproduceError> {
    let mut table = Table::new(&heads("set, segments"));
    let mut weights = Vec::new();
    let config = PoseConfig::default();
    for set in table_sets(bench.settings.quick)? {
        let model = bench.network(&set.catalog)?;
        let (mut truly, mut network, mut none) =
            (Pooled::default(), Pooled::default(), Pooled::default());
        for (i, made) in set.held_out(bench).enumerate() {
            let made = made?;
            truly.add(bench, &made, &true_segments(&made, &set.catalog), &set.catalog, &config)?;
            let found = set.segmented(bench, &model, &made, i as u64)?;
            network.add(bench, &made, &found, &set.catalog, &config)?;
            none.add(bench, &made, &no_segments(&made), &set.catalog, &config)?;
        }
        for (name, pooled) in [("true", &truly), ("network", &network), ("none", &none)] {
            table.row(row(format!("{}, {name}", set.name), pooled));
        }
        let line = weights_line(&model)?;
        if !weights.contains(&line) {
            weights.push(line);
        }
    }
    Ok(format!(
        "Right: displacement ≤ 0.1 d_box and rotation ≤ 5° modulo symmetry; blocks hidden to less than 80 % are scored. \
         *About shift* is E_d without the mean displacement of each scene, which is the survey's own error and the same \
         for all its blocks. Time: the pose stage alone, wall. Weights: {}.\n\n{}\n\
         The thesis, its own sites, white noise: P/R 99.3/79.4 and 83.2/85.4 (Sawara UAV, MBES), 96.1/95.5 and 86.1/77.9 \
         (Todohokke), 98.6/97.0 and 97.9/95.2 (Era); E_d 23–39 mm, E_R 0.5–2.4°; 72–175 s a region.\n",
        weights.join("; "),
        table.finish()
    ))
}
