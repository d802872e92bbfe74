//! A site cut into tiles gives what the whole gives: in any order, cut in any number, with workers killed in the middle.

use crate::site::{CATALOG, files, ok, tsumu};
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::OnceLock;
use tempfile::TempDir;

const RECIPE: &str = r#"
name = "short strip"
count = [100, 110]
density_per_m2 = 220.0

[site]
kind = "strip"
length_m = 52.0
width_m = 8.0

[sensor]
kind = "gaussian"
noise_sd_m = 0.01
"#;

const SITE: &str = r#"
name = "Short strip"
crs = "EPSG:6679"
vertical_datum = "T.P."
seed = 5

[[survey]]
file = "survey.laz"
sensor = "uav"
vertical_offset_m = 0.0

[design]
kind = "level"
level_m = 3.4
boundary = [[41246.0, -98763.0], [41254.0, -98763.0], [41254.0, -98757.0], [41246.0, -98757.0]]

[plan.uncertainty]
seeds = 0
"#;

fn text(path: &Path) -> String {
    path.to_string_lossy().into_owned()
}

fn strip() -> &'static Path {
    static FOLDER: OnceLock<TempDir> = OnceLock::new();
    let folder = FOLDER.get_or_init(|| {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| text(&folder.path().join(name));
        std::fs::write(at("recipe.toml"), RECIPE).unwrap();
        std::fs::write(at("catalog.toml"), CATALOG).unwrap();
        std::fs::write(at("site.toml"), SITE).unwrap();
        let (recipe, catalog, out) = (at("recipe.toml"), at("catalog.toml"), at(""));
        ok(&[
            "synth",
            &recipe,
            "--catalog",
            &catalog,
            "--seed",
            "17",
            "--site-crs",
            "EPSG:6679",
            "--site-origin",
            "41250,-98760,1.5",
            "--out",
            &out,
        ]);
        folder
    });
    folder.path()
}

/// A copy of the site that a test may spoil.
fn copy() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    for name in ["site.toml", "catalog.toml", "survey.laz"] {
        std::fs::copy(strip().join(name), folder.path().join(name)).unwrap();
    }
    folder
}

fn planned(site: &Path, plan: &Path, blocks: &str) -> Vec<String> {
    let ran = ok(&[
        "tiles",
        "plan",
        &text(site),
        "--out",
        &text(plan),
        "--blocks-per-tile",
        blocks,
        "--json",
    ]);
    event(&ran.out, "tiles")
        .as_array()
        .unwrap()
        .iter()
        .map(|t| t["key"].as_str().unwrap().into())
        .collect()
}

fn event(out: &str, name: &str) -> serde_json::Value {
    let lines = out.lines().filter_map(|l| serde_json::from_str::<serde_json::Value>(l).ok());
    let found = lines.rev().find(|e| e["event"] == name);
    found.unwrap_or_else(|| panic!("no event {name} in {out}"))["value"].clone()
}

fn work_on(plan: &Path, key: &str) -> serde_json::Value {
    event(&ok(&["tiles", "run", &text(plan), "--key", key, "--json"]).out, "tile")
}

fn merged(plan: &Path, out: &Path) {
    ok(&["tiles", "merge", &text(plan), "--out", &text(out)]);
}

/// Places nearer than this are the same: 3.4 mm was the most seen on this seed, of a block whose points were seen from four sides.
const SAME_M: f64 = 4e-3;

/// Number and centre of every block of a run.
fn blocks(run: &Path) -> Vec<(u32, [f64; 3])> {
    let table = std::fs::read_to_string(run.join("recognise/blocks.csv")).unwrap();
    let mut lines = table.lines();
    let names: Vec<&str> = lines.next().unwrap().split(',').collect();
    let column =
        |name: &str| names.iter().position(|n| *n == name).unwrap_or_else(|| panic!("{names:?}"));
    let at = ["x_m", "y_m", "z_m"].map(column);
    let id = column("block_id");
    lines
        .map(|line| {
            let cells: Vec<&str> = line.split(',').collect();
            (cells[id].parse().unwrap(), at.map(|c| cells[c].parse().unwrap()))
        })
        .collect()
}

fn apart_m(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt()
}

/// Blocks of one run that the other does not have there.
fn differing(a: &Path, b: &Path) -> Vec<(u32, [f64; 3])> {
    let other = blocks(b);
    let there = |p: &[f64; 3]| other.iter().any(|(_, q)| apart_m(p, q) < SAME_M);
    blocks(a).into_iter().filter(|(_, p)| !there(p)).collect()
}

#[test]
fn tiles_give_what_the_whole_gives_in_any_order_and_number() {
    let runs = tempfile::tempdir().unwrap();
    let at = |name: &str| runs.path().join(name);
    ok(&["run", &text(strip()), "--out", &text(&at("whole"))]);

    let keys = planned(strip(), &at("many"), "20");
    assert!(keys.len() >= 4, "{keys:?}");
    // A worker that is killed in the middle leaves nothing that counts.
    let mut child = Command::new(env!("CARGO_BIN_EXE_tsumu"))
        .args(["tiles", "run", &text(&at("many")), "--key", &keys[1], "--json"])
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    // It says what the blocks are, and goes to work.
    let said = BufReader::new(child.stdout.take().unwrap()).lines().take(2).count();
    assert_eq!(said, 2);
    child.kill().unwrap();
    child.wait().unwrap();
    for key in keys.iter().rev() {
        work_on(&at("many"), key);
    }
    assert_eq!(work_on(&at("many"), &keys[0])["kept"], true);
    merged(&at("many"), &at("of-many"));

    let fewer = planned(strip(), &at("few"), "60");
    assert!(fewer.len() < keys.len() && fewer.len() >= 2, "{fewer:?}");
    fewer.iter().for_each(|key| drop(work_on(&at("few"), key)));
    merged(&at("few"), &at("of-few"));

    let (whole, many, few) = (at("whole"), at("of-many"), at("of-few"));
    let found = blocks(&whole).len();
    assert!(found > 60, "{found} blocks");
    for (a, b) in [(&whole, &many), (&many, &whole), (&many, &few), (&few, &many)] {
        let other = differing(a, b);
        assert!(other.is_empty(), "{} is not in {}: {other:?}", a.display(), b.display());
    }
    // Numbers are the same however it was cut.
    for ((n, p), (m, q)) in blocks(&many).iter().zip(&blocks(&few)) {
        assert!(n == m && apart_m(p, q) < SAME_M, "{n} {p:?}, {m} {q:?}");
    }
    // The run of the whole is a run like any other.
    assert!(many.join("report.html").is_file() && many.join("plan/placements.csv").is_file());
    ok(&["verify", &text(&many), "--site", &text(strip())]);
    ok(&["report", &text(&many), "--site", &text(strip()), "--out", &text(&at("page.html"))]);
}

#[test]
fn what_does_not_belong_together_is_named_and_not_merged() {
    let site = copy();
    let (plan, out) = (site.path().join("plan"), site.path().join("out"));
    let keys = planned(site.path(), &plan, "40");
    let merge = || tsumu(&["tiles", "merge", &text(&plan), "--out", &text(&out)]);
    // A second plan of the same is the same; of other sizes it is refused.
    assert_eq!(planned(site.path(), &plan, "40"), keys);
    let other = tsumu(&[
        "tiles",
        "plan",
        &text(site.path()),
        "--out",
        &text(&plan),
        "--blocks-per-tile",
        "200",
    ]);
    assert!(other.code == 2 && other.err.contains("another plan"), "{}", other.err);

    let too_much = tsumu(&["tiles", "run", &text(&plan), "--index", "0", "--memory", "300MB"]);
    assert!(too_much.code == 2 && too_much.err.contains("--memory 300MB"), "{}", too_much.err);
    let beyond = tsumu(&["tiles", "run", &text(&plan), "--index", "999"]);
    assert!(beyond.code == 2 && beyond.err.contains("999"), "{}", beyond.err);
    let which = tsumu(&["tiles", "run", &text(&plan)]);
    assert!(which.code == 2 && which.err.contains("SLURM_ARRAY_TASK_ID"), "{}", which.err);
    let by_scheduler = Command::new(env!("CARGO_BIN_EXE_tsumu"))
        .args(["tiles", "run", &text(&plan)])
        .env("JOB_COMPLETION_INDEX", "0")
        .output()
        .unwrap();
    assert!(by_scheduler.status.success());

    for key in &keys[..keys.len() - 1] {
        work_on(&plan, key);
    }
    let missing = merge();
    assert!(missing.code == 2 && missing.err.contains(keys.last().unwrap()), "{}", missing.err);
    assert!(!out.join("recognise").exists(), "something was merged");
    work_on(&plan, keys.last().unwrap());

    // Damage, a result of another plan, a changed site.
    let result = |key: &str| -> PathBuf {
        let folder = plan.join("tiles").join(key);
        let (name, _) =
            files(&folder).into_iter().find(|f| text(&f.0).starts_with("result-")).unwrap();
        folder.join(name)
    };
    let sound = std::fs::read(result(&keys[0])).unwrap();
    let mut bytes = sound.clone();
    *bytes.last_mut().unwrap() ^= 1;
    std::fs::write(result(&keys[0]), &bytes).unwrap();
    let damaged = merge();
    assert!(damaged.code == 2 && damaged.err.contains("damaged"), "{}", damaged.err);
    std::fs::write(result(&keys[0]), &sound).unwrap();

    let done = plan.join("tiles").join(&keys[0]).join("done.json");
    let own = std::fs::read_to_string(&done).unwrap();
    let id = serde_json::from_str::<serde_json::Value>(&own).unwrap()["plan"]
        .as_str()
        .unwrap()
        .to_string();
    std::fs::write(&done, own.replace(&id, "0123")).unwrap();
    let foreign = merge();
    assert!(foreign.code == 2 && foreign.err.contains("another plan"), "{}", foreign.err);
    let status = event(&ok(&["tiles", "status", &text(&plan), "--json"]).out, "status");
    assert_eq!(status["wrong"].as_array().unwrap().len(), 1, "{status}");
    std::fs::write(&done, &own).unwrap();

    let toml = site.path().join("site.toml");
    std::fs::write(&toml, SITE.replace("seed = 5", "seed = 6")).unwrap();
    let changed = merge();
    assert!(changed.code == 2 && changed.err.contains("site.toml"), "{}", changed.err);
    assert!(!out.join("recognise").exists(), "something was merged");
    std::fs::write(&toml, SITE).unwrap();
    merged(&plan, &out);
}
