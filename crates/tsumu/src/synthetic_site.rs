//! A synthetic scene as a site folder: the survey in projected coordinates, the truth beside it.

use crate::catalogue::RecipeInputs;
use crate::error::OrBadInput;
use crate::{Result, dataset};
use geom::DVec3;
use io::RawCloud;
use io::blocks_csv::BlockRow;
use scene::SiteFrame;
use std::path::Path;

/// Where a synthetic site lies.
#[derive(Clone, Debug)]
pub struct Georeference {
    /// `EPSG:n`.
    pub crs: String,
    /// Site coordinates of the scene's origin: east, north, up.
    pub origin: [f64; 3],
}

/// What a synthetic site holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SyntheticSite {
    /// True blocks.
    pub blocks: usize,
    /// Survey points.
    pub points: usize,
}

/// Makes one scene and writes survey.laz, truth/truth.csv and truth/cloud.laz. site.toml and catalog.toml are the user's.
pub fn make_site(
    folder: &Path,
    inputs: &RecipeInputs,
    seed: u64,
    place: &Georeference,
) -> Result<SyntheticSite> {
    let scene =
        synth::scene(&inputs.recipe, &inputs.catalog, dataset::seed(seed, 0)).or_bad_input()?;
    let catalog = &inputs.catalog;
    let frame = SiteFrame { origin: place.origin, crs: place.crs.clone(), ..SiteFrame::default() };
    let position: Vec<DVec3> =
        scene.survey.cloud.position_m.iter().map(|&p| frame.site_from_local(p)).collect();
    let line = (!scene.survey.line.is_empty()).then(|| scene.survey.line.clone());
    let survey = RawCloud { position, line, crs: Some(place.crs.clone()), ..RawCloud::default() };
    io::points::write(&folder.join("survey.laz"), &survey)?;
    let labelled = RawCloud { instance: Some(scene.instance.clone()), ..survey };
    io::points::write(&folder.join("truth/cloud.laz"), &labelled)?;
    let rows: Vec<BlockRow> = scene
        .scene
        .blocks
        .iter()
        .zip(&scene.occlusion)
        .map(|(block, &occlusion)| BlockRow::of_truth(block, occlusion, catalog, &frame))
        .collect();
    io::blocks_csv::write_truth(&folder.join("truth/truth.csv"), &rows)?;
    Ok(SyntheticSite { blocks: scene.scene.blocks.len(), points: scene.survey.cloud.len() })
}
