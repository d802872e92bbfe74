//! Point clouds of every kind; the first byte chooses the kind.
#![no_main]

#[path = "../panics.rs"]
mod panics;

#[allow(dead_code)]
#[path = "../../crates/io/tests/hostile/readers.rs"]
mod readers;

libfuzzer_sys::fuzz_target!(init: panics::may_be_caught(), |data: &[u8]| {
    panics::keep(data);
    let Some((&first, rest)) = data.split_first() else { return };
    let _ = readers::read(readers::CLOUDS[usize::from(first) % readers::CLOUDS.len()], rest);
});
