//! Everything that looks at surveys before they are worked on: `check`, `init`, sizes from surveys alone. Surveys, designs and tables of
//! every kind, damaged one at a time.

use crate::{Told, damage, mutants};
use geom::{DVec3, SeedTree};
use std::fs;
use std::path::Path;
use tsumu::Job;

const SITE: &str = "name = \"a\"\ncrs = \"EPSG:6679\"\n[[survey]]\nfile = \"SURVEY\"\nsensor = \"uav\"\nvertical_offset_m = 0.0\nleave_out = [5, \"overlap\"]\nkeep = [9]\n";
const LEVEL: &str = "[design]\nkind = \"level\"\nlevel_m = 3.4\nboundary = [[41247.0, -98763.0], [41253.0, -98763.0], [41253.0, -98757.0], [41247.0, -98757.0]]\n";
const CATALOG: &str = "[[block]]\nname = \"t\"\nshape = \"tetrapod 5t\"\n";
const LANDXML: &str = "<?xml version=\"1.0\" encoding=\"UTF-8\"?><LandXML><Units><Metric linearUnit=\"meter\" elevationUnit=\"meter\"/></Units><CoordinateSystem horizontalDatum=\"JGD2011\" horizontalCoordinateSystemName=\"11(X,Y)\"/><Surfaces><Surface name=\"FG\"><Definition surfType=\"TIN\"><Pnts><P id=\"1\">-98763 41247 3.4</P><P id=\"2\">-98763 41253 3.4</P><P id=\"3\">-98757 41253 3.4</P><P id=\"4\">-98757 41247 3.4</P></Pnts><Faces><F>1 2 3</F><F>1 3 4</F></Faces></Definition></Surface></Surfaces></LandXML>";

fn points() -> Vec<DVec3> {
    let at = |i: usize| {
        let t = i as f64;
        let (x, y) = ((t * 0.371).sin() * 4.0, (t * 0.613).cos() * 4.0);
        DVec3::new(41_250.0 + x, -98_760.0 + y, 3.0 - 0.2 * x.abs() + (t * 1.7).sin() * 0.2)
    };
    (0..400).map(at).collect()
}

/// Surveys of every kind, by name.
fn surveys(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let points = points();
    let cloud = io::RawCloud {
        position: points.clone(),
        line: Some((0..400).map(|i| 1 + i / 100).collect()),
        crs: Some("EPSG:6679".into()),
        ..io::RawCloud::default()
    };
    let mut all = Vec::new();
    for name in ["a.laz", "a.las", "a.ply"] {
        let path = folder.join(name);
        io::points::write(&path, &cloud).unwrap();
        all.push((name.to_string(), fs::read(&path).unwrap()));
        fs::remove_file(path).unwrap();
    }
    let rows = |turned: bool, sign: &str, end: &str| -> String {
        let row = |(i, p): (usize, &DVec3)| {
            let (a, b) = if turned { (p.y, p.x) } else { (p.x, p.y) };
            format!("{i}{sign}{a:.3}{sign}{b:.3}{sign}{:.3}{sign}{}{end}", p.z, 1 + i % 9)
        };
        points.iter().enumerate().map(row).collect()
    };
    let head =
        "# +proj=tmerc +lat_0=44 +lon_0=140.25 +k=0.9999 +x_0=0 +y_0=0 +ellps=GRS80 +units=m\n";
    let english =
        format!("{head}No,East,North,Height (m),Classification\n{}", rows(false, ",", "\n"));
    let japanese =
        format!("点番;X座標(北);Y座標(東);標高;分類\r{}", rows(true, ";", "\r").replace('.', ","));
    all.push(("a.csv".into(), english.into_bytes()));
    all.push(("a.txt".into(), japanese.encode_utf16().flat_map(u16::to_le_bytes).collect()));
    let pcd = format!(
        "# .PCD v0.7\n# EPSG:6679\nVERSION 0.7\nFIELDS n x y z classification\nSIZE 4 8 8 8 1\nTYPE U F F F U\nCOUNT 1 1 1 1 1\nWIDTH 400\nHEIGHT 1\nVIEWPOINT 41250 -98790 9 1 0 0 0\nPOINTS 400\nDATA ascii\n{}",
        rows(false, " ", "\n")
    );
    all.push(("a.pcd".into(), pcd.into_bytes()));
    all
}

/// A site of one survey, checked, and a first site from it. What is wrong becomes complaints, a line each.
fn look(folder: &Path, survey: &Path) -> tsumu::Result<()> {
    let job = Job::silent();
    let found = preflight::check(folder, &geom::Silent);
    assert!(found.because.iter().all(|line| !line.is_empty() && line.len() < 4000));
    let first = tempfile::tempdir().unwrap();
    let made = tsumu::init(&[survey.to_path_buf()], Some("tetrapod 5t"), first.path(), &job);
    if made.is_ok() {
        // What it writes is a site, or says what is wrong with its survey.
        io::site::load(first.path()).map_err(tsumu::Error::bad_input)?;
    }
    match tsumu::cannot(&found) {
        Some(error) => Err(error),
        None => made.map(drop),
    }
}

#[test]
fn no_damage_of_any_survey_ends_a_check_in_a_panic() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let all = surveys(folder.path());
    fs::write(path("catalog.toml"), CATALOG).unwrap();
    let mut told = Told::default();
    for (number, (name, own)) in all.iter().enumerate() {
        fs::write(path("site.toml"), SITE.replace("SURVEY", name) + LEVEL).unwrap();
        fs::write(path(name), own).unwrap();
        look(folder.path(), &path(name))
            .unwrap_or_else(|e| panic!("{name}, undamaged: {}", e.line()));
        let tree = SeedTree::new(31).child("survey", number as u64);
        for i in 0..mutants(40 * all.len() as u64) / all.len() as u64 {
            fs::write(path(name), damage::damaged(own, tree.child("mutant", i))).unwrap();
            told.hear(&format!("mutant {i} of {name}"), || look(folder.path(), &path(name)));
        }
        fs::remove_file(path(name)).unwrap();
    }
    println!("{} mutants of surveys before a run, {} refused", told.tried, told.refused);
    assert!(told.refused > told.tried / 4, "{} of {}", told.refused, told.tried);
}

#[test]
fn no_damage_of_a_site_or_its_design_ends_a_check_in_a_panic() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    // One that says nothing of its system, so that the file beside it does.
    let (name, survey) = surveys(folder.path()).remove(4);
    fs::write(path(&name), survey).unwrap();
    let site = SITE.replace("SURVEY", &name);
    let prj = io::crs::wkt_of_epsg(6679).unwrap();
    let by_file = "[design_file]\nfile = \"d.xml\"\ncell_m = 0.5\nsurface = \"FG\"\n";
    let files = [
        ("site.toml", site.clone() + LEVEL),
        ("catalog.toml", CATALOG.to_string()),
        ("site.toml", site + by_file),
        ("d.xml", LANDXML.to_string()),
        ("a.prj", prj),
    ];
    for (name, text) in &files {
        fs::write(path(name), text).unwrap();
    }
    let mut told = Told::default();
    for (number, (name, own)) in files.iter().enumerate() {
        fs::write(path(name), own).unwrap();
        let tree = SeedTree::new(37).child("file", number as u64);
        for i in 0..mutants(200) / files.len() as u64 {
            fs::write(path(name), damage::damaged(own.as_bytes(), tree.child("mutant", i)))
                .unwrap();
            told.hear(&format!("mutant {i} of {name}"), || {
                let found = preflight::check(folder.path(), &geom::Silent);
                tsumu::cannot(&found).map_or(Ok(()), Err)
            });
        }
        fs::write(path(name), own).unwrap();
    }
    println!("{} mutants of a site before a run, {} refused", told.tried, told.refused);
    assert!(told.refused > told.tried / 5, "{} of {}", told.refused, told.tried);
}

/// Kind and size from damaged surveys: dear, so few of them.
#[test]
fn sizes_from_damaged_surveys() {
    let folder = tempfile::tempdir().unwrap();
    let (name, own) = surveys(folder.path()).remove(0);
    let path = folder.path().join(&name);
    let mut told = Told::default();
    for i in 0..(mutants(200) / 10) {
        let tree = SeedTree::new(41).child("mutant", i);
        fs::write(&path, damage::damaged(&own, tree)).unwrap();
        told.hear(&format!("mutant {i} of {name}"), || {
            let job = Job::silent();
            let clouds = tsumu::Clouds { files: vec![path.clone()], ..tsumu::Clouds::default() };
            let cubes = tsumu::FitOptions {
                kinds: vec!["cube".into()],
                least_m: 1.8,
                most_m: 2.2,
                ..tsumu::FitOptions::default()
            };
            tsumu::fit_blocks(&clouds, &cubes, &job).map(drop)
        });
    }
    println!("{} mutants for sizes, {} refused", told.tried, told.refused);
}
