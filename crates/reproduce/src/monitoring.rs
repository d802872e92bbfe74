//! Detection of what happened to each block between two surveys, against the truth of synthetic storms.

use crate::bin_kept::digits;
use crate::monitoring_score::{Score, WRONG_HEAD};
use crate::{Bench, Experiment, ReproduceError, SiteSet, Table, site_sets};
use geom::{SeedTree, Vec3};
use monitor::{CompareConfig, Epoch, StableGround, compare};
use pipeline::{Config, Recogniser};
use scene::{Catalog, Recognised, Survey};
use segment::SegmentModel;
use serde::{Serialize, de::DeserializeOwned};
use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::sync::Arc;
use synth::SynthScene;
use synth::then::{Datum, NextEpoch, Storm, Then, then};

pub const EXPERIMENT: Experiment = Experiment {
    name: "monitoring",
    about: "what happened to each block between two surveys, against the truth of synthetic storms",
    body,
};

/// Pairs of sensors: name, set of the first survey, set whose sensor makes the second.
const PAIRS: [(&str, &str, &str); 3] = [
    ("UAV, UAV", "sawara-uav", "sawara-uav"),
    ("MBES, MBES", "sawara-mbes", "sawara-mbes"),
    ("UAV, MBES", "sawara-uav", "sawara-mbes"),
];

/// What happens, by name. A quiet year leaves most blocks where they were; broken legs alone are many, because few of them lie in
/// sight.
const STORMS: [(&str, StormOf); 3] =
    [("storm", Storm::default), ("quiet year", quiet_year), ("broken legs", broken_legs)];

/// Makes a storm.
type StormOf = fn() -> Storm;

/// A fifth of what a storm does.
fn quiet_year() -> Storm {
    let usual = Storm::default();
    let share = 0.2;
    Storm {
        kicked: share * usual.kicked,
        turned: share * usual.turned,
        missing: share * usual.missing,
        broken: share * usual.broken,
        rolled: share * usual.rolled,
        added: share * usual.added,
        ..usual
    }
}

/// Every eighth block loses the end of a leg, and nothing else happens.
fn broken_legs() -> Storm {
    Storm {
        kicked: 0.0,
        turned: 0.0,
        missing: 0.0,
        broken: 0.125,
        rolled: 0.0,
        added: 0.0,
        ..Storm::default()
    }
}

fn body(bench: &Bench) -> Result<String, ReproduceError> {
    let sets = site_sets()?;
    let of = |name: &str| sets.iter().find(|s| s.name == name).expect("a set of the recipes");
    let mut table = Table::new(&Score::HEADS);
    let mut calibration = Table::new(&Score::CALIBRATION_HEADS);
    // Whatever happens then, the first survey of a scene is the same.
    let mut scenes: HashMap<(&str, u64), Arc<SynthScene>> = HashMap::new();
    let mut wrong = vec![format!("surveys,{WRONG_HEAD}")];
    for ((sensors, first, second), (happened, storm)) in
        STORMS.into_iter().flat_map(|s| PAIRS.map(|p| (p, s)))
    {
        let name = &format!("{sensors}, {happened}");
        let mut score = Score::default();
        for index in 0..bench.settings.scenes {
            let before = match scenes.entry((first, index)) {
                Entry::Occupied(known) => Arc::clone(known.get()),
                Entry::Vacant(place) => {
                    let made = of(first).scene(bench.settings.seed, index)?;
                    Arc::clone(place.insert(Arc::new(made)))
                }
            };
            let pair = EpochPair::new(bench, before, of(first), of(second), &storm(), index)?;
            let (earlier, later) = pair.recognised(bench, name)?;
            let start = (bench.clock)();
            let found = compare(
                &Epoch::of(&pair.before.survey, &earlier),
                &Epoch::of(&pair.after.scene.survey, &later),
                &pair.catalog,
                &StableGround::default(),
                &CompareConfig::default(),
                bench.observer,
            )?;
            let seconds = (bench.clock)() - start;
            score.add(&pair, &earlier, &later, &found, seconds);
        }
        let surveys = name.replace(", ", "-");
        wrong.extend(score.wrong.iter().map(|line| format!("{surveys},{line}")));
        table.row(score.row(name));
        calibration.row(score.calibration_row(name));
    }
    let file = bench.folder.join("monitoring_wrong.csv");
    std::fs::write(&file, wrong.join("\n") + "\n")
        .map_err(|source| ReproduceError::File { file: file.display().to_string(), source })?;
    Ok(format!(
        "Storms on {} scenes of each pair of sensors; every block suffers one thing at most: kicked 5 %, turned 5 %, missing \
         4 %, broken 4 %, rolled by a symmetry 2 %, added 3 % (a fifth of that in a quiet year; of *broken legs* every eighth block breaks and nothing else happens); datum step of up to 6 cm and 0.05°. Blocks recognised with their true pose \
         in both surveys are scored.\n\n{}\n{}",
        bench.settings.scenes,
        table.finish(),
        calibration.finish()
    ))
}

/// Two epochs with their truth.
pub(crate) struct EpochPair {
    pub catalog: Catalog,
    pub before: Arc<SynthScene>,
    pub after: NextEpoch,
    pub datum: Datum,
    first: &'static str,
    key: String,
}

impl EpochPair {
    fn new(
        bench: &Bench,
        before: Arc<SynthScene>,
        first: &SiteSet,
        second: &SiteSet,
        storm: &Storm,
        index: u64,
    ) -> Result<Self, ReproduceError> {
        if bench.observer.cancelled() {
            return Err(ReproduceError::Stopped);
        }
        let seed = SeedTree::new(bench.settings.seed).child("storm", index);
        let datum = datum(seed.child("datum", 0));
        let storm = Storm {
            datum,
            sensor: Some(second.recipe.sensor.clone()),
            density_per_m2: Some(second.recipe.density_per_m2),
            ..storm.clone()
        };
        let happens = Then::Storm(storm);
        let after = then(&first.recipe, &first.catalog, &before.scene, &happens, None, seed)
            .map_err(|source| ReproduceError::Scene { set: first.name.into(), index, source })?;
        let key = format!("{}-{index}", bench.settings.seed);
        Ok(Self { catalog: first.catalog.clone(), before, after, datum, first: first.name, key })
    }

    /// Seed and number of the scene.
    pub(crate) fn key(&self) -> &str {
        &self.key
    }

    fn recognised(
        &self,
        bench: &Bench,
        name: &str,
    ) -> Result<(Vec<Recognised>, Vec<Recognised>), ReproduceError> {
        let model = match bench.model {
            Some(model) => model.clone(),
            None => SegmentModel::shipped(&self.catalog)?,
        };
        let name = name.replace(", ", "-").replace(' ', "-").to_lowercase();
        let weights = weights_digits(&model)?;
        let one = |file: String, survey: &Survey| {
            kept(&bench.folder.join(file), || recognised(bench, survey, &self.catalog, &model))
        };
        let key = format!("{}-{weights}", self.key);
        let earlier = one(format!("{}-{key}.json", self.first), &self.before.survey)?;
        let later = one(format!("{name}-{key}-later.json"), &self.after.scene.survey)?;
        Ok((earlier, later))
    }
}

/// A datum step of some centimetres and hundredths of a degree.
pub(crate) fn datum(seed: SeedTree) -> Datum {
    use rand::RngExt;
    let mut rng = seed.rng();
    let shift_m = std::array::from_fn(|_| rng.random_range(-0.06..0.06_f32));
    Datum { shift_m, yaw_deg: rng.random_range(-0.05..0.05), ..Datum::default() }
}

/// Where a datum shows a point.
pub(crate) fn shown(datum: &Datum, p: Vec3) -> Vec3 {
    geom::Quat::from_rotation_z(datum.yaw_deg.to_radians()) * p + Vec3::from_array(datum.shift_m)
}

/// Where a point that a datum shows there really is.
pub(crate) fn unshown(datum: &Datum, p: Vec3) -> Vec3 {
    geom::Quat::from_rotation_z(-datum.yaw_deg.to_radians()) * (p - Vec3::from_array(datum.shift_m))
}

pub(crate) fn recognised(
    bench: &Bench,
    survey: &Survey,
    catalog: &Catalog,
    model: &SegmentModel,
) -> Result<Vec<Recognised>, ReproduceError> {
    let (config, seed) = (Config::default(), SeedTree::new(bench.settings.seed).child("run", 0));
    let recogniser = Recogniser { catalog, model, config: &config, seed, observer: bench.observer };
    Ok(recogniser.recognise(survey)?.blocks)
}

/// Eight digits that stand for weights and program: what they made is not taken for the work of others.
pub(crate) fn weights_digits(model: &SegmentModel) -> Result<String, ReproduceError> {
    let of = [&model.to_bytes()?[..], env!("CARGO_PKG_VERSION").as_bytes()].concat();
    Ok(digits(&of))
}

/// What an earlier run of the experiment left, or made now and left for the next.
pub(crate) fn kept<T: Serialize + DeserializeOwned>(
    file: &std::path::Path,
    make: impl FnOnce() -> Result<T, ReproduceError>,
) -> Result<T, ReproduceError> {
    let failed = |source| ReproduceError::File { file: file.display().to_string(), source };
    if let Ok(text) = std::fs::read_to_string(file) {
        return serde_json::from_str(&text).map_err(|e| failed(e.into()));
    }
    let value = make()?;
    let text = serde_json::to_string(&value).map_err(|e| failed(e.into()))?;
    let aside = file.with_extension("part");
    std::fs::write(&aside, text).and_then(|()| std::fs::rename(&aside, file)).map_err(failed)?;
    Ok(value)
}
