//! A synthetic scene as a site folder: the survey in projected coordinates, the truth beside it.

use crate::exit::Exit;
use geom::DVec3;
use io::RawCloud;
use io::blocks_csv::BlockRow;
use scene::{Catalog, SiteFrame};
use std::path::Path;
use synth::SynthScene;

/// Where a synthetic site lies.
#[derive(Clone, Debug)]
pub struct Georeference {
    /// `EPSG:n`.
    pub crs: String,
    /// Site coordinates of the scene's origin: east, north, up.
    pub origin: [f64; 3],
}

/// Writes survey.laz, truth/truth.csv and truth/cloud.laz. site.toml and catalog.toml are the user's.
pub fn write(
    folder: &Path,
    scene: &SynthScene,
    catalog: &Catalog,
    place: &Georeference,
) -> Result<(), Exit> {
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
    Ok(())
}
