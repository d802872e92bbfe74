//! Measurements: times of the kernels, and recognition on held-out piles of the six site-sensor sets.

use crate::check::built;
use crate::process::{cargo, command, done};
use crate::root;
use anyhow::{Context, Result, bail};
use std::path::{Path, PathBuf};
use std::time::Instant;
use toml::{Table, Value};

const SITES: [&str; 3] = ["sawara", "todohokke", "era"];
/// Sensor and the thesis' white noise for it, metres.
const SENSORS: [(&str, f64); 2] = [("uav", 0.01), ("mbes", 0.03)];

pub fn bench(args: &[&str]) -> Result<()> {
    match args {
        ["kernels", filter @ ..] => kernels(filter),
        ["sites", rest @ ..] => sites(&Sites::read(rest)?),
        ["trust", rest @ ..] => crate::trust::trust(rest),
        _ => bail!(
            "what to measure: `bench kernels [FILTER]`, `bench sites OUT [...]` or `bench trust OUT [...]`"
        ),
    }
}

fn kernels(filter: &[&str]) -> Result<()> {
    done(cargo(
        &[&["bench", "--locked", "-p", "kernels", "--bench", "kernels", "--"], filter].concat(),
    ))
}

/// What `bench sites` is asked for.
struct Sites {
    out: PathBuf,
    scenes: u64,
    seed: u64,
    white_noise: bool,
}

impl Sites {
    fn read(args: &[&str]) -> Result<Self> {
        let (mut out, mut scenes, mut seed, mut white_noise) = (None, 3, 900_001, false);
        let mut rest = args.iter();
        let number = |word: Option<&&str>, flag: &str| -> Result<u64> {
            let word = word.with_context(|| format!("{flag} needs a number"))?;
            word.parse().with_context(|| format!("{flag} {word} is not a number"))
        };
        while let Some(&arg) = rest.next() {
            match arg {
                "--scenes" => scenes = number(rest.next(), arg)?,
                "--seed" => seed = number(rest.next(), arg)?,
                "--white-noise" => white_noise = true,
                other if !other.starts_with('-') && out.is_none() => out = Some(other.into()),
                other => bail!(
                    "`{other}` is not understood; OUT [--scenes N] [--seed SEED] [--white-noise]"
                ),
            }
        }
        Ok(Self {
            out: out.context("OUT, the folder for scenes and results, is missing")?,
            scenes,
            seed,
            white_noise,
        })
    }
}

fn sites(asked: &Sites) -> Result<()> {
    std::fs::create_dir_all(&asked.out)?;
    let out = asked.out.canonicalize()?;
    done(cargo(&["build", "--release", "--locked", "--bin", "tsumu"]))?;
    let tsumu = built().join("release/tsumu").display().to_string();
    for site in SITES {
        for (sensor, noise_sd_m) in SENSORS {
            let name = format!("{site}-{sensor}");
            let recipe_path = root().join("recipes").join(format!("{name}.toml"));
            let mut recipe = read(&recipe_path)?;
            if asked.white_noise {
                recipe.insert("sensor".into(), white_noise(sensor, noise_sd_m));
            }
            let made_of = out.join(format!("{name}.toml"));
            std::fs::write(&made_of, toml::to_string(&recipe)?)?;
            let set = Set { tsumu: &tsumu, name: &name, sensor, made_of: &made_of, out: &out };
            set.measure(&catalogue(&recipe)?, asked)?;
        }
    }
    Ok(())
}

fn read(path: &Path) -> Result<Table> {
    let text = std::fs::read_to_string(path).with_context(|| path.display().to_string())?;
    text.parse().with_context(|| path.display().to_string())
}

/// The thesis' sensor: white noise, one viewpoint.
fn white_noise(sensor: &str, noise_sd_m: f64) -> Value {
    let table: Table = [
        ("kind".to_owned(), "gaussian".into()),
        ("noise_sd_m".to_owned(), noise_sd_m.into()),
        ("measured_as".to_owned(), sensor.into()),
    ]
    .into_iter()
    .collect();
    table.into()
}

/// The recipe's blocks as a catalogue file.
fn catalogue(recipe: &Table) -> Result<Table> {
    let blocks = recipe.get("catalog").and_then(|c| c.get("block"));
    let blocks = blocks.context("the recipe has no [[catalog.block]]")?.clone();
    Ok([("block".to_owned(), blocks)].into_iter().collect())
}

/// One site measured by one sensor.
struct Set<'a> {
    tsumu: &'a str,
    name: &'a str,
    sensor: &'a str,
    made_of: &'a Path,
    out: &'a Path,
}

impl Set<'_> {
    fn measure(&self, catalogue: &Table, asked: &Sites) -> Result<()> {
        let text = |path: &Path| path.display().to_string();
        let folder = self.out.join(self.name);
        let (scenes, seed) = (asked.scenes.to_string(), asked.seed.to_string());
        let made_of = text(self.made_of);
        let into = text(&folder);
        done(command(
            self.tsumu,
            ["synth", &made_of, "--scenes", &scenes, "--seed", &seed, "--out", &into, "--quiet"],
        ))?;
        let catalogue_path = folder.join("catalog.toml");
        std::fs::write(&catalogue_path, toml::to_string(catalogue)?)?;
        let results = self.out.join("result").join(self.name);
        let start = Instant::now();
        for scene in scenes_of(&folder.join("scenes"))? {
            let name = scene.file_name().context("a scene's folder has a name")?;
            let mut recognise = command(self.tsumu, ["recognise", &text(&scene.join("cloud.ply"))]);
            // The boat's and the drone's positions are known, as they are in a survey with its trajectory.
            recognise.args(sensor_positions(&scene.join("scene.json"))?);
            recognise.args([
                "--catalog",
                &text(&catalogue_path),
                "--sensor",
                self.sensor,
                "--seed",
                "1",
            ]);
            recognise.args(["--out", &text(&results.join(name)), "--quiet"]);
            done(recognise)?;
        }
        let seconds = start.elapsed().as_secs_f64();
        println!("== {}: {scenes} scenes, recognised in {seconds:.1} s", self.name);
        let scores = text(&self.out.join(format!("{}.json", self.name)));
        let (truth, result) = (text(&folder.join("scenes")), text(&results));
        let catalogue = text(&catalogue_path);
        let args = ["--truth", &truth, "--result", &result, "--catalog", &catalogue];
        done(command(self.tsumu, [&["evaluate"], &args[..], &["--out", &scores]].concat()))
    }
}

fn scenes_of(folder: &Path) -> Result<Vec<PathBuf>> {
    let entries = std::fs::read_dir(folder).with_context(|| folder.display().to_string())?;
    let mut scenes: Vec<PathBuf> =
        entries.map(|e| Ok(e?.path())).collect::<Result<_, std::io::Error>>()?;
    scenes.retain(|s| s.is_dir());
    scenes.sort();
    Ok(scenes)
}

/// `--sensor-position=X,Y,Z` for each place of the sensor that a scene's file names.
fn sensor_positions(scene: &Path) -> Result<Vec<String>> {
    let text = std::fs::read_to_string(scene).with_context(|| scene.display().to_string())?;
    let value: serde_json::Value = serde_json::from_str(&text)?;
    let places = value.get("sensor_positions").and_then(|p| p.as_array());
    let places = places.with_context(|| format!("{}: no sensor_positions", scene.display()))?;
    let flag = |place: &serde_json::Value| {
        let numbers: Vec<String> =
            place.as_array().into_iter().flatten().map(ToString::to_string).collect();
        format!("--sensor-position={}", numbers.join(","))
    };
    Ok(places.iter().map(flag).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_of_a_command_are_read_or_named() {
        let read = Sites::read(&["out", "--scenes", "2", "--white-noise"]).unwrap();
        assert!(read.scenes == 2 && read.seed == 900_001 && read.white_noise);
        let error = |args: &[&str]| Sites::read(args).err().expect("refused").to_string();
        assert!(error(&["out", "--scenes", "two"]).contains("two"));
        assert!(error(&["out", "--sences", "2"]).contains("--sences"));
        assert!(error(&[]).contains("OUT"));
    }

    #[test]
    fn every_recipe_of_a_set_has_a_catalogue_and_takes_the_white_noise() {
        for site in SITES {
            for (sensor, noise) in SENSORS {
                let path = root().join("recipes").join(format!("{site}-{sensor}.toml"));
                let mut recipe = read(&path).unwrap();
                assert!(
                    toml::to_string(&catalogue(&recipe).unwrap()).unwrap().contains("[[block]]")
                );
                assert!(recipe.insert("sensor".into(), white_noise(sensor, noise)).is_some());
                assert!(toml::to_string(&recipe).unwrap().contains("kind = \"gaussian\""));
            }
        }
    }
}
