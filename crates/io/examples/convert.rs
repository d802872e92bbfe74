//! Reads a cloud, writes it as another format, and says how long each took:
//! `cargo run --release -p io --example convert -- IN [OUT [CELL_M]]`.

use std::path::Path;
use std::time::Instant;

struct Print;

impl geom::Observer for Print {
    fn event(&self, event: geom::Event) {
        eprintln!("{event:?}");
    }
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [from, rest @ ..] = arguments.as_slice() else {
        eprintln!("usage: convert IN [OUT [CELL_M]]");
        std::process::exit(2);
    };
    let result = run(Path::new(from), rest);
    if let Err(error) = result {
        eprintln!("{error}");
        std::process::exit(1);
    }
}

fn run(from: &Path, rest: &[String]) -> Result<(), io::IoError> {
    let start = Instant::now();
    let cell = rest.get(1).and_then(|c| c.parse().ok());
    let cloud = match cell {
        Some(cell_m) => io::points::read_thinned(from, cell_m, &Print)?,
        None => io::points::read(from, &Print)?,
    };
    println!("read {} points in {:.3} s", cloud.len(), start.elapsed().as_secs_f64());
    println!(
        "extent {:?}, crs {:?}, sensors {:?}",
        cloud.extent(),
        cloud.crs,
        cloud.sensor_positions
    );
    if let Some(to) = rest.first() {
        let start = Instant::now();
        io::points::write(Path::new(to), &cloud)?;
        println!("wrote {to} in {:.3} s", start.elapsed().as_secs_f64());
    }
    Ok(())
}
