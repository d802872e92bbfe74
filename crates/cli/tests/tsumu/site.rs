//! A tiny synthetic site on disk, made by the program itself, and a way to run the program.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::OnceLock;
use tempfile::TempDir;

pub const RECIPE: &str = r#"
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

pub const CATALOG: &str = r#"
[[block]]
name = "tetrapod-5t"
shape = { kind = "tetrapod", size = 2.0 }
"#;

pub const SITE: &str = r#"
name = "Tiny <site> & test"
crs = "EPSG:6679"
vertical_datum = "T.P."
seed = 5

[[survey]]
file = "survey.laz"
sensor = "uav"
vertical_offset_m = 0.0

[design]
kind = "level"
level_m = 4.4
boundary = [[41247.0, -98763.0], [41253.0, -98763.0], [41253.0, -98757.0], [41247.0, -98757.0]]
"#;

/// Three blocks in a pen: what is run hundreds of times.
const SMALL_RECIPE: &str = r#"
name = "small"
count = [3, 3]
density_per_m2 = 120.0

[site]
kind = "pen"
side_blocks = 2.2

[sensor]
kind = "gaussian"
noise_sd_m = 0.01
"#;

const SMALL_SITE: &str = r#"
name = "Small"
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
boundary = [[41248.5, -98761.5], [41251.5, -98761.5], [41251.5, -98758.5], [41248.5, -98758.5]]
"#;

/// What a call printed and how it ended.
pub struct Ran {
    pub code: i32,
    pub out: String,
    pub err: String,
}

impl From<Output> for Ran {
    fn from(output: Output) -> Self {
        Self {
            code: output.status.code().expect("not killed"),
            out: String::from_utf8_lossy(&output.stdout).into_owned(),
            err: String::from_utf8_lossy(&output.stderr).into_owned(),
        }
    }
}

/// Runs the program, as if there were no screen: without arguments it would open its page.
pub fn tsumu<A: AsRef<std::ffi::OsStr>>(args: &[A]) -> Ran {
    Command::new(env!("CARGO_BIN_EXE_tsumu"))
        .args(args)
        .env_remove("DISPLAY")
        .env_remove("WAYLAND_DISPLAY")
        .env("LC_ALL", "C")
        .output()
        .expect("the program starts")
        .into()
}

/// Runs it and expects success.
pub fn ok<A: AsRef<std::ffi::OsStr> + std::fmt::Debug>(args: &[A]) -> Ran {
    let ran = tsumu(args);
    assert_eq!(ran.code, 0, "tsumu {args:?}\n{}\n{}", ran.out, ran.err);
    ran
}

/// The site every test may read; made once. Tests that change something copy it.
pub fn shared() -> &'static Path {
    static SITE_FOLDER: OnceLock<TempDir> = OnceLock::new();
    SITE_FOLDER.get_or_init(|| made(RECIPE, SITE)).path()
}

/// A smaller one, for tests that run it often.
pub fn small() -> &'static Path {
    static SITE_FOLDER: OnceLock<TempDir> = OnceLock::new();
    SITE_FOLDER.get_or_init(|| made(SMALL_RECIPE, SMALL_SITE)).path()
}

fn made(recipe: &str, site: &str) -> TempDir {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = |name: &str| folder.path().join(name);
    std::fs::write(at("recipe.toml"), recipe).unwrap();
    std::fs::write(at("catalog.toml"), CATALOG).unwrap();
    std::fs::write(at("site.toml"), site).unwrap();
    let p = |name: &str| at(name).display().to_string();
    ok(&[
        "synth",
        &p("recipe.toml"),
        "--catalog",
        &p("catalog.toml"),
        "--seed",
        "3",
        "--site-crs",
        "EPSG:6679",
        "--site-origin",
        "41250,-98760,1.5",
        "--out",
        &p(""),
    ]);
    folder
}

/// A copy of the shared site that a test may spoil.
pub fn copy() -> TempDir {
    copy_of(shared())
}

/// A copy of the small site.
pub fn small_copy() -> TempDir {
    copy_of(small())
}

fn copy_of(site: &Path) -> TempDir {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for name in ["site.toml", "catalog.toml", "survey.laz"] {
        std::fs::copy(site.join(name), folder.path().join(name)).unwrap();
    }
    folder
}

/// Every file below a folder with its bytes, by relative path.
pub fn files(folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let mut found = Vec::new();
    let mut open = vec![folder.to_path_buf()];
    while let Some(dir) = open.pop() {
        for entry in std::fs::read_dir(&dir).unwrap() {
            let path = entry.unwrap().path();
            match path.is_dir() {
                true => open.push(path),
                false => found.push((
                    path.strip_prefix(folder).unwrap().to_path_buf(),
                    std::fs::read(&path).unwrap(),
                )),
            }
        }
    }
    found.sort();
    found
}
