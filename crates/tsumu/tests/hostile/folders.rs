//! A site and a run of it with one file damaged, through everything that reads them: what the mutants of this test and the fuzz
//! targets have in common.

use std::fs;
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

/// A site folder: site.toml, catalog.toml and survey.laz.
pub fn site_folder() -> TempDir {
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

/// A finished run of it, inside it.
pub fn run_of(site_folder: &Path) -> PathBuf {
    let job = Job::silent();
    let site = Site::load(site_folder, &job).unwrap();
    let run = site_folder.join("run");
    tsumu::run(&site, &run, &RunOptions::default(), &job).unwrap();
    run
}

/// Relative names of all files below a folder, sorted.
pub fn names(folder: &Path) -> Vec<PathBuf> {
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

/// Files of a run that are read again. `verify` sees the others by their hash.
pub fn read_again(run: &Path) -> Vec<PathBuf> {
    let read = |name: &PathBuf| {
        let ending = name.extension().and_then(|e| e.to_str()).unwrap_or_default();
        ["csv", "json", "toml", "laz"].contains(&ending) && !name.starts_with("exports")
    };
    names(run).into_iter().filter(read).collect()
}

/// How much is done with what was read.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Depth {
    /// Read only.
    Read,
    /// Recognised, too; of a run nothing.
    Recognise,
    /// To the end: a whole run of a site; page, exports and a plan of a run.
    End,
}

/// A run of which one file has this content. With its manifest most damage is refused at once; without one, as a folder put
/// together by hand, it is read to its end.
pub fn through_a_run(
    site_folder: &Path,
    (name, content): (&Path, &[u8]),
    by_hand: bool,
    depth: Depth,
) -> tsumu::Result<()> {
    let run = site_folder.join("run");
    let (path, manifest) = (run.join(name), run.join("manifest.json"));
    let [own, manifest_own] = [&path, &manifest].map(|p| fs::read(p).unwrap());
    fs::write(&path, content).unwrap();
    if by_hand {
        fs::remove_file(&manifest).unwrap();
    }
    let job = Job::silent();
    let read = || {
        let settled = Run::settled(&run, Site::load(site_folder, &job)?, &job)?;
        reads_a_run(&settled, &run, depth == Depth::End)
    };
    let told = read();
    fs::write(&path, own).unwrap();
    fs::write(&manifest, manifest_own).unwrap();
    told
}

fn reads_a_run(site: &Site, run: &Path, to_the_end: bool) -> tsumu::Result<()> {
    let job = Job::silent();
    let verified = Run::verify(run, site.folder.as_deref());
    let opened = Run::open(run, site);
    let found = Run::open_recognition(run, site, &job);
    if let Ok(opened) = opened.as_ref()
        && to_the_end
    {
        let scratch = tempfile::tempdir().unwrap();
        opened.report(site, &job)?;
        opened.export(site, scratch.path())?;
    }
    if let Ok(found) = found
        && to_the_end
    {
        site.plan(&found, &PlanOptions::default(), &job)?;
    }
    verified.and(opened.map(drop))
}

/// A site of which one file has this content.
pub fn through_a_site(
    site_folder: &Path,
    (name, content): (&Path, &[u8]),
    depth: Depth,
) -> tsumu::Result<()> {
    let path = site_folder.join(name);
    let own = fs::read(&path).unwrap();
    fs::write(&path, content).unwrap();
    let told = reads_a_site(site_folder, depth);
    fs::write(&path, own).unwrap();
    told
}

fn reads_a_site(site_folder: &Path, depth: Depth) -> tsumu::Result<()> {
    let job = Job::silent();
    let settings =
        Settings { plans: Some(0), memory: Some("2GB".parse().unwrap()), ..Settings::default() };
    let site = Site::load_checked(site_folder, &settings, &job)?;
    match depth {
        Depth::Read => Ok(()),
        Depth::Recognise => site.recognise(&RecogniseOptions::default(), &job).map(drop),
        Depth::End => {
            let out = tempfile::tempdir().unwrap();
            tsumu::run(&site, &out.path().join("run"), &RunOptions::default(), &job).map(drop)
        }
    }
}
