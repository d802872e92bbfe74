//! Table 2.5 and the first column of 3.8: time of the stage against the number of points and instances.

use crate::{Bench, Experiment, ReproduceError, Table, weights_line};
use geom::{PointCloud, SeedTree, Vec3};
use scene::{Catalog, Shape};
use segment::{SegmentConfig, segment};

pub const EXPERIMENT: Experiment = Experiment {
    name: "segmentation-time",
    about: "time against points and instances (thesis, Tables 2.5 and 3.8)",
    body,
};

/// Piles side by side.
const PILES: [usize; 4] = [1, 2, 4, 7];
/// Points per square metre of one pile of 55 blocks.
const DENSITY: [u32; 2] = [400, 700];

fn body(bench: &Bench) -> Result<String, ReproduceError> {
    let block = blocks::shape_model("tetrapod", Shape::Tetrapod { size: 2.0 }, 2300.0)?;
    let catalog = Catalog::new(vec![block]);
    let model = bench.network(&catalog)?;
    let mut table = Table::new(&[
        "piles",
        "points",
        "blocks",
        "instances",
        "one pass s",
        "four passes (default) s",
    ]);
    for density in DENSITY {
        let set = "time";
        let text = format!(
            "name = \"time\"\ncount = [55, 55]\ndensity_per_m2 = {density}\n[sensor]\nkind = \"gaussian\"\n"
        );
        let wrong = |e: synth::SynthError| ReproduceError::Recipe {
            set: set.into(),
            message: e.to_string(),
        };
        let recipe = synth::Recipe::parse(&text).map_err(wrong)?;
        let made =
            synth::scene(&recipe, &catalog, SeedTree::new(bench.settings.seed)).map_err(wrong)?;
        for piles in PILES {
            let one = &made.survey.cloud.position_m;
            let apart = |c: usize| one.iter().map(move |p| *p + Vec3::X * (14.0 * c as f32));
            let cloud = PointCloud::from_positions((0..piles).flat_map(apart).collect());
            let mut seconds = Vec::new();
            let mut instances = 0;
            for passes in [1, 4] {
                let config = SegmentConfig { passes, ..Default::default() };
                let from = (bench.clock)();
                let found =
                    segment(&cloud, &catalog, &model, &config, SeedTree::new(1), bench.observer)?;
                seconds.push(format!("{:.2}", (bench.clock)() - from));
                instances = found.instances;
            }
            let [once, four] = [&seconds[0], &seconds[1]].map(String::clone);
            table.row([
                piles.to_string(),
                cloud.len().to_string(),
                (55 * piles).to_string(),
                instances.to_string(),
                once,
                four,
            ]);
        }
    }
    Ok(format!(
        "Weights: {}. Times of this machine, now.\n\n{}",
        weights_line(&model)?,
        table.finish()
    ))
}
