//! Precision, recall, errors and time of the pose stage on synthetic scenes (docs/bench/poses.md).
//!
//! `cargo run --release -p pose --example bench_poses -- SHAPES NOISE_M DENSITY SCENES SEGMENTS [KEY=VALUE …]`
//! where SHAPES is e.g. `tetrapod:2.0` or `cube:1.6+cube:1.7`, SEGMENTS is `true` (true segments and centres),
//! `degraded` (what a network gives: two centres a block off by 0.15 d_max, a fifth false, a quarter of the points
//! foreign) or `none` (no segmentation at all), and KEY=VALUE sets a key of the stage's configuration.
//! With DUMP=FILE in the environment the segments, truths and the stage's own result go to a JSON file, which
//! `tools/oracle/peers_poses.py` gives to other programs. VERBOSE=1 explains every mistake. With STRANGERS=1 only the first
//! type is searched for: the others are blocks that stand in the pile and in no catalogue.

use geom::{Event, Observer, SeedTree, Vec3};
use metrics::{PoseCriteria, PoseScore, TrueBlock, score_poses};
use pose::PoseConfig;
use rand::RngExt;
use rand::seq::SliceRandom;
use scene::{BlockSpec, Catalog, CatalogSpec, CentreHypothesis, Segmentation, Shape};
use std::time::Instant;
use synth::{Recipe, SynthScene};

/// Says when each search began and ended.
struct Clock(Instant);

impl Observer for Clock {
    fn event(&self, event: Event) {
        let verbose = std::env::var_os("VERBOSE").is_some();
        if verbose && !matches!(event, Event::Advanced { .. }) {
            println!("  {:.2} s {event:?}", self.0.elapsed().as_secs_f64());
        }
    }
}

fn main() {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let [shapes, noise, density, scenes, segments, settings @ ..] = args.as_slice() else {
        eprintln!(
            "usage: bench_poses SHAPES NOISE_M DENSITY SCENES true|degraded|none [KEY=VALUE …]"
        );
        std::process::exit(2);
    };
    let config = config(settings);
    let (piled, recipe) =
        if shapes.ends_with(".toml") { of_recipe(shapes) } else { plain(shapes, noise, density) };
    let foreign = std::env::var_os("FOREIGN").is_some();
    let known =
        piled.iter().map(|(_, model)| model.clone()).take(if foreign { 1 } else { piled.len() });
    let catalog = Catalog::new(known.collect());
    // On a survey without points the stage only prepares its models.
    let cpu = cpu_s();
    let nothing = Segmentation::default();
    pose::recognise(
        &scene::Survey::default(),
        &nothing,
        &catalog,
        &config,
        SeedTree::new(1),
        &geom::Silent,
    )
    .expect("an empty survey is sound input");
    let prepare_s = cpu_s() - cpu;
    println!("models prepared in {prepare_s:.2} s of processor (included below)");
    let scenes: u64 = scenes.parse().expect("SCENES is a number");
    let mut pooled = PoseScore::default();
    let (mut seconds, mut points, mut blocks, mut hypotheses) = (0.0, 0, 0, 0);
    let (mut open, mut features) = (0, Vec::new());
    for n in 0..scenes {
        let seed = match std::env::var("SEED") {
            Ok(seed) => {
                SeedTree::new(seed.parse().expect("SEED is a number")).child(&recipe.name, n)
            }
            Err(_) => SeedTree::new(20_261).child("held-out", n),
        };
        let made = match synth::scene(&recipe, &piled, seed) {
            Ok(made) => made,
            Err(e) => {
                eprintln!("scene {n}: {e}");
                continue;
            }
        };
        let segmentation = match segments.as_str() {
            "true" => true_segments(&made, &piled),
            "degraded" => degraded(&made, &piled, seed.child("degrade", 0)),
            _ => Segmentation::of_nothing(made.instance.len()),
        };
        let start = Instant::now();
        let cpu = cpu_s();
        let stated = pose::recognise_with_features(
            &made.survey,
            &segmentation,
            &catalog,
            &config,
            SeedTree::new(1),
            &Clock(start),
        )
        .expect("a synthetic scene is sound input");
        let took = start.elapsed().as_secs_f64();
        let took_cpu = cpu_s() - cpu;
        let found: Vec<scene::Recognised> = stated.iter().map(|s| s.0.clone()).collect();
        let truths: Vec<TrueBlock> = made
            .scene
            .blocks
            .iter()
            .zip(&made.occlusion)
            .filter(|(placed, _)| (placed.model.0 as usize) < catalog.len())
            .map(|(&placed, &occlusion)| TrueBlock { placed, occlusion })
            .collect();
        let score = score_poses(&found, &truths, &catalog, &PoseCriteria::default());
        println!(
            "scene {n}: {} points, {} blocks, {} hypotheses: {:?} ignored {} in {took:.2} s, {took_cpu:.2} s of processor",
            made.instance.len(),
            truths.len(),
            segmentation.hypotheses.len(),
            score.counts,
            score.ignored
        );
        if let Some(file) = std::env::var_os("DUMP") {
            dump(&file, &made, &segmentation, &found, &truths, &catalog, took_cpu - prepare_s);
        }
        if std::env::var_os("VERBOSE").is_some() {
            explain(&found, &truths, &catalog);
            types(&stated, &truths, &catalog);
        }
        if let Some(file) = std::env::var_os("SIGNS") {
            signs_of(&file, &recipe.name, segments, &stated, &truths, &catalog);
        }
        seconds += took;
        points += made.instance.len();
        blocks += truths.len();
        hypotheses += segmentation.hypotheses.len();
        open += found.iter().filter(|r| !r.is_stated()).count();
        features.extend(score.confidence.iter().copied());
        pooled = pooled.plus(&score);
    }
    let percent = |v: Option<f64>| v.map_or("-".into(), |v| format!("{:.1} %", 100.0 * v));
    println!(
        "P {}  R {}  E_d {:.1} mm, {:.1} about shift  E_R {:.2}°  type {} ({} open)  ignored {}  not judged {open}",
        percent(pooled.counts.precision()),
        percent(pooled.counts.recall()),
        1e3 * pooled.mean_displacement_m().unwrap_or(f64::NAN),
        1e3 * pooled.mean_about_shift_m().unwrap_or(f64::NAN),
        pooled.mean_rotation_rad().unwrap_or(f64::NAN).to_degrees(),
        percent(pooled.type_accuracy()),
        pooled.types_open,
        pooled.ignored,
    );
    println!(
        "{points} points, {blocks} blocks, {:.2} s a scene, {:.1} ms a hypothesis",
        seconds / scenes as f64,
        1e3 * seconds / hypotheses.max(1) as f64
    );
    for low in [0.0, 0.5, 0.7, 0.8, 0.9, 0.95] {
        let high = [0.5, 0.7, 0.8, 0.9, 0.95, 1.01].into_iter().find(|h| *h > low).unwrap_or(1.01);
        let bin: Vec<bool> =
            features.iter().filter(|(c, _)| (low..high).contains(c)).map(|c| c.1).collect();
        let right = bin.iter().filter(|r| **r).count();
        println!("confidence {low:.2}–{high:.2}: {right} of {} right", bin.len());
    }
}

/// A recipe's own catalogue and sensor.
fn of_recipe(file: &str) -> (Catalog, Recipe) {
    let recipe = Recipe::parse(&std::fs::read_to_string(file).expect("the recipe can be read"))
        .expect("a recipe");
    let spec = recipe.catalog.clone().expect("the recipe names its blocks");
    (
        blocks::catalog(&spec, &|_| Err("no mesh files here".into())).expect("built-in shapes"),
        recipe,
    )
}

/// White noise over a pen.
fn plain(shapes: &str, noise: &str, density: &str) -> (Catalog, Recipe) {
    let mbes = noise.parse::<f32>().expect("NOISE_M is a number") > 0.02;
    let kind = if mbes { "mbes" } else { "uav" };
    let recipe = Recipe::parse(&format!(
        "name = \"bench\"\ndensity_per_m2 = {density}\n[sensor]\nkind = \"gaussian\"\nnoise_sd_m = {noise}\nmeasured_as = \"{kind}\""
    ))
    .expect("the recipe above is well formed");
    (catalog(shapes), recipe)
}

/// Processor time of this process so far, seconds; 0 where the system does not say.
fn cpu_s() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let ticks =
        |n: usize| stat.rsplit(") ").next().and_then(|s| s.split(' ').nth(n)?.parse::<f64>().ok());
    (ticks(11).unwrap_or(0.0) + ticks(12).unwrap_or(0.0)) / 100.0
}

/// One scene's segments, truths and result as JSON.
fn dump(
    file: &std::ffi::OsStr,
    made: &SynthScene,
    segmentation: &Segmentation,
    found: &[scene::Recognised],
    truths: &[TrueBlock],
    catalog: &Catalog,
    cpu_s: f64,
) {
    let (_, model) = catalog.iter().next().expect("the command line names a shape");
    let pose = |p: &geom::Pose| serde_json::json!({"t": p.translation.to_array(), "xyzw": p.rotation.to_array()});
    let segments: Vec<_> = segmentation
        .hypotheses
        .iter()
        .map(|h| {
            let off = |t: &&TrueBlock| (t.placed.site_from_block * model.centre - h.centre).length();
            let truth = truths.iter().min_by(|a, b| off(a).total_cmp(&off(b))).expect("scenes have blocks");
            let points: Vec<_> =
                h.points.iter().map(|&i| made.survey.cloud.position_m[i as usize].to_array()).collect();
            serde_json::json!({"points": points, "truth": pose(&truth.placed.site_from_block), "occlusion": truth.occlusion})
        })
        .collect();
    let stated: Vec<_> = scene::stated(found).map(|(_, fit)| pose(&fit.site_from_block)).collect();
    let rotations: Vec<_> = model.symmetry.rotations().iter().map(|q| q.to_array()).collect();
    let sensor: Vec<_> = made.survey.sensor_positions.iter().map(|p| p.to_array()).collect();
    let value = serde_json::json!({
        "vertices": model.mesh.vertices.iter().map(|v| v.to_array()).collect::<Vec<_>>(),
        "triangles": model.mesh.triangles,
        "centre": model.centre.to_array(),
        "d_box_m": model.d_box_m,
        "d_max_m": model.d_max_m,
        "rotations": rotations,
        "sensor": sensor,
        "segments": segments,
        "stated": stated,
        "cpu_s": cpu_s,
    });
    std::fs::write(file, value.to_string()).expect("DUMP can be written");
}

fn catalog(shapes: &str) -> Catalog {
    let block = shapes
        .split('+')
        .enumerate()
        .map(|(i, s)| {
            let (kind, size) = s.split_once(':').expect("a shape is KIND:SIZE");
            let size: f32 = size.parse().expect("a size is a number");
            let shape = match kind {
                "tetrapod" => Shape::Tetrapod { size },
                "cube" => Shape::Cube { size },
                "antifer" => Shape::Antifer { size },
                _ => Shape::Dolos { size },
            };
            BlockSpec {
                name: format!("{kind}{i}"),
                shape: Some(shape),
                mesh: None,
                unit: None,
                density_kg_m3: 2300.0,
            }
        })
        .collect();
    blocks::catalog(&CatalogSpec { block }, &|_| Err("no mesh files here".into()))
        .expect("built-in shapes")
}

/// Settings by dotted key, through the same names a configuration file uses.
fn config(settings: &[String]) -> PoseConfig {
    let mut value =
        serde_json::to_value(PoseConfig::default()).expect("the configuration is plain data");
    for setting in settings {
        let (key, text) = setting.split_once('=').expect("a setting is KEY=VALUE");
        let mut at = &mut value;
        for part in key.split('.') {
            at = at.get_mut(part).unwrap_or_else(|| panic!("no key {key}"));
        }
        *at = serde_json::from_str(text).unwrap_or_else(|_| serde_json::Value::String(text.into()));
    }
    serde_json::from_value(value).expect("the setting has the key's type")
}

fn centre(made: &SynthScene, catalog: &Catalog, b: usize) -> Vec3 {
    let block = &made.scene.blocks[b];
    block.site_from_block * catalog.get(block.model).centre
}

fn true_segments(made: &SynthScene, catalog: &Catalog) -> Segmentation {
    let mut hypotheses = Vec::new();
    let mut label = vec![0; made.scene.blocks.len() + 1];
    for b in 0..made.scene.blocks.len() {
        let id = made.scene.blocks[b].block.0;
        let points: Vec<u32> =
            (0..made.instance.len() as u32).filter(|&i| made.instance[i as usize] == id).collect();
        if !points.is_empty() {
            hypotheses.push(CentreHypothesis {
                centre: centre(made, catalog, b),
                score: 1.0,
                points,
            });
            label[id as usize] = hypotheses.len() as u32;
        }
    }
    Segmentation {
        instance: made.instance.iter().map(|&i| label[i as usize]).collect(),
        confidence: vec![1.0; made.instance.len()],
        instances: hypotheses.len(),
        hypotheses,
    }
}

fn degraded(made: &SynthScene, catalog: &Catalog, seed: SeedTree) -> Segmentation {
    let mut rng = seed.rng();
    let truth = true_segments(made, catalog);
    let position = &made.survey.cloud.position_m;
    let d = catalog.d_max_m();
    let normal = |rng: &mut rand_chacha::ChaCha8Rng| {
        let mut v = || (0..12).map(|_| rng.random::<f32>()).sum::<f32>() - 6.0;
        Vec3::new(v(), v(), v())
    };
    let mut all = Vec::new();
    for h in &truth.hypotheses {
        for _ in 0..2 {
            let off = h.centre + normal(&mut rng) * (0.15 * d / 3.0_f32.sqrt());
            let mut points = h.points.clone();
            points.shuffle(&mut rng);
            points.truncate((h.points.len() * 3).div_ceil(4));
            // A third as many foreign points from around the centre: a quarter of the whole.
            let mut foreign: Vec<u32> = (0..position.len() as u32)
                .filter(|&i| (position[i as usize] - h.centre).length() < 1.2 * d)
                .filter(|i| h.points.binary_search(i).is_err())
                .collect();
            foreign.shuffle(&mut rng);
            foreign.truncate(points.len() / 3);
            points.extend(foreign);
            points.sort_unstable();
            all.push(CentreHypothesis { centre: off, score: 0.8, points });
        }
    }
    let false_ones = all.len() / 4;
    for _ in 0..false_ones {
        let at = position[rng.random_range(0..position.len())] + normal(&mut rng) * (0.4 * d)
            - Vec3::Z * (0.3 * d);
        let points: Vec<u32> = (0..position.len() as u32)
            .filter(|&i| (position[i as usize] - at).length() < 0.8 * d)
            .collect();
        all.push(CentreHypothesis { centre: at, score: 0.3, points });
    }
    all.shuffle(&mut rng);
    Segmentation { hypotheses: all, ..Segmentation::of_nothing(position.len()) }
}

/// Appends the features of every block, as `tsumu-lab reproduce pose-confidence` writes them.
fn signs_of(
    file: &std::ffi::OsStr,
    set: &str,
    segments: &str,
    stated: &[(scene::Recognised, Option<pose::Features>)],
    truths: &[TrueBlock],
    catalog: &Catalog,
) {
    use std::io::Write;
    let mut out = std::fs::OpenOptions::new()
        .append(true)
        .create(true)
        .open(file)
        .expect("SIGNS can be written");
    for (r, features) in stated {
        let Some(features) = features else { continue };
        let Some(fit) = r.fit() else { continue };
        let right =
            truths.iter().find(|t| scene::is_right(&fit.posed(catalog), &t.placed.posed(catalog)));
        let kind = right.is_some_and(|t| t.placed.model == fit.model);
        let terms: Vec<String> = features.terms().iter().map(|f| format!("{f:.5}")).collect();
        let (place, kind, margin) =
            (u8::from(right.is_some()), u8::from(kind), features.type_margin);
        writeln!(out, "{set},{segments},{place},{kind},{margin},{}", terms.join(" "))
            .expect("SIGNS can be written");
    }
}

/// The type's margin of every block in its place, for fitting how much a nat is worth.
fn types(
    stated: &[(scene::Recognised, Option<pose::Features>)],
    truths: &[TrueBlock],
    catalog: &Catalog,
) {
    for (r, features) in stated {
        let Some(features) = features.filter(|s| s.type_margin.is_finite()) else { continue };
        let Some(fit) = r.fit() else { continue };
        let right =
            truths.iter().find(|t| scene::is_right(&fit.posed(catalog), &t.placed.posed(catalog)));
        if let Some(t) = right {
            let same = u8::from(t.placed.model == fit.model);
            println!(
                "  margin {:.2} right {same} occl {:.2} points {} at {:.1}",
                features.type_margin,
                t.occlusion,
                r.points.len(),
                fit.site_from_block.translation
            );
        }
    }
}

/// Every mistake with what is near it.
fn explain(found: &[scene::Recognised], truths: &[TrueBlock], catalog: &Catalog) {
    let error =
        |fit: &scene::Fit, t: &TrueBlock| fit.posed(catalog).error(&t.placed.posed(catalog));
    let right = |r: &scene::Recognised, t: &TrueBlock| {
        r.fit().is_some_and(|fit| scene::is_right(&fit.posed(catalog), &t.placed.posed(catalog)))
    };
    for r in found.iter().filter(|r| !truths.iter().any(|t| right(r, t))) {
        let Some(fit) = r.fit() else { continue };
        let near = truths
            .iter()
            .min_by(|a, b| error(fit, a).displacement_m.total_cmp(&error(fit, b).displacement_m))
            .expect("scenes have blocks");
        let e = error(fit, near);
        println!(
            "  false, {}, conf {:.2} occl {:.2} fit {:.3}: nearest truth off {:.2} m {:.0}° occl {:.2}",
            if r.is_stated() { "stated" } else { "not judged" },
            fit.confidence.unwrap_or(f32::NAN),
            fit.occlusion.unwrap_or(f32::NAN),
            fit.fitness_m.unwrap_or(f32::NAN),
            e.displacement_m,
            e.rotation_rad.to_degrees(),
            near.occlusion
        );
    }
    for t in truths.iter().filter(|t| t.occlusion < 0.8 && !found.iter().any(|r| right(r, t))) {
        println!("  missed: block {} occl {:.2}", t.placed.block.0, t.occlusion);
    }
}
