//! Trains the shipped tetrapod model: `train_tetrapod FOLDER STEPS [INIT]`. Resumes when FOLDER has a checkpoint.

mod piles;

use geom::{Event, Observer, SeedTree};
use segment::{SegmentModel, ShapeSignature, Split, TrainConfig, train};
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

static STOP: AtomicBool = AtomicBool::new(false);

struct Print {
    start: Instant,
}

impl Observer for Print {
    fn event(&self, event: Event) {
        if let Event::Advanced { done, .. } = event
            && (done < 50 || done % 100 == 0)
        {
            println!("{done} steps, {:.0} s", self.start.elapsed().as_secs_f64());
        }
    }

    fn cancelled(&self) -> bool {
        STOP.load(Ordering::Relaxed)
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let args: Vec<String> = std::env::args().collect();
    let folder = PathBuf::from(args.get(1).ok_or("FOLDER STEPS [INIT]")?);
    let steps = args.get(2).ok_or("STEPS")?.parse()?;
    let init = args.get(3).map(|p| SegmentModel::load(p.as_ref())).transpose()?;
    ctrlc::set_handler(|| STOP.store(true, Ordering::Relaxed))?;
    let root = SeedTree::new(20261122);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    let source = |split: Split, index: u64| {
        let node = root.child(if split == Split::Train { "train" } else { "held out" }, index);
        let start = Instant::now();
        let scene = pool.install(|| piles::labelled(node));
        if index < 20 {
            println!(
                "scene {index}: {:.2} s, {:?} points",
                start.elapsed().as_secs_f64(),
                scene.as_ref().map(|s| s.position_m.len())
            );
        }
        scene
    };
    let shape = scene::Shape::Tetrapod { size: 1.0 };
    let shapes = vec![ShapeSignature::of(&blocks::shape_model("tetrapod", shape, 2300.0)?)];
    let name = "tetrapod, UAV and MBES, bed points".into();
    let config = TrainConfig { steps, name, shapes, ..Default::default() };
    let trained = train(
        &source,
        &config,
        init.as_ref(),
        &folder,
        SeedTree::new(4),
        &Print { start: Instant::now() },
    )?;
    println!("{} steps, held out {:?}", trained.steps, trained.validation);
    Ok(())
}
