//! Two surveys of the tiny site against each other, and what cannot be compared.

use crate::site::{CATALOG, RECIPE, SITE, files, ok, shared, tsumu};
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use tempfile::TempDir;

const STORM: &str = "
kind = \"storm\"
missing = 0.15
kicked = 0.15
kick_blocks = [0.2, 0.4]
";

fn text(path: &Path) -> String {
    path.to_string_lossy().into_owned()
}

fn json_file(path: &Path) -> Value {
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

/// Rows of a table by column name.
fn table(path: &Path) -> Vec<BTreeMap<String, String>> {
    let content = std::fs::read_to_string(path).unwrap();
    let mut lines = content.lines();
    let head: Vec<&str> = lines.next().unwrap().split(',').collect();
    let row =
        |l: &str| head.iter().map(|h| h.to_string()).zip(l.split(',').map(String::from)).collect();
    lines.map(row).collect()
}

/// A folder with the site before (`a`) and after a storm (`b`), both with a run.
fn epochs() -> &'static Path {
    static FOLDER: OnceLock<TempDir> = OnceLock::new();
    FOLDER
        .get_or_init(|| {
            let folder = tempfile::tempdir().unwrap();
            let (made, at) = (folder.path().join("made"), |n: &str| folder.path().join(n));
            std::fs::write(at("recipe.toml"), RECIPE).unwrap();
            std::fs::write(at("catalog.toml"), CATALOG).unwrap();
            std::fs::write(at("storm.toml"), STORM).unwrap();
            let [recipe, catalog, storm] =
                ["recipe.toml", "catalog.toml", "storm.toml"].map(|n| text(&at(n)));
            let place = ["--site-crs", "EPSG:6679", "--site-origin", "41250,-98760,1.5"];
            let line = ["synth", &recipe, "--catalog", &catalog, "--seed", "3", "--then", &storm];
            let out = text(&made);
            let said = ok(&[&line[..], &place, &["--out", &out]].concat());
            assert!(said.out.contains("then: "), "{}", said.out);
            for (name, survey) in [("a", made.clone()), ("b", made.join("then"))] {
                site(&at(name), SITE, CATALOG, &survey.join("survey.laz"));
                ok(&["run", &text(&at(name)), "--plans", "0"]);
            }
            folder
        })
        .path()
}

fn site(folder: &Path, toml: &str, catalog: &str, survey: &Path) {
    std::fs::create_dir_all(folder).unwrap();
    std::fs::write(folder.join("site.toml"), toml).unwrap();
    std::fs::write(folder.join("catalog.toml"), catalog).unwrap();
    std::fs::copy(survey, folder.join("survey.laz")).unwrap();
}

/// Another site of the same survey.
fn sibling(catalog: &str) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    site(folder.path(), SITE, catalog, &epochs().join("a/survey.laz"));
    folder
}

/// Compares, expects refusal with these words, and nothing left.
fn refused(arguments: &[&Path], words: &[&str]) {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let mut line = vec!["compare".to_string()];
    line.extend(arguments.iter().map(|p| text(p)));
    line.extend(["--out".into(), text(&out)]);
    let ran = tsumu(&line);
    assert_eq!(ran.code, 2, "{}{}", ran.out, ran.err);
    for word in words {
        assert!(ran.err.contains(word), "`{word}` is not in: {}", ran.err);
    }
    assert!(!ran.err.contains("panicked"), "{}", ran.err);
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0, "something is left");
}

fn counts(out: &Path) -> Value {
    json_file(&out.join("summary.json"))["counts"].clone()
}

#[test]
fn the_same_survey_twice_is_unchanged() {
    let folder = tempfile::tempdir().unwrap();
    let (out, a) = (folder.path().join("out"), text(&epochs().join("a")));
    ok(&["compare", &a, &a, "--out", &text(&out)]);
    let rows = table(&out.join("changes.csv"));
    assert!(rows.len() >= 5, "{rows:?}");
    for row in &rows {
        assert_eq!(
            (row["class"].as_str(), row["distance_m"].as_str()),
            ("unchanged", "0"),
            "{row:?}"
        );
        assert_eq!(row["earlier_id"], row["later_id"]);
    }
    ok(&["verify", &text(&out)]);
    for name in ["changes.geojson", "changes.gpkg", "cloud.laz", "registration.json"] {
        assert!(out.join(name).is_file(), "{name} is missing");
    }
    let page = std::fs::read_to_string(out.join("report.html")).unwrap();
    assert!(page.contains("Tiny &lt;site&gt; &amp; test") && !page.contains("unsafe-inline"));
    assert_eq!(page.matches("<image").count(), 3, "both surveys and their difference");
    assert!(!page.contains("http://") && !page.contains("https://"), "it refers to the network");
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1, "only the comparison is left");
}

#[test]
fn a_storm_is_found_and_told_twice_alike() {
    let folder = tempfile::tempdir().unwrap();
    let [one, two] = ["one", "two"].map(|n| folder.path().join(n));
    let [a, b] = ["a", "b"].map(|n| text(&epochs().join(n)));
    // Few blocks stay: they tell no registration, and the surveys have none to need.
    for (out, threads) in [(&one, "1"), (&two, "2"), (&two, "1")] {
        ok(&["compare", &a, &b, "--fixed", "--out", &text(out), "--threads", threads]);
    }
    assert!(files(&one) == files(&two), "two comparisons differ");
    let truth = table(&epochs().join("made/then/truth/changes_truth.csv"));
    let gone = truth.iter().filter(|t| t["what"] == "missing").count();
    let found = counts(&one);
    assert!(gone > 0, "{truth:?}");
    let lost = found["missing"].as_u64().unwrap() + found["hidden"].as_u64().unwrap();
    assert!(lost as usize >= gone && found["unchanged"].as_u64().unwrap() >= 1, "{found:#}");
}

#[test]
fn a_series_keeps_the_numbers() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let [a, b] = ["a", "b"].map(|n| text(&epochs().join(n)));
    ok(&["compare", &a, &a, &b, "--fixed", "--out", &text(&out)]);
    let summary = json_file(&out.join("summary.json"));
    assert_eq!(summary["epochs"].as_array().unwrap().len(), 3);
    let pair = folder.path().join("pair");
    ok(&["compare", &a, &b, "--fixed", "--out", &text(&pair)]);
    // An epoch without change between changes no number.
    assert!(table(&out.join("changes.csv")) == table(&pair.join("changes.csv")));
}

#[test]
fn a_plan_that_nobody_built_is_not_placed() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let a = text(&epochs().join("a"));
    ok(&["compare", "--plan", &a, &a, "--out", &text(&out)]);
    let planned = table(&epochs().join("a/run/plan/placements.csv"));
    let kept = planned.iter().filter(|p| p["state"] == "kept").count();
    let built = table(&out.join("as_built.csv"));
    assert_eq!(built.len(), kept);
    assert!(kept > 0 && built.iter().all(|b| b["state"] != "placed" && b["later_id"].is_empty()));
    assert_eq!(json_file(&out.join("summary.json"))["as_built"]["built_blocks"], 0);
}

#[test]
fn what_cannot_be_compared_is_named() {
    let a = epochs().join("a");
    refused(&[&a], &["two runs"]);
    refused(&[&a, Path::new("no/such")], &["no/such"]);
    let other_type = sibling(&CATALOG.replace("tetrapod-5t", "tetrapod-6t"));
    refused(&[&a, other_type.path()], &["catalogue", "tetrapod-5t", "tetrapod-6t"]);
}

#[test]
fn an_unfinished_run_and_one_of_another_survey_are_named() {
    let a = epochs().join("a");
    let copied = |name: &str| -> (TempDir, PathBuf) {
        let folder = sibling(CATALOG);
        let run = folder.path().join("run");
        for (file, bytes) in files(&a.join("run")) {
            let to = run.join(file);
            std::fs::create_dir_all(to.parent().unwrap()).unwrap();
            std::fs::write(to, bytes).unwrap();
        }
        let file = folder.path().join(name);
        (folder, file)
    };
    let (unfinished, manifest) = copied("run/manifest.json");
    std::fs::remove_file(manifest).unwrap();
    refused(&[&a, unfinished.path()], &["not finished"]);
    let (other, survey) = copied("survey.laz");
    std::fs::copy(epochs().join("b/survey.laz"), survey).unwrap();
    refused(&[&a, other.path()], &["survey.laz", "run the site again"]);
    let (empty, blocks) = copied("run/recognise/blocks.csv");
    let content = std::fs::read_to_string(&blocks).unwrap();
    std::fs::write(&blocks, content.lines().next().unwrap().to_owned() + "\n").unwrap();
    refused(&[&a, empty.path()], &["no block was recognised"]);
}

/// A site without a run at another place, or in another CRS.
fn elsewhere(crs: &str, origin: &str) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let out = text(folder.path());
    let [recipe, catalog] = ["recipe.toml", "catalog.toml"].map(|n| text(&shared().join(n)));
    let line = ["synth", &recipe, "--catalog", &catalog, "--site-crs", crs];
    ok(&[&line[..], &["--site-origin", origin, "--out", &out]].concat());
    let toml = SITE.split("[design]").next().unwrap().replace("EPSG:6679", crs);
    std::fs::write(folder.path().join("site.toml"), toml).unwrap();
    std::fs::write(folder.path().join("catalog.toml"), CATALOG).unwrap();
    folder
}

#[test]
fn surveys_apart_and_in_other_coordinates_are_named() {
    let a = epochs().join("a");
    refused(&[&a, elsewhere("EPSG:6679", "42250,-98760,1.5").path()], &["do not overlap"]);
    refused(
        &[&a, elsewhere("EPSG:6678", "41250,-98760,1.5").path()],
        &["EPSG:6679", "EPSG:6678", "transform"],
    );
}

#[test]
fn nothing_of_the_users_is_written_over() {
    let a = epochs().join("a");
    let before = files(&a);
    for out in [a.clone(), a.join("run"), a.join("run/comparison"), a.join("run/plan")] {
        let ran = tsumu(&["compare", &text(&a), &text(&a), "--out", &text(&out)]);
        assert_eq!(ran.code, 2, "{}{}", ran.out, ran.err);
        assert!(ran.err.contains("--out"), "{}", ran.err);
    }
    assert!(files(&a) == before);
}

#[test]
fn works_need_a_plan() {
    let folder = tempfile::tempdir().unwrap();
    let works = folder.path().join("works.toml");
    std::fs::write(&works, "kind = \"works\"\n").unwrap();
    let out = folder.path().join("out");
    let [recipe, catalog] = ["recipe.toml", "catalog.toml"].map(|n| text(&shared().join(n)));
    let (works, at) = (text(&works), text(&out));
    let line = ["synth", &recipe, "--catalog", &catalog, "--then", &works, "--out", &at];
    let ran = tsumu(&[&line[..], &["--site-crs", "EPSG:6679", "--site-origin", "0,0,0"]].concat());
    assert_eq!(ran.code, 2, "{}", ran.err);
    assert!(ran.err.contains("plan") && !out.exists(), "{}", ran.err);
}

#[test]
fn days_tell_the_order_and_rules_the_grades() {
    let dated = |name: &str, day: &str| -> TempDir {
        let folder = tempfile::tempdir().unwrap();
        let toml = format!("survey_date = \"{day}\"\n{SITE}");
        site(folder.path(), &toml, CATALOG, &epochs().join(name).join("survey.laz"));
        folder
    };
    let (early, late) = (dated("a", "2025-05-01"), dated("b", "2026-05-02"));
    refused(&[late.path(), early.path()], &["2026-05-02", "2025-05-01", "earlier survey first"]);

    let folder = tempfile::tempdir().unwrap();
    let [out, config] = ["out", "rules.toml"].map(|n| folder.path().join(n));
    let rule = |key: &str| format!("[spans.grades.{key}]\na = 0\nb = 0\nc = 0\n");
    std::fs::write(&config, rule("moved_share") + &rule("gone_share")).unwrap();
    let [early, late, out_text, config] = [early.path(), late.path(), &out, &config].map(text);
    let line = ["compare", &early, &late, "--fixed", "--out", &out_text];
    ok(&[&line[..], &["--config", &config]].concat());
    let summary = json_file(&out.join("summary.json"));
    assert_eq!(summary["survey_dates"], serde_json::json!(["2025-05-01", "2026-05-02"]));
    // Whatever changed at all is grade a by these rules.
    let spans = summary["spans"].as_array().unwrap();
    assert!(spans.iter().any(|s| s["grade"] == "a"), "{spans:?}");
    let page = std::fs::read_to_string(out.join("report.html")).unwrap();
    assert!(page.contains("2025-05-01 → 2026-05-02"));
}
