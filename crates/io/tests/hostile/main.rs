//! Hostile files: thousands of mutants of every format and hand-made bombs. Nothing may panic, take long, or
//! allocate more than the stated multiple of the file's size. One test, because it watches the whole process's memory.

mod bombs;
mod damage;
#[path = "../files/foreign.rs"]
mod foreign;
mod mutants;
mod readers;
#[path = "../files/sample.rs"]
mod sample;
mod seeds;

use io::IoError;
use peak_alloc::PeakAlloc;
use std::time::{Duration, Instant};

/// Counts live bytes; its own `unsafe` is in the crate, none is needed here.
#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

/// What any file may cost, however small.
const FREE_BYTES: usize = 128 << 20;
/// What each byte of the file may cost on top (formats.md states it).
const BYTES_PER_BYTE: usize = 256;
/// No mutant of these few kilobytes may take longer.
const TIME: Duration = Duration::from_secs(5);

/// Reads the bytes as this kind of file and holds it against the limits.
pub fn read_within_limits(kind: &str, bytes: &[u8]) -> Result<(), IoError> {
    let before = MEMORY.current_usage();
    MEMORY.reset_peak_usage();
    let start = Instant::now();
    let result = readers::read(kind, bytes);
    let (peak, took) = (MEMORY.peak_usage().saturating_sub(before), start.elapsed());
    let limit = FREE_BYTES + BYTES_PER_BYTE * bytes.len();
    assert!(
        peak <= limit,
        "{kind}: {} bytes of file cost {peak} bytes of memory (limit {limit})",
        bytes.len()
    );
    assert!(took <= TIME, "{kind}: {} bytes of file cost {took:?}", bytes.len());
    result
}

#[test]
fn no_file_does_harm() {
    // Two threads, so that the limits do not depend on the machine.
    let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().unwrap();
    let panics = std::sync::Arc::new(std::sync::atomic::AtomicUsize::new(0));
    let counter = panics.clone();
    std::panic::set_hook(Box::new(move |info| {
        if counter.fetch_add(1, std::sync::atomic::Ordering::Relaxed) < 3 {
            eprintln!("{info}");
        }
    }));
    // Whoever adds a reader adds a file to damage.
    let with_seed: std::collections::BTreeSet<_> = seeds::all().iter().map(|s| s.0).collect();
    assert_eq!(with_seed, readers::CLOUDS.into_iter().chain(readers::OTHERS).collect());
    let (tried, refused) = pool.install(|| {
        bombs::all_are_refused();
        mutants::all_are_harmless()
    });
    let _ = std::panic::take_hook();
    println!(
        "{tried} mutants, {refused} refused, {} panics caught inside decoders",
        panics.load(std::sync::atomic::Ordering::Relaxed)
    );
    assert!(tried >= 10_000);
    // Most damage must be noticed, or the test is looking at nothing.
    assert!(refused > tried / 3);
}
