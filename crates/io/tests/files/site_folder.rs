//! Site folders: what they say, and what they may not.

use io::site;
use scene::{AxisOrder, DesignSurface, SensorKind, Shape, SiteSpec};
use std::fs;
use std::path::Path;

const SITE: &str = r#"name = "Sample"
crs = "EPSG:6679"
vertical_datum = "T.P. (EPSG:6695)"
axis_order = "north-east"
seed = 7

[[survey]]
file = "survey.laz"
sensor = "mbes"
sensor_positions = [[1.0, 2.0, 30.0]]
vertical_offset_m = -0.12

[design]
kind = "section"
alignment = [[0.0, 0.0], [15.0, 0.0]]
crest_level_m = 4.0
crest_width_m = 6.0
left_slope_m = 1.5
right_slope_m = 1.5
toe_level_m = -2.0

[ground]
kind = "plane"
point = [0.0, 0.0]
level_m = -3.0
falls_towards_deg = 180.0
slope_m = 30.0

[plan]
rounds = 12
"#;

const CATALOG: &str = r#"[[block]]
name = "tetrapod"
shape = { kind = "tetrapod", size = 2.0 }

[[block]]
name = "part"
mesh = "part.stl"
unit = "mm"
density_kg_m3 = 2400.0
"#;

fn folder(site: &str, catalog: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("site.toml"), site).unwrap();
    fs::write(folder.path().join("catalog.toml"), catalog).unwrap();
    for name in ["survey.laz", "part.stl"] {
        fs::write(folder.path().join(name), b"").unwrap();
    }
    folder
}

#[test]
fn a_site_is_read_whole() {
    let folder = folder(SITE, CATALOG);
    let site = site::load(folder.path()).unwrap();
    assert_eq!(site.spec.axis_order, AxisOrder::NorthEast);
    assert_eq!(site.spec.survey[0].sensor, SensorKind::Mbes);
    assert_eq!(site.spec.survey[0].vertical_offset_m, Some(-0.12));
    assert!(matches!(site.spec.design, Some(DesignSurface::Section { crest_width_m: 6.0, .. })));
    assert_eq!(site.spec.plan["rounds"].as_integer(), Some(12));
    assert_eq!(site.catalog.block[0].shape, Some(Shape::Tetrapod { size: 2.0 }));
    assert_eq!(site.survey_files, [folder.path().join("survey.laz")]);
    let names: Vec<_> = site.inputs().iter().map(|p| p.display().to_string()).collect();
    assert_eq!(names, ["catalog.toml", "part.stl", "site.toml", "survey.laz"]);
    // What was read can be written and read again: the resolved configuration of a run.
    let text = toml::to_string(&site.spec).unwrap();
    assert_eq!(site::parse_toml::<SiteSpec>(Path::new("again"), &text).unwrap(), site.spec);
}

fn fails(site: &str, catalog: &str) -> String {
    site::load(folder(site, catalog).path()).unwrap_err().to_string()
}

#[test]
fn mistakes_are_named_with_file_line_and_key() {
    let all =
        |error: String, parts: &[&str]| assert!(parts.iter().all(|p| error.contains(p)), "{error}");
    all(fails(&SITE.replace("seed = 7", "sed = 7"), CATALOG), &["site.toml, line 5", "`sed`"]);
    all(
        fails(&SITE.replace("crest_level_m", "crest_levl_m"), CATALOG),
        &["site.toml, line", "crest_levl_m"],
    );
    all(
        fails(&SITE.replace("crs = \"EPSG:6679\"\n", ""), CATALOG),
        &["site.toml", "crs = \"EPSG:"],
    );
    all(fails(&SITE.replace("EPSG:6679", "6679"), CATALOG), &["\"6679\" is not an EPSG code"]);
    all(
        fails(&SITE.replace("vertical_offset_m = -0.12\n", ""), CATALOG),
        &["survey.laz", "vertical_offset_m"],
    );
    all(fails(&SITE.replace("-0.12", "nan"), CATALOG), &["vertical_offset_m", "finite"]);
    all(
        fails(&SITE.replace("toe_level_m = -2.0", "toe_level_m = 5.0"), CATALOG),
        &["design.toe_level_m"],
    );
    all(
        fails(
            &SITE.replace("alignment = [[0.0, 0.0], [15.0, 0.0]]", "alignment = [[0.0, 0.0]]"),
            CATALOG,
        ),
        &["alignment"],
    );
    all(fails(&SITE.replace("\"mbes\"", "\"sonar\""), CATALOG), &["line 9", "sonar", "mbes"]);
    all(
        fails(SITE, &CATALOG.replace("size = 2.0", "size = 2.0, side = 1")),
        &["catalog.toml, line 3", "side"],
    );
    all(
        fails(SITE, &CATALOG.replace("part.stl", "part2.stl")),
        &["part2.stl", "check the spelling"],
    );
    all(fails("name = \"x\"\ncrs = \"none\"\n", CATALOG), &["[[survey]]"]);
    all(fails("name = [", CATALOG), &["site.toml, line 1"]);
}

#[test]
fn no_mesh_lies_outside_the_folder() {
    for path in ["../secret.stl", "/etc/passwd", "a/../../b.stl", "./../x"] {
        let error = fails(SITE, &CATALOG.replace("part.stl", path));
        assert!(error.contains("leaves the site folder") && error.contains(path), "{error}");
    }
}

#[cfg(unix)]
#[test]
fn a_link_to_a_mesh_does_not_leave_the_folder_either() {
    let other = tempfile::tempdir().unwrap();
    fs::write(other.path().join("secret.stl"), b"").unwrap();
    let folder = folder(SITE, &CATALOG.replace("part.stl", "link.stl"));
    std::os::unix::fs::symlink(other.path().join("secret.stl"), folder.path().join("link.stl"))
        .unwrap();
    let error = site::load(folder.path()).unwrap_err().to_string();
    assert!(error.contains("leaves the site folder"), "{error}");
}

#[test]
fn surveys_may_lie_anywhere() {
    let other = tempfile::tempdir().unwrap();
    fs::write(other.path().join("far.laz"), b"").unwrap();
    let far = other.path().join("far.laz");
    let folder = folder(&SITE.replace("survey.laz", &far.display().to_string()), CATALOG);
    let site = site::load(folder.path()).unwrap();
    assert_eq!(site.survey_files, std::slice::from_ref(&far));
    assert!(site.inputs().contains(&far));
    assert_eq!(io::manifest::portable(&far), far.display().to_string());
    let up = SITE.replace("survey.laz", "../survey.laz");
    fs::create_dir(folder.path().join("inner")).unwrap();
    fs::write(folder.path().join("survey.laz"), b"").unwrap();
    for (name, text) in [("site.toml", up.as_str()), ("catalog.toml", CATALOG), ("part.stl", "")] {
        fs::write(folder.path().join("inner").join(name), text).unwrap();
    }
    site::load(&folder.path().join("inner")).unwrap();
}

#[test]
fn everything_wrong_is_said_at_once() {
    let site = SITE
        .replace("EPSG:6679", "EPSG:4326")
        .replace("survey.laz", "C:\\\\data\\\\survey.laz")
        .replace("vertical_offset_m = -0.12\n", "")
        .replace("toe_level_m = -2.0", "toe_level_m = 5.0");
    let error = fails(&site, &CATALOG.replace("part.stl", "part2.stl"));
    let lines: Vec<&str> = error.lines().collect();
    assert_eq!(lines.len(), 5, "{error}");
    for part in ["degrees", "vertical_offset_m", "toe_level_m", "part2.stl", "drive letter"] {
        assert_eq!(lines.iter().filter(|l| l.contains(part)).count(), 1, "{part}: {error}");
    }
}

#[test]
fn the_first_steps_are_shown() {
    let folder = folder(SITE, CATALOG);
    let cloud = site::load(&folder.path().join("survey.laz")).unwrap_err().to_string();
    assert!(cloud.contains("tsumu init"), "{cloud}");
    fs::remove_file(folder.path().join("site.toml")).unwrap();
    let none = site::load(folder.path()).unwrap_err().to_string();
    assert!(none.contains("tsumu init survey.laz"), "{none}");
}

#[test]
fn a_site_without_crs_takes_that_of_its_survey() {
    let folder = folder(&SITE.replace("crs = \"EPSG:6679\"\n", ""), CATALOG);
    let cloud = io::RawCloud { crs: Some("EPSG:6677".into()), ..super::clouds::sample(10) };
    io::points::write(&folder.path().join("survey.laz"), &cloud).unwrap();
    assert_eq!(site::load(folder.path()).unwrap().spec.crs, "EPSG:6677");
}
