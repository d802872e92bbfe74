//! The mixed tetrapod piles the shipped model is trained and judged on.
#![allow(dead_code)]

use geom::SeedTree;
use rand::RngExt;
use scene::{BlockModel, Catalog, SensorKind, Shape};
use segment::tile::LabelledScene;
use synth::sensor::{Gaussian, Mbes, Ring, Uav};
use synth::{Recipe, Sensor, Site, SynthScene};

/// A pile with its survey and the block it is made of.
pub struct Pile {
    pub model: BlockModel,
    pub made: SynthScene,
    pub uav: bool,
}

/// One pile of the mixed recipe: size, number, density, sensor and bed all drawn from the seed.
pub fn pile(seed: SeedTree) -> Result<Pile, String> {
    let mut rng = seed.child("recipe", 0).rng();
    let height_m = 1.5 + 2.0 * rng.random::<f32>();
    let model = blocks::shape_model("tetrapod", Shape::Tetrapod { size: height_m }, 2300.0)
        .map_err(|e| e.to_string())?;
    let catalog = Catalog::new(vec![model.clone()]);
    let recipe = recipe(height_m, &mut rng)?;
    let made =
        synth::scene(&recipe, &catalog, seed.child("scene", 0)).map_err(|e| e.to_string())?;
    Ok(Pile { model, uav: recipe.sensor.kind() == SensorKind::Uav, made })
}

/// What training wants of a pile.
pub fn labelled(seed: SeedTree) -> Result<LabelledScene, String> {
    let Pile { model, made, .. } = pile(seed)?;
    let centre_m = made.scene.blocks.iter().map(|b| b.site_from_block * model.centre).collect();
    Ok(LabelledScene {
        position_m: made.survey.cloud.position_m,
        instance: made.instance,
        centre_m,
        unit_m: model.d_max_m,
    })
}

pub fn recipe(height_m: f32, rng: &mut impl rand::Rng) -> Result<Recipe, String> {
    let mut between = |a: f32, b: f32| a + (b - a) * rng.random::<f32>();
    let uav = between(0.0, 1.0) < 0.5;
    // Points per square metre that give a block of 2 m the densities of METHOD §1.1, scaled with the block.
    let scale = (2.0 / height_m).powi(2);
    let density = if uav { between(300.0, 900.0) } else { between(150.0, 800.0) } * scale;
    let mut recipe = Recipe::parse(&format!(
        "name = \"t\"\ndensity_per_m2 = {density}\n[sensor]\nkind = \"gaussian\"\n"
    ))
    .map_err(|e| e.to_string())?;
    let most = between(18.0, 60.0) as u32;
    recipe.count = [most, most];
    recipe.site = Site::Pen { side_blocks: between(4.0, 6.0) };
    // Half of the beds smooth; stones far below a block's size only cost time in the physics.
    recipe.bed.stone_blocks = if between(0.0, 1.0) < 0.5 { 0.0 } else { between(0.2, 0.5) };
    recipe.bed.slope_m = if between(0.0, 1.0) < 0.4 { between(1.5, 8.0) } else { 0.0 };
    recipe.bed.falls_towards_deg = between(0.0, 360.0);
    recipe.sensor = match (between(0.0, 1.0) < 0.35, uav) {
        (true, _) => white_noise(uav, &mut between),
        (false, true) => Sensor::Uav(Uav {
            altitude_m: between(20.0, 50.0),
            depth_noise_sd_m: between(0.008, 0.03),
            edge_radius_m: between(0.02, 0.06),
            ..Default::default()
        }),
        (false, false) => Sensor::Mbes(Mbes {
            passes: between(3.0, 9.0) as u32,
            clearance_m: between(3.0, 8.0),
            range_noise_sd_m: between(0.006, 0.015),
            heave_bias_sd_m: between(0.01, 0.04),
            position_bias_sd_m: between(0.01, 0.05),
            ..Default::default()
        }),
    };
    Ok(recipe)
}

/// The thesis' sensor model.
fn white_noise(uav: bool, between: &mut impl FnMut(f32, f32) -> f32) -> Sensor {
    let above = Ring { elevation_deg: 90.0, cameras: 1 };
    let oblique = Ring { elevation_deg: between(40.0, 70.0), cameras: if uav { 4 } else { 2 } };
    Sensor::Gaussian(Gaussian {
        noise_sd_m: if uav { between(0.005, 0.025) } else { between(0.015, 0.045) },
        altitude_m: between(10.0, 50.0),
        rings: if between(0.0, 1.0) < 0.6 { vec![above, oblique] } else { vec![above] },
        measured_as: if uav { SensorKind::Uav } else { SensorKind::Mbes },
    })
}
