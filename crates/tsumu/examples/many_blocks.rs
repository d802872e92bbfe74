//! Two runs of many blocks, made without recognition, to time a comparison: `many_blocks FOLDER BLOCKS [POINTS_A_M2]`.
//!
//! FOLDER/earlier and FOLDER/later are sites with a run each: a strip of tetrapods in random attitudes, twenty rows deep, as a survey
//! from above shows them. Of each hundred blocks five moved, five turned, four went and three came. Then
//! `tsumu compare FOLDER/earlier FOLDER/later --out CHANGES`. Prints the seconds of each step of the same in this process.

use geom::{DVec3, Pose, Quat, SeedTree, Vec3};
use io::RawCloud;
use rand::RngExt;
use scene::{Catalog, Covariance, Fit, InstanceId, ModelId, Recognised};
use std::path::Path;
use std::time::Instant;
use tsumu::{
    CompareOptions, ComparisonFolder, EpochRun, Job, RecogniseOptions, Recognition, Run, Segments,
    Site,
};

type Outcome<T> = Result<T, Box<dyn std::error::Error>>;

const ROWS: usize = 20;
const STEP_M: f32 = 1.9;
const SITE: &str = "name = \"Many blocks\"\ncrs = \"EPSG:6679\"\nvertical_datum = \"T.P.\"\naxis_order = \"east-north\"\n\n[[survey]]\nfile = \"survey.laz\"\nsensor = \"uav\"\nvertical_offset_m = 0.0\n";
const CATALOG: &str = "[[block]]\nname = \"tetrapod-5t\"\nshape = { kind = \"tetrapod\", size = 2.0 }\ndensity_kg_m3 = 2300.0\n";
const CORNER: DVec3 = DVec3::new(41_000.0, -98_000.0, 0.0);

fn main() -> Outcome<()> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let (folder, blocks, per_m2) = match words.as_slice() {
        [folder, blocks] => (Path::new(folder), blocks.parse()?, 200.0),
        [folder, blocks, points] => (Path::new(folder), blocks.parse()?, points.parse()?),
        _ => return Err("many_blocks FOLDER BLOCKS [POINTS_A_M2]".into()),
    };
    let job = Job::silent();
    let before = pile(blocks);
    let after = changed(&before);
    for (name, poses, seed) in [("earlier", &before, 1), ("later", &after, 2)] {
        let start = Instant::now();
        make(&folder.join(name), poses, per_m2, seed, &job)?;
        println!("{name}: {} blocks, made in {:.1} s", poses.len(), start.elapsed().as_secs_f64());
    }
    let (options, start) = (RecogniseOptions::default(), Instant::now());
    let out = ComparisonFolder::begin(&folder.join("changes"))?;
    let earlier = EpochRun::open(&folder.join("earlier"), &options, &job)?;
    let later = EpochRun::open(&folder.join("later"), &options, &job)?;
    let read = start.elapsed().as_secs_f64();
    let options = CompareOptions::default();
    let found = tsumu::compare(&earlier, &later, &options, &job)?;
    let compared = start.elapsed().as_secs_f64();
    println!("{}", found.headline());
    found.write(out, &options)?;
    let written = start.elapsed().as_secs_f64();
    println!(
        "read {read:.1} s, compared {:.1} s, written {:.1} s, together {written:.1} s",
        compared - read,
        written - compared
    );
    Ok(())
}

/// Blocks on a strip, each in an attitude of its own.
fn pile(count: usize) -> Vec<Pose> {
    let mut rng = SeedTree::new(1).child("pile", 0).rng();
    let one = |i: usize| {
        let mut about = |reach: f32| rng.random_range(-reach..reach);
        let place = Vec3::new((i / ROWS) as f32 * STEP_M, (i % ROWS) as f32 * STEP_M, 1.2);
        let at = place + Vec3::new(about(0.25), about(0.25), about(0.4));
        Pose::from_parts(at, Quat::from_scaled_axis(Vec3::new(about(3.0), about(3.0), about(3.0))))
    };
    (0..count).map(one).collect()
}

fn changed(before: &[Pose]) -> Vec<Pose> {
    let mut rng = SeedTree::new(1).child("storm", 0).rng();
    let mut after = Vec::with_capacity(before.len());
    for pose in before {
        let mut about = |reach: f32| rng.random_range(-reach..reach);
        let shift = Vec3::new(about(0.5), about(0.5), about(0.2));
        let turn = Quat::from_scaled_axis(Vec3::new(about(0.5), about(0.5), about(0.5)));
        match rng.random_range(0..100) {
            0..5 => after.push(Pose::from_parts(pose.translation + shift, pose.rotation)),
            5..10 => after.push(Pose::from_parts(pose.translation, turn * pose.rotation)),
            10..14 => {}
            14..17 => {
                after.push(*pose);
                let above = pose.translation + Vec3::Z * 1.9;
                after.push(Pose::from_parts(above, turn * pose.rotation));
            }
            _ => after.push(*pose),
        }
    }
    after
}

/// A site with its run.
fn make(folder: &Path, poses: &[Pose], per_m2: f32, seed: u64, job: &Job) -> Outcome<()> {
    std::fs::create_dir_all(folder)?;
    std::fs::write(folder.join("site.toml"), SITE)?;
    std::fs::write(folder.join("catalog.toml"), CATALOG)?;
    let spec: scene::CatalogSpec = toml::from_str(CATALOG)?;
    let catalog = blocks::catalog(&spec, &|_| Err("built-in".into()))?;
    let (points, instance) = surveyed(poses, &catalog, per_m2, seed);
    let position = points.iter().map(|p| p.as_dvec3() + CORNER).collect();
    let crs = Some("EPSG:6679".into());
    io::las::write_cloud(
        &folder.join("survey.laz"),
        &RawCloud { position, crs, ..RawCloud::default() },
    )?;
    let site = Site::load(folder, job)?;
    let found = recognition(&site, poses, instance, seed);
    let run = folder.join("run");
    if run.is_dir() {
        std::fs::remove_dir_all(&run)?;
    }
    Run::create(&run, &site)?.keep(&found)?.seal()?;
    Ok(())
}

/// What a sensor above sees of each block, and of the bed between them.
fn surveyed(poses: &[Pose], catalog: &Catalog, per_m2: f32, seed: u64) -> (Vec<Vec3>, Vec<u32>) {
    let mut rng = SeedTree::new(seed).child("survey", 0).rng();
    let model = catalog.get(ModelId(0));
    let samples = (model.mesh.area_m2() * per_m2) as usize;
    let (mut points, mut instance) = (Vec::new(), Vec::new());
    for (i, pose) in poses.iter().enumerate() {
        for (p, n) in model.mesh.sample_surface(samples, &mut rng) {
            let mut noise = || rng.random_range(-0.01..0.01_f32);
            let at = *pose * p + Vec3::new(noise(), noise(), noise());
            // The lower half of a block lies in its neighbours' shade.
            if (pose.rotation * n).z > 0.05 && at.z > pose.translation.z - 0.2 {
                points.push(at);
                instance.push(i as u32 + 1);
            }
        }
    }
    (points, instance)
}

/// The blocks as a recognition of that survey would state them.
fn recognition(site: &Site, poses: &[Pose], instance: Vec<u32>, seed: u64) -> Recognition {
    let mut rng = SeedTree::new(seed).child("seen", 0).rng();
    let origin = DVec3::from_array(site.survey.frame.origin);
    let mut own: Vec<Vec<u32>> = vec![Vec::new(); poses.len()];
    for (point, block) in instance.iter().enumerate() {
        own[*block as usize - 1].push(point as u32);
    }
    let mut covariance = [0.0; 36];
    for i in 0..6 {
        covariance[7 * i] = if i < 3 { 0.006_f32 } else { 0.003 }.powi(2);
    }
    let one = |((i, pose), points): ((usize, &Pose), Vec<u32>)| {
        let mut about = |reach: f32| rng.random_range(-reach..reach);
        let at = pose.translation + Vec3::new(about(0.01), about(0.01), about(0.01));
        let turn = Quat::from_scaled_axis(Vec3::new(about(5e-3), about(5e-3), about(5e-3)));
        let local = (at.as_dvec3() + CORNER - origin).as_vec3();
        let fit = Fit {
            confidence: Some(0.98),
            occlusion: Some(0.5),
            covariance: Some(Covariance::new(covariance)),
            fitness_m: Some(0.01),
            ..Fit::of_pose(ModelId(0), Pose::from_parts(local, turn * pose.rotation))
        };
        Recognised::of_fit(InstanceId(i as u32 + 1), points, fit)
    };
    let blocks = poses.iter().enumerate().zip(own).map(one).collect();
    let segments = Segments {
        confidence: vec![1.0; instance.len()],
        instances: poses.len(),
        centre_hypotheses: poses.len(),
        instance,
    };
    Recognition { segments, blocks, ..Recognition::default() }
}
