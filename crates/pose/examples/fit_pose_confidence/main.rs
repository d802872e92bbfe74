//! Makes the scenes the confidence is fitted to, and fits it.
//!
//! `cargo run --release -p pose --example fit_pose_confidence -- collect SEED REPEATS FEATURES.csv`
//! `cargo run --release -p pose --example fit_pose_confidence -- fit FEATURES.csv OTHERS.csv FOLDER`, which writes
//! `confidence.txt` and `among-confidence.txt` of `crates/pose/fitted`
//!
//! `cargo xtask fit pose-confidence` runs both. `collect-types SEED FILE` and `fit-types FILE OTHER OUT` do the same for the type's margin
//! (`cargo xtask fit type-confidence`).
//!
//! `collect` piles blocks of several shapes in heaps, towers and rows on several grounds, lets several sensors measure
//! them, and recognises them with their own catalogue and with wrong ones (other sizes, other shapes); it cuts pieces out of
//! surveys by drone of blocks that are not quite their model, lets a depth camera see parts in bins, and makes land, stones,
//! steps, stairs and plants that hold no block at all. Every accepted block becomes a row, right or wrong. What a
//! file already holds is not made again, so that an interrupted collection goes on with the same command. `fit` fits two
//! files of different seeds together, and tells on the standard error how well each is predicted from the other.

mod logistic;
mod nature;
mod piles;
mod types;

use geom::{SeedTree, Silent};
use pose::{EvidenceConfig, NAMES, Outcome, PoseConfig};
use rand::RngExt;
use scene::{Catalog, PoseLimits, PosedModel, Segmentation, Survey};
use std::collections::BTreeSet;
use std::fs::OpenOptions;
use std::io::Write;
use std::path::Path;
use synth::SynthScene;

fn main() {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = args.iter().map(String::as_str).collect();
    match words.as_slice() {
        ["collect", seed, repeats, out] => {
            let number = |s: &str| s.parse().expect("SEED and REPEATS are numbers");
            collect(number(seed), number(repeats), &mut Kept::features(Path::new(out)));
        }
        ["collect-types", seed, out] => {
            let seed = seed.parse().expect("SEED is a number");
            types::collect(seed, &mut Kept::open(Path::new(out), "condition,right,margin"));
        }
        ["fit-types", first, second, out] => {
            std::fs::write(out, types::fit(first, second)).expect("OUT can be written");
        }
        ["fit", first, second, folder] => {
            for (name, text) in FITTED.iter().zip(logistic::fit(first, second)) {
                std::fs::write(Path::new(folder).join(name), text).expect("FOLDER can be written");
            }
        }
        _ => {
            eprintln!(
                "usage: fit_pose_confidence collect SEED REPEATS FILE | fit FILE OTHER FOLDER | collect-types SEED FILE | fit-types FILE OTHER OUT"
            );
            std::process::exit(2);
        }
    }
}

/// The files of `fit`.
const FITTED: [&str; 2] = ["confidence.txt", "among-confidence.txt"];

/// Settings of each shape in one repeat; others in the next.
const SETTINGS: usize = 7;

/// A file of rows, which grows by one condition at a time.
struct Kept {
    file: std::fs::File,
    /// Conditions it holds.
    there: BTreeSet<String>,
}

impl Kept {
    fn features(path: &Path) -> Self {
        Self::open(path, &format!("condition,right,flat,sd-shift,sd-turn,{}", NAMES.join(" ")))
    }

    fn open(path: &Path, head: &str) -> Self {
        let text = std::fs::read_to_string(path).unwrap_or_default();
        let there: BTreeSet<String> =
            text.lines().filter_map(|l| l.strip_prefix("# ")).map(str::to_owned).collect();
        let file = OpenOptions::new().create(true).append(true).open(path);
        let mut file = file.expect("FILE can be written");
        if text.is_empty() {
            writeln!(file, "{head}").expect("FILE can be written");
        }
        Self { file, there }
    }

    fn has(&self, condition: &str) -> bool {
        self.there.contains(condition)
    }

    /// Adds the rows of a condition, whole or not at all.
    fn add(&mut self, condition: &str, rows: &str) {
        let text = format!("{rows}# {condition}\n");
        self.file.write_all(text.as_bytes()).expect("FILE can be written");
    }
}

/// Rows of every condition.
fn collect(seed: u64, repeats: u64, out: &mut Kept) {
    for repeat in 0..repeats {
        let seed = SeedTree::new(seed).child("confidence", repeat);
        for step in 0..SETTINGS {
            for (s, (name, own)) in piles::shapes().iter().enumerate() {
                let n = step * 3 + s * 2 + repeat as usize * 11;
                let (setting, recipe) = piles::setting(name, n);
                let condition = format!("{setting}/{repeat}");
                let seed = seed.child(name, step as u64);
                let (kind, wrong) = wrong_catalogue(own, s, step, seed);
                let wrongly = format!("{kind}/{condition}");
                if out.has(&condition) && out.has(&wrongly) {
                    continue;
                }
                let made = piles::pile(own, &recipe, seed);
                let of = |condition: &str, catalog: &Catalog, truth: bool| {
                    let rows =
                        |m: &SynthScene| rows(condition, &m.survey, catalog, truth.then_some(m));
                    made.as_ref().map_or(String::new(), rows)
                };
                for (condition, catalog, truth) in
                    [(&condition, own, true), (&wrongly, &wrong, false)]
                {
                    if !out.has(condition) {
                        out.add(condition, &of(condition, catalog, truth));
                    }
                }
            }
            if step < BINS {
                bins(step, repeat, seed, out);
            }
            if step < MORE_STAIRS {
                more_stairs(step, repeat, seed, out);
            }
            if step < CUTS {
                cuts(step, repeat, seed, out);
            }
            if step < SMOOTH {
                smooth(step, repeat, seed, out);
            }
            let kind = step % nature::KINDS.len();
            let name = nature::KINDS[kind];
            // Every kind of land for some of the shapes, the others in the next repeat.
            for (s, (shape, own)) in piles::shapes().into_iter().enumerate() {
                let condition = format!("{name}/{shape}/{repeat}");
                if (s + step + repeat as usize).is_multiple_of(2) && !out.has(&condition) {
                    let survey = nature::nature(kind, &own, seed.child(name, 0).child(shape, 0));
                    out.add(&condition, &rows(&condition, &survey, &own, None));
                }
            }
        }
    }
}

/// Bins of a repeat for each part.
const BINS: usize = 2;
/// Cuts of a repeat for each shape.
const CUTS: usize = 2;
/// Stairs and steps more for blocks of flat faces.
const MORE_STAIRS: usize = 4;

/// Surveys of smooth ground of a repeat for each shape and kind.
const SMOOTH: usize = 3;

/// Smooth ground with bumps as large as a block, which has hardly any noise to tell it by.
fn smooth(step: usize, repeat: u64, seed: SeedTree, out: &mut Kept) {
    for (kind, name) in nature::BUMPS.iter().enumerate() {
        for (shape, own) in piles::shapes() {
            let condition = format!("{name}/{shape}/{repeat}~{step}");
            if !out.has(&condition) {
                let survey =
                    nature::bumps(kind, &own, seed.child(name, step as u64).child(shape, 0));
                out.add(&condition, &rows(&condition, &survey, &own, None));
            }
        }
    }
}

/// Surfaces of flat faces that are no blocks, which blocks of flat faces fit best: other steps and stairs.
fn more_stairs(step: usize, repeat: u64, seed: SeedTree, out: &mut Kept) {
    for (shape, own) in piles::shapes().iter().filter(|(name, _)| piles::is_set_in_rows(name)) {
        for (kind, name) in nature::KINDS.iter().enumerate().filter(|k| k.1.starts_with("st")) {
            let condition = format!("{name}/{shape}/{repeat}~{step}");
            if *name != "stones" && !out.has(&condition) {
                let seed = seed.child(name, 1 + step as u64).child(shape, 0);
                let survey = nature::nature(kind, own, seed);
                out.add(&condition, &rows(&condition, &survey, own, None));
            }
        }
    }
}

/// Rows of pieces cut out of surveys of blocks that are not quite their model, the sensor's places unknown.
fn cuts(step: usize, repeat: u64, seed: SeedTree, out: &mut Kept) {
    for (s, (shape, own)) in piles::shapes().iter().enumerate() {
        let (setting, recipe, size) = piles::cut(shape, step * 5 + s + repeat as usize * 3);
        let condition = format!("{setting}/{repeat}");
        if out.has(&condition) {
            continue;
        }
        let (_, model) = own.iter().next().expect("one block");
        let built = Catalog::new(vec![model.scaled(size)]);
        let mut found = String::new();
        if let Some(mut made) = piles::pile(&built, &recipe, seed.child(shape, 100 + step as u64)) {
            made.survey.sensor_positions.clear();
            found += &rows(&condition, &made.survey, own, Some(&made));
        }
        out.add(&condition, &found);
    }
}

/// Rows of parts in bins, as themselves and as another part.
fn bins(step: usize, repeat: u64, seed: SeedTree, out: &mut Kept) {
    let bins = piles::bins(step);
    for (p, (part, own, recipe)) in bins.iter().enumerate() {
        let condition = format!("bin/{part}/{repeat}~{step}");
        let (other, wrong, _) = &bins[(p + 1 + step) % bins.len()];
        let wrongly = format!("as-{other}/{condition}");
        if out.has(&condition) && out.has(&wrongly) {
            continue;
        }
        let made = piles::pile(own, recipe, seed.child(part, 200 + step as u64));
        let of = |condition: &str, catalog: &Catalog, truth: bool| {
            let rows = |m: &SynthScene| rows(condition, &m.survey, catalog, truth.then_some(m));
            made.as_ref().map_or(String::new(), rows)
        };
        out.add(&condition, &of(&condition, own, true));
        out.add(&wrongly, &of(&wrongly, wrong, false));
    }
}

/// A catalogue of what does not lie there: a wrong size or a wrong shape.
fn wrong_catalogue(own: &Catalog, s: usize, step: usize, seed: SeedTree) -> (String, Catalog) {
    let mut rng = seed.child("wrong", 0).rng();
    if step.is_multiple_of(2) {
        let sizes = [0.82, 0.9, 0.94, 0.96, 1.04, 1.06, 1.1, 1.2];
        let factor = sizes[rng.random_range(0..sizes.len())];
        let (_, model) = own.iter().next().expect("one block");
        return (format!("size-{factor}"), Catalog::new(vec![model.scaled(factor)]));
    }
    let all = piles::shapes();
    let (name, other) = &all[(s + rng.random_range(1..all.len())) % all.len()];
    (format!("as-{name}"), other.clone())
}

/// A row for every accepted block of a survey; without truth all are wrong.
fn rows(condition: &str, survey: &Survey, catalog: &Catalog, truth: Option<&SynthScene>) -> String {
    let evidence = EvidenceConfig { min_confidence: 0.0, max_shared: 0.2, ..Default::default() };
    let found = recognised(condition, survey, catalog, evidence);
    // All blocks together tell the wrong size, and none is stated.
    let Some(found) = found.filter(|f| !f.pile.wrong_size()) else { return String::new() };
    let mut out = String::new();
    for (block, features) in found.blocks {
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
        let (right, flat) = (u8::from(right), u8::from(features.flat_faces));
        let terms = terms.join(" ");
        out += &format!("{condition},{right},{flat},{shift:.2},{turn:.2},{terms}\n");
    }
    out
}

/// What is accepted in a survey without any segments; a failure is told, and is `None`.
fn recognised(
    condition: &str,
    survey: &Survey,
    catalog: &Catalog,
    evidence: EvidenceConfig,
) -> Option<Outcome> {
    let config = PoseConfig { evidence, ..Default::default() };
    let nothing = Segmentation::of_nothing(survey.cloud.len());
    pose::recognise_pile(survey, &nothing, catalog, &config, &Silent)
        .map_err(|e| eprintln!("{condition}: {e}"))
        .ok()
}
