//! The figures of a run as `summary.json` has them: made once, read by words, pages and other programs.

use crate::recognition::Recognition;
use metrics::Repeatability;
use pipeline::PileVerdict;
use plan::{BlockChoice, ThresholdRange, Uncertainty, UncertaintyConfig, UnfilledReason};
use scene::{Catalog, Placement, Plan, PlanSummary, Survey};
use serde::{Deserialize, Deserializer, Serialize};
use std::collections::BTreeMap;
use std::path::PathBuf;

/// `recognise/summary.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RecogniseSummary {
    /// Survey points.
    pub points: usize,
    /// Instances the network found.
    pub instances: usize,
    /// Places where a block's centre may be.
    pub centre_hypotheses: usize,
    /// Stated blocks.
    pub recognised_blocks: usize,
    /// The same by type.
    pub recognised_by_type: BTreeMap<String, usize>,
    /// Stated blocks whose type is left open.
    pub types_not_judged: usize,
    /// Stated blocks of which a sensor looked through a leg.
    #[serde(default)]
    pub damaged_blocks: usize,
    /// Blocks too little is seen of.
    pub not_judged_blocks: usize,
    /// How near a block a point must be to match it, metres.
    pub fitting_threshold_m: f64,
    /// Mean distance of the points within the threshold, metres.
    pub fitting_error_m: Option<f64>,
    /// Share of the points within the threshold, in [0, 1].
    pub matching_rate: Option<f64>,
    /// Points of stated blocks.
    pub explained_points: usize,
    /// Mean distance of those within the threshold, metres.
    pub fitting_error_of_explained_points_m: Option<f64>,
    /// What is said of the survey as a whole: share of what stands above the ground that the blocks explain, the size that fits
    /// them, places that are no block, from where the survey was taken to be measured.
    #[serde(default)]
    pub pile: PileVerdict,
    /// How far both halves of the survey agree, where `--self-check` asked for it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub self_check: Option<Repeatability>,
}

impl RecogniseSummary {
    /// Fit of the recognised blocks to the survey, and counts.
    pub fn of(survey: &Survey, recognition: &Recognition, catalog: &Catalog) -> Self {
        let stated = || scene::stated(&recognition.blocks);
        let placed = pipeline::placed_blocks(&recognition.blocks);
        let threshold_m = fitting_threshold_m(catalog);
        let distance =
            metrics::model_distances_m(&survey.cloud.position_m, &placed, catalog, threshold_m);
        let on_blocks: Vec<f32> =
            stated().flat_map(|(b, _)| &b.points).map(|&i| distance[i as usize]).collect();
        let all = metrics::fitting(&distance, threshold_m);
        let own = metrics::fitting(&on_blocks, threshold_m);
        let of_type = |id| placed.iter().filter(|b| b.model == id).count();
        Self {
            points: survey.cloud.len(),
            instances: recognition.segments.instances,
            centre_hypotheses: recognition.segments.centre_hypotheses,
            recognised_blocks: placed.len(),
            recognised_by_type: catalog
                .iter()
                .map(|(id, m)| (m.name.clone(), of_type(id)))
                .collect(),
            types_not_judged: stated().filter(|(_, fit)| !fit.type_judged).count(),
            damaged_blocks: stated()
                .filter(|(_, fit)| fit.legs.is_some_and(|l| l.missing > 0))
                .count(),
            not_judged_blocks: recognition.blocks.len() - placed.len(),
            fitting_threshold_m: (f64::from(threshold_m) * 1e6).round() / 1e6,
            fitting_error_m: all.error_m,
            matching_rate: all.matching_rate,
            explained_points: on_blocks.len(),
            fitting_error_of_explained_points_m: own.error_m,
            pile: recognition.pile.clone(),
            self_check: recognition.self_check.clone(),
        }
    }
}

/// The thesis takes 0.1 m for its 2–3 m blocks: a twentieth of the largest edge.
pub(crate) fn fitting_threshold_m(catalog: &Catalog) -> f32 {
    catalog.iter().map(|(_, m)| m.d_box_m * 0.05).fold(f32::INFINITY, f32::min)
}

/// `plan/summary.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PlannedSummary {
    /// Figures of the plan itself.
    #[serde(flatten)]
    pub plan: PlanSummary,
    /// How far the count depends on chance, when that was asked for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub count_range: Option<CountRange>,
    /// Blocks of each type, where the plan may use several.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub types: Vec<TypeCount>,
    /// Working days it takes, where hours and rate are given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub days: Option<u32>,
    /// Places that stay below the design, by reason, the largest void first.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub unfilled: Vec<UnfilledCount>,
}

/// What a whole run ends with, for programs that started it.
#[derive(Clone, Debug, Serialize)]
pub struct RunSummary<'a> {
    /// Figures of recognition.
    pub recognised: &'a RecogniseSummary,
    /// Figures of the plan; `None` for an inventory.
    pub planned: Option<&'a PlannedSummary>,
    /// The run folder.
    pub folder: PathBuf,
}

/// What a plan takes of one type.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TypeCount {
    /// Name in the catalogue.
    pub name: String,
    /// Blocks to place.
    pub blocks: u32,
    /// How many lay ready; `None`: as many as needed are made.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stock: Option<u32>,
    /// Their cost in place, in the currency of the settings.
    pub cost: f64,
}

/// Places of one reason.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct UnfilledCount {
    /// The reason's word in `unfilled.csv`.
    pub reason: UnfilledReason,
    /// Places.
    pub places: usize,
    /// Volume missing in them, m³.
    pub void_m3: f32,
}

impl TypeCount {
    /// Of every type that a plan may use; none where it may use one only.
    pub(crate) fn of(plan: &Plan, blocks: &[BlockChoice], catalog: &Catalog) -> Vec<Self> {
        let of = |choice: &BlockChoice| {
            let model = catalog.find(&choice.name);
            let new = |p: &&Placement| Some(p.model) == model && p.is_new();
            let own = plan.placements.iter().filter(new).count() as u32;
            Self {
                name: choice.name.clone(),
                blocks: own,
                stock: choice.stock,
                cost: f64::from(own) * f64::from(choice.cost),
            }
        };
        blocks.iter().map(of).collect()
    }
}

/// Counts over seeds and thresholds: a tenth, half and nine tenths of the plans need at most so many blocks.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CountRange {
    /// Plans for each pair of thresholds.
    pub seeds: u32,
    /// Plans in all.
    pub plans: usize,
    /// Whether each plan was built with the crane's errors and planned on from; else plans are counted.
    pub built: bool,
    /// P10.
    pub p10: f32,
    /// Median.
    pub p50: f32,
    /// P90.
    pub p90: f32,
    /// The same for each pair of thresholds.
    pub by_thresholds: Vec<RangeOfThresholds>,
    /// By N = φ·A·V^(−2/3).
    #[serde(deserialize_with = "nan_if_null")]
    pub by_layers: f32,
    /// By void·(1 − P)/V with the handbook's porosity.
    #[serde(deserialize_with = "nan_if_null")]
    pub by_volume: f32,
    /// The same with the plan's own porosity.
    #[serde(deserialize_with = "nan_if_null")]
    pub by_own_porosity: f32,
}

/// Counts at one minimum volume v and one overflow threshold f.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RangeOfThresholds {
    /// v.
    pub minimum_volume_m3: f32,
    /// f.
    pub overflow_m: f32,
    /// P10.
    pub p10: f32,
    /// Median.
    pub p50: f32,
    /// P90.
    pub p90: f32,
    /// Mean distance to the design.
    #[serde(deserialize_with = "nan_if_null")]
    pub mean_distance_m: f32,
    /// Void left below the design.
    #[serde(deserialize_with = "nan_if_null")]
    pub void_after_m3: f32,
}

/// JSON writes what is not a number as null.
fn nan_if_null<'de, D: Deserializer<'de>>(from: D) -> Result<f32, D::Error> {
    Ok(Option::deserialize(from)?.unwrap_or(f32::NAN))
}

impl CountRange {
    pub(crate) fn of(found: &Uncertainty, study: &UncertaintyConfig) -> Self {
        let of = |t: &ThresholdRange| RangeOfThresholds {
            minimum_volume_m3: t.minimum_volume_m3,
            overflow_m: t.overflow_m,
            p10: t.blocks.p10,
            p50: t.blocks.p50,
            p90: t.blocks.p90,
            mean_distance_m: t.mean_distance_m,
            void_after_m3: t.void_after_m3,
        };
        Self {
            seeds: study.seeds,
            plans: found.cases.len(),
            built: study.building.shifts > 0,
            p10: found.blocks.p10,
            p50: found.blocks.p50,
            p90: found.blocks.p90,
            by_thresholds: found.by_thresholds.iter().map(of).collect(),
            by_layers: found.by_layers,
            by_volume: found.by_volume,
            by_own_porosity: found.by_own_porosity,
        }
    }

    /// Whether thresholds were varied, not seeds alone.
    pub fn varied(&self) -> bool {
        self.by_thresholds.len() > 1
    }
}
