//! Works against their plan: what a comparison with a later survey says of each planned block.

use crate::monitoring::{datum, kept, recognised, shown, weights_digits};
use crate::monitoring_score::{Share, known, median};
use crate::survey_offset::survey_offset_m;
use crate::{Bench, Experiment, ReproduceError, SiteSet, Table, site_sets};
use geom::{HeightMap, SeedTree};
use monitor::{AsBuilt, AsBuiltConfig, Built, Epoch, StableGround, as_built};
use pipeline::{Config, Works as Planned, plan_works};
use scene::{Catalog, DesignSurface, Fit, PlacedBlock, Plan, Recognised, Scene, Survey};
use segment::SegmentModel;
use synth::SynthScene;
use synth::then::{NextEpoch, Then, TrueChange, What, Works, then};

pub const EXPERIMENT: Experiment = Experiment {
    name: "as-built",
    about: "works against their plan: each block's place and state, porosity, packing",
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
    Ok(format!(
        "A level design {LEVEL_M} m above the bed on {SIDE_M} × {SIDE_M} m over a pile of 50 to 60 tetrapods, planned from the \
         recognised blocks of a first survey and built with a crane's errors of 15 cm and 10° per axis; 5 % skipped, 3 % extra; datum step \
         of up to 6 cm. *Off by* is compared with the truth of the blocks whose pose the second survey got right.\n\n{}",
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

pub(crate) fn works<'a>(
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

const HEADS: [&str; 15] = [
    "surveys",
    "planned",
    "state right of recognised",
    "off by within 2 cm",
    "error of off by, mm (median)",
    "off by within its 95 % level (axes)",
    "the same in the first survey's coordinates, within 2 cm",
    "error there, mm (median)",
    "skipped found not placed",
    "placed called not placed",
    "extra found",
    "called extra and is none",
    "new blocks counted, true",
    "porosity measured, of poses, true",
    "packing measured, true",
];

#[derive(Default)]
struct Score {
    planned: usize,
    recovered: Share,
    errors_m: Vec<f64>,
    inside_level: Share,
    /// The same in the coordinates of the survey that the plan was made on.
    recovered_there: Share,
    errors_there_m: Vec<f64>,
    skipped: Share,
    denied: Share,
    extra: Share,
    not_extra: Share,
    states: Share,
    new: [usize; 2],
    porosity: Vec<[f64; 3]>,
    packing: Vec<[f64; 2]>,
}

impl Score {
    fn add(&mut self, case: &Case, found: &AsBuilt) {
        let changes = &case.after.changes;
        let event = |b: &PlacedBlock| changes.iter().find(|c| c.later == Some(b.block));
        let blocks = &case.after.scene.scene.blocks;
        let truth = known(&case.later, blocks, &case.catalog, event, |p| shown(&case.datum, p));
        // The plan stands where its survey shows the pile; the crane places in true coordinates.
        let first = survey_offset_m(&case.before, &case.catalog, |p| p, |_| true).as_dvec3();
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
                for (error, level) in off.to_array().into_iter().zip(block.level_axes_m) {
                    self.inside_level.count(error.abs() <= level);
                }
                self.errors_there_m.push((off - first).length());
                self.recovered_there.count((off - first).length() <= RECOVERED_M);
                self.states.count(block.state == state(real, &case.catalog));
            }
        }
        for (id, real) in &truth {
            if real.what == What::Added {
                let claim = found.blocks.iter().find(|b| b.later_id == Some(*id));
                self.extra.count(claim.is_some_and(|b| b.state == Built::Extra));
            }
        }
        for block in found.blocks.iter().filter(|b| b.state == Built::Extra) {
            if let Some(real) = block.later_id.and_then(|id| truth.get(&id)) {
                self.not_extra.count(real.what != What::Added);
            }
        }
        let came = changes.iter().filter(|c| c.earlier.is_none() && c.later.is_some());
        let came: Vec<&PlacedBlock> =
            came.filter_map(|c| blocks.iter().find(|b| Some(b.block) == c.later)).collect();
        self.new[0] += found.built();
        self.new[1] += came.len();
        let real = Figures::of(case, &came);
        if let (Some(a), Some(b)) = (found.porosity_measured, found.porosity_of_poses) {
            self.porosity.push([a, b, real.porosity]);
        }
        if let Some(packing) = found.packing {
            self.packing.push([packing, real.packing]);
        }
    }

    fn row(&self, name: &str) -> Vec<String> {
        let mean = |values: Vec<f64>| values.iter().sum::<f64>() / values.len().max(1) as f64;
        let porosity = |i: usize| mean(self.porosity.iter().map(|p| p[i]).collect());
        let packing = |i: usize| mean(self.packing.iter().map(|p| p[i]).collect());
        vec![
            name.into(),
            self.planned.to_string(),
            self.states.text(),
            self.recovered.text(),
            format!("{:.1}", 1e3 * median(&self.errors_m)),
            self.inside_level.text(),
            self.recovered_there.text(),
            format!("{:.1}", 1e3 * median(&self.errors_there_m)),
            self.skipped.text(),
            self.denied.text(),
            self.extra.text(),
            self.not_extra.text(),
            format!("{}, {}", self.new[0], self.new[1]),
            format!("{:.2}, {:.2}, {:.2}", porosity(0), porosity(1), porosity(2)),
            format!("{:.2}, {:.2}", packing(0), packing(1)),
        ]
    }
}

/// Placed or off, by the tolerance of the comparison, as it really stands.
fn state(real: &TrueChange, catalog: &Catalog) -> Built {
    let limits = AsBuiltConfig::default();
    let size = f64::from(catalog.get(real.model).d_box_m);
    let near = f64::from(real.shift_m.length()) <= limits.place_blocks * size;
    let straight = f64::from(real.turn_rad) <= limits.place_turn_rad;
    if near && straight { Built::Placed } else { Built::OffBy }
}

/// The new blocks' true figures, over the true pile before them.
struct Figures {
    porosity: f64,
    packing: f64,
}

impl Figures {
    fn of(case: &Case, came: &[&PlacedBlock]) -> Self {
        let catalog = &case.catalog;
        let size_m = catalog.iter().map(|(_, m)| m.d_box_m).fold(0.0, f32::max);
        let bounds = case.before.survey.cloud.bounds().grown(size_m);
        let (low, high) = (bounds.min.truncate(), bounds.max.truncate());
        let mut before = HeightMap::empty(low, high, 0.05 * size_m);
        before.fill_with(|x, y| case.before.scene.ground.height_m(x, y));
        let raise = |map: &mut HeightMap, b: &PlacedBlock| {
            map.raise(&catalog.get(b.model).mesh, &b.site_from_block);
        };
        case.before.scene.blocks.iter().for_each(|b| raise(&mut before, b));
        let mut after = before.clone();
        came.iter().for_each(|b| raise(&mut after, b));
        let cell = f64::from(before.cell_m).powi(2);
        let rises = before.z_m.iter().zip(&after.z_m).map(|(a, b)| f64::from(b - a));
        let rises: Vec<f64> = rises.filter(|d| *d > 0.0).collect();
        let volume = |b: &&PlacedBlock| f64::from(catalog.get(b.model).volume_m3);
        let concrete: f64 = came.iter().map(volume).sum();
        let dn2: f64 = came.iter().map(|b| volume(b).powf(2.0 / 3.0)).sum();
        let (area, between) = (cell * rises.len() as f64, cell * rises.iter().sum::<f64>());
        Self { porosity: 1.0 - concrete / between, packing: dn2 / area }
    }
}

/// A pile as if every block had been recognised where it is.
pub(crate) fn as_recognised(scene: &Scene) -> Vec<Recognised> {
    let one = |b: &PlacedBlock| {
        Recognised::of_fit(b.block, Vec::new(), Fit::of_pose(b.model, b.site_from_block))
    };
    scene.blocks.iter().map(one).collect()
}
