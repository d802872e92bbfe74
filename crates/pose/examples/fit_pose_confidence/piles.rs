//! Piles as surveys meet them: shapes, how they lie, what they lie on, who measures them.

use geom::SeedTree;
use scene::{BlockSpec, Catalog, CatalogSpec, Shape};
use synth::{Recipe, Site, SynthScene};

/// A way of measuring a pile: name, density and the recipe's lines.
const SENSORS: [(&str, u32, &str); 10] = [
    ("above-1cm", 250, "[sensor]\nkind = \"gaussian\"\nnoise_sd_m = 0.01\nmeasured_as = \"uav\""),
    (
        "oblique-1cm",
        600,
        "[sensor]\nkind = \"gaussian\"\nnoise_sd_m = 0.01\nmeasured_as = \"uav\"\nrings = [{ elevation_deg = 45, cameras = 4 }, { elevation_deg = 90, cameras = 1 }]",
    ),
    ("above-3cm", 250, "[sensor]\nkind = \"gaussian\"\nnoise_sd_m = 0.03\nmeasured_as = \"mbes\""),
    ("uav", 350, "[sensor]\nkind = \"uav\""),
    ("mbes", 250, "[sensor]\nkind = \"mbes\""),
    ("sparse", 60, "[sensor]\nkind = \"gaussian\"\nnoise_sd_m = 0.02\nmeasured_as = \"mbes\""),
    ("scanner", 400, "[sensor]\nkind = \"scanner\""),
    (
        "oblique-4cm",
        600,
        "[sensor]\nkind = \"gaussian\"\nnoise_sd_m = 0.04\nmeasured_as = \"uav\"\nrings = [{ elevation_deg = 40, cameras = 6 }]",
    ),
    ("scanner-not-told", 400, "[sensor]\nkind = \"scanner\"\ntold = false"),
    (
        "holes",
        400,
        "[sensor]\nkind = \"gaussian\"\nnoise_sd_m = 0.01\nmeasured_as = \"uav\"\n[delivery]\nholes = 8\ncrop = 0.85\nuneven = 4.0",
    ),
];

/// What lies under and around a pile.
const GROUNDS: [(&str, &str); 6] = [
    ("no-ground", "[bed]\nmeasured = false"),
    ("rubble", "[bed]\nmeasured = true"),
    ("floor", "[bed]\nstone_blocks = 0.0"),
    ("slope", "[bed]\nslope_m = 1.5"),
    ("sand", "[around]\nsand_blocks = 0.4"),
    ("wall", "[around]\nwall_blocks = 1.6"),
];

/// How blocks lie: count, side of the pen in blocks, a line of `[drop]`.
const LAYINGS: [(&str, [u32; 2], f32, &str); 4] = [
    ("heap", [10, 14], 3.4, ""),
    ("tower", [20, 24], 2.8, ""),
    ("rows-3cm", [16, 25], 5.4, "rows_joint_m = 0.03"),
    ("rows-6cm", [16, 25], 5.4, "rows_joint_m = 0.06"),
];

/// Ways of laying that dropped blocks take; rows are for blocks that can be set side by side.
const DROPPED: usize = 2;

pub fn shapes() -> Vec<(&'static str, Catalog)> {
    [
        ("tetrapod", Shape::Tetrapod { size: 2.0 }),
        ("dolos", Shape::Dolos { size: 2.2 }),
        ("cube", Shape::Cube { size: 1.5 }),
        ("antifer", Shape::Antifer { size: 1.6 }),
        ("six-leg", Shape::SixLegLike { size: 2.0 }),
    ]
    .map(|(name, shape)| (name, catalog(shape)))
    .into()
}

/// Whether blocks of a shape are set in rows too.
pub fn is_set_in_rows(shape: &str) -> bool {
    matches!(shape, "cube" | "antifer")
}

fn catalog(shape: Shape) -> Catalog {
    let spec = BlockSpec {
        name: "block".into(),
        shape: Some(shape),
        mesh: None,
        unit: None,
        density_kg_m3: 2300.0,
    };
    blocks::catalog(&CatalogSpec { block: vec![spec] }, &|_| Err("no mesh files here".into()))
        .expect("built-in shapes")
}

/// The `n`-th way of laying and measuring blocks of a shape: its name and recipe.
pub fn setting(shape: &str, n: usize) -> (String, Recipe) {
    let (sensor, density, measured) = SENSORS[n % SENSORS.len()];
    let (ground, under) = GROUNDS[n % GROUNDS.len()];
    let layings = if is_set_in_rows(shape) { LAYINGS.len() } else { DROPPED };
    let (laying, count, side, drop) = LAYINGS[(n + n / SENSORS.len()) % layings];
    let text = format!(
        "name = \"fit\"\ncount = [{}, {}]\ndensity_per_m2 = {density}\nsite = {{ kind = \"pen\", side_blocks = {side} }}\n\
         [drop]\n{drop}\n{under}\n{measured}",
        count[0], count[1]
    );
    let recipe = Recipe::parse(&text).unwrap_or_else(|e| panic!("{e} in\n{text}"));
    (format!("{shape}/{sensor}/{ground}/{laying}"), recipe)
}

/// Blocks are never quite what the catalogue says; sizes over the catalogue's.
const BUILT: [f32; 4] = [0.985, 1.012, 0.992, 1.018];
/// Which part of both sides a cut leaves.
const CUTS: [f32; 3] = [0.45, 0.6, 0.75];

/// The `n`-th piece cut out of a survey by drone of blocks that are not quite their model: name, recipe, and the blocks' size
/// over the catalogue's.
pub fn cut(shape: &str, n: usize) -> (String, Recipe, f32) {
    let (size, crop, (ground, under)) =
        (BUILT[n % BUILT.len()], CUTS[n % CUTS.len()], GROUNDS[n % GROUNDS.len()]);
    let density = [300, 1500, 700][(n + n / CUTS.len()) % 3];
    let text = format!(
        "name = \"fit\"\ncount = [12, 16]\ndensity_per_m2 = {density}\nsite = {{ kind = \"pen\", side_blocks = 3.2 }}\n\
         {under}\n[sensor]\nkind = \"uav\"\n[delivery]\ncrop = {crop}"
    );
    let recipe = Recipe::parse(&text).unwrap_or_else(|e| panic!("{e} in\n{text}"));
    (format!("{shape}/cut-{crop}/built-{size}/{ground}"), recipe, size)
}

/// Recipes of parts in bins.
const BINS: [(&str, &str); 5] = [
    ("bracket", include_str!("../../../../recipes/bin-bracket.toml")),
    ("eye-bolt", include_str!("../../../../recipes/bin-eye-bolt.toml")),
    ("gear-shaft", include_str!("../../../../recipes/bin-gear-shaft.toml")),
    ("holed-plate", include_str!("../../../../recipes/bin-holed-plate.toml")),
    ("hook-plate", include_str!("../../../../recipes/bin-hook-plate.toml")),
];

/// Parts in a bin as a depth camera sees them, the bin itself taken away; `n` is how: whole or cropped.
pub fn bins(n: usize) -> Vec<(&'static str, Catalog, Recipe)> {
    let bin = |(name, text): (&'static str, &str)| {
        let mut recipe = Recipe::parse(text).unwrap_or_else(|e| panic!("{name}: {e}"));
        recipe.bin.measured = false;
        recipe.count = [12, 18];
        recipe.site = Site::Pen { side_blocks: 2.0 };
        recipe.delivery.crop = if n.is_multiple_of(2) { 1.0 } else { 0.6 };
        let spec = recipe.catalog.clone().expect("a recipe of parts names its part");
        let parts = blocks::catalog(&spec, &|_| Err("no mesh files here".into()));
        (name, parts.expect("built-in shapes"), recipe)
    };
    BINS.map(bin).into()
}

pub fn pile(catalog: &Catalog, recipe: &Recipe, seed: SeedTree) -> Option<SynthScene> {
    synth::scene(recipe, catalog, seed).map_err(|e| eprintln!("{e}")).ok()
}
