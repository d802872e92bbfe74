//! A finished run of which one file is damaged, through `verify`, opening, report, exports and planning. The first byte chooses the
//! file, the second whether the folder keeps its manifest and how far it is used.
#![no_main]

#[path = "../harness.rs"]
mod harness;

#[allow(dead_code)]
#[path = "../../crates/tsumu/tests/hostile/folders.rs"]
mod folders;

use folders::Depth;
use std::path::PathBuf;
use std::sync::OnceLock;

/// The site and the files of its run that are read again.
fn whole() -> &'static (PathBuf, Vec<PathBuf>) {
    static WHOLE: OnceLock<(PathBuf, Vec<PathBuf>)> = OnceLock::new();
    WHOLE.get_or_init(|| {
        let site = folders::site_folder().keep();
        let files = folders::read_again(&folders::run_of(&site));
        (site, files)
    })
}

libfuzzer_sys::fuzz_target!(init: harness::let_panics_be_caught(), |data: &[u8]| {
    harness::keep_last(data);
    let [which, how, content @ ..] = data else { return };
    let (site, files) = whole();
    let name = &files[usize::from(*which) % files.len()];
    let by_hand = how % 4 != 0 && !name.ends_with("manifest.json");
    let depth = if how / 4 % 8 == 0 { Depth::End } else { Depth::Read };
    let _ = folders::through_a_run(site, (name, content), by_hand, depth);
});
