//! A tiny synthetic site on disk with blocks of two types, some of which are not judged.

use std::path::Path;
use std::sync::OnceLock;
use tempfile::TempDir;
use tsumu::{Georeference, Job, Run, RunOptions, Site};

const RECIPE: &str = r#"
name = "tiny"
count = [7, 7]
density_per_m2 = 220.0

[site]
kind = "pen"
side_blocks = 3.2

[sensor]
kind = "gaussian"
noise_sd_m = 0.01
"#;

const CATALOG: &str = r#"
[[block]]
name = "tetrapod-5t"
shape = { kind = "tetrapod", size = 2.0 }

[[block]]
name = "cube-4t"
shape = { kind = "cube", size = 1.2 }
"#;

/// A site of the tiny survey, some of whose blocks do not reach the confidence they are held to.
pub fn site() -> &'static str {
    static TEXT: OnceLock<String> = OnceLock::new();
    TEXT.get_or_init(|| {
        let with = |confidence: f32| SITE.replace("CONFIDENCE", &format!("{confidence:?}"));
        let (folder, job) = (site_folder(&with(0.0)), Job::silent());
        let site = Site::load(folder.path(), &job).unwrap();
        let found = site.recognise(&Default::default(), &job).unwrap();
        let fits = scene::stated(&found.blocks).filter_map(|(_, fit)| fit.confidence);
        let mut all: Vec<f32> = fits.collect();
        all.sort_by(f32::total_cmp);
        with(0.5 * (all[all.len() / 2 - 1] + all[all.len() / 2]))
    })
}

const SITE: &str = r#"
name = "Tiny <site> & test"
crs = "EPSG:6679"
vertical_datum = "T.P."
seed = 5

[[survey]]
file = "survey.laz"
sensor = "uav"
vertical_offset_m = 0.0

[pose.evidence]
min_confidence = CONFIDENCE

[plan]
rounds = 1
block = "tetrapod-5t"

[plan.uncertainty]
seeds = 1

[design]
kind = "level"
level_m = 4.4
boundary = [[41247.0, -98763.0], [41253.0, -98763.0], [41253.0, -98757.0], [41247.0, -98757.0]]
"#;

fn survey() -> &'static Path {
    static FOLDER: OnceLock<TempDir> = OnceLock::new();
    FOLDER
        .get_or_init(|| {
            let folder = tempfile::tempdir().unwrap();
            let at = |name: &str| folder.path().join(name);
            std::fs::write(at("recipe.toml"), RECIPE).unwrap();
            std::fs::write(at("catalog.toml"), CATALOG).unwrap();
            let job = Job::silent();
            let inputs =
                tsumu::read_recipe(&at("recipe.toml"), Some(&at("catalog.toml")), &job).unwrap();
            let place = Georeference { crs: "EPSG:6679".into(), origin: [41250.0, -98760.0, 1.5] };
            tsumu::make_site(folder.path(), &inputs, 3, &place).unwrap();
            folder
        })
        .path()
}

/// A site folder that a test may spoil.
pub fn site_folder(site_toml: &str) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    for name in ["catalog.toml", "survey.laz"] {
        std::fs::copy(survey().join(name), folder.path().join(name)).unwrap();
    }
    std::fs::write(folder.path().join("site.toml"), site_toml).unwrap();
    folder
}

/// Runs a site folder into its `run`.
pub fn run(folder: &Path) -> Site {
    let job = Job::silent();
    let site = Site::load(folder, &job).unwrap();
    tsumu::run(&site, &folder.join("run"), &RunOptions::default(), &job).unwrap();
    site
}

/// Opens it again.
pub fn open(folder: &Path) -> (Site, Run) {
    let site = Site::load(folder, &Job::silent()).unwrap();
    let run = Run::open(&folder.join("run"), &site).unwrap();
    (site, run)
}
