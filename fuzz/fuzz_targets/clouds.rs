//! Point clouds of every kind; the first byte chooses the kind.
#![no_main]

use libfuzzer_sys::fuzz_target;
use std::path::Path;

const KINDS: [&str; 6] = ["laz", "las", "ply", "pcd", "e57", "xyz"];

fuzz_target!(|data: &[u8]| {
    let Some((&first, rest)) = data.split_first() else { return };
    let kind = KINDS[usize::from(first) % KINDS.len()];
    let mut input = io::Input::of_bytes(Path::new("fuzz"), rest);
    let _ = io::points::read_as(&mut input, kind, &geom::Silent);
});
