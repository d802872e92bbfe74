//! The method's published tables, made again on our own sites with seeds that no training used.
//!
//! In: an experiment's name, settings, weights. Out: a page of Markdown with the table, its seeds and the hash of the
//! weights, so that anybody can make it again. No algorithm of the pipeline lives here: an experiment makes scenes,
//! calls stages with the settings it compares, and asks `metrics`.

mod as_built;
mod back_test;
mod bin_data;
mod bin_kept;
mod bin_parts;
mod bin_picking;
mod bin_rows;
mod bin_weights;
mod error;
mod markdown;
mod monitoring;
mod monitoring_score;
mod peak_memory;
mod placement_ambiguity;
mod placement_network;
mod planning_gains;
mod planning_limit;
mod planning_log;
mod planning_paths;
mod planning_policies;
mod planning_ratings;
mod planning_site;
mod planning_tables;
mod pose_ablation;
mod pose_confidence;
mod pose_fitting;
mod pose_hard;
mod pose_judge;
mod pose_sites;
mod region_times;
mod scenes;
mod segmentation_confidence;
mod segmentation_judge;
mod segmentation_loss;
mod segmentation_misses;
mod segmentation_networks;
mod segmentation_shapes;
mod segmentation_sites;
mod segmentation_suppression;
mod segmentation_time;
mod survey_offset;

pub use error::ReproduceError;
pub use markdown::{Align, Table};
pub use scenes::{HeldOut, SiteSet, site_sets, table_sets, white_noise_sets};

use geom::Observer;
use segment::SegmentModel;
use std::path::Path;

/// What an experiment may be told.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Settings {
    /// Scenes of each set.
    pub scenes: u64,
    /// Seed of the scenes. Trainings use small ones; the default is far from them.
    pub seed: u64,
    /// Optimiser steps of the experiments that train.
    pub steps: u64,
    /// Repetitions with other seeds, for what depends on chance.
    pub repeats: u64,
    /// Part of the full site to work on, percent.
    pub percent: u64,
    /// As little as still makes every table of an experiment: to see that it runs, not to be quoted.
    pub quick: bool,
}

impl Default for Settings {
    fn default() -> Self {
        Self { scenes: 3, seed: 900_001, steps: 400, repeats: 5, percent: 100, quick: false }
    }
}

impl Settings {
    /// As little as still makes every table.
    pub fn quick() -> Self {
        Self { scenes: 1, steps: 10, repeats: 1, percent: 10, quick: true, ..Self::default() }
    }
}

/// Everything an experiment works with.
pub struct Bench<'a> {
    /// What the user chose.
    pub settings: &'a Settings,
    /// Weights of the user's own; `None`: the shipped ones that suit each catalogue.
    pub model: Option<&'a SegmentModel>,
    /// Folder with parts and scenes of others, for the experiments that take them.
    pub data: Option<&'a Path>,
    /// Folder for what an experiment keeps beside its page, trainings for example.
    pub folder: &'a Path,
    /// Seconds since some moment; for the experiments that state times.
    pub clock: &'a dyn Fn() -> f64,
    /// Who is told how far it is.
    pub observer: &'a dyn Observer,
}

impl Bench<'_> {
    /// The user's weights, or the shipped ones for a catalogue.
    pub(crate) fn network(&self, catalog: &scene::Catalog) -> Result<SegmentModel, ReproduceError> {
        Ok(match self.model {
            Some(model) => model.clone(),
            None => SegmentModel::shipped(catalog)?,
        })
    }
}

/// A named experiment.
pub struct Experiment {
    /// As the command line says it.
    pub name: &'static str,
    /// What it shows, one line.
    pub about: &'static str,
    /// Makes the page's body: tables with a few words.
    pub body: fn(&Bench) -> Result<String, ReproduceError>,
}

/// Every experiment, in the order of the method's chapters.
pub const EXPERIMENTS: &[Experiment] = &[
    bin_picking::EXPERIMENT,
    bin_weights::EXPERIMENT,
    segmentation_sites::EXPERIMENT,
    segmentation_shapes::EXPERIMENT,
    segmentation_suppression::EXPERIMENT,
    segmentation_loss::EXPERIMENT,
    segmentation_confidence::EXPERIMENT,
    segmentation_misses::EXPERIMENT,
    segmentation_networks::EXPERIMENT,
    segmentation_time::EXPERIMENT,
    pose_sites::EXPERIMENT,
    pose_fitting::EXPERIMENT,
    region_times::EXPERIMENT,
    pose_ablation::EXPERIMENT,
    pose_confidence::EXPERIMENT,
    pose_hard::HARD,
    pose_hard::SIZES,
    placement_network::EXPERIMENT,
    placement_ambiguity::EXPERIMENT,
    planning_tables::EXPERIMENT,
    planning_policies::EXPERIMENT,
    planning_limit::EXPERIMENT,
    planning_paths::EXPERIMENT,
    planning_gains::EXPERIMENT,
    planning_ratings::EXPERIMENT,
    monitoring::EXPERIMENT,
    as_built::EXPERIMENT,
    back_test::EXPERIMENT,
];

/// Experiments that take parts and scenes of others.
const TAKE_DATA: [&str; 2] = ["bin-picking", "bin-weights"];

impl Experiment {
    /// Whether it takes parts and scenes of others.
    pub fn takes_data(&self) -> bool {
        TAKE_DATA.contains(&self.name)
    }

    /// The complaint where a folder of them is given to one that takes none.
    pub fn refuse_data(&self) -> Result<(), ReproduceError> {
        if self.takes_data() {
            return Ok(());
        }
        Err(ReproduceError::NoData { experiment: self.name, takers: TAKE_DATA.join(" and ") })
    }
}

/// The experiment of that name.
pub fn find(name: &str) -> Option<&'static Experiment> {
    EXPERIMENTS.iter().find(|e| e.name == name)
}

/// The whole page: head with everything needed to make it again, then the body.
pub fn page(experiment: &Experiment, bench: &Bench) -> Result<String, ReproduceError> {
    let body = (experiment.body)(bench)?;
    let Settings { scenes, seed, steps, repeats, percent, quick } = bench.settings;
    let options = format!(
        "--scenes {scenes} --seed {seed} --steps {steps} --repeats {repeats} --percent {percent}"
    );
    let mut model = if bench.model.is_some() { " --model MODEL" } else { "" }.to_string();
    for (given, option) in [(*quick, " --quick"), (bench.data.is_some(), " --data FOLDER")] {
        model += if given { option } else { "" };
    }
    Ok(format!(
        "# {}: {}\n\n`tsumu-lab reproduce {} {options}{model}`, tsumu {}.\n\n{body}",
        experiment.name,
        experiment.about,
        experiment.name,
        env!("CARGO_PKG_VERSION")
    ))
}

/// One line that identifies weights: what they are and the BLAKE3 hash of their file.
pub fn weights_line(model: &SegmentModel) -> Result<String, ReproduceError> {
    let hash = blake3::hash(&model.to_bytes()?).to_hex();
    Ok(format!(
        "{}, {} steps, BLAKE3 {}…",
        model.description.name,
        model.description.steps,
        &hash[..16]
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_distinct_and_found() {
        for (i, e) in EXPERIMENTS.iter().enumerate() {
            assert!(EXPERIMENTS[..i].iter().all(|o| o.name != e.name), "{}", e.name);
            assert_eq!(find(e.name).unwrap().about, e.about);
        }
        assert!(find("nothing").is_none());
        assert!(TAKE_DATA.iter().all(|name| find(name).unwrap().refuse_data().is_ok()));
        let refused = find("pose-sites").unwrap().refuse_data().unwrap_err();
        assert!(refused.is_bad_input() && refused.to_string().contains("bin-weights"), "{refused}");
    }
}
