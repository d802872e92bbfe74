//! `tsumu recognise`: pose and type of every block in a cloud.

use crate::exit::{Exit, OrBadInput};
use crate::progress::Terminal;
use crate::result_folder::RunFolder;
use crate::{inputs, outputs, review, version, weights};
use clap::Args;
use geom::SeedTree;
use pipeline::{Config, Recogniser};
use scene::{Area, Survey};
use std::path::PathBuf;

/// Find pose and type of every block in a cloud.
///
/// Leaves recognise/blocks.csv (one row a block), recognise/cloud.laz (the block of every point),
/// recognise/summary.json, segment/cloud.laz and picture.png in the folder given with --out.
#[derive(Debug, Args)]
pub struct RecogniseArgs {
    /// Clouds: LAS, LAZ or PLY; several are joined
    #[arg(value_name = "CLOUD", required = true)]
    pub clouds: Vec<PathBuf>,
    /// The block types that may be in the pile
    #[arg(long, value_name = "FILE")]
    pub catalog: PathBuf,
    /// Folder for the results
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// A review.json saved from a report: its decisions stand
    #[arg(long, value_name = "FILE")]
    pub review: Option<PathBuf>,
    /// How the cloud was measured
    #[command(flatten)]
    pub measured: Measured,
    /// Weights and settings
    #[command(flatten)]
    pub chosen: Chosen,
}

/// How a loose cloud was measured.
#[derive(Clone, Debug, Args)]
pub struct Measured {
    /// Kind of sensor; with a depth camera the bin's floor is removed first
    #[arg(long, value_enum, default_value_t = Sensor::Uav)]
    pub sensor: Sensor,
    /// Where the sensor was, in the cloud's coordinates; repeat it for several places [default: straight above]
    #[arg(long, value_name = "X,Y,Z", value_parser = point, allow_hyphen_values = true)]
    pub sensor_position: Vec<[f64; 3]>,
    /// Read only what lies in this rectangle, in the cloud's coordinates; a COPC only where it touches it
    #[arg(long, value_name = "X0,Y0,X1,Y1", value_parser = rectangle, allow_hyphen_values = true)]
    pub area: Option<Area>,
}

impl Measured {
    /// The clouds as one survey.
    pub fn survey(&self, clouds: &[PathBuf], terminal: &Terminal) -> Result<Survey, Exit> {
        inputs::loose_survey(
            clouds,
            self.sensor.kind(),
            &self.sensor_position,
            self.area.as_ref(),
            terminal,
        )
    }
}

/// Weights and settings.
#[derive(Clone, Debug, Args)]
pub struct Chosen {
    /// Folder or weights file of `tsumu train segment`, or shipped weights by name: `tetrapod`, `any-shape`, `fpcc`
    /// [default: the shipped weights that suit the catalogue]
    #[arg(long, value_name = "MODEL")]
    pub model: Option<PathBuf>,
    /// A TOML file with settings that differ from the defaults ([segment], [pose], [plan])
    #[arg(long, value_name = "FILE")]
    pub config: Option<PathBuf>,
    /// Root of all random choices
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
}

/// Kinds of sensor on the command line.
#[derive(Clone, Copy, Debug, clap::ValueEnum)]
pub enum Sensor {
    /// Photogrammetry or laser from the air
    Uav,
    /// Multibeam sonar
    Mbes,
    /// Depth camera above a bin
    DepthCamera,
}

impl Sensor {
    /// The program's word.
    pub fn kind(self) -> scene::SensorKind {
        match self {
            Self::Uav => scene::SensorKind::Uav,
            Self::Mbes => scene::SensorKind::Mbes,
            Self::DepthCamera => scene::SensorKind::DepthCamera,
        }
    }
}

/// `x,y,z` as three numbers.
pub fn point(text: &str) -> Result<[f64; 3], String> {
    <[f64; 3]>::try_from(numbers(text)?)
        .map_err(|n| format!("{} numbers instead of x,y,z", n.len()))
}

/// `x0,y0,x1,y1` as a rectangle.
fn rectangle(text: &str) -> Result<Area, String> {
    let [west, south, east, north] = <[f64; 4]>::try_from(numbers(text)?)
        .map_err(|n| format!("{} numbers instead of x0,y0,x1,y1", n.len()))?;
    let area = Area { west, east, south, north };
    area.check().map_err(|e| e.to_string())?;
    Ok(area)
}

fn numbers(text: &str) -> Result<Vec<f64>, String> {
    text.split(',')
        .map(|t| t.trim().parse::<f64>())
        .collect::<Result<_, _>>()
        .map_err(|e| e.to_string())
}

impl Chosen {
    /// The settings file over the defaults.
    pub fn settings(&self) -> Result<Config, Exit> {
        match &self.config {
            Some(file) => io::site::read_toml(file).or_bad_input(),
            None => Ok(Config::default()),
        }
    }
}

/// Recognises and writes.
pub fn recognise(args: &RecogniseArgs, terminal: &Terminal) -> Result<(), Exit> {
    let config = args.chosen.settings()?;
    let catalog = inputs::catalog(&args.catalog, terminal)?;
    let survey = args.measured.survey(&args.clouds, terminal)?;
    let weights = weights::choose(args.chosen.model.as_deref(), &catalog, terminal)?;
    let run = RunFolder::for_writing(&args.out)?;
    let seed = SeedTree::new(args.chosen.seed);
    let decided = match &args.review {
        Some(file) => Some(review::of_file(file)?),
        None => None,
    };
    let recogniser = Recogniser {
        catalog: &catalog,
        model: &weights.model,
        config: &config,
        seed,
        observer: terminal,
    };
    let mut recognition = recogniser.recognise(&survey)?;
    let honoured = review::honour(
        decided.as_ref(),
        &catalog,
        &survey.frame,
        &mut recognition.blocks,
        terminal,
    )?;
    outputs::write_segment(&run, &survey, &recognition)?;
    let summary = outputs::write_recognise(&run, &survey, &recognition, &catalog)?;
    io::atomic::write_bytes(
        &run.picture(),
        &crate::page::picture(&survey, &catalog, &recognition.blocks)?,
    )?;
    let config = serde_json::to_value(&config)?;
    let mut manifest = io::manifest::Manifest::new(version::STAMP, args.chosen.seed, config);
    weights.record(&mut manifest);
    honoured.iter().for_each(|h| h.record(&mut manifest));
    for file in args.clouds.iter().chain(std::iter::once(&args.catalog)).chain(&args.review) {
        manifest.add_input(file.file_name().map_or(file.as_path(), |n| n.as_ref()), file)?;
    }
    let written = io::manifest::files_below(run.root())?;
    manifest.seal(run.root(), written.iter().map(|name| name.as_path()))?;
    terminal.emit("recognised", summary.clone());
    say(&summary, terminal);
    terminal.say(format!("results: {}", args.out.display()));
    Ok(())
}

/// The figures of recognition in words.
pub fn say(summary: &serde_json::Value, terminal: &Terminal) {
    let number = |key: &str| summary[key].as_f64();
    let or_dash = |v: Option<String>| v.unwrap_or("–".into());
    terminal.say(format!(
        "{} blocks recognised, {} not judged, in {} points",
        summary["recognised_blocks"], summary["not_judged_blocks"], summary["points"]
    ));
    if let Some(open @ 1..) = summary["types_not_judged"].as_u64() {
        terminal
            .say(format!("{open} of them have a pose, but their type is not judged: `type_judged` = no in blocks.csv"));
    }
    terminal.say(format!(
        "fitting error {}, matching rate {} (within {:.1} mm of a block)",
        or_dash(number("fitting_error_m").map(|v| format!("{:.2} mm", v * 1000.0))),
        or_dash(number("matching_rate").map(|v| format!("{:.1} %", v * 100.0))),
        number("fitting_threshold_m").unwrap_or(0.0) * 1000.0
    ));
}
