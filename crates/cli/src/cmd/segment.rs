//! `tsumu segment`: the block of every point.

use crate::cmd::recognise::{Chosen, Measured};
use crate::exit::{Exit, OrBadInput};
use crate::progress::Terminal;
use crate::{inputs, outputs, weights};
use anyhow::anyhow;
use clap::Args;
use geom::SeedTree;
use pipeline::Recogniser;
use serde_json::json;
use std::path::PathBuf;

/// Label every point of a cloud with the block it belongs to.
///
/// Every point of CLOUD comes back, in its order, with `instance` (0 = no block) and `confidence`.
#[derive(Debug, Args)]
pub struct SegmentArgs {
    /// The cloud: LAS, LAZ, PLY or another format of the guide
    #[arg(value_name = "CLOUD")]
    pub cloud: PathBuf,
    /// The block types that may be in the pile
    #[arg(long, value_name = "FILE")]
    pub catalog: PathBuf,
    /// The labelled cloud: .ply, .laz or .las
    #[arg(long, value_name = "FILE")]
    pub out: PathBuf,
    /// How the cloud was measured
    #[command(flatten)]
    pub measured: Measured,
    /// Weights and settings
    #[command(flatten)]
    pub chosen: Chosen,
}

/// Segments and writes.
pub fn segment(args: &SegmentArgs, terminal: &Terminal) -> Result<(), Exit> {
    let extension =
        args.out.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
    if !["ply", "laz", "las"].contains(&extension.as_str()) {
        return Err(Exit::bad_input(anyhow!(
            "--out {}: end it in .ply, .laz or .las",
            args.out.display()
        )));
    }
    let config = args.chosen.settings()?;
    let catalog = inputs::catalog(&args.catalog, terminal)?;
    let files = std::slice::from_ref(&args.cloud);
    let survey = args.measured.survey(files, terminal)?;
    let weights = weights::choose(args.chosen.model.as_deref(), &catalog, terminal)?;
    let seed = SeedTree::new(args.chosen.seed);
    let recogniser = Recogniser {
        catalog: &catalog,
        model: &weights.model,
        config: &config,
        seed,
        observer: terminal,
    };
    let segmentation = recogniser.segments(&survey).or_bad_input()?;
    io::points::write(&args.out, &outputs::labelled_cloud(&survey, &segmentation))?;
    let labelled = segmentation.instance.iter().filter(|&&i| i > 0).count();
    terminal.emit(
        "segmented",
        json!({ "points": survey.cloud.len(), "labelled_points": labelled, "instances": segmentation.instances,
                "centre_hypotheses": segmentation.hypotheses.len(), "weights": weights.origin }),
    );
    terminal.say(format!(
        "{} instances ({} centre hypotheses); {labelled} of {} points belong to one",
        segmentation.instances,
        segmentation.hypotheses.len(),
        survey.cloud.len()
    ));
    terminal.say(format!("weights: {}", weights.origin));
    terminal.say(format!("labelled cloud: {}", args.out.display()));
    Ok(())
}
