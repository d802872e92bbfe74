//! Small files made to cost a lot.

use crate::{read_within_limits, seeds};

/// Every bomb must be refused, within the limits.
pub fn all_are_refused() {
    let refused = |kind: &str, bytes: &[u8], part: &str| {
        let error =
            read_within_limits(kind, bytes).expect_err("a bomb must be refused").to_string();
        assert!(error.contains(part), "{kind}: {error}");
    };
    let laz = seeds::all().iter().find(|s| s.0 == "laz").unwrap().1.clone();
    let las = seeds::all().iter().find(|s| s.0 == "las").unwrap().1.clone();

    // Points that are not there.
    for (kind, file) in [("laz", &laz), ("las", &las)] {
        for count in [u64::MAX, u64::from(u32::MAX), 10_000_000] {
            let mut bomb = file.clone();
            bomb[247..255].copy_from_slice(&count.to_le_bytes());
            refused(kind, &bomb, "promises");
        }
    }
    // A table of four thousand million chunks; a layer of four gigabytes.
    let data_at = u32::from_le_bytes(laz[96..100].try_into().unwrap()) as usize;
    let table_at = u64::from_le_bytes(laz[data_at..data_at + 8].try_into().unwrap()) as usize;
    let mut bomb = laz.clone();
    bomb[table_at + 4..table_at + 8].fill(0xff);
    refused("laz", &bomb, "chunks");
    let mut bomb = laz.clone();
    let layers_at = data_at + 8 + 40 + 4;
    bomb[layers_at..layers_at + 4].copy_from_slice(&u32::MAX.to_le_bytes());
    refused("laz", &bomb, "larger than their chunk");
    // Records of 64 kB each.
    let mut bomb = laz.clone();
    bomb[105..107].copy_from_slice(&u16::MAX.to_le_bytes());
    refused("laz", &bomb, "LASzip record");
    // Variable-length records without end.
    let mut bomb = laz;
    bomb[100..104].fill(0xff);
    refused("laz", &bomb, "variable-length records");

    let ply = |count: u64, format: &str, property: &str| {
        format!("ply\nformat {format} 1.0\nelement vertex {count}\nproperty float x\nproperty float y\nproperty float z\n{property}end_header\n")
            .into_bytes()
    };
    refused("ply", &ply(u64::MAX, "binary_little_endian", ""), "promises");
    refused("ply", &ply(4_000_000_000, "ascii", ""), "promises");
    let mut list = ply(1, "binary_little_endian", "property list uint double l\n");
    list.extend([0; 12]);
    list.extend(u32::MAX.to_le_bytes());
    refused("ply", &list, "a list needs");
    let mut stl = vec![0; 84];
    stl[80..].fill(0xff);
    refused("stl", &stl, "promises");
    refused("obj", &vec![b' '; 3 << 20], "longer than");
    refused("site.toml", "a=".repeat(1000).as_bytes(), "line 1");
    refused("site.toml", format!("a={}", "[".repeat(100_000)).as_bytes(), "site.toml");
}

/// Found by libFuzzer: GPS times so damaged that LASzip's decoder calls itself until the stack is full, which nothing could catch.
#[test]
fn gps_times_without_end_are_refused() {
    let bytes = include_bytes!("endless_gps_times.laz");
    let small = std::thread::Builder::new().stack_size(1024 * 1024);
    let read = || crate::readers::read("laz", bytes).unwrap_err().to_string();
    let why = small.spawn(read).unwrap().join().unwrap();
    assert!(why.contains("damaged (GPS times without end)"), "{why}");
    assert!(crate::readers::read("labels.laz", bytes).is_err());
}
