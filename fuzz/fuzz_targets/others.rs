//! Meshes, tables, designs, maps, reviews, manifests and site files; the first byte chooses the kind.
#![no_main]

#[path = "../harness.rs"]
mod harness;

#[allow(dead_code)]
#[path = "../../crates/io/tests/hostile/readers.rs"]
mod readers;

libfuzzer_sys::fuzz_target!(init: harness::let_panics_be_caught(), |data: &[u8]| {
    harness::keep_last(data);
    let Some((&first, rest)) = data.split_first() else { return };
    let _ = readers::read(readers::OTHERS[usize::from(first) % readers::OTHERS.len()], rest);
});
