//! Time of the whole stage on piles side by side: `segment_speed [PILES]`; a pile has about 100 k points.

mod piles;

use geom::{PointCloud, SeedTree, Silent, Vec3};
use scene::{Catalog, Shape};
use segment::{SegmentConfig, SegmentModel, segment};
use std::time::Instant;

#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let copies: usize = std::env::args().nth(1).map_or(Ok(1), |s| s.parse())?;
    let model = blocks::shape_model("tetrapod", Shape::Tetrapod { size: 2.0 }, 2300.0)?;
    let catalog = Catalog::new(vec![model]);
    let text = "name = \"speed\"\ncount = [55, 55]\ndensity_per_m2 = 1000\n[sensor]\nkind = \"gaussian\"\n";
    let made = synth::scene(&synth::Recipe::parse(text)?, &catalog, SeedTree::new(3))?;
    let one = &made.survey.cloud.position_m;
    let positions = (0..copies)
        .flat_map(|c| one.iter().map(move |p| *p + Vec3::X * (14.0 * c as f32)))
        .collect();
    let cloud = PointCloud::from_positions(positions);
    let weights = SegmentModel::shipped(&catalog)?;
    for passes in [1, 4] {
        let config = SegmentConfig { passes, ..Default::default() };
        let clock = Instant::now();
        let result = segment(&cloud, &catalog, &weights, &config, SeedTree::new(1), &Silent)?;
        let seconds = clock.elapsed().as_secs_f64();
        println!(
            "{} points, {passes} passes: {seconds:.2} s, {} instances of {} blocks",
            cloud.len(),
            result.instances,
            55 * copies
        );
    }
    Ok(())
}
