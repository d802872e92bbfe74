//! Works against their plan: what a comparison with a later survey says of each planned block, and whether the planned range of
//! the count holds what was really needed.

use crate::markdown::percent;
use crate::monitoring::{datum, kept, recognised, shown, weights_digits};
use crate::monitoring_score::{Share, known, median};
use crate::{Bench, Experiment, ReproduceError, SiteSet, Table, site_sets};
use geom::SeedTree;
use monitor::{AsBuilt, AsBuiltConfig, Built, Epoch, StableGround, as_built};
use pipeline::{Config, Works as Planned, count_range, plan_works};
use plan::{PlanConfig, PlanInput, UncertaintyConfig};
use scene::{Catalog, DesignSurface, Fit, PlacedBlock, Plan, Recognised, Scene, Survey};
use segment::SegmentModel;
use synth::SynthScene;
use synth::then::{NextEpoch, Then, What, Works, then};

pub const EXPERIMENT: Experiment = Experiment {
    name: "as-built",
    about: "works against their plan: each block's place, and whether the planned range holds the count",
    body,
};

/// The works' design: a level so far above the bed, on a square of this side in the middle of the pen.
const LEVEL_M: f64 = 4.2;
const SIDE_M: f64 = 9.0;
/// Agreement that the places of built blocks are asked for.
const RECOVERED_M: f64 = 0.02;

fn design() -> DesignSurface {
    let h = SIDE_M / 2.0;
    DesignSurface::Level { level_m: LEVEL_M, boundary: vec![[-h, -h], [h, -h], [h, h], [-h, h]] }
}

fn body(bench: &Bench) -> Result<String, ReproduceError> {
    let sets = site_sets()?;
    let mut table = Table::new(&HEADS);
    for name in ["sawara-uav", "sawara-mbes"] {
        let set = sets.iter().find(|s| s.name == name).expect("a set of the recipes");
        let mut score = Score::default();
        for index in 0..bench.settings.scenes {
            let works = Case::new(bench, set, index)?;
            let found = works.compared(bench)?;
            score.add(&works, &found);
        }
        table.row(score.row(name));
    }
    let back_test = back_test(bench, &sets[0])?;
    Ok(format!(
        "A level design {LEVEL_M} m above the bed on {SIDE_M} × {SIDE_M} m over a pile of 50 to 60 tetrapods, planned from the \
         recognised blocks of a first survey and built with a crane's errors of 15 cm and 10° per axis; 5 % skipped, 3 % extra; datum step \
         of up to 6 cm. *Off by* is compared with the truth of the blocks whose pose the second survey got right.\n\n{}\n{back_test}",
        table.finish()
    ))
}

/// One plan, built and surveyed.
struct Case {
    catalog: Catalog,
    before: SynthScene,
    earlier: Vec<Recognised>,
    plan: Plan,
    after: NextEpoch,
    later: Vec<Recognised>,
    datum: synth::then::Datum,
}

impl Case {
    fn new(bench: &Bench, set: &SiteSet, index: u64) -> Result<Self, ReproduceError> {
        if bench.observer.cancelled() {
            return Err(ReproduceError::Stopped);
        }
        let catalog = set.catalog.clone();
        let model = match bench.model {
            Some(model) => model.clone(),
            None => SegmentModel::shipped(&catalog)?,
        };
        let seed = SeedTree::new(bench.settings.seed).child("works", index);
        let before = set.scene(bench.settings.seed, index)?;
        let weights = weights_digits(&model)?;
        let key = format!("{}-{}-{index}-{weights}", set.name, bench.settings.seed);
        let file = |what: &str| bench.folder.join(format!("works-{key}-{what}.json"));
        let found = |what: &str, survey: &Survey| {
            kept(&file(what), || recognised(bench, survey, &catalog, &model))
        };
        let earlier = found("earlier", &before.survey)?;
        let plan =
            kept(&file("plan"), || planned(&before.survey, &catalog, &earlier, seed, bench))?;
        let datum = datum(seed.child("datum", 0));
        let happens = Then::Works(Works { datum, ..Works::default() });
        let after = then(&set.recipe, &catalog, &before.scene, &happens, Some(&plan), seed)
            .map_err(|source| ReproduceError::Scene { set: set.name.into(), index, source })?;
        let later = found("later", &after.scene.survey)?;
        Ok(Self { catalog, before, earlier, plan, after, later, datum })
    }

    fn compared(&self, bench: &Bench) -> Result<AsBuilt, ReproduceError> {
        Ok(as_built(
            &Epoch::of(&self.before.survey, &self.earlier),
            &self.plan,
            &Epoch::of(&self.after.scene.survey, &self.later),
            &self.catalog,
            &StableGround::default(),
            &AsBuiltConfig::default(),
            bench.observer,
        )?)
    }
}

fn planned(
    survey: &Survey,
    catalog: &Catalog,
    blocks: &[Recognised],
    seed: SeedTree,
    bench: &Bench,
) -> Result<Plan, ReproduceError> {
    let design = design();
    let works = works(survey, catalog, blocks, &design);
    Ok(plan_works(&works, &Config::default(), seed, bench.observer)?.1)
}

fn works<'a>(
    survey: &'a Survey,
    catalog: &'a Catalog,
    blocks: &'a [Recognised],
    design: &'a DesignSurface,
) -> Planned<'a> {
    Planned {
        survey,
        catalog,
        blocks,
        placed: &[],
        previous: None,
        design,
        proposer: None,
        ground: Some(scene::Ground::Level { z_m: 0.0 }),
    }
}

const HEADS: [&str; 8] = [
    "surveys",
    "planned",
    "off by within 2 cm",
    "error of off by, mm (median)",
    "skipped found not placed",
    "placed called not placed",
    "extra found",
    "porosity measured, of poses",
];

#[derive(Default)]
struct Score {
    planned: usize,
    recovered: Share,
    errors_m: Vec<f64>,
    skipped: Share,
    denied: Share,
    extra: Share,
    porosity: Vec<[f64; 2]>,
}

impl Score {
    fn add(&mut self, case: &Case, found: &AsBuilt) {
        let changes = &case.after.changes;
        let event = |b: &PlacedBlock| changes.iter().find(|c| c.later == Some(b.block));
        let blocks = &case.after.scene.scene.blocks;
        let truth = known(&case.later, blocks, &case.catalog, event, |p| shown(&case.datum, p));
        self.planned += case.plan.placements.len();
        for block in &found.blocks {
            let Some(order) = block.order else { continue };
            let Some(real) = changes.iter().find(|c| c.planned == Some(order)) else { continue };
            if real.what == What::Skipped {
                self.skipped.count(block.state == Built::NotPlaced);
                continue;
            }
            self.denied.count(block.state == Built::NotPlaced);
            let own = block.later_id.and_then(|id| truth.get(&id));
            if own.is_some_and(|t| t.planned == Some(order)) {
                let off = geom::DVec3::from_array(block.off_m) - real.shift_m.as_dvec3();
                self.errors_m.push(off.length());
                self.recovered.count(off.length() <= RECOVERED_M);
            }
        }
        for (id, real) in &truth {
            if real.what == What::Added {
                let claim = found.blocks.iter().find(|b| b.later_id == Some(*id));
                self.extra.count(claim.is_some_and(|b| b.state == Built::Extra));
            }
        }
        if let (Some(a), Some(b)) = (found.porosity_measured, found.porosity_of_poses) {
            self.porosity.push([a, b]);
        }
    }

    fn row(&self, name: &str) -> Vec<String> {
        let mean = |i: usize| {
            self.porosity.iter().map(|p| p[i]).sum::<f64>() / self.porosity.len().max(1) as f64
        };
        vec![
            name.into(),
            self.planned.to_string(),
            self.recovered.text(),
            format!("{:.1}", 1e3 * median(&self.errors_m)),
            self.skipped.text(),
            self.denied.text(),
            self.extra.text(),
            format!("{:.2}, {:.2}", mean(0), mean(1)),
        ]
    }
}

/// Plans on a first survey, builds with noise, plans on from what stands until the design is reached: the count that was really
/// needed, against the range that was announced.
fn back_test(bench: &Bench, set: &SiteSet) -> Result<String, ReproduceError> {
    let mut inside = Share::default();
    let (mut announced, mut needed) = (Vec::new(), Vec::new());
    for trial in 0..bench.settings.repeats {
        if bench.observer.cancelled() {
            return Err(ReproduceError::Stopped);
        }
        let file = bench.folder.join(format!(
            "back-test-{}-{trial}-{}.json",
            bench.settings.seed,
            env!("CARGO_PKG_VERSION")
        ));
        let [p10, p90, planned, built] = kept(&file, || one_trial(bench, set, trial))?;
        inside.count((p10..=p90).contains(&built));
        announced.push(f64::from(planned));
        needed.push(f64::from(built));
    }
    let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len().max(1) as f64;
    Ok(format!(
        "Back-test on {} piles: plan and range (P10–P90 of {SEEDS} plans), built with the crane's errors by the physics engine, planned on \
         from what stands until no window is left. The range holds the count that was needed in {}; planned {:.1}, needed \
         {:.1} blocks on average.\n",
        inside.of,
        if inside.of > 0 {
            percent(Some(inside.hits as f64 / inside.of as f64)) + " %"
        } else {
            "–".into()
        },
        mean(&announced),
        mean(&needed),
    ))
}

/// Plans a range is made of.
const SEEDS: u32 = 10;
/// Shifts of the works, each planned on what the last one left.
const SHIFTS: u64 = 4;

/// P10, P90, planned and needed blocks.
fn one_trial(bench: &Bench, set: &SiteSet, trial: u64) -> Result<[u32; 4], ReproduceError> {
    let seed = SeedTree::new(bench.settings.seed).child("back-test", trial);
    let failed = |source| ReproduceError::Scene { set: set.name.into(), index: trial, source };
    let made = synth::scene(&set.recipe, &set.catalog, seed.child("scene", 0)).map_err(failed)?;
    let design = design();
    let first = as_recognised(&made.scene);
    let on = works(&made.survey, &set.catalog, &first, &design);
    let mut config = Config::default();
    config.plan.uncertainty = UncertaintyConfig { seeds: SEEDS, ..UncertaintyConfig::default() };
    let (scene, mut plan) = plan_works(&on, &config, seed, bench.observer)?;
    let range = count_range(&on, &scene, &config, seed, bench.observer)?;
    let planned = plan.placements.len() as u32;
    // The crane skips nothing here and adds nothing of its own: it builds, looks and goes on.
    let happens = Then::Works(Works { skipped: 0.0, extra: 0.0, ..Works::default() });
    let mut recipe = set.recipe.clone();
    recipe.density_per_m2 = 50.0;
    let mut pile = made.scene.clone();
    for shift in 0..SHIFTS {
        if plan.placements.is_empty() {
            break;
        }
        let seed = seed.child("shift", shift);
        let next =
            then(&recipe, &set.catalog, &pile, &happens, Some(&plan), seed).map_err(failed)?;
        pile = next.scene.scene;
        plan = plan::plan(
            &PlanInput {
                scene: &pile,
                frame: &made.survey.frame,
                design: &design,
                catalog: &set.catalog,
                placed: &[],
                proposer: None,
                survey: None,
            },
            &PlanConfig::default(),
            seed,
            bench.observer,
        )?;
    }
    let built = (pile.blocks.len() - made.scene.blocks.len()) as u32;
    let whole = |v: f32| v.round() as u32;
    Ok([whole(range.blocks.p10), whole(range.blocks.p90), planned, built])
}

/// A pile as if every block had been recognised where it is.
fn as_recognised(scene: &Scene) -> Vec<Recognised> {
    let one = |b: &PlacedBlock| {
        Recognised::of_fit(b.block, Vec::new(), Fit::of_pose(b.model, b.site_from_block))
    };
    scene.blocks.iter().map(one).collect()
}
