//! Tsumu looks at a pile and plans the next layer. In: a site folder (surveys, catalogue, design surface). Out: a run folder
//! (recognised blocks, plan, report, exports). This crate is the only room that knows both; the command line, examples and
//! other front ends are thin over it. It never prints and never reads a signal: progress goes to the [`Job`]'s observer.
//!
//! ```no_run
//! use tsumu::{Job, RunOptions, Site};
//! let job = Job::silent();
//! let site = Site::load("examples/breakwater".as_ref(), &job)?;
//! let run = tsumu::run(&site, "out".as_ref(), &RunOptions::default(), &job)?;
//! println!("{}", run.report().display());
//! # Ok::<(), tsumu::Error>(())
//! ```

mod arrays;
mod before;
mod bin;
mod bin_lines;
mod block_look;
mod block_size;
mod catalogue;
mod choices;
mod comparison;
mod dataset;
mod draft;
mod drawings;
mod error;
mod evaluate;
mod evaluate_labels;
mod input_kinds;
mod job;
mod labelled;
mod lifts;
mod local_survey;
mod lock;
mod memory;
mod next;
mod outputs;
mod own_records;
mod page;
mod planning;
mod ratings;
mod recognition;
mod resume;
mod review;
mod review_matching;
mod run;
mod run_folder;
mod self_check;
mod settings;
mod sheet_font;
mod site;
mod stored;
mod summary;
mod surveys;
mod synthetic_site;
mod tiles;
mod unfilled;
pub mod version;
mod weights;
mod what_if;
mod whole_run;
mod written;

pub use arrays::{Arrays, catalog_of};
pub use before::{cannot, check, check_first, init, write_map};
pub use bin::{Bin, BinLook, BinOptions, Grasp};
pub use block_size::{BlockFit, FitOptions, fit_blocks};
pub use catalogue::{RecipeInputs, read as read_catalog, read_recipe};
pub use choices::PlanChoice;
pub use comparison::{
    CompareOptions, Compared, ComparisonFolder, EpochRun, compare, compare_series,
    compare_with_plan, read_stable_ground,
};
pub use dataset::{DatasetOptions, DatasetSummary, Shard, make_dataset};
pub use draft::{Draft, Variant, read_draft, write_draft, write_review, write_variant};
pub use error::{Error, Kind, Result};
pub use evaluate::{Evaluation, Scores, evaluate};
pub use evaluate_labels::{LabelEvaluation, LabelScores, evaluate_labels};
pub use input_kinds::InputKinds;
pub use io::what_if_csv::WhatIfRow;
pub use job::{Cancel, Job};
pub use labelled::check_labelled;
pub use memory::MemoryLimit;
pub use metrics::{Repeatability, Split};
pub use next::NextLift;
pub use outputs::json_value;
pub use page::Page;
pub use pipeline::Method;
pub use planning::{PlanOptions, Planned, kept_of};
pub use preflight::{FirstSite, Preflight, SurveyLook};
pub use ratings::{RatingsRecord, WeightRecord};
pub use recognition::{RecogniseOptions, Recognition, Segments};
pub use review::{DecisionRecord, ReviewRecord};
pub use run::{NewRun, Part, Run, folders_of};
pub use run_folder::{RunEntry, RunFolder, runs_of};
pub use settings::Settings;
pub use site::Site;
pub use summary::{
    CountRange, PlannedSummary, RangeOfThresholds, RecogniseSummary, RunSummary, TypeCount,
    UnfilledCount,
};
pub use surveys::Clouds;
pub use synthetic_site::{
    Georeference, SyntheticSite, make_next_epoch, make_scene, make_site, read_then,
};
pub use tiles::{
    Tile, TileDone, TileOptions, TilePlan, TileRequest, TileStatus, TiledSite, merge_tiles,
};
pub use weights::{WeightsOrigin, load as load_weights};
pub use what_if::WhatIf;
pub use whole_run::{RunOptions, WholeRun, run};
