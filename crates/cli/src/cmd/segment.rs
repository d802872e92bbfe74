//! `tsumu segment`: the block of every point.

use crate::cmd::chosen::Chosen;
use crate::cmd::measured::Measured;
use clap::Args;
use serde_json::json;
use std::path::PathBuf;
use terminal::Terminal;
use tsumu::{Job, Result, Site};

/// Label every point of a cloud with the block it belongs to.
///
/// Every point of CLOUD comes back, in its order, with `instance` (0 = no block) and `confidence`.
/// Beside the labelled cloud FILE lie FILE.manifest.json and FILE.config.toml.
#[derive(Debug, Args)]
pub struct SegmentArgs {
    /// The cloud: LAS, LAZ, PLY or another format of the guide
    #[arg(value_name = "CLOUD")]
    pub cloud: PathBuf,
    /// The block types that may be in the pile
    #[arg(long, value_name = "FILE")]
    pub catalog: PathBuf,
    /// The labelled cloud: .ply, .laz or .las; .pcd for a cloud that is one
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
pub fn segment(args: &SegmentArgs, terminal: &Terminal, job: &Job) -> Result<()> {
    tsumu::check_labelled(&args.out, &args.cloud)?;
    let clouds = args.measured.clouds(std::slice::from_ref(&args.cloud));
    let site = Site::of_clouds(&clouds, &args.catalog, None, &args.chosen.settings(), job)?;
    let (found, weights) = site.segment(&args.chosen.options(), job)?;
    site.write_labelled(&args.out, &found, &weights)?;
    let (points, labelled) = (found.instance.len(), found.labelled());
    terminal.emit(
        "segmented",
        &json!({ "points": points, "labelled_points": labelled, "instances": found.instances,
                 "centre_hypotheses": found.centre_hypotheses, "weights": weights.line }),
    );
    terminal.say(format!(
        "{} instances ({} centre hypotheses); {labelled} of {points} points belong to one",
        found.instances, found.centre_hypotheses
    ));
    terminal.say(format!("weights: {}", weights.line));
    terminal.say(format!("labelled cloud: {}", args.out.display()));
    Ok(())
}
