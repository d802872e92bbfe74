//! Poses in which a block looks much the same: a plate turned over, a shaft end for end, a bracket on its other wall.
//!
//! A search that begins with the points of one place finds one member of such a family and is content: the face it stands on is
//! explained by all of them. Which one is right, the two-sided evidence tells, if it is asked. The family is a matter of the
//! shape alone: what is seen of it from some sides is fitted by itself in all other turns. Every accepted block offers
//! its twins as further candidates.

use crate::EvidenceConfig;
use crate::acceptance::Candidate;
use crate::evidence::weigh;
use crate::fit::{CentredPose, FitPoint, fit};
use crate::measured::Measured;
use crate::search::nearby;
use crate::template::Template;
use geom::{Quat, Vec3};
use rayon::prelude::*;
use scene::PoseLimits;

/// A turn and a shift in block coordinates after which it looks much the same.
#[derive(Clone, Copy, Debug)]
pub struct Twin {
    /// The turn.
    pub rotation: Quat,
    /// The shift of the centre.
    pub shift: Vec3,
}

/// Points of a side that are fitted, and points of the surface that are seen at all by this cosine.
const POINTS: usize = 60;
const FACING: f32 = 0.3;
/// A twin explains at least so much of what the block itself explains of a side.
const ALIKE: f32 = 0.55;
/// Turns of a side that are fitted to the end.
const FITTED: usize = 40;
/// Twins of a shape at most, those most alike first.
const MOST: usize = 120;
/// Reaches of a fit, in d_max: those that find a side again from any turn, those that end there, and the last.
const FROM_AFAR: [f32; 3] = [0.3, 0.2, 0.12];
const CLOSER: [f32; 2] = [0.08, 0.05];
const FINE: f32 = 0.03;
/// Points around a block, within so many d_max, that rank its twins; those that explain most are fitted to more.
const FEW_NEARBY: usize = 200;
const AROUND: f32 = 1.2;
const BEST: usize = 60;
const NEARBY: usize = 600;
/// Poses within this part of the limits of a right one are one.
const APART: f32 = 1.5;

/// Blocks whose twins were looked at.
#[derive(Default)]
pub struct Families {
    known: Vec<(usize, CentredPose)>,
}

impl Families {
    /// The twins of the `accepted` blocks, each fitted to the points around it; what was looked at before is left out.
    pub fn of(
        &mut self,
        accepted: &[&Candidate],
        templates: &[Template],
        measured: &Measured,
        config: &EvidenceConfig,
    ) -> Vec<Candidate> {
        let mut families: Vec<(usize, CentredPose)> = Vec::new();
        for block in accepted {
            let template = &templates[block.template];
            let is_known = |known: &(usize, CentredPose)| {
                known.0 == block.template && is_one(template, &known.1, &block.at)
            };
            if !self.known.iter().any(is_known) {
                self.known.push((block.template, block.at));
                families.push((block.template, block.at));
            }
        }
        let of_one = |(entry, at): (usize, CentredPose)| {
            let best = best_twins(&templates[entry], &at, measured);
            best.into_iter().map(move |at| (entry, at)).collect::<Vec<_>>()
        };
        let found: Vec<(usize, CentredPose)> = families.into_par_iter().flat_map(of_one).collect();
        let case = |(template, at): (usize, CentredPose)| {
            let evidence = weigh(&templates[template], &at, measured, config);
            Candidate { template, at, evidence }
        };
        found.into_par_iter().map(case).collect()
    }
}

/// The twins of a pose that explain most of the points around it, each fitted to these.
fn best_twins(template: &Template, at: &CentredPose, measured: &Measured) -> Vec<CentredPose> {
    let twins = twins(template);
    if twins.is_empty() {
        return Vec::new();
    }
    let (model, d) = (template.fit_model(), template.model.d_max_m);
    let fine = (2.5 * measured.noise_sd_m).max(FINE * d);
    let few = nearby(measured, at.centre, AROUND * d, FEW_NEARBY);
    let mut ranked: Vec<(f32, CentredPose)> = twins
        .iter()
        .map(|twin| {
            let (at, _) = fit(&model, &few, twin_of(at, twin), &[CLOSER[1] * d]);
            let (at, score) = fit(&model, &few, at, &[fine]);
            (score, at)
        })
        .collect();
    ranked.sort_by(|a, b| b.0.total_cmp(&a.0));
    ranked.truncate(BEST);
    ranked
        .into_iter()
        .map(|(_, at)| {
            let near = nearby(measured, at.centre, d + 3.0 * fine, NEARBY);
            fit(&model, &near, at, &[fine, fine]).0
        })
        .collect()
}

/// The pose of a block's twin.
fn twin_of(at: &CentredPose, twin: &Twin) -> CentredPose {
    CentredPose {
        rotation: (at.rotation * twin.rotation).normalize(),
        centre: at.centre + at.rotation * twin.shift,
    }
}

fn is_one(template: &Template, a: &CentredPose, b: &CentredPose) -> bool {
    let right = PoseLimits::right(template.model);
    template.same(a, b, right.displacement_m, right.rotation_rad)
}

/// The twins of a shape, those most alike first; found when they are first asked for.
pub fn twins<'t>(template: &'t Template) -> &'t [Twin] {
    template.twins.get_or_init(|| {
        let own = CentredPose { rotation: Quat::IDENTITY, centre: template.model.centre };
        let mut found: Vec<(f32, CentredPose)> =
            sides().into_par_iter().flat_map(|side| alike_from(template, side, &own)).collect();
        found.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut kept: Vec<CentredPose> = Vec::new();
        for (_, at) in found {
            if kept.len() < MOST && kept.iter().all(|k| !is_one(template, k, &at)) {
                kept.push(at);
            }
        }
        let twin = |at: CentredPose| Twin { rotation: at.rotation, shift: at.centre - own.centre };
        kept.into_iter().map(twin).collect()
    })
}

/// Sides a shape is looked at from: along its axes and between them.
fn sides() -> Vec<Vec3> {
    let step = [-1.0, 0.0, 1.0];
    let all = step.into_iter().flat_map(|x| {
        step.into_iter().flat_map(move |y| step.into_iter().map(move |z| Vec3::new(x, y, z)))
    });
    all.filter_map(Vec3::try_normalize).collect()
}

/// Other poses that explain much of what is seen of a shape from a side, with how much.
fn alike_from(template: &Template, side: Vec3, own: &CentredPose) -> Vec<(f32, CentredPose)> {
    let d = template.model.d_max_m;
    let seen: Vec<FitPoint> = template
        .surface
        .iter()
        .filter(|(p, n)| n.dot(side) > FACING && !is_hidden(template, *p, side))
        .map(|&(position, normal)| FitPoint { position, normal, to_sensor: side })
        .collect();
    let stride = seen.len().div_ceil(POINTS).max(1);
    let points: Vec<FitPoint> = seen.into_iter().step_by(stride).collect();
    if points.len() < crate::search::FEWEST_POINTS {
        return Vec::new();
    }
    let model = template.fit_model();
    let fine = FINE * d;
    let score = |at: CentredPose| fit(&model, &points, at, &[fine]).1;
    let mut coarse: Vec<(f32, CentredPose)> = template
        .rotations
        .iter()
        .map(|&rotation| {
            let start = CentredPose { rotation, centre: own.centre };
            let (at, score) = fit(&model, &points, start, &FROM_AFAR.map(|reach| reach * d));
            (score, at)
        })
        .collect();
    coarse.sort_by(|a, b| b.0.total_cmp(&a.0));
    let whole = score(*own);
    coarse
        .into_iter()
        .take(FITTED)
        .map(|(_, at)| fit(&model, &points, at, &[CLOSER[0] * d, CLOSER[1] * d, fine, fine]).0)
        .map(|at| (score(at) / whole, at))
        .filter(|(alike, at)| *alike > ALIKE && !is_another_of(template, at, own))
        .collect()
}

/// Whether a pose is too near to another to be a twin of it.
fn is_another_of(template: &Template, at: &CentredPose, own: &CentredPose) -> bool {
    let right = PoseLimits::right(template.model);
    template.same(at, own, APART * right.displacement_m, APART * right.rotation_rad)
}

/// Whether the shape hides a place of its surface from a side.
fn is_hidden(template: &Template, p: Vec3, side: Vec3) -> bool {
    let step = 2.0 * template.field.cell_m();
    let steps = (2.0 * template.model.d_max_m / step) as usize;
    (2..steps).any(|k| template.field.distance_m(p + side * (k as f32 * step)) < 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{PoseConfig, template::templates};
    use geom::{PointCloud, SeedTree};
    use scene::{Catalog, SensorKind, Shape, Survey};

    #[test]
    fn plates_and_shafts_have_twins_turned_over_and_tetrapods_have_none() {
        let of = |name: &str, shape| blocks::shape_model(name, shape, 2300.0).unwrap();
        let catalog = Catalog::new(vec![
            of("plate", Shape::HookPlate { size: 0.15 }),
            of("shaft", Shape::GearShaft { size: 0.4 }),
            of("tetrapod", Shape::Tetrapod { size: 2.0 }),
        ]);
        let templates = templates(&catalog, &PoseConfig::default(), SeedTree::new(1)).unwrap();
        let of = |name: &str| templates.iter().find(|t| t.model.name == name).unwrap();
        let turned_over =
            |name: &str| twins(of(name)).iter().any(|t| (t.rotation * Vec3::Z).z < -0.95);
        assert!(turned_over("plate") && turned_over("shaft"));
        assert!(twins(of("tetrapod")).is_empty());
    }

    /// A camera that sees a plate from above, and a pose of it turned over: its twins hold the right one.
    #[test]
    fn the_family_of_a_wrong_pose_holds_the_right_one() {
        let plate = blocks::shape_model("plate", Shape::HookPlate { size: 0.15 }, 2300.0).unwrap();
        let dense = plate.mesh.sample_surface(4000, &mut SeedTree::new(2).rng());
        let centre = plate.centre;
        let catalog = Catalog::new(vec![plate]);
        let config = PoseConfig::default();
        let templates = templates(&catalog, &config, SeedTree::new(1)).unwrap();
        let t = &templates[0];
        let seen = dense.iter().filter(|(p, n)| n.z > 0.3 && !is_hidden(t, *p, Vec3::Z));
        let survey = Survey {
            cloud: PointCloud::from_positions(seen.map(|s| s.0).collect()),
            sensor: SensorKind::DepthCamera,
            sensor_positions: vec![Vec3::Z],
            ..Survey::default()
        };
        let cell_m = config.search.working_cell * t.model.d_max_m;
        let measured = Measured::new(&survey, cell_m, t.model.d_max_m, 0.001, None, None);
        let right = CentredPose { rotation: Quat::IDENTITY, centre };
        let wrong = CentredPose { rotation: Quat::from_rotation_x(std::f32::consts::PI), centre };
        let case = |at: CentredPose| {
            let evidence = weigh(t, &at, &measured, &config.evidence);
            Candidate { template: 0, at, evidence }
        };
        let wrong = case(wrong);
        let mut families = Families::default();
        let found = families.of(&[&wrong], &templates, &measured, &config.evidence);
        let best = found.iter().max_by(|a, b| a.evidence.score().total_cmp(&b.evidence.score()));
        let best = best.expect("a plate has twins");
        assert!(is_one(t, &best.at, &right), "{:?}", best.at);
        assert!(best.evidence.score() > 1.1 * wrong.evidence.score());
        assert!(families.of(&[&wrong], &templates, &measured, &config.evidence).is_empty());
    }
}
