//! Makes the scenes the confidence is fitted to, and fits it.
//!
//! `cargo run --release -p pose --example fit_pose_confidence -- collect SEED REPEATS FEATURES.csv`
//! `cargo run --release -p pose --example fit_pose_confidence -- fit FEATURES.csv CHECKED.csv crates/pose/fitted/confidence.txt`
//!
//! `cargo xtask fit pose-confidence` runs both.
//!
//! `collect` piles blocks of several shapes on a measured and an unmeasured bed, lets several sensors measure them, and
//! recognises them with their own catalogue and with wrong ones (other sizes, other shapes); and it makes land, stones,
//! steps and plants that hold no block at all. Every accepted block becomes a row, right or wrong. `fit` fits the first
//! file and tells on the standard error how well the second, which must be of another seed, is predicted.

use geom::{PointCloud, SeedTree, Silent, Vec3};
use pose::{EvidenceConfig, NAMES, PoseConfig};
use rand::RngExt;
use scene::{
    BlockSpec, Catalog, CatalogSpec, PoseLimits, PosedModel, Segmentation, SensorKind, Shape,
    Survey,
};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::Write;
use synth::{Recipe, SynthScene};

fn main() {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = args.iter().map(String::as_str).collect();
    match words.as_slice() {
        ["collect", seed, repeats, out] => {
            let number = |s: &str| s.parse().expect("SEED and REPEATS are numbers");
            let mut out = File::create(out).expect("FEATURES can be written");
            collect(number(seed), number(repeats), &mut out);
        }
        ["fit", fitted, checked, out] => {
            std::fs::write(out, fit(fitted, checked)).expect("OUT can be written");
        }
        _ => {
            eprintln!(
                "usage: fit_pose_confidence collect SEED REPEATS FEATURES | fit FEATURES CHECKED OUT"
            );
            std::process::exit(2);
        }
    }
}

/// Sensors a pile is measured with: name, recipe lines, points per square metre.
const SENSORS: [(&str, &str, u32); 5] = [
    ("white-1cm", "kind = \"gaussian\"\nnoise_sd_m = 0.01\nmeasured_as = \"uav\"", 250),
    ("white-3cm", "kind = \"gaussian\"\nnoise_sd_m = 0.03\nmeasured_as = \"mbes\"", 250),
    ("sparse", "kind = \"gaussian\"\nnoise_sd_m = 0.02\nmeasured_as = \"mbes\"", 60),
    ("uav", "kind = \"uav\"", 350),
    ("mbes", "kind = \"mbes\"", 250),
];

fn shapes() -> Vec<(&'static str, Catalog)> {
    [
        ("tetrapod", Shape::Tetrapod { size: 2.0 }),
        ("dolos", Shape::Dolos { size: 2.2 }),
        ("cube", Shape::Cube { size: 1.5 }),
        ("antifer", Shape::Antifer { size: 1.6 }),
    ]
    .map(|(name, shape)| (name, catalog(shape)))
    .into()
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

fn pile(catalog: &Catalog, sensor: usize, bed: bool, seed: SeedTree) -> Option<SynthScene> {
    let (_, lines, density) = SENSORS[sensor];
    let recipe = format!(
        "name = \"fit\"\ncount = [10, 14]\ndensity_per_m2 = {density}\nsite = {{ kind = \"pen\", side_blocks = 3.4 }}\n\
         [bed]\nmeasured = {bed}\n[sensor]\n{lines}"
    );
    let recipe = Recipe::parse(&recipe).expect("the recipe above is well formed");
    synth::scene(&recipe, catalog, seed).map_err(|e| eprintln!("{e}")).ok()
}

/// Rows of every condition.
fn collect(seed: u64, repeats: u64, out: &mut File) {
    let names = NAMES.join(" ");
    writeln!(out, "condition,right,sd-shift,sd-turn,{names}").expect("FEATURES can be written");
    for repeat in 0..repeats {
        let seed = SeedTree::new(seed).child("confidence", repeat);
        for step in 0..SENSORS_A_SHAPE {
            for (s, (name, own)) in shapes().iter().enumerate().rev() {
                let sensor = (s + 2 * step + repeat as usize) % SENSORS.len();
                let bed = (s + step + repeat as usize).is_multiple_of(2);
                let seed = seed.child(name, sensor as u64);
                let Some(made) = pile(own, sensor, bed, seed) else { continue };
                let condition = format!("{name}/{}", SENSORS[sensor].0);
                rows(out, &condition, &made.survey, own, Some(&made));
                wrong_catalogues(out, &condition, &made, own, s, seed);
            }
        }
        for (kind, name) in ["land", "stones", "steps", "plants"].into_iter().enumerate() {
            // Two of the four shapes; the others in the next repeat.
            let every = shapes().into_iter().enumerate();
            let own = every.filter(|(s, _)| (s + kind + repeat as usize).is_multiple_of(2));
            for (_, (shape, own)) in own {
                let survey = nature(kind, &own, seed.child(name, 0).child(shape, 0));
                rows(out, &format!("{name}/{shape}"), &survey, &own, None);
            }
        }
    }
}

/// Sensors each shape is measured with in one repeat; others in the next.
const SENSORS_A_SHAPE: usize = 3;

/// The same pile recognised with what does not lie there: one wrong size and one wrong shape.
fn wrong_catalogues(
    out: &mut File,
    condition: &str,
    made: &SynthScene,
    own: &Catalog,
    s: usize,
    seed: SeedTree,
) {
    let mut rng = seed.child("wrong", 0).rng();
    let sizes = [0.82, 0.9, 0.94, 0.96, 1.04, 1.06, 1.1, 1.2];
    let factor = sizes[rng.random_range(0..sizes.len())];
    let (_, model) = own.iter().next().expect("one block");
    let wrong = Catalog::new(vec![model.scaled(factor)]);
    rows(out, &format!("size-{factor}/{condition}"), &made.survey, &wrong, None);
    let all = shapes();
    let (name, other) = &all[(s + rng.random_range(1..all.len())) % all.len()];
    rows(out, &format!("as-{name}/{condition}"), &made.survey, other, None);
}

/// Recognises and prints a row for every accepted block; without truth all are wrong.
fn rows(
    out: &mut File,
    condition: &str,
    survey: &Survey,
    catalog: &Catalog,
    truth: Option<&SynthScene>,
) {
    let evidence = EvidenceConfig { min_confidence: 0.0, max_shared: 0.2, ..Default::default() };
    let config = PoseConfig { evidence, ..Default::default() };
    let n = survey.cloud.len();
    let nothing =
        Segmentation { instance: vec![0; n], confidence: vec![0.0; n], ..Default::default() };
    let seed = SeedTree::new(0);
    let found = pose::recognise_with_features(survey, &nothing, catalog, &config, seed, &Silent);
    let found = match found {
        Ok(found) => found,
        Err(e) => return eprintln!("{condition}: {e}"),
    };
    for (block, features) in found {
        let Some(features) = features else { continue };
        let Some(fit) = block.fit() else { continue };
        let model = catalog.get(fit.model);
        let error = |s: &SynthScene| {
            s.scene
                .blocks
                .iter()
                .map(|b| {
                    let truth = PosedModel::new(catalog.get(b.model), b.site_from_block);
                    let e = fit.posed(catalog).error(&truth);
                    (e.displacement_m, e.rotation_rad)
                })
                .min_by(|a, b| a.0.total_cmp(&b.0))
                .expect("a pile has blocks")
        };
        let error = truth.map(error);
        let limits = PoseLimits::right(model);
        let right = error.is_some_and(|(shift_m, turn_rad)| {
            shift_m <= limits.displacement_m && turn_rad <= limits.rotation_rad
        });
        // Errors over their standard deviations, for judging the covariance.
        let sd = |k: usize| {
            let variance =
                |c: &scene::Covariance| (0..3).map(|i| c.row_major()[7 * (k + i)]).sum::<f32>();
            fit.covariance.as_ref().map_or(f32::INFINITY, |c| variance(c).sqrt())
        };
        let (shift, turn) = error.map_or((0.0, 0.0), |e| (e.0 / sd(0), e.1 / sd(3)));
        let terms: Vec<String> = features.terms().iter().map(|t| format!("{t:.4}")).collect();
        let (right, terms) = (u8::from(right), terms.join(" "));
        writeln!(out, "{condition},{right},{shift:.2},{turn:.2},{terms}")
            .expect("FEATURES can be written");
    }
}

/// A survey from above of 5 × 5 block lengths without a block: 0 land, 1 stones, 2 steps, 3 plants.
fn nature(kind: usize, catalog: &Catalog, seed: SeedTree) -> Survey {
    let (_, model) = catalog.iter().next().expect("one block");
    let d = model.d_box_m;
    let mut rng = seed.rng();
    let mut r = |low: f32, high: f32| rng.random_range(low..high);
    let side = 5.0 * d;
    let waves: Vec<[f32; 4]> = (0..24)
        .map(|k| {
            let length = d * r(0.5, 1.0) * 1.25_f32.powi(k % 12);
            let turn = r(0.0, std::f32::consts::TAU);
            let k = std::f32::consts::TAU / length;
            [k * turn.cos(), k * turn.sin(), r(0.0, 6.3), 0.035 * length * r(0.2, 1.0)]
        })
        .collect();
    let land = |x: f32, y: f32| {
        waves.iter().map(|w| w[3] * (w[0] * x + w[1] * y + w[2]).sin()).sum::<f32>()
    };
    // Lumps: centre, half axes, turn about z.
    let lumps: Vec<(Vec3, Vec3, f32)> = (0..if kind == 1 { 45 } else { 20 })
        .map(|_| {
            let (x, y, size) = (r(0.0, side), r(0.0, side), d * r(0.15, 0.6));
            let axes = size * Vec3::new(r(0.6, 1.2), r(0.6, 1.2), r(0.5, 1.0));
            let up = if kind == 3 { r(0.3, 2.0) * d } else { 0.3 * axes.z };
            (Vec3::new(x, y, land(x, y) + up), axes, r(0.0, 3.1))
        })
        .collect();
    let boxes: Vec<[f32; 5]> = (0..9)
        .map(|_| [r(0.0, side), r(0.0, side), d * r(0.3, 2.0), d * r(0.3, 2.0), d * r(0.2, 1.2)])
        .collect();
    let count = (700.0 * side * side / (d * d)) as usize;
    let mut points = Vec::with_capacity(count);
    for _ in 0..count {
        let (x, y) = (r(0.0, side), r(0.0, side));
        let mut z = land(x, y);
        match kind {
            1 => {
                for (c, axes, turn) in &lumps {
                    let (u, v) = (x - c.x, y - c.y);
                    let (u, v) = (u * turn.cos() + v * turn.sin(), v * turn.cos() - u * turn.sin());
                    let inside = 1.0 - (u / axes.x).powi(2) - (v / axes.y).powi(2);
                    if inside > 0.0 {
                        // Squared off: stones have faces.
                        z = z.max(c.z + axes.z * inside.powf(0.35));
                    }
                }
            }
            2 => {
                z *= 0.2;
                for b in &boxes {
                    if (x - b[0]).abs() < b[2] && (y - b[1]).abs() < b[3] {
                        z = z.max(b[4]);
                    }
                }
            }
            3 if r(0.0, 1.0) < 0.6 => {
                let (c, axes, _) = lumps[(r(0.0, 1.0) * lumps.len() as f32) as usize % lumps.len()];
                let dir = Vec3::new(r(-1.0, 1.0), r(-1.0, 1.0), r(-1.0, 1.0)).normalize_or(Vec3::Z);
                points.push(c + dir * axes * 1.6 * r(0.3, 1.0).sqrt());
                continue;
            }
            _ => {}
        }
        points.push(Vec3::new(x, y, z + 0.01 * (r(-1.0, 1.0) + r(-1.0, 1.0))));
    }
    Survey {
        cloud: PointCloud::from_positions(points),
        sensor: SensorKind::Uav,
        ..Default::default()
    }
}

/// A row of a features file.
struct Row {
    condition: String,
    right: bool,
    x: Vec<f64>,
}

fn read(file: &str) -> Vec<Row> {
    let text = std::fs::read_to_string(file).unwrap_or_else(|e| panic!("{file}: {e}"));
    let row = |line: &str| {
        let part: Vec<&str> = line.split(',').collect();
        let x: Option<Vec<f64>> = part.get(4)?.split(' ').map(|v| v.parse().ok()).collect();
        let x = x.filter(|x| x.len() == NAMES.len())?;
        Some(Row { condition: part[0].to_string(), right: part[1] == "1", x })
    };
    text.lines().skip(1).filter_map(row).collect()
}

/// A condition counts for as many blocks at most, so that no rich one drowns the others.
const MOST_OF_A_CONDITION: f64 = 25.0;
/// Sizes that the common size decides.
const NEARLY: [&str; 4] = ["size-0.94/", "size-0.96/", "size-1.04/", "size-1.06/"];
/// Pull of every weight towards 0.
const RIDGE: f64 = 0.2;
/// Features that can only speak for a block (+) or against it (−); their weights keep that sign.
const SIGNS: [f64; 20] = [
    0.0, 1.0, 1.0, 1.0, 1.0, -1.0, -1.0, -1.0, -1.0, -1.0, -1.0, 1.0, -1.0, -1.0, 1.0, -1.0, -1.0,
    1.0, 1.0, -1.0,
];

/// The fitted file; how good it is goes to the standard error.
fn fit(fitted: &str, checked: &str) -> String {
    let mut rows = read(fitted);
    // Blocks a few per cent too large or small are right in all but their size, which all of them together tell.
    rows.retain(|row| !NEARLY.iter().any(|size| row.condition.starts_with(size)));
    let mut of_condition: BTreeMap<&str, f64> = BTreeMap::new();
    for row in &rows {
        *of_condition.entry(&row.condition).or_default() += 1.0;
    }
    let count = |row: &Row| (MOST_OF_A_CONDITION / of_condition[row.condition.as_str()]).min(1.0);
    let counts: Vec<f64> = rows.iter().map(count).collect();
    let w = weights(&rows, &counts);
    let right = rows.iter().filter(|r| r.right).count();
    let mut file = format!(
        "# Weights of the pose stage's confidence, made by `cargo xtask fit pose-confidence`: a feature and its weight a line.\n\
         # Fitted to {} blocks of {} conditions, {right} of them right ({}).\n",
        rows.len(),
        of_condition.len(),
        name(fitted)
    );
    for (name, w) in NAMES.iter().zip(&w) {
        file += &format!("{name} {w:.3}\n");
    }
    for (title, rows) in [("fitted to", &rows), ("checked on", &read(checked))] {
        eprintln!("{title} {} blocks", rows.len());
        for (low, high) in [(0.0, 0.5), (0.5, 0.7), (0.7, 0.9), (0.9, 0.99), (0.99, 1.01)] {
            let inside: Vec<&Row> =
                rows.iter().filter(|r| (low..high).contains(&probability(&w, &r.x))).collect();
            let right = inside.iter().filter(|r| r.right).count();
            eprintln!("{low:.2} to {:.2}: {right} of {} right", f64::min(high, 1.0), inside.len());
        }
        let mut wrong: BTreeMap<&str, (u32, u32)> = BTreeMap::new();
        for row in rows.iter() {
            let p = probability(&w, &row.x);
            let kind = wrong.entry(row.condition.split('/').next().unwrap_or("")).or_default();
            kind.0 += u32::from(!row.right && p >= 0.7);
            kind.1 += u32::from(row.right && p < 0.7);
        }
        eprintln!("stated wrong, right and not stated: {wrong:?}");
    }
    file
}

fn name(file: &str) -> &str {
    std::path::Path::new(file).file_name().and_then(|n| n.to_str()).unwrap_or(file)
}

fn probability(w: &[f64], x: &[f64]) -> f64 {
    let z: f64 = w.iter().zip(x).map(|(w, x)| w * x).sum();
    1.0 / (1.0 + (-z).exp())
}

/// Rounds over all weights.
const ROUNDS: usize = 3000;

/// Logistic regression, one weight after the other by Newton's step, each kept on the side its feature speaks for.
fn weights(rows: &[Row], counts: &[f64]) -> Vec<f64> {
    let n = NAMES.len();
    // About their means features hardly move the constant.
    let total: f64 = counts.iter().sum();
    let mean = |i: usize| rows.iter().zip(counts).map(|(r, c)| c * r.x[i]).sum::<f64>() / total;
    let means: Vec<f64> = (0..n).map(|i| if i == 0 { 0.0 } else { mean(i) }).collect();
    let mut w = vec![0.0; n];
    let mut z = vec![0.0; rows.len()];
    for _ in 0..ROUNDS {
        for i in 0..n {
            let ridge = if i == 0 { 1e-3 } else { RIDGE };
            let (mut slope, mut curve) = (-ridge * w[i], ridge);
            for ((row, c), z) in rows.iter().zip(counts).zip(&z) {
                let p = 1.0 / (1.0 + f64::exp(-z));
                let x = row.x[i] - means[i];
                slope += c * (f64::from(u8::from(row.right)) - p) * x;
                curve += c * p * (1.0 - p) * x * x;
            }
            let mut next = w[i] + (slope / curve).clamp(-1.0, 1.0);
            if next * SIGNS[i] < 0.0 {
                next = 0.0;
            }
            for (row, z) in rows.iter().zip(&mut z) {
                *z += (next - w[i]) * (row.x[i] - means[i]);
            }
            w[i] = next;
        }
    }
    w[0] -= w.iter().zip(&means).map(|(w, m)| w * m).sum::<f64>();
    w
}
