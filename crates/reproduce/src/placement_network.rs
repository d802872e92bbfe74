//! Table 4.1: what a network makes of a window. The thesis' regression of the one best drop by extractor, both ways to write a
//! rotation, and the network with many modes; same data, same steps.

use crate::bin_kept::training_folder;
use crate::{Bench, Experiment, ReproduceError, Table};
use geom::SeedTree;
use placement::{
    ImageTransformerConfig, ResNetDepth, RotationCode, SampleConfig, TrainConfig, train,
};
use scene::{BlockModel, Catalog, Shape};
use synth::Recipe;
use teach::PlacementScenes;

pub const EXPERIMENT: Experiment = Experiment {
    name: "placement-network",
    about: "errors of placement networks by extractor, code and modes (Table 4.1)",
    body,
};

pub(crate) const RECIPE: &str = include_str!("../../../recipes/placement.toml");

/// A row of the table.
struct Variant {
    name: &'static str,
    /// Layers of the residual network; `None`: an image Transformer.
    depth: Option<ResNetDepth>,
    rotation: RotationCode,
    /// Answers, and drops that teach.
    modes: usize,
    /// The thesis' row of the same extractor.
    thesis: &'static str,
}

const fn variant(
    name: &'static str,
    depth: Option<ResNetDepth>,
    rotation: RotationCode,
    modes: usize,
    thesis: &'static str,
) -> Variant {
    Variant { name, depth, rotation, modes, thesis }
}

/// By extractor as in the thesis, then by what it is asked.
const VARIANTS: [Variant; 7] = [
    variant(
        "image Transformer, Euler, one answer (thesis)",
        None,
        RotationCode::Euler,
        1,
        "42.5°, 0.42 m",
    ),
    variant("ResNet-18, Euler, one answer (thesis)", L18, RotationCode::Euler, 1, "36.2°, 0.36 m"),
    variant("ResNet-34, Euler, one answer (thesis)", L34, RotationCode::Euler, 1, "28.5°, 0.37 m"),
    variant("ResNet-50, Euler, one answer (thesis)", L50, RotationCode::Euler, 1, "25.2°, 0.31 m"),
    variant("ResNet-18, six numbers, one answer", L18, RotationCode::SixNumbers, 1, "–"),
    variant("ResNet-18, Euler, 16 modes", L18, RotationCode::Euler, 16, "–"),
    variant("ResNet-18, six numbers, 16 modes (shipped)", L18, RotationCode::SixNumbers, 16, "–"),
];

const L18: Option<ResNetDepth> = Some(ResNetDepth::Layers18);
const L34: Option<ResNetDepth> = Some(ResNetDepth::Layers34);
const L50: Option<ResNetDepth> = Some(ResNetDepth::Layers50);

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
    let settings = format!(
        "seed {} scenes {} steps {} {}",
        bench.settings.seed,
        bench.settings.scenes,
        bench.settings.steps,
        env!("CARGO_PKG_VERSION")
    );
    let folder = bench.folder.join(training_folder("placement-network", &settings));
    let scenes = PlacementScenes { recipe: &recipe, catalog: &catalog, block };
    let common = TrainConfig {
        samples: amount,
        steps: bench.settings.steps,
        warmup: (bench.settings.steps / 10).clamp(1, 100),
        name: "Table 4.1".into(),
        ..TrainConfig::default()
    };
    let [samples, held_out] =
        scenes.samples(&common, &folder.join("data"), seed, bench.observer)?;
    let mut table = Table::new(&[
        "network",
        "rotation error",
        "displacement, m",
        "nearest of the modes: rotation",
        "displacement, m",
        "the thesis' extractor",
    ]);
    let mut windows = 0;
    for v in VARIANTS {
        let mut config = TrainConfig { targets: v.modes, ..common.clone() };
        match v.depth {
            Some(depth) => config.network.backbone.depth = depth,
            None => config.network.transformer = Some(ImageTransformerConfig::default()),
        }
        config.network.rotation = v.rotation;
        config.network.modes = v.modes;
        let words: Vec<&str> =
            v.name.split(|c: char| !c.is_ascii_alphanumeric()).filter(|w| !w.is_empty()).collect();
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
            v.name.to_string(),
            format!("{:.1}°", e.rotation_rad.to_degrees()),
            format!("{:.2}", e.displacement * block.d_box_m),
            format!("{:.1}°", e.nearest_rotation_rad.to_degrees()),
            format!("{:.2}", e.nearest_displacement * block.d_box_m),
            v.thesis.to_string(),
        ]);
    }
    Ok(format!(
        "{} windows to learn from, {windows} held out, {} random drops each; residual networks of width {}, {} steps. Errors of the \
         surest answer against the best drop, modulo symmetry.\n\n{}\nThe thesis' shallowest has 16 layers, ours 18; its images have 512 pixels a side, ours {}.\n",
        samples.len(),
        amount.drops,
        common.network.backbone.width,
        bench.settings.steps,
        table.finish(),
        common.network.view.pixels
    ))
}
