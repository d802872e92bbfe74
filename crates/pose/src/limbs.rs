//! Whether the legs of a stated block are there: seen, hidden, or looked through.
//!
//! A broken unit keeps its place and mostly its pose; what it lacks is a leg that a sensor looked through. In: a block at
//! its pose and what the sensors saw. Out: a verdict on every leg; the block is stated all the same.

use crate::finish::Accepted;
use crate::measured::Measured;
use crate::sight::Seen;
use crate::template::Template;
use geom::Vec3;

/// What is known of a leg.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LimbState {
    /// Its surface was measured.
    Seen,
    /// It lies behind something or where nothing was measured.
    Hidden,
    /// A sensor looked through where it ought to be.
    Missing,
}

/// A leg of a block.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limb {
    /// Middle of its tip, local frame, metres.
    pub tip: Vec3,
    /// What is known of it.
    pub state: LimbState,
}

/// Legs begin this far from the centre, in units of d_max.
const BEGINS: f32 = 0.62;
/// Samples of one leg are no farther from the next one than this part of d_max.
const TOGETHER: f32 = 0.3;
/// A leg has so many of the samples at least, of one hundred.
const FEWEST_PERCENT: usize = 3;
/// So much of a leg's surface must be told to be there or not.
const TOLD: f32 = 0.2;
/// A leg is missing when this share of what is told of it was looked through.
const MISSING: f32 = 0.6;

/// Samples of each leg of a model, entries of `template.surface`; empty for compact blocks, of which corners are no legs.
pub fn limbs(template: &Template) -> Vec<Vec<usize>> {
    let d_max = template.model.d_max_m;
    let centre = template.model.centre;
    let far = |i: &usize| (template.surface[*i].0 - centre).length() > BEGINS * d_max;
    let mut open: Vec<usize> = (0..template.surface.len()).filter(far).collect();
    let mut found = Vec::new();
    while let Some(first) = open.pop() {
        let mut limb = vec![first];
        let mut k = 0;
        while k < limb.len() {
            let p = template.surface[limb[k]].0;
            let (near, rest) = open
                .iter()
                .partition(|i| (template.surface[**i].0 - p).length() < TOGETHER * d_max);
            limb.extend::<Vec<usize>>(near);
            open = rest;
            k += 1;
        }
        if limb.len() * 100 >= FEWEST_PERCENT * template.surface.len() {
            limb.sort_unstable();
            found.push(limb);
        }
    }
    found.sort_unstable();
    if found.len() > 1 { found } else { Vec::new() }
}

/// The verdict on each leg of a block; `reach_m` is how near a measured point must be.
pub fn judge_limbs(
    block: &Accepted,
    template: &Template,
    measured: &Measured,
    reach_m: f32,
) -> Vec<Limb> {
    let site_from_block = block.at.pose(template.model.centre);
    let judge = |limb: Vec<usize>| {
        let (mut here, mut through) = (0.0_f32, 0.0_f32);
        let mut tip = Vec3::ZERO;
        for &i in &limb {
            let (p, n) = template.surface[i];
            let (p, n) = (site_from_block * p, site_from_block.rotation * n);
            tip += p / limb.len() as f32;
            match measured.sight.of_surface(p, n, reach_m) {
                Some(Seen::Here) => here += 1.0,
                Some(Seen::Through) => through += 1.0,
                _ => {}
            }
        }
        let told = here + through;
        let state = if told < TOLD * limb.len() as f32 {
            LimbState::Hidden
        } else if through > MISSING * told {
            LimbState::Missing
        } else {
            LimbState::Seen
        };
        Limb { tip, state }
    };
    limbs(template).into_iter().map(judge).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::CentredPose;
    use crate::{PoseConfig, template::templates};
    use geom::{MeshQuery, PointCloud, Quat, SeedTree};
    use scene::{Catalog, Shape, Survey};

    fn block(shape: Shape) -> Catalog {
        Catalog::new(vec![blocks::shape_model("block", shape, 2300.0).unwrap()])
    }

    #[test]
    fn tetrapods_have_four_legs_dolosse_two_flukes_and_cubes_none() {
        for (shape, legs) in [
            (Shape::Tetrapod { size: 2.0 }, 4),
            (Shape::Cube { size: 1.6 }, 0),
            (Shape::Dolos { size: 2.0 }, 2),
        ] {
            let catalog = block(shape);
            let templates = templates(&catalog, &PoseConfig::default(), SeedTree::new(1)).unwrap();
            assert_eq!(limbs(&templates[0]).len(), legs, "{shape:?}");
        }
    }

    /// A tetrapod on a floor, seen from above; what is measured of one leg is the floor below it.
    #[test]
    fn a_leg_that_was_looked_through_is_missing() {
        let catalog = block(Shape::Tetrapod { size: 2.0 });
        let templates = templates(&catalog, &PoseConfig::default(), SeedTree::new(1)).unwrap();
        let template = &templates[0];
        let at = CentredPose { rotation: Quat::from_rotation_x(0.4), centre: Vec3::Z };
        let site_from_block = at.pose(template.model.centre);
        let query = MeshQuery::new(&template.model.mesh).unwrap();
        let tips: Vec<Vec3> = limbs(template)
            .iter()
            .map(|l| l.iter().map(|&i| template.surface[i].0).sum::<Vec3>() / l.len() as f32)
            .collect();
        let block = Accepted { template: 0, at, gain: 1.0, other_type: None, type_margin: 0.0 };
        let states = |broken: Option<usize>| -> Vec<LimbState> {
            let mut points = Vec::new();
            for i in 0..120 * 120 {
                let (x, y) = ((i % 120) as f32 * 0.04 - 2.4, (i / 120) as f32 * 0.04 - 2.4);
                let from = Vec3::new(x, y, 5.0);
                let back = site_from_block.inverse();
                let hit = query.cast_ray(back * from, back.rotation * Vec3::NEG_Z, 9.0);
                let p = hit.map_or(Vec3::new(x, y, -0.2), |h| from - Vec3::Z * h.distance_m);
                let local = back * p;
                let near = |k: usize| (local - tips[k]).length();
                let of = (0..tips.len()).min_by(|&a, &b| near(a).total_cmp(&near(b)));
                let far = (local - template.model.centre).length() > 0.5 * template.model.d_max_m;
                let gone = broken == of && far && hit.is_some();
                points.push(if gone { Vec3::new(x, y, -0.2) } else { p });
            }
            let survey = Survey { cloud: PointCloud::from_positions(points), ..Default::default() };
            let measured = Measured::new(&survey, 0.04, template.model.d_max_m, 0.01, None, None);
            judge_limbs(&block, template, &measured, 0.05).iter().map(|l| l.state).collect()
        };
        let whole = states(None);
        assert!(!whole.contains(&LimbState::Missing), "{whole:?}");
        let seen = whole.iter().position(|s| *s == LimbState::Seen).unwrap();
        let broken = states(Some(seen));
        assert_eq!(broken[seen], LimbState::Missing, "{broken:?}");
        let others = (0..4).filter(|k| *k != seen).map(|k| (broken[k], whole[k]));
        assert!(others.clone().all(|(now, before)| now == before || before == LimbState::Hidden));
    }
}
