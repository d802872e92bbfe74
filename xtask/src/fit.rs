//! Fits a fitted vector anew: one command each, whatever it is made of.

use crate::check::built;
use crate::process::{cargo, command, done};
use crate::root;
use anyhow::{Context, Result, bail};
use std::path::Path;

/// A vector that data decided, and how to decide it again.
struct Fit {
    name: &'static str,
    /// What it is and where it stands.
    about: &'static str,
    run: fn(&Path) -> Result<()>,
}

const FITS: &[Fit] = &[
    Fit {
        name: "votes-tetrapod",
        about: "vote width and confidence curve of the shipped weights for tetrapods, in the weights' header",
        run: |out| votes("tetrapod", out),
    },
    Fit {
        name: "votes-any-shape",
        about: "the same of the weights for any shape",
        run: |out| votes("any-shape", out),
    },
    Fit {
        name: "pose-confidence",
        about: "weights of the pose stage's confidence, crates/pose/fitted/confidence.txt and among-confidence.txt",
        run: pose_confidence,
    },
    Fit {
        name: "type-confidence",
        about: "what the type's margin says, crates/pose/fitted/type-confidence.txt",
        run: type_confidence,
    },
];

pub fn fit(args: &[&str]) -> Result<()> {
    let (name, out) = match args {
        [] => {
            for fit in FITS {
                println!("{:<22}{}", fit.name, fit.about);
            }
            return Ok(());
        }
        [name] => (*name, built().join("fit").join(name)),
        [name, out] => (*name, (*out).into()),
        _ => bail!("`fit NAME [OUT]`"),
    };
    let fit = FITS.iter().find(|f| f.name == name);
    let fit = fit.with_context(|| {
        format!("nothing named `{name}` is fitted; `cargo xtask fit` lists what is")
    })?;
    std::fs::create_dir_all(&out)?;
    (fit.run)(&out)?;
    println!("{}: {}", fit.name, out.display());
    Ok(())
}

/// Fits the curve of shipped weights; `OUT/model.safetensors` is the file with the new curve, of which `tsumu-lab halve` makes what
/// is shipped.
fn votes(weights: &str, out: &Path) -> Result<()> {
    let model = root().join(format!("crates/segment/weights/{weights}.safetensors"));
    let [model, made] = [model, out.join("model.safetensors")].map(|p| p.display().to_string());
    let program = ["run", "--release", "--locked", "-p", "reproduce", "--example", "fit_votes"];
    done(cargo(&[&program[..], &["--", &model, &made]].concat()))
}

/// Makes piles and scenes without blocks from two seeds and fits the weights to the features of every accepted block; how well
/// each seed is predicted from the other is told on the standard error. `OUT/confidence.txt` and `OUT/among-confidence.txt` are the new files.
fn pose_confidence(out: &Path) -> Result<()> {
    let program = fitter()?;
    let file = |name: &str| out.join(name).display().to_string();
    let seeds = SEEDS.map(|seed| (seed, file(&format!("features-{seed}.csv"))));
    for (seed, features) in &seeds {
        done(command(&program, ["collect", seed, "1", features]))?;
    }
    let [(_, first), (_, second)] = &seeds;
    done(command(&program, ["fit", first, second, &out.display().to_string()]))
}

/// Makes piles of two types that are easily mixed up from two seeds and fits what a margin says to the blocks that are in their
/// places. `OUT/type-confidence.txt` is the file with the new weights.
fn type_confidence(out: &Path) -> Result<()> {
    let program = fitter()?;
    let file = |name: &str| out.join(name).display().to_string();
    let seeds = SEEDS.map(|seed| (seed, file(&format!("types-{seed}.csv"))));
    for (seed, rows) in &seeds {
        done(command(&program, ["collect-types", seed, rows]))?;
    }
    let [(_, first), (_, second)] = &seeds;
    done(command(&program, ["fit-types", first, second, &file("type-confidence.txt")]))
}

/// Seeds of what is fitted to; no figure is measured on them.
const SEEDS: [&str; 2] = ["710001", "810001"];

fn fitter() -> Result<String> {
    let example = "fit_pose_confidence";
    done(cargo(&["build", "--release", "--locked", "-p", "pose", "--example", example]))?;
    Ok(built().join("release/examples").join(example).display().to_string())
}
