//! What the page may ask the program to do, and the command line that this is.

use crate::names::{below, made_plain, shown, site_folder};
use crate::refusal::{Answer, Refusal};
use serde::Deserialize;
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use tsumu::Variant;

/// Folders of comparisons lie here.
const COMPARISONS: &str = "comparisons";
/// Folders of variants lie here, in their site.
pub const VARIANTS: &str = "what-if";

/// One piece of work, as the page sends it.
#[derive(Clone, Debug, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Order {
    /// A first site from surveys.
    Init {
        /// Survey files below the folder.
        files: Vec<String>,
        /// The block, by name.
        block: String,
        /// Name of the site and its folder.
        name: String,
    },
    /// All complaints, and the map.
    Check { site: String },
    /// Everything for a site.
    Run { site: String },
    /// A plan with something otherwise, on the latest run.
    WhatIf { site: String, variant: Variant },
    /// What happened between epochs: sites or runs below the folder, the earliest first.
    Compare { epochs: Vec<String>, name: String },
}

/// A command line, with what the page shows of it.
pub struct Command {
    pub kind: &'static str,
    pub site: String,
    /// What it writes, below the folder.
    pub out: PathBuf,
    pub args: Vec<OsString>,
    /// Work of minutes: one at a time.
    pub heavy: bool,
}

impl Command {
    /// `scratch`: where a map may be written.
    pub fn of(order: &Order, root: &Path, map: &Path) -> Answer<Self> {
        match order {
            Order::Init { files, block, name } => init(root, files, block, name),
            Order::Check { site } => check(root, site, map),
            Order::Run { site } => run(root, site),
            Order::WhatIf { site, variant } => what_if(root, site, variant),
            Order::Compare { epochs, name } => compare(root, epochs, name),
        }
    }
}

fn args<const N: usize>(words: [&dyn AsRef<std::ffi::OsStr>; N]) -> Vec<OsString> {
    words.iter().map(|w| w.as_ref().to_os_string()).collect()
}

fn init(root: &Path, files: &[String], block: &str, name: &str) -> Answer<Command> {
    if files.is_empty() {
        return Err(Refusal::bad("no-survey", "no survey was chosen"));
    }
    let folder = made_plain(name)?;
    let out = root.join(&folder);
    if out.exists() {
        return Err(Refusal::conflict("name-taken", folder));
    }
    let mut args = args([&"init", &format!("--block={block}"), &"--out", &out, &"--"]);
    for file in files {
        args.push(below(root, file)?.into());
    }
    Ok(Command { kind: "init", site: folder, out, args, heavy: false })
}

fn check(root: &Path, site: &str, map: &Path) -> Answer<Command> {
    let folder = site_folder(root, site)?;
    let args = args([&"check", &"--map", &map, &folder]);
    Ok(Command { kind: "check", site: site.into(), out: PathBuf::new(), args, heavy: false })
}

fn run(root: &Path, site: &str) -> Answer<Command> {
    let folder = site_folder(root, site)?;
    let out = folder.join(next_run(&folder));
    let args = args([&"run", &"--out", &out, &folder]);
    Ok(Command { kind: "run", site: site.into(), out, args, heavy: true })
}

/// The folder of an interrupted run, which goes on; else a new one: no delivered result is overwritten.
fn next_run(site: &Path) -> String {
    let runs = tsumu::runs_of(site);
    if let Some(open) = runs.iter().find(|r| !r.whole) {
        return open.name.clone();
    }
    let mut names = (1..).map(|n| if n == 1 { "run".into() } else { format!("run-{n}") });
    names.find(|name: &String| !site.join(name).exists()).expect("some number is free")
}

fn what_if(root: &Path, site: &str, variant: &Variant) -> Answer<Command> {
    let folder = site_folder(root, site)?;
    let runs = tsumu::runs_of(&folder);
    let run = runs.iter().find(|r| r.whole && r.recognised.is_some());
    let run = run.ok_or_else(|| Refusal::bad("no-run", "this site has no finished run yet"))?;
    let place = folder.join(VARIANTS);
    let number = (1..).find(|n| !place.join(n.to_string()).exists()).expect("some number is free");
    let place = place.join(number.to_string());
    tsumu::write_variant(&folder, &place, variant)?;
    let out = place.join("run");
    let of = folder.join(&run.name);
    let args = args([&"plan", &"--plans", &"0", &"--site", &place, &"--out", &out, &of]);
    Ok(Command { kind: "what-if", site: site.into(), out, args, heavy: true })
}

fn compare(root: &Path, epochs: &[String], name: &str) -> Answer<Command> {
    if epochs.len() < 2 {
        return Err(Refusal::bad("epochs", "a comparison needs two surveys at least"));
    }
    let out = root.join(COMPARISONS).join(made_plain(name)?);
    std::fs::create_dir_all(root.join(COMPARISONS))
        .map_err(|e| Refusal::system("make the folder of comparisons", &e))?;
    if out.exists() {
        return Err(Refusal::conflict("name-taken", shown(root, &out)));
    }
    let mut args = args([&"compare", &"--out", &out, &"--"]);
    for epoch in epochs {
        // As the comparison's page will name it: the program works in the folder.
        args.push(shown(root, &below(root, epoch)?).into());
    }
    Ok(Command { kind: "compare", site: String::new(), out, args, heavy: true })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder() -> (tempfile::TempDir, PathBuf) {
        let folder = tempfile::tempdir().unwrap();
        let root = folder.path().canonicalize().unwrap();
        std::fs::create_dir(root.join("pier")).unwrap();
        std::fs::write(root.join("pier/site.toml"), "name = \"p\"\n").unwrap();
        std::fs::write(root.join("a.laz"), "").unwrap();
        (folder, root)
    }

    fn order(text: &str) -> Order {
        serde_json::from_str(text).unwrap()
    }

    #[test]
    fn a_name_is_never_taken_for_a_flag_or_a_path() {
        let (_folder, root) = folder();
        let of = |text: &str| Command::of(&order(text), &root, Path::new("m"));
        let init = of(r#"{"kind":"init","files":["a.laz"],"block":"tetrapod 5t","name":"../x"}"#);
        assert_eq!(init.unwrap().out, root.join("x"));
        let bad = of(r#"{"kind":"init","files":["../a.laz"],"block":"tetrapod 5t","name":"x"}"#);
        assert_eq!(bad.err().unwrap().code, "outside");
        let taken = of(r#"{"kind":"init","files":["a.laz"],"block":"b","name":"pier"}"#);
        assert_eq!(taken.err().unwrap().code, "name-taken");
        assert_eq!(of(r#"{"kind":"run","site":"--help"}"#).err().unwrap().code, "gone");
        assert!(serde_json::from_str::<Order>(r#"{"kind":"verify","site":"pier"}"#).is_err());
    }

    #[test]
    fn a_whole_run_is_not_overwritten_and_an_interrupted_one_goes_on() {
        let (_folder, root) = folder();
        let pier = root.join("pier");
        assert_eq!(next_run(&pier), "run");
        std::fs::create_dir_all(pier.join("run/recognise")).unwrap();
        for file in ["run/manifest.json", "run/recognise/blocks.csv"] {
            std::fs::write(pier.join(file), "").unwrap();
        }
        assert_eq!(next_run(&pier), "run-2");
        std::fs::create_dir_all(pier.join("run-2/.tsumu-resume")).unwrap();
        assert_eq!(next_run(&pier), "run-2");
    }

    #[test]
    fn a_variant_needs_a_run() {
        let (_folder, root) = folder();
        let text = r#"{"kind":"what-if","site":"pier","variant":{"overflow_m":0.2}}"#;
        assert_eq!(Command::of(&order(text), &root, Path::new("m")).err().unwrap().code, "no-run");
        assert!(!root.join("pier/what-if").exists());
    }
}
