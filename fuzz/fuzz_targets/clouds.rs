//! Point clouds of every kind; the first byte chooses the kind.
#![no_main]

#[allow(dead_code)]
#[path = "../../crates/io/tests/hostile/readers.rs"]
mod readers;

libfuzzer_sys::fuzz_target!(|data: &[u8]| {
    let Some((&first, rest)) = data.split_first() else { return };
    let _ = readers::read(readers::CLOUDS[usize::from(first) % readers::CLOUDS.len()], rest);
});
