//! Judges a model on piles never trained on: `evaluate_tetrapod MODEL [SCENES] [votes|embedding] [SCORES.csv] [SEED]`.
//! The CSV gets every hypothesis' score, distance to the nearest true centre (d_max) and that block's occlusion.

mod piles;

use geom::{SeedTree, Silent, Vec3};
use metrics::{DetectionCounts, InstanceScene};
use scene::Catalog;
use segment::{Clustering, SegmentConfig, SegmentModel, segment};
use std::time::Instant;

#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

#[derive(Default)]
struct Sums {
    scenes: usize,
    counts: DetectionCounts,
    blocks: usize,
    hit: usize,
    hit_by_instance: usize,
    errors: Vec<f32>,
    hypotheses: usize,
    /// Score and whether it was right.
    scored: Vec<(f32, bool)>,
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let args: Vec<String> = std::env::args().collect();
    let model =
        SegmentModel::load(args.get(1).ok_or("MODEL [SCENES] [votes|embedding]")?.as_ref())?;
    let count: u64 = args.get(2).map_or(Ok(8), |s| s.parse())?;
    let clustering = match args.get(3).map(String::as_str) {
        Some("embedding") => Clustering::Embedding,
        _ => Clustering::Votes,
    };
    let config = SegmentConfig { clustering, ..Default::default() };
    let seed = args.get(5).map_or(Ok(777_000), |s| s.parse())?;
    let root = SeedTree::new(seed);
    let mut sums = [Sums::default(), Sums::default()];
    let mut csv = String::from("scene,sensor,score,points,distance,occlusion\n");
    for index in 0..count {
        let pile = piles::pile(root.child("test", index))?;
        let made = &pile.made;
        let catalog = Catalog::new(vec![pile.model.clone()]);
        let clock = Instant::now();
        let result =
            segment(&made.survey.cloud, &catalog, &model, &config, SeedTree::new(index), &Silent)?;
        let seconds = clock.elapsed().as_secs_f64();
        let d = pile.model.d_max_m;
        let centres: Vec<Vec3> =
            made.scene.blocks.iter().map(|b| b.site_from_block * pile.model.centre).collect();
        // Blocks that are less than 80 % hidden count; points of the others are not held against anybody.
        let counted = |label: u32| label > 0 && made.occlusion[label as usize - 1] < 0.8;
        let keep: Vec<usize> = (0..made.instance.len())
            .filter(|&i| made.instance[i] == 0 || counted(made.instance[i]))
            .collect();
        // An instance that lies mostly on a block that does not count is neither right nor wrong.
        let mut points = vec![(0_u32, 0_u32); result.instances + 1];
        for (&instance, &label) in result.instance.iter().zip(&made.instance) {
            let p = &mut points[instance as usize];
            p.0 += 1;
            p.1 += u32::from(label > 0 && !counted(label));
        }
        let judged = |i: u32| if points[i as usize].1 * 2 > points[i as usize].0 { 0 } else { i };
        let predicted: Vec<u32> = keep.iter().map(|&i| judged(result.instance[i])).collect();
        let truth: Vec<u32> = keep.iter().map(|&i| made.instance[i]).collect();
        let s = &mut sums[usize::from(!pile.uav)];
        let one = metrics::precision_recall(
            &[InstanceScene { predicted: &predicted, truth: &truth }],
            0.5,
        )?;
        let nearest = |c: &Vec3, n: usize| {
            result
                .hypotheses
                .iter()
                .take(n)
                .map(|h| (h.centre - *c).length() / d)
                .fold(f32::INFINITY, f32::min)
        };
        let visible: Vec<&Vec3> = centres
            .iter()
            .enumerate()
            .filter(|(i, _)| made.occlusion[*i] < 0.8)
            .map(|(_, c)| c)
            .collect();
        for c in &visible {
            let e = nearest(c, usize::MAX);
            s.blocks += 1;
            s.hit_by_instance += usize::from(nearest(c, result.instances) < 0.25);
            if e < 0.25 {
                s.hit += 1;
                s.errors.push(e);
            }
        }
        s.hypotheses += result.hypotheses.len();
        for h in &result.hypotheses {
            let right = centres.iter().any(|c| (*c - h.centre).length() < 0.25 * d);
            s.scored.push((h.score, right));
            let nearest = (0..centres.len())
                .map(|i| ((centres[i] - h.centre).length() / d, i))
                .min_by(|a, b| a.0.total_cmp(&b.0))
                .expect("a pile has blocks");
            csv += &format!(
                "{index},{},{},{},{:.3},{:.3}\n",
                pile.uav,
                h.score,
                h.points.len(),
                nearest.0,
                made.occlusion[nearest.1]
            );
        }
        println!(
            "{index} {} {:6} points, {:2} blocks ({} visible), {} instances, {} hypotheses, P {:.2} R {:.2}, {seconds:.2} s",
            if pile.uav { "UAV " } else { "MBES" },
            made.instance.len(),
            centres.len(),
            visible.len(),
            result.instances,
            result.hypotheses.len(),
            one.precision().unwrap_or(0.0),
            one.recall().unwrap_or(0.0),
        );
        s.scenes += 1;
        s.counts = s.counts.plus(&one);
    }
    if let Some(path) = args.get(4) {
        std::fs::write(path, csv)?;
    }
    for (name, s) in ["UAV", "MBES"].iter().zip(&mut sums) {
        if s.scenes == 0 {
            continue;
        }
        let pr = s.counts;
        s.errors.sort_by(f32::total_cmp);
        println!(
            "{name}: {} scenes, P {:.3} R {:.3} at IoU 0.5; centres within 0.25 d_max: {:.3} by any of {:.2} hypotheses a block, {:.3} by an instance; median error {:.3} d_max",
            s.scenes,
            pr.precision().unwrap_or(0.0),
            pr.recall().unwrap_or(0.0),
            s.hit as f64 / s.blocks as f64,
            s.hypotheses as f64 / s.blocks as f64,
            s.hit_by_instance as f64 / s.blocks as f64,
            s.errors.get(s.errors.len() / 2).copied().unwrap_or(f32::NAN),
        );
        for low in [0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9] {
            let bin: Vec<_> =
                s.scored.iter().filter(|(x, _)| *x >= low && *x < low + 0.1).collect();
            let right = bin.iter().filter(|b| b.1).count();
            println!(
                "  score {low:.1}: {} hypotheses, {:.2} right",
                bin.len(),
                right as f64 / bin.len().max(1) as f64
            );
        }
    }
    Ok(())
}
