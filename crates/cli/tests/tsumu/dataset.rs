//! `tsumu synth`: a dataset is the same bytes whole, in shards, on one thread or two, and after an interruption.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

const RECIPE: &str = r#"
name = "tiny"
count = [4, 6]
density_per_m2 = 40
site = { kind = "pen", side_blocks = 2.5 }
bed = { stone_blocks = 0.0 }

[sensor]
kind = "uav"

[[catalog.block]]
name = "cube"
shape = { kind = "cube", size = 1.0 }
"#;

fn synth(folder: &Path, out: &str, more: &[&str]) -> Output {
    let recipe = folder.join("recipe.toml");
    fs::write(&recipe, RECIPE).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_tsumu"));
    command.arg("synth").arg(recipe).arg("--out").arg(folder.join(out)).args(more);
    command.output().unwrap()
}

fn made(folder: &Path, out: &str, more: &[&str]) {
    let output = synth(folder, out, more);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

fn files(root: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut found = BTreeMap::new();
    let mut waiting = vec![root.to_path_buf()];
    while let Some(folder) = waiting.pop() {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                waiting.push(path);
            } else {
                found.insert(path.strip_prefix(root).unwrap().to_path_buf(), fs::read(&path).unwrap());
            }
        }
    }
    found
}

#[test]
fn whole_shards_threads_and_resuming_give_the_same_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let five = ["--scenes", "5", "--seed", "7", "--preview"];
    made(folder, "whole", &[&five[..], &["--threads", "2"]].concat());
    let whole = files(&folder.join("whole"));
    assert_eq!(whole.len(), 3 + 5 * 4, "{:?}", whole.keys());

    made(folder, "shards", &[&five[..], &["--threads", "1", "--shard", "1/2"]].concat());
    assert!(!folder.join("shards/index.csv").exists());
    made(folder, "shards", &[&five[..], &["--threads", "1", "--shard", "0/2"]].concat());
    assert_eq!(files(&folder.join("shards")), whole);

    // As a killed run leaves it: some scenes missing, one half written, no index.
    fs::remove_dir_all(folder.join("shards/scenes/00003")).unwrap();
    fs::remove_file(folder.join("shards/index.csv")).unwrap();
    fs::create_dir(folder.join("shards/scenes/.00003-99.part")).unwrap();
    fs::write(folder.join("shards/scenes/.00003-99.part/cloud.ply"), b"ply").unwrap();
    made(folder, "shards", &five);
    assert_eq!(files(&folder.join("shards")), whole);
}

#[test]
fn bad_orders_are_refused_with_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    made(folder, "there", &[]);
    for (out, more, words) in [
        ("there", &["--seed", "9"][..], "choose another --out"),
        ("new", &["--shard", "3/3"], "0/3 to 2/3"),
        ("new", &["--scenes", "0"], "at least 1"),
        ("new", &["--split", "0.5,0.1,0.1"], "add up to 1"),
        ("new", &["--catalog", "nowhere.toml"], "nowhere.toml"),
    ] {
        let output = synth(folder, out, more);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{more:?}: {said}");
        assert!(said.contains(words), "{more:?}: {said}");
        assert!(!folder.join("new").exists());
    }
}
