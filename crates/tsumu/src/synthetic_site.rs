//! A synthetic scene as a site folder: the survey in projected coordinates, the truth beside it; and the same site later.

use crate::catalogue::RecipeInputs;
use crate::error::OrBadInput;
use crate::planning::read_placements;
use crate::{Error, Result, dataset};
use anyhow::{Context, anyhow};
use geom::DVec3;
use io::RawCloud;
use io::blocks_csv::BlockRow;
use io::changes_csv::TruthRow;
use scene::{Catalog, SiteFrame};
use std::path::Path;
use synth::SynthScene;
use synth::then::{Then, TrueChange};

const SURVEY: &str = "survey.laz";
const TRUTH: &str = "truth/truth.csv";

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
/// Errors: the folder has a survey that was not made so.
pub fn make_site(
    folder: &Path,
    inputs: &RecipeInputs,
    seed: u64,
    place: &Georeference,
) -> Result<SyntheticSite> {
    refuse_survey(folder)?;
    let scene =
        synth::scene(&inputs.recipe, &inputs.catalog, dataset::seed(seed, 0)).or_bad_input()?;
    let frame = SiteFrame { origin: place.origin, crs: place.crs.clone(), ..SiteFrame::default() };
    write_survey(folder, &scene, &inputs.catalog, &frame)?;
    Ok(SyntheticSite::of(&scene))
}

/// One scene in memory: scene `index` of a dataset of this seed, to the byte.
pub fn make_scene(inputs: &RecipeInputs, seed: u64, index: u32) -> Result<SynthScene> {
    synth::scene(&inputs.recipe, &inputs.catalog, dataset::seed(seed, index)).or_bad_input()
}

/// The same scene after something happened to it: survey and truth, and `truth/changes_truth.csv`, what really happened to
/// each block. `plan`: the placements that works build, a storm needs none. Errors: works without a plan.
pub fn make_next_epoch(
    folder: &Path,
    inputs: &RecipeInputs,
    seed: u64,
    place: &Georeference,
    then: &Then,
    plan: Option<&Path>,
) -> Result<SyntheticSite> {
    refuse_survey(folder)?;
    let (recipe, catalog) = (&inputs.recipe, &inputs.catalog);
    let seed = dataset::seed(seed, 0);
    let frame = SiteFrame { origin: place.origin, crs: place.crs.clone(), ..SiteFrame::default() };
    let plan = plan.map(|file| read_placements(file, catalog, &frame)).transpose()?;
    let before = synth::scene(recipe, catalog, seed).or_bad_input()?;
    let next = synth::then::then(
        recipe,
        catalog,
        &before.scene,
        then,
        plan.as_ref(),
        seed.child("then", 0),
    )
    .or_bad_input()?;
    write_survey(folder, &next.scene, catalog, &frame)?;
    let rows: Vec<TruthRow> = next.changes.iter().map(|c| truth(c, catalog)).collect();
    io::changes_csv::write_truth(&folder.join("truth/changes_truth.csv"), &rows)?;
    Ok(SyntheticSite::of(&next.scene))
}

/// Reads what happens, from a TOML file.
pub fn read_then(file: &Path) -> Result<Then> {
    let text = io::read_text(file, 16 << 20).or_bad_input()?;
    Then::parse(&text).with_context(|| file.display().to_string()).or_bad_input()
}

fn truth(change: &TrueChange, catalog: &Catalog) -> TruthRow {
    TruthRow {
        earlier_id: change.earlier.map(|id| id.0),
        later_id: change.later.map(|id| id.0),
        plan_order: change.planned,
        model: catalog.get(change.model).name.clone(),
        what: change.what.word().into(),
        shift_m: change.shift_m.as_dvec3().to_array(),
        turn_deg: f64::from(change.turn_rad.to_degrees()),
        lost_leg: change.lost_leg.into(),
        cut_plane: change
            .cut
            .map(|p| [p.normal.x, p.normal.y, p.normal.z, p.offset_m].map(f64::from)),
    }
}

impl SyntheticSite {
    fn of(scene: &SynthScene) -> Self {
        Self { blocks: scene.scene.blocks.len(), points: scene.survey.cloud.len() }
    }
}

/// A survey without a truth beside it was measured, or is another's.
fn refuse_survey(folder: &Path) -> Result<()> {
    let survey = folder.join(SURVEY);
    if survey.symlink_metadata().is_err() || folder.join(TRUTH).is_file() {
        return Ok(());
    }
    Err(Error::bad_input(anyhow!(
        "{}: is no made-up survey (there is no {TRUTH} beside it) and is not overwritten; choose another --out",
        survey.display()
    )))
}

/// The truth first: a survey never lies there without it.
fn write_survey(
    folder: &Path,
    scene: &SynthScene,
    catalog: &Catalog,
    frame: &SiteFrame,
) -> Result<()> {
    let position: Vec<DVec3> =
        scene.survey.cloud.position_m.iter().map(|&p| frame.site_from_local(p)).collect();
    let line = (!scene.survey.line.is_empty()).then(|| scene.survey.line.clone());
    let survey = RawCloud { position, line, crs: Some(frame.crs.clone()), ..RawCloud::default() };
    let blocks = scene.scene.blocks.iter().zip(&scene.occlusion);
    let rows: Vec<BlockRow> = blocks
        .map(|(block, &occlusion)| BlockRow::of_truth(block, occlusion, catalog, frame))
        .collect();
    io::blocks_csv::write_truth(&folder.join(TRUTH), &rows)?;
    io::points::write(&folder.join(SURVEY), &survey)?;
    let labelled = RawCloud { instance: Some(scene.instance.clone()), ..survey };
    Ok(io::points::write(&folder.join("truth/cloud.laz"), &labelled)?)
}
