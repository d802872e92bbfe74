//! Hostile folders: a site and a run of it, one file damaged at a time, through everything that reads them. A named error or a
//! result; never a panic. `TSUMU_MUTANTS=20000` for hours of it.

mod before;
#[path = "../../../io/tests/hostile/damage.rs"]
mod damage;

use geom::SeedTree;
use std::fs;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use tempfile::TempDir;
use tsumu::{Georeference, Job, PlanOptions, RecogniseOptions, Run, RunOptions, Settings, Site};

const RECIPE: &str = r#"
name = "small"
count = [2, 2]
density_per_m2 = 60.0
[site]
kind = "pen"
side_blocks = 2.0
[sensor]
kind = "gaussian"
noise_sd_m = 0.01
"#;
const CATALOG: &str =
    "[[block]]\nname = \"tetrapod-5t\"\nshape = { kind = \"tetrapod\", size = 2.0 }\n";
const SITE: &str = r#"
name = "Small"
crs = "EPSG:6679"
vertical_datum = "T.P."
seed = 5
[[survey]]
file = "survey.laz"
sensor = "uav"
vertical_offset_m = 0.0
[plan]
policy = "random"
rounds = 1
[plan.uncertainty]
seeds = 0
[design]
kind = "level"
level_m = 3.4
boundary = [[41248.5, -98761.5], [41251.5, -98761.5], [41251.5, -98758.5], [41248.5, -98758.5]]
"#;

fn mutants(usual: u64) -> u64 {
    std::env::var("TSUMU_MUTANTS").ok().and_then(|n| n.parse().ok()).unwrap_or(usual)
}

fn made() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    for (name, text) in [("recipe.toml", RECIPE), ("catalog.toml", CATALOG), ("site.toml", SITE)] {
        fs::write(at(name), text).unwrap();
    }
    let job = Job::silent();
    let inputs = tsumu::read_recipe(&at("recipe.toml"), Some(&at("catalog.toml")), &job).unwrap();
    let place = Georeference { crs: "EPSG:6679".into(), origin: [41250.0, -98760.0, 1.5] };
    tsumu::make_site(folder.path(), &inputs, 3, &place).unwrap();
    fs::remove_dir_all(at("truth")).unwrap();
    fs::remove_file(at("recipe.toml")).unwrap();
    folder
}

/// Relative names of all files below a folder, sorted.
fn names(folder: &Path) -> Vec<PathBuf> {
    let (mut found, mut open) = (Vec::new(), vec![folder.to_path_buf()]);
    while let Some(here) = open.pop() {
        for item in fs::read_dir(here).unwrap() {
            let path = item.unwrap().path();
            if path.is_dir() {
                open.push(path);
            } else {
                found.push(path.strip_prefix(folder).unwrap().to_path_buf());
            }
        }
    }
    found.sort();
    found
}

/// Counts what became of mutants.
#[derive(Default)]
struct Told {
    tried: u64,
    refused: u64,
}

impl Told {
    #[track_caller]
    fn hear(&mut self, what: &str, work: impl FnOnce() -> tsumu::Result<()>) {
        self.tried += 1;
        match catch_unwind(AssertUnwindSafe(work)) {
            Ok(Ok(())) => {}
            Ok(Err(error)) => {
                self.refused += 1;
                let line = error.line();
                assert!(!line.is_empty() && !line.contains('\n'), "{what}: {line}");
            }
            Err(_) => panic!("a panic at {what}"),
        }
    }
}

/// Everything that reads a run; to the end of what follows from it, a page, exports and a plan, where `to_the_end`.
fn reads_a_run(site: &Site, run: &Path, scratch: &Path, to_the_end: bool) -> tsumu::Result<()> {
    let job = Job::silent();
    let verified = Run::verify(run, site.folder.as_deref());
    let opened = Run::open(run, site);
    let found = Run::open_recognition(run, site, &job);
    if let Ok(opened) = opened.as_ref()
        && to_the_end
    {
        opened.report(site, &job)?;
        opened.export(site, scratch)?;
    }
    if let Ok(found) = found
        && to_the_end
    {
        site.plan(&found, &PlanOptions::default(), &job)?;
    }
    verified.and(opened.map(drop))
}

#[test]
fn no_damage_of_a_run_folder_ends_in_a_panic() {
    let site_folder = made();
    let job = Job::silent();
    let site = Site::load(site_folder.path(), &job).unwrap();
    let run = site_folder.path().join("run");
    tsumu::run(&site, &run, &RunOptions::default(), &job).unwrap();
    let scratch = tempfile::tempdir().unwrap();
    // What nobody reads again is left out; `verify` sees it by its hash.
    let read = |name: &&PathBuf| {
        let ending = name.extension().and_then(|e| e.to_str()).unwrap_or_default();
        ["csv", "json", "toml", "laz"].contains(&ending) && !name.starts_with("exports")
    };
    let all = names(&run);
    let targets: Vec<&PathBuf> = all.iter().filter(read).collect();
    assert!(targets.len() >= 8, "{all:?}");
    let mut told = Told::default();
    let manifest = fs::read(run.join("manifest.json")).unwrap();
    for i in 0..mutants(240) {
        let name = targets[(i % targets.len() as u64) as usize];
        let (path, own) = (run.join(name), fs::read(run.join(name)).unwrap());
        let tree = SeedTree::new(22).child("run", i);
        fs::write(&path, damage::damaged(&own, tree.child("damage", 0))).unwrap();
        // With its manifest most damage is refused at once; as a folder put together by hand it is read to its end.
        let by_hand =
            !(i / targets.len() as u64).is_multiple_of(4) && !name.ends_with("manifest.json");
        if by_hand {
            fs::remove_file(run.join("manifest.json")).unwrap();
        }
        let what = format!("mutant {i} of {}", name.display());
        told.hear(&what, || {
            let settled = Run::settled(&run, Site::load(site_folder.path(), &job)?, &job)?;
            reads_a_run(&settled, &run, scratch.path(), i % 5 == 2)
        });
        fs::write(&path, own).unwrap();
        fs::write(run.join("manifest.json"), &manifest).unwrap();
    }
    println!("{} mutants of a run folder, {} refused", told.tried, told.refused);
    assert!(told.refused > told.tried / 4, "{} of {}", told.refused, told.tried);
}

#[test]
fn no_damage_of_a_site_ends_in_a_panic() {
    let site_folder = made();
    let mut told = Told::default();
    let all = names(site_folder.path());
    assert_eq!(all.len(), 3, "{all:?}");
    let settings =
        Settings { plans: Some(0), memory: Some("2GB".parse().unwrap()), ..Settings::default() };
    for i in 0..mutants(240) {
        let name = &all[(i % 3) as usize];
        let path = site_folder.path().join(name);
        let own = fs::read(&path).unwrap();
        let tree = SeedTree::new(23).child("site", i);
        let mutant = damage::damaged(&own, tree.child("damage", 0));
        fs::write(&path, &mutant).unwrap();
        told.hear(&format!("mutant {i} of {}", name.display()), || {
            let job = Job::silent();
            let site = Site::load_checked(site_folder.path(), &settings, &job)?;
            // A damaged survey is recognised like any other; every eighth to its end.
            if i % 8 == 0 {
                let out = tempfile::tempdir().unwrap();
                tsumu::run(&site, &out.path().join("run"), &RunOptions::default(), &job)?;
            } else if i % 8 == 4 {
                site.recognise(&RecogniseOptions::default(), &job)?;
            }
            Ok(())
        });
        fs::write(&path, own).unwrap();
    }
    println!("{} mutants of a site, {} refused", told.tried, told.refused);
    assert!(told.refused > told.tried / 4, "{} of {}", told.refused, told.tried);
}
