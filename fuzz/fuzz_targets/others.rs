//! Meshes, tables, designs and site files; the first byte chooses the kind.
#![no_main]

use libfuzzer_sys::fuzz_target;
use std::path::Path;

fuzz_target!(|data: &[u8]| {
    let Some((&first, rest)) = data.split_first() else { return };
    let name = Path::new("fuzz");
    let mut input = io::Input::of_bytes(name, rest);
    match first % 9 {
        0 => drop(io::mesh::read_as(&mut input, "stl")),
        1 => drop(io::mesh::read_as(&mut input, "obj")),
        2 => drop(io::mesh::read_as(&mut input, "ply")),
        3 => drop(io::blocks_csv::read_from(&mut input)),
        4 => drop(io::placements_csv::read_from(&mut input)),
        5 => drop(io::landxml::read(&mut input, None)),
        6 => drop(io::dxf::read_faces(&mut input)),
        7 => drop(io::geotiff::read(&mut input)),
        _ => drop(io::site::parse_toml::<scene::SiteSpec>(name, &String::from_utf8_lossy(rest))),
    }
});
