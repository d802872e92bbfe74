//! A site of which one file is damaged, through check, reading, recognition and a whole run. The first byte chooses the file, the
//! second how far it goes.
#![no_main]

#[path = "../harness.rs"]
mod harness;

#[allow(dead_code)]
#[path = "../../crates/tsumu/tests/hostile/folders.rs"]
mod folders;

use folders::Depth;
use std::path::PathBuf;
use std::sync::OnceLock;

fn whole() -> &'static (PathBuf, Vec<PathBuf>) {
    static WHOLE: OnceLock<(PathBuf, Vec<PathBuf>)> = OnceLock::new();
    WHOLE.get_or_init(|| {
        let site = folders::site_folder().keep();
        let files = folders::names(&site);
        (site, files)
    })
}

libfuzzer_sys::fuzz_target!(init: harness::let_panics_be_caught(), |data: &[u8]| {
    harness::keep_last(data);
    let [which, how, content @ ..] = data else { return };
    let (site, files) = whole();
    let name = &files[usize::from(*which) % files.len()];
    let depth = match how % 16 {
        0 => Depth::End,
        1 => Depth::Recognise,
        _ => Depth::Read,
    };
    let _ = folders::through_a_site(site, (name, content), depth);
});
