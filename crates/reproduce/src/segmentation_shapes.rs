//! Shapes no shipped network was trained on: a dolos, a ring and a holed part that interlocks (Table 2.2's hard objects,
//! in our own make).

use crate::markdown::percent;
use crate::segmentation_judge::{Judged, verdict};
use crate::{Bench, Experiment, ReproduceError, Table, weights_line};
use geom::SeedTree;
use pose::PoseConfig;
use scene::{BlockModel, Catalog, CentreHypothesis, Recognised, Segmentation, Shape};
use segment::{Clustering, SegmentConfig, SegmentModel, segment};

pub const EXPERIMENT: Experiment = Experiment {
    name: "segmentation-shapes",
    about: "shapes the weights never saw, among them rings and a holed part (thesis, Table 2.2)",
    body,
};

/// The shapes, each about as large as a tetrapod of two metres.
fn shapes() -> Result<Vec<BlockModel>, ReproduceError> {
    Ok(vec![
        blocks::shape_model("tetrapod", Shape::Tetrapod { size: 2.0 }, 2300.0)?,
        blocks::shape_model("dolos", Shape::Dolos { size: 2.2 }, 2300.0)?,
        blocks::parts::ring(2.2)?,
        blocks::parts::holed_plate(2.2)?,
    ])
}

const RECIPE: &str =
    "name = \"shapes\"\ncount = [50, 55]\ndensity_per_m2 = 700\n[sensor]\nkind = \"uav\"\n";

fn body(bench: &Bench) -> Result<String, ReproduceError> {
    let mut table = Table::new(&[
        "shape, clustering",
        "scored blocks",
        "P %",
        "R %",
        "AP50 %",
        "known to the weights",
    ]);
    let mut weights = Vec::new();
    for model in shapes()? {
        let name = model.name.clone();
        let catalog = Catalog::new(vec![model]);
        let network = match bench.model {
            Some(network) => network.clone(),
            None => SegmentModel::shipped(&catalog)?,
        };
        let line = weights_line(&network)?;
        if !weights.contains(&line) {
            weights.push(line);
        }
        let recipe = synth::Recipe::parse(RECIPE)
            .map_err(|e| ReproduceError::Recipe { set: name.clone(), message: e.to_string() })?;
        let mut scenes = Vec::new();
        for index in 0..bench.settings.scenes {
            let seed = SeedTree::new(bench.settings.seed).child(&name, index);
            scenes.push(
                synth::scene(&recipe, &catalog, seed).map_err(|source| ReproduceError::Scene {
                    set: name.clone(),
                    index,
                    source,
                })?,
            );
        }
        let known = if network.description.shapes.is_empty() {
            "for any shape"
        } else if network.unseen_types(&catalog).is_empty() {
            "trained on it"
        } else {
            "no"
        };
        let mut rows: Vec<(&str, Vec<Judged>)> =
            ["votes", "votes, then poses", "embedding"].map(|label| (label, Vec::new())).into();
        for (i, scene) in scenes.iter().enumerate() {
            let seed = SeedTree::new(bench.settings.seed).child("segment", i as u64);
            let look = |clustering| {
                let config = SegmentConfig { clustering, ..Default::default() };
                segment(&scene.survey.cloud, &catalog, &network, &config, seed, bench.observer)
            };
            let votes = look(Clustering::Votes)?;
            let seed = SeedTree::new(bench.settings.seed).child("pose", 0);
            let blocks = pose::recognise(
                &scene.survey,
                &votes,
                &catalog,
                &PoseConfig::default(),
                seed,
                bench.observer,
            )?;
            rows[0].1.push(Judged::of(&votes, scene));
            rows[1].1.push(Judged::of(&of_blocks(&blocks, scene.instance.len()), scene));
            rows[2].1.push(Judged::of(&look(Clustering::Embedding)?, scene));
        }
        for (label, judged) in rows {
            let v = verdict(&judged)?;
            let asked = v.counts.true_positives + v.counts.false_negatives;
            table.row([
                format!("{name}, {label}"),
                asked.to_string(),
                percent(v.counts.precision()),
                percent(v.counts.recall()),
                percent(v.ap50),
                known.to_string(),
            ]);
        }
    }
    Ok(format!(
        "Drone survey, 700 points/m², 50–55 blocks a scene. *Then poses*: the points of the blocks that the pose stage, which knows \
         the mesh, recognises from those instances. Weights: {}.\n\n{}",
        weights.join("; "),
        table.finish()
    ))
}

/// The points of recognised blocks as instances.
pub fn of_blocks(blocks: &[Recognised], points: usize) -> Segmentation {
    let mut found = Segmentation { instances: blocks.len(), ..Segmentation::of_nothing(points) };
    for (label, block) in (1..).zip(blocks) {
        for &i in &block.points {
            found.instance[i as usize] = label;
        }
        let Some(fit) = block.fit() else { continue };
        found.hypotheses.push(CentreHypothesis {
            centre: fit.site_from_block.translation,
            score: fit.confidence.unwrap_or(0.0),
            points: block.points.clone(),
        });
    }
    found
}
