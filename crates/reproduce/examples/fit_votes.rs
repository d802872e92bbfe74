//! Fits the width of the votes' kernel and the confidence of weights anew on scenes of the six sets: `fit_votes MODEL OUT [SEED] [SCENES]`.

use geom::{SeedTree, Silent};
use segment::calibration::CalibrationData;
use segment::tile::LabelledScene;
use segment::{SegmentModel, scales};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let args: Vec<String> = std::env::args().collect();
    let [_, model, out, ..] = &args[..] else { return Err("MODEL OUT [SEED] [SCENES]".into()) };
    let mut model = SegmentModel::load(model.as_ref())?;
    let seed: u64 = args.get(3).map_or(Ok(700_001), |s| s.parse())?;
    let scenes: u64 = args.get(4).map_or(Ok(4), |s| s.parse())?;
    let mut seen = CalibrationData::default();
    for set in reproduce::site_sets()? {
        // Sets of several sizes are seen at the largest; blocks of the others are not scored.
        let unit_m = scales(&set.catalog)?[0];
        for index in 0..scenes {
            let made = set.scene(seed, index)?;
            let centre_m = made
                .scene
                .blocks
                .iter()
                .map(|b| b.site_from_block * set.catalog.get(b.model).centre);
            let scene = LabelledScene {
                centre_m: centre_m.collect(),
                instance: made.instance,
                position_m: made.survey.cloud.position_m,
                unit_m,
            };
            seen.add(&model, &scene, SeedTree::new(seed).child("fit", index), &Silent)?;
        }
    }
    for trial in seen.trials() {
        println!("{trial:?}");
    }
    let fitted = seen.fit().ok_or("nothing to fit")?;
    println!("{:?} before, {fitted:?} now", model.description.calibration());
    model.description.calibrate(fitted);
    model.save(out.as_ref())?;
    Ok(())
}
