//! How sure the count is: percentiles over seeds, over the crane's errors and over (v, f), and two formulas to hold against it.

use crate::built::{BuildingConfig, built_blocks};
use crate::{PlanConfig, PlanError, PlanInput, plans_over_volumes, site};
use geom::{Observer, SeedTree, Silent, Stage};
use scene::PlanSummary;
use serde::{Deserialize, Serialize};

/// What to vary.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct UncertaintyConfig {
    /// Plans for each (v, f), the first with the seed of [`plan()`](crate::plan()) itself.
    pub seeds: u32,
    /// Minimum volumes v to try; none: the configured one.
    pub minimum_volume_m3: Vec<f32>,
    /// Overflow thresholds f to try; none: the configured one.
    pub overflow_m: Vec<f32>,
    /// How exactly blocks are placed: every plan is built with these errors and planned on from.
    pub building: BuildingConfig,
    /// Layer coefficient k_Δ of the block, for the formula (tetrapod 1.04, Shore Protection Manual).
    pub layer_coefficient: f32,
    /// Porosity of the handbook, for the formulas (tetrapod 0.5).
    pub handbook_porosity: f32,
}

/// Plans that a range can be taken from; its percentiles no longer move after some hundred.
pub const MOST_SEEDS: u32 = 1_000;

impl Default for UncertaintyConfig {
    fn default() -> Self {
        Self {
            seeds: 5,
            minimum_volume_m3: Vec::new(),
            overflow_m: Vec::new(),
            building: BuildingConfig::default(),
            layer_coefficient: 1.04,
            handbook_porosity: 0.5,
        }
    }
}

/// One plan of the study.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PlanVariant {
    /// Minimum volume v.
    pub minimum_volume_m3: f32,
    /// Overflow threshold f.
    pub overflow_m: f32,
    /// Number of the seed.
    pub seed: u32,
    /// Its figures.
    pub summary: PlanSummary,
    /// Blocks that the works need when it is built with the crane's errors and planned on from.
    pub built: u32,
}

/// A tenth, half and nine tenths of works like these need at most this many blocks.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Percentiles {
    /// P10.
    pub p10: f32,
    /// Median.
    pub p50: f32,
    /// P90.
    pub p90: f32,
}

/// The plans of one pair of thresholds.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ThresholdRange {
    /// Minimum volume v.
    pub minimum_volume_m3: f32,
    /// Overflow threshold f.
    pub overflow_m: f32,
    /// Blocks built, over the seeds.
    pub blocks: Percentiles,
    /// Mean distance to the design, mean over the seeds, m.
    pub mean_distance_m: f32,
    /// Void left below the design, mean over the seeds, m³.
    pub void_after_m3: f32,
}

/// The study.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Uncertainty {
    /// Every plan: v outermost, then f, then the seed.
    pub cases: Vec<PlanVariant>,
    /// Blocks built, over all cases.
    pub blocks: Percentiles,
    /// The same for each (v, f), v outermost.
    pub by_thresholds: Vec<ThresholdRange>,
    /// N = φ·A·V^(−2/3), φ = n·k_Δ·(1 − P), with whole layers n of the design's mean depth.
    pub by_layers: f32,
    /// Deficit · (1 − P) / V with the handbook's porosity.
    pub by_volume: f32,
    /// Filled void · (1 − P) / V with the porosity of the median plan's own layer: must come near its count.
    pub by_own_porosity: f32,
}

/// Plans again and again. Errors are those of [`plan()`](crate::plan()); the observer's `cancelled` is asked between plans.
pub fn uncertainty(
    input: &PlanInput,
    config: &PlanConfig,
    study: &UncertaintyConfig,
    seed: SeedTree,
    observer: &dyn Observer,
) -> Result<Uncertainty, PlanError> {
    if study.seeds > MOST_SEEDS {
        return Err(PlanError::TooMuch {
            key: "uncertainty.seeds",
            value: study.seeds,
            most: MOST_SEEDS,
        });
    }
    if study.seeds == 0 {
        return Err(PlanError::BadSetting {
            key: "uncertainty.seeds",
            value: 0.0,
            why: "it must be at least 1",
        });
    }
    study.building.check()?;
    let prepared = site::prepare(input, config, seed, observer)?;
    let settings = &prepared.main().settings;
    let or_own =
        |given: &[f32], own: f32| if given.is_empty() { vec![own] } else { given.to_vec() };
    let volumes = or_own(&study.minimum_volume_m3, settings.minimum_volume_m3);
    let overflows = or_own(&study.overflow_m, settings.overflow_m);
    let total = volumes.len() * overflows.len() * study.seeds as usize;
    observer.event(geom::Event::Started { stage: Stage::Uncertainty, total: total as u64 });
    let mut cases: Vec<(usize, PlanVariant)> = Vec::with_capacity(total);
    for (row, &f) in overflows.iter().enumerate() {
        let varied = PlanConfig { overflow_m: Some(f), ..config.clone() };
        for number in 0..study.seeds {
            if observer.cancelled() {
                return Err(PlanError::Cancelled);
            }
            // The first is the plan that is carried out: its own count belongs in the range.
            let child =
                if number == 0 { seed } else { seed.child("uncertainty", u64::from(number)) };
            let plans = plans_over_volumes(input, &varied, &volumes, child, &Silent)?;
            let works = child.child("works", 0);
            for (column, of) in plans.into_iter().enumerate() {
                let place =
                    (column * overflows.len() + row) * study.seeds as usize + number as usize;
                let (v, summary) = (of.minimum_volume_m3, of.plan.summary);
                let own = PlanConfig { minimum_volume_m3: Some(v), ..varied.clone() };
                let built = match study.building.shifts {
                    0 => summary.blocks,
                    _ => built_blocks(input, &own, &of.plan, &study.building, works, observer)?,
                };
                let case = PlanVariant {
                    minimum_volume_m3: v,
                    overflow_m: f,
                    seed: number,
                    summary,
                    built,
                };
                cases.push((place, case));
            }
            observer.event(geom::Event::Advanced {
                stage: Stage::Uncertainty,
                done: cases.len() as u64,
            });
        }
    }
    cases.sort_by_key(|(place, _)| *place);
    let cases: Vec<PlanVariant> = cases.into_iter().map(|(_, case)| case).collect();
    observer.event(geom::Event::Finished { stage: Stage::Uncertainty });
    let by_thresholds = cases.chunks(study.seeds as usize).map(of_thresholds).collect();
    let median = median_case(&cases).summary;
    // With several types: of the mean block of the median plan.
    let volume_m3 = match prepared.types.len() > 1 && median.blocks > 0 {
        true => median.concrete_m3 / median.blocks as f32,
        false => input.catalog.get(prepared.main().model).volume_m3,
    };
    let solid = 1.0 - study.handbook_porosity;
    let depth_m = median.void_before_m3 / median.area_m2.max(f32::MIN_POSITIVE);
    let layers = (depth_m / (study.layer_coefficient * volume_m3.cbrt())).round();
    let phi = layers * study.layer_coefficient * solid;
    Ok(Uncertainty {
        blocks: percentiles(&cases),
        by_thresholds,
        by_layers: phi * median.area_m2 * volume_m3.powf(-2.0 / 3.0),
        by_volume: median.void_before_m3 * solid / volume_m3,
        by_own_porosity: (median.void_before_m3 - median.void_after_m3) * (1.0 - median.porosity)
            / volume_m3,
        cases,
    })
}

fn percentiles(cases: &[PlanVariant]) -> Percentiles {
    let mut counts: Vec<f32> = cases.iter().map(|c| c.built as f32).collect();
    counts.sort_by(f32::total_cmp);
    Percentiles { p10: below(&counts, 0.1), p50: at(&counts, 0.5), p90: below(&counts, 0.9) }
}

/// Below what the count of one more such works lies with this probability. Of few works the smallest and the largest seen say too
/// little: between n sorted counts lie n + 1 equally likely gaps, and outside them a Student's t of their spread is all there is.
fn below(sorted: &[f32], share: f32) -> f32 {
    let n = sorted.len() as f32;
    let place = share * (n + 1.0) - 1.0;
    if place >= 0.0 && place <= n - 1.0 {
        return at(sorted, place / (n - 1.0).max(1.0));
    }
    let mean = sorted.iter().sum::<f32>() / n;
    let Some(t) = STUDENT_90.get((sorted.len()).wrapping_sub(2)) else { return mean };
    let variance = sorted.iter().map(|c| (c - mean).powi(2)).sum::<f32>() / (n - 1.0);
    let reach = t * (variance * (1.0 + 1.0 / n)).sqrt();
    if share < 0.5 {
        (mean - reach).max(0.0).min(sorted[0])
    } else {
        (mean + reach).max(sorted[sorted.len() - 1])
    }
}

/// 90 % of Student's t with 1, 2, … degrees of freedom, as far as gaps do not yet serve.
const STUDENT_90: [f32; 7] = [3.078, 1.886, 1.638, 1.533, 1.476, 1.440, 1.415];

/// Cases of one (v, f), at least one.
fn of_thresholds(cases: &[PlanVariant]) -> ThresholdRange {
    let mean = |of: fn(&PlanSummary) -> f32| {
        (cases.iter().map(|c| f64::from(of(&c.summary))).sum::<f64>() / cases.len() as f64) as f32
    };
    ThresholdRange {
        minimum_volume_m3: cases[0].minimum_volume_m3,
        overflow_m: cases[0].overflow_m,
        blocks: percentiles(cases),
        mean_distance_m: mean(|s| s.mean_distance_m),
        void_after_m3: mean(|s| s.void_after_m3),
    }
}

/// Linear interpolation between the sorted values.
fn at(sorted: &[f32], share: f32) -> f32 {
    let place = share * (sorted.len() - 1) as f32;
    let (low, high) = (place.floor() as usize, place.ceil() as usize);
    sorted[low] + (sorted[high] - sorted[low]) * (place - low as f32)
}

fn median_case(cases: &[PlanVariant]) -> &PlanVariant {
    let mut order: Vec<&PlanVariant> = cases.iter().collect();
    order.sort_by_key(|c| c.summary.blocks);
    order[order.len() / 2]
}

#[cfg(test)]
mod tests {
    #[test]
    fn percentiles_interpolate() {
        assert_eq!(super::at(&[10.0], 0.9), 10.0);
        assert!((super::at(&[0.0, 10.0, 20.0], 0.1) - 2.0).abs() < 1e-6);
        assert!((super::at(&[0.0, 10.0, 20.0], 0.5) - 10.0).abs() < 1e-6);
    }

    /// Of many draws of n counts and one more, eight in ten of the last lie between P10 and P90.
    #[test]
    fn a_range_of_few_holds_the_next_as_often_as_it_says() {
        use rand_distr::{Distribution, StandardNormal};
        let mut rng = geom::SeedTree::new(1).rng();
        let mut draw = || {
            50.0 + 4.0 * <StandardNormal as Distribution<f32>>::sample(&StandardNormal, &mut rng)
        };
        for n in [3, 5, 9, 10, 20] {
            let inside = |_: &u32| {
                let mut counts: Vec<f32> = (0..n).map(|_| draw()).collect();
                counts.sort_by(f32::total_cmp);
                let next = draw();
                super::below(&counts, 0.1) <= next && next <= super::below(&counts, 0.9)
            };
            let share = (0..4000_u32).filter(inside).count() as f32 / 4000.0;
            assert!((0.76..0.86).contains(&share), "{n}: {share}");
        }
        assert_eq!(super::below(&[7.0], 0.1), 7.0);
    }
}
