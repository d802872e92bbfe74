//! Hostile files: thousands of mutants of every format and hand-made bombs. Nothing may panic, take long, or
//! allocate more than the stated multiple of the file's size. One test, because it watches the whole process's memory.

mod bombs;
#[path = "../files/foreign.rs"]
mod foreign;
mod mutants;
#[path = "../files/sample.rs"]
mod sample;
mod seeds;

use io::{Input, IoError};
use peak_alloc::PeakAlloc;
use std::path::Path;
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
    let result = read(kind, bytes);
    let (peak, took) = (MEMORY.peak_usage().saturating_sub(before), start.elapsed());
    let limit = FREE_BYTES + BYTES_PER_BYTE * bytes.len();
    assert!(peak <= limit, "{kind}: {} bytes of file cost {peak} bytes of memory (limit {limit})", bytes.len());
    assert!(took <= TIME, "{kind}: {} bytes of file cost {took:?}", bytes.len());
    result
}

fn read(kind: &str, bytes: &[u8]) -> Result<(), IoError> {
    let name = format!("hostile.{kind}");
    let mut input = Input::of_bytes(Path::new(&name), bytes);
    match kind {
        "las" | "laz" | "ply" | "xyz" | "pcd" | "e57" => io::points::read_as(&mut input, kind, &geom::Silent).map(drop),
        "copc.laz" => {
            let (low, high) = (geom::DVec3::ZERO, geom::DVec3::new(5.0, 99.0, 99.0));
            io::las::stream_box(&mut input, low, high, &mut |_| Ok(())).map(drop)
        }
        "tif" => io::geotiff::read(&mut input).map(drop),
        "xml" => io::landxml::read(&mut input, None).map(|tin| drop(tin.on_grid(0.5))),
        "dxf" => io::dxf::read_faces(&mut input).map(|faces| drop(io::tin::Tin::of_faces(&faces).on_grid(0.5))),
        "stl" | "obj" => io::mesh::read_as(&mut input, kind).map(drop),
        "mesh.ply" => io::mesh::read_as(&mut input, "ply").map(drop),
        "blocks.csv" => io::blocks_csv::read_from(&mut input).map(drop),
        "placements.csv" => io::placements_csv::read_from(&mut input).map(drop),
        "site.toml" => io::site::parse_toml::<scene::SiteSpec>(Path::new(&name), &String::from_utf8_lossy(bytes))
            .map(|site| drop(site.check())),
        _ => panic!("the test knows no `{kind}`"),
    }
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
