//! Piles of two types that are easily taken for each other, and how much a nat of the type's margin says.

use crate::logistic::name;
use crate::piles;
use geom::SeedTree;
use pose::EvidenceConfig;
use scene::{BlockSpec, Catalog, CatalogSpec, PosedModel, Shape};
use std::collections::BTreeMap;
use synth::{Recipe, SynthScene};

/// Types that share a pile.
fn pairs() -> Vec<(&'static str, [Shape; 2])> {
    let cube = |size| Shape::Cube { size };
    let tetrapod = |size| Shape::Tetrapod { size };
    vec![
        ("tetrapods-6%", [tetrapod(2.0), tetrapod(2.12)]),
        ("tetrapods-12%", [tetrapod(2.0), tetrapod(2.24)]),
        ("cubes-6%", [cube(1.5), cube(1.59)]),
        ("cubes-12%", [cube(1.5), cube(1.68)]),
        ("dolosse-8%", [Shape::Dolos { size: 2.2 }, Shape::Dolos { size: 2.376 }]),
        ("cube-antifer", [cube(1.5), Shape::Antifer { size: 1.55 }]),
        ("tetrapod-six-leg", [tetrapod(2.0), Shape::SixLegLike { size: 2.0 }]),
        ("cube-tetrapod", [cube(1.5), tetrapod(2.0)]),
    ]
}

/// Ways of measuring: name and the recipe's lines.
const SENSORS: [(&str, &str); 4] = [
    (
        "above-1cm",
        "density_per_m2 = 250\n[sensor]\nkind = \"gaussian\"\nnoise_sd_m = 0.01\nmeasured_as = \"uav\"",
    ),
    (
        "above-3cm",
        "density_per_m2 = 150\n[sensor]\nkind = \"gaussian\"\nnoise_sd_m = 0.03\nmeasured_as = \"mbes\"",
    ),
    ("uav", "density_per_m2 = 350\n[sensor]\nkind = \"uav\""),
    ("mbes", "density_per_m2 = 250\n[sensor]\nkind = \"mbes\""),
];

/// Adds a row for every block in its place that `out` does not hold: whether its type is right, and the margin.
pub fn collect(seed: u64, out: &mut crate::Kept) {
    for (pair, shapes) in pairs() {
        let catalog = catalog(shapes);
        for (sensor, lines) in SENSORS {
            let condition = format!("{pair}/{sensor}");
            if out.has(&condition) {
                continue;
            }
            let text = format!(
                "name = \"types\"\ncount = [20, 24]\nsite = {{ kind = \"pen\", side_blocks = 3.4 }}\n{lines}"
            );
            let recipe = Recipe::parse(&text).unwrap_or_else(|e| panic!("{e} in\n{text}"));
            let seed = SeedTree::new(seed).child("types", 0).child(&condition, 0);
            let made = piles::pile(&catalog, &recipe, seed);
            out.add(&condition, &made.map_or(String::new(), |m| rows(&condition, &m, &catalog)));
        }
    }
}

fn catalog(shapes: [Shape; 2]) -> Catalog {
    let block = shapes.into_iter().enumerate().map(|(n, shape)| BlockSpec {
        name: format!("type-{n}"),
        shape: Some(shape),
        mesh: None,
        unit: None,
        density_kg_m3: 2300.0,
    });
    blocks::catalog(&CatalogSpec { block: block.collect() }, &|_| Err("no mesh files here".into()))
        .expect("built-in shapes")
}

fn rows(condition: &str, made: &SynthScene, catalog: &Catalog) -> String {
    let evidence = EvidenceConfig { min_confidence: 0.0, ..Default::default() };
    let Some(found) = crate::recognised(condition, &made.survey, catalog, evidence) else {
        return String::new();
    };
    let mut out = String::new();
    for (block, features) in found.blocks {
        let Some(margin) = features.map(|f| f.type_margin).filter(|m| m.is_finite()) else {
            continue;
        };
        let Some(fit) = block.fit() else { continue };
        // In its place whichever type it was taken for: two types that are alike have the same axes.
        let there = made.scene.blocks.iter().find(|b| {
            let truth = catalog.get(b.model);
            let as_true = PosedModel::new(truth, fit.site_from_block);
            scene::is_right(&as_true, &PosedModel::new(truth, b.site_from_block))
        });
        if let Some(truth) = there {
            let right = u8::from(truth.model == fit.model);
            out += &format!("{condition},{right},{margin:.3}\n");
        }
    }
    out
}

/// A pair's rows under one sensor count for as many blocks at most.
const MOST_OF_A_CONDITION: f64 = 12.0;
/// Pull of both weights towards 0.
const RIDGE: f64 = 1.0;
/// Margins are scaled by this for the fit, so that one pull fits both weights.
const SCALE: f64 = 20.0;
/// Newton's steps.
const STEPS: usize = 200;

struct Row {
    condition: String,
    right: bool,
    margin: f64,
}

fn read(file: &str) -> Vec<Row> {
    let text = std::fs::read_to_string(file).unwrap_or_else(|e| panic!("{file}: {e}"));
    let row = |line: &str| {
        let part: Vec<&str> = line.split(',').collect();
        let margin = part.get(2)?.parse().ok()?;
        Some(Row { condition: part[0].to_string(), right: part[1] == "1", margin })
    };
    text.lines().skip(1).filter(|l| !l.starts_with('#')).filter_map(row).collect()
}

/// The fitted file; how well each file is predicted from the other goes to the standard error.
pub fn fit(first: &str, second: &str) -> String {
    let [one, two] = [first, second].map(read);
    for (name, rows, others) in [(second, &two, &one), (first, &one, &two)] {
        tell(name, rows, weights(others.iter()));
    }
    let all = || one.iter().chain(&two);
    let right = all().filter(|r| r.right).count();
    let (slope, growth) = weights(all());
    format!(
        "# What a nat of the type's margin says, made by `cargo xtask fit type-confidence`: logit = margin (slope + growth margin).\n\
         # Fitted to {} blocks in their places in piles of two types, {right} of the right type ({} and {}).\n\
         slope {slope:.4}\ngrowth {growth:.5}\n",
        one.len() + two.len(),
        name(first),
        name(second)
    )
}

fn probability((slope, growth): (f64, f64), margin: f64) -> f64 {
    1.0 / (1.0 + (-margin * (slope + growth * margin)).exp())
}

fn tell(file: &str, rows: &[Row], w: (f64, f64)) {
    eprintln!("{}: {} blocks, predicted from the other file", name(file), rows.len());
    for (low, high) in [(0.0, 0.6), (0.6, 0.8), (0.8, 0.95), (0.95, 0.99), (0.99, 1.01)] {
        let inside: Vec<&Row> =
            rows.iter().filter(|r| (low..high).contains(&probability(w, r.margin))).collect();
        let right = inside.iter().filter(|r| r.right).count();
        let said: f64 = inside.iter().map(|r| probability(w, r.margin)).sum();
        eprintln!(
            "{low:.2} to {:.2}: {right} of {} right, {said:.1} said",
            f64::min(high, 1.0),
            inside.len()
        );
    }
}

/// Slope and growth, neither below 0.
fn weights<'a>(rows: impl Iterator<Item = &'a Row> + Clone) -> (f64, f64) {
    let mut of_condition: BTreeMap<&str, f64> = BTreeMap::new();
    for row in rows.clone() {
        *of_condition.entry(&row.condition).or_default() += 1.0;
    }
    let mut w = [0.0, 0.0];
    for step in 0..STEPS {
        let i = step % 2;
        let (mut slope, mut curve) = (-RIDGE * w[i], RIDGE);
        for row in rows.clone() {
            let m = row.margin / SCALE;
            let p = 1.0 / (1.0 + (-m * (w[0] + w[1] * m)).exp());
            let x = if i == 0 { m } else { m * m };
            let count = (MOST_OF_A_CONDITION / of_condition[row.condition.as_str()]).min(1.0);
            slope += count * (f64::from(u8::from(row.right)) - p) * x;
            curve += count * p * (1.0 - p) * x * x;
        }
        w[i] = (w[i] + (slope / curve).clamp(-1.0, 1.0)).max(0.0);
    }
    (w[0] / SCALE, w[1] / SCALE.powi(2))
}
