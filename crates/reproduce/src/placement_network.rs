//! Table 4.1: what a network makes of a window. The thesis' regression of the one best drop, with both ways to write a
//! rotation, and the network with many modes; same data, same steps.

use crate::{Bench, Experiment, ReproduceError, Table};
use geom::SeedTree;
use placement::{RotationCode, SampleConfig, TrainConfig, train};
use scene::{BlockModel, Catalog, Shape};
use synth::Recipe;
use teach::PlacementLessons;

pub const EXPERIMENT: Experiment = Experiment {
    name: "placement-network",
    about: "errors of placement networks: Euler angles, six numbers, many modes (Table 4.1)",
    body,
};

pub(crate) const RECIPE: &str = include_str!("../../../recipes/placement.toml");

/// Name, rotation code, modes, drops that teach.
const VARIANTS: [(&str, RotationCode, usize, usize); 4] = [
    ("Euler angles, one answer (thesis)", RotationCode::Euler, 1, 1),
    ("six numbers, one answer", RotationCode::SixNumbers, 1, 1),
    ("Euler angles, 16 modes", RotationCode::Euler, 16, 16),
    ("six numbers, 16 modes (shipped)", RotationCode::SixNumbers, 16, 16),
];

fn body(bench: &Bench) -> Result<String, ReproduceError> {
    let recipe = Recipe::parse(RECIPE)
        .map_err(|e| ReproduceError::Recipe { set: "placement".into(), message: e.to_string() })?;
    let tetrapod =
        |name: &str, size: f32| blocks::shape_model(name, Shape::Tetrapod { size }, 2300.0);
    let catalog =
        Catalog::new(vec![tetrapod("tetrapod-2.0m", 2.0)?, tetrapod("tetrapod-2.1m", 2.1)?]);
    let block: &BlockModel =
        catalog.get(catalog.find("tetrapod-2.1m").expect("it was just put there"));
    let seed = SeedTree::new(bench.settings.seed);
    let amount = SampleConfig {
        piles: 3 * bench.settings.scenes,
        held_out_piles: bench.settings.scenes,
        ..SampleConfig::default()
    };
    let folder = bench.folder.join("placement-network");
    let lessons = PlacementLessons { recipe: &recipe, catalog: &catalog, block };
    let common = TrainConfig {
        samples: amount,
        steps: bench.settings.steps,
        warmup: (bench.settings.steps / 10).clamp(1, 100),
        name: "Table 4.1".into(),
        ..TrainConfig::default()
    };
    let [samples, held_out] =
        lessons.samples(&common, &folder.join("data"), seed, bench.observer)?;
    let mut table = Table::new(&[
        "network",
        "rotation error",
        "displacement, m",
        "nearest of the modes: rotation",
        "displacement, m",
    ]);
    let mut windows = 0;
    for (name, rotation, modes, targets) in VARIANTS {
        let mut config = TrainConfig { targets, ..common.clone() };
        config.network.rotation = rotation;
        config.network.modes = modes;
        let words: Vec<&str> =
            name.split(|c: char| !c.is_ascii_alphanumeric()).filter(|w| !w.is_empty()).collect();
        let place = folder.join(words.join("-"));
        let trained = train(
            &samples,
            &held_out,
            block,
            &config,
            &place,
            seed.child("placement", 0),
            bench.observer,
        )?;
        if trained.steps < config.steps {
            return Err(ReproduceError::Stopped);
        }
        let e = trained.errors;
        windows = e.windows;
        table.row([
            name.to_string(),
            format!("{:.1}°", e.rotation_rad.to_degrees()),
            format!("{:.2}", e.displacement * block.d_box_m),
            format!("{:.1}°", e.nearest_rotation_rad.to_degrees()),
            format!("{:.2}", e.nearest_displacement * block.d_box_m),
        ]);
    }
    Ok(format!(
        "{} windows to learn from, {windows} held out, {} random drops each; ResNet-18 of width {}, {} steps. Errors of the \
         surest answer against the best drop, modulo symmetry.\n\n{}\nThe thesis, ResNet-50: 25.2°, 0.31 m.\n",
        samples.len(),
        amount.drops,
        common.network.backbone.width,
        bench.settings.steps,
        table.finish()
    ))
}
