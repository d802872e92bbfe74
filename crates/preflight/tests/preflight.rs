//! A site is looked at before it is worked on, and a first one is made from a survey alone.

use geom::{DVec3, Silent};
use io::RawCloud;
use preflight::{Preflight, check, first_site};
use std::fs;
use std::path::Path;

fn heap(shift: DVec3) -> Vec<DVec3> {
    let at = |i: u32| {
        let (x, y) = (f64::from(i % 100) * 0.08, f64::from(i / 100) * 0.08);
        let z = 3.0 - 0.3 * (x - 4.0).abs() - 0.3 * (y - 4.0).abs() + (x * 3.0).sin() * 0.2;
        DVec3::new(41_246.0 + x, -98_764.0 + y, z) + shift
    };
    (0..10_000).map(at).collect()
}

fn cloud(position: Vec<DVec3>, crs: &str) -> RawCloud {
    let crs = Some(crs.to_string()).filter(|c| !c.is_empty());
    RawCloud { position, crs, ..RawCloud::default() }
}

const CATALOG: &str = "[[block]]\nname = \"tetrapod\"\nshape = \"tetrapod 5t\"\n";
const DESIGN: &str = "[design]\nkind = \"level\"\nlevel_m = 3.4\nboundary = [[41246.0, -98764.0], [41253.0, -98764.0], [41253.0, -98757.0], [41246.0, -98757.0]]\n";

fn site(crs: &str, surveys: &[&str], design: &str) -> String {
    let all: String = surveys
        .iter()
        .map(|f| format!("[[survey]]\nfile = \"{f}\"\nvertical_offset_m = 0.0\n"))
        .collect();
    format!("name = \"a\"\ncrs = \"{crs}\"\n{all}{design}")
}

fn looked(site: &str, clouds: &[(&str, RawCloud)]) -> Preflight {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("site.toml"), site).unwrap();
    fs::write(folder.path().join("catalog.toml"), CATALOG).unwrap();
    for (name, cloud) in clouds {
        io::points::write(&folder.path().join(name), cloud).unwrap();
    }
    check(folder.path(), &Silent)
}

fn codes(found: &Preflight) -> Vec<&str> {
    found.complaints.iter().map(|c| c.code).collect()
}

#[test]
fn a_sound_site_can_be_answered() {
    let found = looked(
        &site("EPSG:6679", &["a.laz"], DESIGN),
        &[("a.laz", cloud(heap(DVec3::ZERO), "EPSG:6679"))],
    );
    assert!(found.can_be_answered, "{:?}", found.because);
    assert_eq!(found.surveys[0].points, 10_000);
    assert!(
        (found.surveys[0].density_per_m2 - 156.0).abs() < 15.0,
        "{}",
        found.surveys[0].density_per_m2
    );
    assert!(found.design_covered.unwrap() > 0.95);
    assert_eq!(found.design_levels_m, Some([3.4, 3.4]));
    // What a page is given holds all of it.
    let json = serde_json::to_value(&found).unwrap();
    assert_eq!(json["can_be_answered"], true);
    assert_eq!(json["surveys"][0]["points"], 10_000);
}

#[test]
fn every_complaint_comes_at_once() {
    let far = "[design]\nkind = \"level\"\nlevel_m = 340.0\nboundary = [[41246.0, -98764.0], [41253.0, -98764.0], [41253.0, -98757.0]]\n";
    let mut points = heap(DVec3::ZERO);
    points.push(DVec3::new(42_250.0, -98_760.0, 2.0));
    let found = looked(
        &site("EPSG:6679", &["a.laz", "b.laz", "c.laz"], far),
        &[
            ("a.laz", cloud(points, "EPSG:6677")),
            ("b.laz", cloud(heap(DVec3::new(0.0, 0.0, 0.45)), "")),
            ("c.laz", cloud(heap(DVec3::ZERO).into_iter().step_by(400).collect(), "")),
        ],
    );
    assert!(!found.can_be_answered);
    let codes = codes(&found);
    for code in ["crs-differs", "design-heights", "strays", "datum-step", "density"] {
        assert!(codes.contains(&code), "{code}: {codes:?}");
    }
    let because = found.because.join("\n");
    assert!(because.contains("6677") && because.contains("340.00"), "{because}");
    // Refusals stand first.
    assert_eq!(found.complaints[0].severity, scene::Severity::Refusal);
}

#[test]
fn a_design_that_fits_turned_round_says_so() {
    let turned = "[design]\nkind = \"level\"\nlevel_m = 3.4\nboundary = [[-98764.0, 41246.0], [-98757.0, 41246.0], [-98757.0, 41253.0]]\n";
    let found =
        looked(&site("EPSG:6679", &["a.laz"], turned), &[("a.laz", cloud(heap(DVec3::ZERO), ""))]);
    assert!(found.because.join(" ").contains("change places"), "{:?}", found.because);
}

#[test]
fn files_that_are_missing_are_complaints_too() {
    let found = looked(&site("EPSG:4326", &["a.laz", "b.laz"], DESIGN), &[]);
    assert_eq!(found.because.len(), 3, "{:?}", found.because);
    assert!(!found.can_be_answered);
}

#[test]
fn a_fault_of_the_catalogue_names_its_file_and_line_alone() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
    io::points::write(&folder.path().join("a.laz"), &cloud(heap(DVec3::ZERO), "")).unwrap();
    write("site.toml", &site("EPSG:6679", &["a.laz"], DESIGN));
    write("catalog.toml", "[[block]]\nname = \"t\"\nshape = \"sealock 3t\"\n");
    let found = check(folder.path(), &Silent);
    let because = found.because.join("\n");
    assert!(because.contains("catalog.toml, line 3: `sealock`"), "{because}");
    assert!(!because.contains("site.toml"), "{because}");
}

#[test]
fn a_first_site_from_a_survey_alone_can_be_answered() {
    let (folder, elsewhere) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    for (place, inside) in [(folder.path(), true), (elsewhere.path(), false)] {
        let survey = place.join("survey 1.laz");
        io::points::write(&survey, &cloud(heap(DVec3::ZERO), "EPSG:6679")).unwrap();
        let first =
            first_site(std::slice::from_ref(&survey), Some("tetrapod 2m"), folder.path()).unwrap();
        let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
        write("site.toml", &first.site_toml);
        write("catalog.toml", &first.catalog_toml);
        assert!(first.site_toml.contains("crs = \"EPSG:6679\""));
        let named = io::site::load(folder.path()).unwrap().spec.survey[0].file.clone();
        // A survey in the folder goes with it; one elsewhere is named from there.
        assert_eq!(named.components().count() == 1, inside, "{}", named.display());
        let found = check(folder.path(), &Silent);
        assert!(found.can_be_answered, "{:?}", found.because);
        assert!(found.design_covered.unwrap() > 0.9);
    }
    let none = first_site(&[], None, Path::new(".")).unwrap_err().to_string();
    assert!(none.contains("survey"));
    let unknown =
        first_site(&[folder.path().join("survey 1.laz")], Some("sealock 5t"), folder.path());
    assert!(unknown.unwrap_err().to_string().contains("tetrapod"));
}

#[test]
fn heights_that_nothing_has_are_another_column() {
    let turned = heap(DVec3::ZERO).into_iter().map(|p| DVec3::new(p.z, p.x, p.y)).collect();
    let found =
        looked(&site("EPSG:6679", &["a.laz"], ""), &[("a.laz", cloud(turned, "EPSG:6679"))]);
    assert!(codes(&found).contains(&"heights"), "{found:?}");
}

/// `scale-0.1.las`: heights in steps of a tenth of a metre once gave two blocks of sixteen without a word that counts.
#[test]
fn scale_0_1_hides_a_block_and_is_refused() {
    let stepped = |step: f64| {
        let all = heap(DVec3::ZERO).into_iter();
        all.map(|p| DVec3::new(p.x, p.y, (p.z / step).round() * step)).collect()
    };
    let look = |step: f64| {
        let cloud = cloud(stepped(step), "EPSG:6679");
        looked(&site("EPSG:6679", &["a.laz"], DESIGN), &[("a.laz", cloud)])
    };
    let coarse = look(0.1);
    assert!(!coarse.can_be_answered && codes(&coarse).contains(&"step"), "{coarse:?}");
    assert!(coarse.because[0].contains("steps of 0.1 m"), "{:?}", coarse.because);
    let middling = look(0.05);
    assert!(middling.can_be_answered && codes(&middling).contains(&"step"), "{middling:?}");
    assert!(!codes(&look(0.001)).contains(&"step"));
}
