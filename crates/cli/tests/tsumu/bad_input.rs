//! What the user gave is wrong: one line that names it, exit status 2, nothing left behind.

use crate::site::{CATALOG, SITE, copy, shared, tsumu};
use std::path::Path;

/// Runs the site and expects refusal with these words.
fn refused(site: &Path, words: &[&str]) {
    let ran = tsumu(&["run", &site.to_string_lossy()]);
    assert_eq!(ran.code, 2, "{}{}", ran.out, ran.err);
    let lines: Vec<_> = ran.err.lines().filter(|l| l.starts_with("tsumu: ")).collect();
    assert_eq!(lines.len(), 1, "one line, not: {}", ran.err);
    for word in words {
        assert!(lines[0].contains(word), "`{word}` is not in: {}", lines[0]);
    }
    assert!(!ran.err.contains("panicked"), "{}", ran.err);
    assert!(!site.join("run").exists(), "a refused run leaves nothing");
}

fn site_with(site_toml: &str) -> tempfile::TempDir {
    let folder = copy();
    std::fs::write(folder.path().join("site.toml"), site_toml).unwrap();
    folder
}

fn site_of_catalog(catalog_toml: &str) -> tempfile::TempDir {
    let folder = copy();
    std::fs::write(folder.path().join("catalog.toml"), catalog_toml).unwrap();
    folder
}

#[test]
fn no_site() {
    refused(Path::new("no/such/folder"), &["no/such/folder"]);
}

#[test]
fn missing_survey_file() {
    refused(site_with(&SITE.replace("survey.laz", "other.laz")).path(), &["other.laz"]);
}

#[test]
fn unknown_key_names_the_key_and_the_line() {
    refused(site_with(&format!("colour = 3\n{SITE}")).path(), &["site.toml", "colour", "line 1"]);
}

#[test]
fn unknown_setting() {
    refused(site_with(&format!("{SITE}\n[plan]\nspeed = 3\n")).path(), &["speed", "plan"]);
}

#[test]
fn crs_missing() {
    // A file that names its system answers for the site; this one names none.
    let text = SITE.replace("crs = \"EPSG:6679\"", "").replace("survey.laz", "survey.ply");
    let folder = site_with(&text);
    let ply = "ply\nformat ascii 1.0\nelement vertex 1\nproperty double x\nproperty double y\nproperty double z\nend_header\n1 2 3\n";
    std::fs::write(folder.path().join("survey.ply"), ply).unwrap();
    refused(folder.path(), &["site.toml", "crs"]);
}

#[test]
fn no_design_to_plan_to() {
    let folder = site_with(SITE.split("[design]").next().unwrap());
    let site = folder.path().to_string_lossy().into_owned();
    // An inventory is a result; a plan is not.
    let ran = crate::site::ok(&["run", &site]);
    assert!(ran.out.contains("inventory"), "{}", ran.out);
    let out = folder.path().join("plan").to_string_lossy().into_owned();
    let ran = tsumu(&["plan", &site, "--out", &out]);
    assert_eq!(ran.code, 2, "{}", ran.err);
    assert!(ran.err.contains("site.toml") && ran.err.contains("[design]"), "{}", ran.err);
    assert!(!Path::new(&out).exists());
}

#[test]
fn design_elsewhere() {
    refused(site_with(&SITE.replace("4125", "5125").replace("41247", "51247")).path(), &["design"]);
}

#[test]
fn empty_and_nan_clouds() {
    let folder = site_with(&SITE.replace("survey.laz", "survey.ply"));
    let header = |n: usize| {
        format!(
            "ply\nformat ascii 1.0\nelement vertex {n}\nproperty double x\nproperty double y\nproperty double z\nend_header\n"
        )
    };
    let ply = folder.path().join("survey.ply");
    std::fs::write(&ply, header(0)).unwrap();
    refused(folder.path(), &["survey.ply", "no points"]);
    std::fs::write(&ply, header(2) + "1 2 3\n1 nan 3\n").unwrap();
    refused(folder.path(), &["survey.ply", "finite"]);
    std::fs::write(&ply, header(3) + "1 2 3\n").unwrap();
    refused(folder.path(), &["survey.ply"]);
}

#[test]
fn wrong_unit() {
    refused(site_of_catalog(&CATALOG.replace("2.0", "2000.0")).path(), &["tetrapod-5t", "unit"]);
    refused(site_of_catalog(&CATALOG.replace("2.0", "0.0002")).path(), &["tetrapod-5t", "unit"]);
    refused(site_of_catalog(&CATALOG.replace("2.0", "-2.0")).path(), &["tetrapod-5t", "size"]);
}

#[test]
fn open_mesh() {
    let folder =
        site_of_catalog("[[block]]\nname = \"sheet\"\nmesh = \"sheet.obj\"\nunit = \"m\"\n");
    std::fs::write(folder.path().join("sheet.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
        .unwrap();
    refused(folder.path(), &["sheet", "watertight"]);
}

#[test]
fn a_mesh_needs_its_unit() {
    let folder = site_of_catalog("[[block]]\nname = \"sheet\"\nmesh = \"sheet.obj\"\n");
    std::fs::write(folder.path().join("sheet.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
        .unwrap();
    refused(folder.path(), &["sheet", "unit"]);
}

#[test]
fn weights_of_something_else() {
    let folder = copy();
    let weights = folder.path().join("weights.safetensors");
    std::fs::write(&weights, "these are no weights").unwrap();
    let ran =
        tsumu(&["run", &folder.path().to_string_lossy(), "--model", &weights.to_string_lossy()]);
    assert_eq!(ran.code, 2, "{}", ran.err);
    assert!(ran.err.contains("weights.safetensors"), "{}", ran.err);
}

#[test]
fn a_folder_of_something_else_is_not_written_into() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("thesis.docx"), "precious").unwrap();
    let out = folder.path().to_string_lossy().into_owned();
    let ran = tsumu(&["run", &shared().to_string_lossy(), "--out", &out]);
    assert_eq!(ran.code, 2, "{}", ran.err);
    assert!(ran.err.contains("thesis.docx"), "{}", ran.err);
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
}

#[test]
fn a_design_no_block_fits_under_gives_a_plan_of_none() {
    let folder = site_with(&SITE.replace("level_m = 4.4", "level_m = -9.0"));
    let ran = tsumu(&["run", &folder.path().to_string_lossy()]);
    assert_eq!(ran.code, 0, "{}", ran.err);
    assert!(ran.out.contains("0 blocks to add"), "{}", ran.out);
    assert!(ran.err.contains("design"), "the reason is said: {}", ran.err);
}

#[test]
fn usage() {
    assert_eq!(tsumu(&["run"]).code, 2);
    assert_eq!(tsumu(&["frobnicate"]).code, 2);
    assert_eq!(tsumu(&["--version"]).code, 0);
    assert_eq!(tsumu(&["run", "x", "--threads", "0"]).code, 2);
}

#[test]
fn an_area_takes_its_part_of_the_survey() {
    let area = |west: f64, east: f64| {
        let lines = format!(
            "[area]\nwest = {west:?}\neast = {east:?}\nsouth = -98770.0\nnorth = -98750.0\n\n[[survey]]"
        );
        site_with(&SITE.replace("[[survey]]", &lines))
    };
    refused(area(0.0, 1.0).path(), &["survey.laz", "none of its points", "east 0 to 1"]);
    refused(area(41253.0, 41247.0).path(), &["site.toml", "area.east"]);
    let (folder, out) = (copy(), tempfile::tempdir().unwrap());
    let at = |name: &str| folder.path().join(name).to_string_lossy().into_owned();
    let labelled = out.path().join("part.ply").to_string_lossy().into_owned();
    let rectangle = "41247,-98770,41250,-98750";
    let catalog = at("catalog.toml");
    let args = [
        "segment",
        &at("survey.laz"),
        "--catalog",
        &catalog,
        "--out",
        &labelled,
        "--area",
        rectangle,
        "--json",
    ];
    let said = crate::site::ok(&args).out;
    let points = |said: &str| {
        let line = said.lines().find(|l| l.contains("\"segmented\"")).unwrap().to_string();
        serde_json::from_str::<serde_json::Value>(&line).unwrap()["value"]["points"]
            .as_u64()
            .unwrap()
    };
    let whole = crate::site::ok(&[&args[..6], &["--json"]].concat()).out;
    assert!(points(&said) > 100 && points(&said) < points(&whole) * 3 / 4);
    assert_eq!(tsumu(&[&args[..6], &["--area", "1,2,3"]].concat()).code, 2);
}

/// What a command was given, and what is of another kind, stays when somebody names it as a place for results.
#[test]
fn nothing_that_was_given_is_overwritten() {
    let folder = crate::site::small_copy();
    let at = |name: &str| folder.path().join(name).to_string_lossy().into_owned();
    let (site, run, p, inside) = (at(""), at("run"), at("p"), at("run/inside"));
    let quick = ["--plans", "0", "--policy", "random", "-q"];
    crate::site::ok(&[&["run", &site][..], &quick].concat());
    crate::site::ok(&[&["plan", &run, "--out", &p][..], &quick].concat());
    let (recipe, catalog) = (at("r.toml"), at("catalog.toml"));
    std::fs::write(&recipe, crate::site::RECIPE).unwrap();
    let synth = ["synth", &recipe, "--catalog", &catalog, "--site-crs", "EPSG:6679"];
    let synth = [&synth[..], &["--site-origin", "1,2,3", "--out", &site]].concat();
    let before = crate::site::files(folder.path());
    for (args, word) in [
        (&["report", &run, "--out", &at("survey.laz")][..], "another name"),
        (&["report", &run, "--out", &at("site.toml")][..], "another name"),
        (&["check", &site, "--map", &at("survey.laz")][..], "another name"),
        (&["check", &site, "--map", &at("run/manifest.json")][..], "another name"),
        (&["plan", &run, "--out", &run][..], "made from"),
        (&["plan", &run, "--from", &p, "--out", &p][..], "made from"),
        (&["plan", &run, "--out", &inside][..], "lies in the run"),
        (&["run", &site, "--out", &inside][..], "lies in the run"),
        (&["what-if", &run, "--raise", "0.1", "--out", &run][..], "lies in the run"),
        (&["compare", &run, &run, "--out", &inside][..], "lies in the run"),
        (&synth[..], "survey.laz"),
        (&["run", &site, "--threads", "99999999"][..], "1024"),
    ] {
        let ran = tsumu(args);
        assert_eq!(ran.code, 2, "{args:?}: {}", ran.err);
        assert!(ran.err.contains(word), "{args:?}: {}", ran.err);
        assert!(crate::site::files(folder.path()) == before, "{args:?} changed a file");
    }
}
