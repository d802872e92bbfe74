//! Losses and time of a training step on one tile, to be held against `tools/oracle/fpccv2_step.py`:
//! `training_step FOLDER [STEPS]` writes `FOLDER/model.safetensors` and `FOLDER/tile.csv`, which that script reads, trains
//! on one thread and prints the loss of every step and the processor time of one.

mod piles;

use geom::SeedTree;
use segment::tile::{Targets, ThinScene};
use segment::{SegmentModel, TrainConfig, train::train_on_tile};
use std::fmt::Write as _;
use std::path::Path;
use std::time::Instant;

#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

/// Steps that warm the caches and are not timed.
const WARM: usize = 3;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let args: Vec<String> = std::env::args().collect();
    let folder = Path::new(args.get(1).ok_or("FOLDER [STEPS]")?);
    let steps = args.get(2).map_or(Ok(20), |s| s.parse::<usize>())?;
    std::fs::create_dir_all(folder)?;
    let config = TrainConfig::default();
    let root = SeedTree::new(31);
    let scene = piles::labelled(root.child("pile", 0))?;
    let thin = ThinScene::new(&scene, config.cell, config.sparsest, root.child("thin", 0));
    let tile = thin.tile(config.tile_points, config.margin, false, root.child("tile", 0));
    let model = SegmentModel::shipped_as("tetrapod").ok_or("no such weights")??;
    model.save(&folder.join("model.safetensors"))?;
    std::fs::write(folder.join("tile.csv"), table(&tile))?;
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    let mut losses = Vec::new();
    let (wall_s, processor_s) = pool.install(|| {
        let mut start = (Instant::now(), processor_s());
        train_on_tile(&model, &tile, &config, 1e-3, &mut |report| {
            losses.push(*report);
            if losses.len() == WARM {
                start = (Instant::now(), processor_s());
            }
            losses.len() < WARM + steps
        })
        .map(|()| {
            (
                start.0.elapsed().as_secs_f64() / steps as f64,
                (processor_s() - start.1) / steps as f64,
            )
        })
    })?;
    for (step, l) in losses.iter().enumerate() {
        println!(
            "{step}: loss {:.6}, pair {:.6}, centre {:.6}, offset {:.6}, block {:.6}",
            l.total, l.pair, l.centre, l.offset, l.block
        );
    }
    println!(
        "{} points, {wall_s:.4} s a step, {processor_s:.4} s of the processor",
        tile.position.len()
    );
    Ok(())
}

/// What this thread has had of the processor so far; 0 where the system does not say.
fn processor_s() -> f64 {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    text.split(' ').next().and_then(|ns| ns.parse::<f64>().ok()).unwrap_or(0.0) / 1e9
}

/// x, y, z, instance, offset, inner: one point a line.
fn table(tile: &Targets) -> String {
    let mut out = String::new();
    for i in 0..tile.position.len() {
        let (p, o) = (tile.position[i], tile.offset[i]);
        let _ = writeln!(
            out,
            "{},{},{},{},{},{},{},{}",
            p.x, p.y, p.z, tile.instance[i], o.x, o.y, o.z, tile.inner[i]
        );
    }
    out
}
